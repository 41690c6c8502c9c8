//! The globals of shaders: properties of the shading point that a shader can read.

use crate::types::Type;

/// Shader globals, in the order of [`GLOBALS`], and other values of the point that calls read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "each variant is the global of its name")]
pub enum Global {
    P,
    I,
    N,
    Ng,
    U,
    V,
    DPdu,
    DPdv,
    Ps,
    Time,
    Dtime,
    DPdtime,
    Ci,
    /// The result of `surfacearea()`; a program cannot name it.
    SurfaceArea,
    /// The result of `backfacing()`, 0 or 1; a program cannot name it.
    Backfacing,
    /// 1 where `calculatenormal()` swaps its operands, because the change of P to the right and the change to
    /// the next row are left-handed with N; else 0. A program cannot name it.
    LeftHanded,
}

impl Global {
    /// All globals.
    pub const ALL: [Global; 16] = [
        Global::P,
        Global::I,
        Global::N,
        Global::Ng,
        Global::U,
        Global::V,
        Global::DPdu,
        Global::DPdv,
        Global::Ps,
        Global::Time,
        Global::Dtime,
        Global::DPdtime,
        Global::Ci,
        Global::SurfaceArea,
        Global::Backfacing,
        Global::LeftHanded,
    ];

    /// Its name, or the call that returns it.
    pub fn name(self) -> &'static str {
        match self {
            Global::P => "P",
            Global::I => "I",
            Global::N => "N",
            Global::Ng => "Ng",
            Global::U => "u",
            Global::V => "v",
            Global::DPdu => "dPdu",
            Global::DPdv => "dPdv",
            Global::Ps => "Ps",
            Global::Time => "time",
            Global::Dtime => "dtime",
            Global::DPdtime => "dPdtime",
            Global::Ci => "Ci",
            Global::SurfaceArea => "surfacearea()",
            Global::Backfacing => "backfacing()",
            Global::LeftHanded => "the handedness of the image",
        }
    }
}

/// Each global with its name, type, and whether a shader may assign it without a warning.
pub const GLOBALS: [(Global, &str, Type, bool); 13] = [
    (Global::P, "P", Type::POINT, true),
    (Global::I, "I", Type::VECTOR, true),
    (Global::N, "N", Type::NORMAL, true),
    (Global::Ng, "Ng", Type::NORMAL, false),
    (Global::U, "u", Type::FLOAT, false),
    (Global::V, "v", Type::FLOAT, false),
    (Global::DPdu, "dPdu", Type::VECTOR, false),
    (Global::DPdv, "dPdv", Type::VECTOR, false),
    (Global::Ps, "Ps", Type::POINT, false),
    (Global::Time, "time", Type::FLOAT, false),
    (Global::Dtime, "dtime", Type::FLOAT, false),
    (Global::DPdtime, "dPdtime", Type::VECTOR, false),
    (Global::Ci, "Ci", Type::CLOSURE, true),
];
