//! The table.

use crate::halt::Flag;

/// A limit as `docs/limits.md` shows it.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// `GROUP.NAME`, as `--limit` takes it.
    pub name: &'static str,
    /// What it bounds.
    pub meaning: &'static str,
    /// What is counted.
    pub unit: &'static str,
    /// What it is where nobody sets it.
    pub default: u64,
    /// The code of the error that a user sees, or how its message begins, or what happens instead.
    pub error: &'static str,
}

/// Groups of limits: `group: Type { /// meaning \n name = default, "unit", "error"; }`.
macro_rules! limits {
    ($($(#[doc = $about:literal])+ $group:ident: $Type:ident {
        $($(#[doc = $meaning:literal])+ $name:ident = $default:expr, $unit:literal, $error:literal;)*
    })*) => {
        $(
            $(#[doc = $about])+
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub struct $Type {
                $($(#[doc = $meaning])+ pub $name: u64,)*
            }

            impl Default for $Type {
                fn default() -> Self {
                    $Type { $($name: $default,)* }
                }
            }
        )*

        /// What input may cost. A copy shares the order to stop, and nothing else.
        #[derive(Clone, Debug, Default)]
        pub struct Limits {
            $($(#[doc = $about])+ pub $group: $Type,)*
            pub(crate) flag: Flag,
        }

        impl Limits {
            /// All limits, in the order of the table.
            pub fn rows() -> &'static [Row] {
                &[$($(Row {
                    name: concat!(stringify!($group), ".", stringify!($name)),
                    meaning: concat!($($meaning),+),
                    unit: $unit,
                    default: $default,
                    error: $error,
                },)*)*]
            }

            /// The field of a name.
            pub(crate) fn field(&mut self, name: &str) -> Option<&mut u64> {
                match name {
                    $($(concat!(stringify!($group), ".", stringify!($name)) => Some(&mut self.$group.$name),)*)*
                    _ => None,
                }
            }
        }
    };
}

limits! {
    /// Sources, compiled shaders and the text of groups.
    reading: Reading {
        /// Size of one file of text.
        file_bytes = 64 << 20, "bytes", "it has more than";
    }
    /// From the syntax tree to a program.
    compiling: Compiling {
    }
    /// What a program does.
    running: Running {
    }
    /// Textures and other images.
    images: Images {
    }
    /// Scenes, meshes and pictures.
    scenes: Scenes {
    }
}
