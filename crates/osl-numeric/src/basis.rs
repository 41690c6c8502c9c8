//! The bases of splines: each defines the polynomial of a segment from four knots.

/// A basis: the distance between segments in knots, and rows of coefficients of x³, x², x and 1.
#[derive(Debug)]
pub struct Basis {
    /// The name in programs.
    pub name: &'static str,
    /// Number of knots from segment to segment.
    pub step: i32,
    /// Coefficients of the four knots, highest power first.
    pub rows: [[f32; 4]; 4],
}

/// The name of the basis that keeps the value of a knot up to the next.
pub const CONSTANT: &str = "constant";
/// The unit of the coefficients of `bspline`.
pub const SIXTH: f32 = 1.0 / 6.0;

/// The bases (OSL language specification, chapter on splines). Any other name means the last, linear.
pub static BASES: [Basis; 6] = [
    Basis {
        name: "catmull-rom",
        step: 1,
        rows: [[-0.5, 1.5, -1.5, 0.5], [1.0, -2.5, 2.0, -0.5], [-0.5, 0.0, 0.5, 0.0], [0.0, 1.0, 0.0, 0.0]],
    },
    Basis {
        name: "bezier",
        step: 3,
        rows: [[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
    },
    Basis {
        name: "bspline",
        step: 1,
        rows: [
            [-SIXTH, 0.5, -0.5, SIXTH],
            [0.5, -1.0, 0.5, 0.0],
            [-0.5, 0.0, 0.5, 0.0],
            [SIXTH, 4.0 * SIXTH, SIXTH, 0.0],
        ],
    },
    Basis {
        name: "hermite",
        step: 2,
        rows: [[2.0, 1.0, -2.0, 1.0], [-3.0, -2.0, 3.0, -1.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
    },
    Basis { name: CONSTANT, step: 1, rows: [[0.0; 4], [0.0; 4], [0.0; 4], [0.0, 1.0, 0.0, 0.0]] },
    Basis {
        name: "linear",
        step: 1,
        rows: [[0.0; 4], [0.0; 4], [0.0, -1.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
    },
];

/// The basis with a name.
pub fn basis(name: &str) -> &'static Basis {
    let [rest @ .., linear] = &BASES;
    rest.iter().find(|b| b.name == name).unwrap_or(linear)
}
