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
        /// Text of one source file.
        source_bytes = 16 << 20, "bytes", "E0017";
        /// Text of all files of a program, each counted as often as it is included.
        included_bytes = 64 << 20, "bytes", "E0017";
        /// Files within files.
        include_depth = 64, "files", "E0002";
        /// Inclusions in all.
        includes = 4096, "files", "E0003";
        /// Tokens that macros make, and their text, 16 bytes for a token.
        expansion = 1 << 20, "tokens", "E0014";
        /// Parentheses and operators within one another in a condition of the preprocessor.
        condition_depth = 100, "levels", "E0010";
        /// Tokens after preprocessing.
        tokens = 1 << 20, "tokens", "E0016";
        /// Text of all tokens after preprocessing: macros can repeat a long name or string.
        token_bytes = 64 << 20, "bytes", "E0016";
        /// Constructs within constructs, and calls of macros within their arguments.
        nesting = 256, "levels", "E0113";
        /// Errors, and as many warnings, that reading a file reports.
        diagnostics = 64, "messages", "E0120";
        /// Tokens that the parser reads again to go on behind errors.
        recovery = 4 << 20, "tokens", "errors behind the last one reported stay unsaid";
        /// Tokens that the search for lost brackets reads.
        repair = 2 << 20, "tokens", "no repair is offered";
        /// Words in the text of a group.
        group_words = 2 << 20, "words", "E0801";
        /// Layers of a group.
        layers = 4096, "layers", "E0803";
        /// Symbols, and as many operations, of a compiled shader.
        oso_lines = 1 << 20, "lines", "E0601";
        /// Blocks within blocks in a compiled shader.
        oso_depth = 512, "levels", "E0601";
        /// Structs within structs in a compiled shader.
        oso_structs = 32, "levels", "E0601";
        /// Elements of constant arrays in a compiled shader, each array counted for every section that uses it.
        oso_elements = 1 << 20, "elements", "E0601";
        /// Lines of the sources that a compiled shader quotes.
        oso_quoted = 1 << 20, "lines", "messages name the line of the compiled shader";
    }
    /// From the syntax tree to a program.
    compiling: Compiling {
        /// Functions of one name in one scope: each call looks at all of them.
        overloads = 256, "functions", "E0208";
        /// Structs within structs.
        struct_depth = 256, "levels", "E0310";
        /// Indices within indices: some are evaluated twice, with all that is in them.
        index_depth = 8, "levels", "E0308";
        /// Calls within calls.
        call_depth = 128, "calls", "E0601";
        /// Jumps of one list of statements that open blocks within one another.
        nested_jumps = 64, "blocks", "what follows starts anew beside these blocks";
        /// Blocks around a list of statements from which on its jumps open no blocks within one another.
        jump_depth = 192, "blocks", "what follows a jump tests a flag instead";
        /// Values of a program once its functions are inlined.
        values = 500_000, "values", "E0601";
        /// Variables of a program once its functions are inlined, each part of a struct by itself.
        variables = 500_000, "variables", "E0601";
        /// Names of the variables of a program once its functions are inlined.
        name_bytes = 64 << 20, "bytes", "E0601";
        /// Words of arrays that a program has for each point.
        array_words = 1 << 20, "words", "E0601";
        /// Values that branches and loops hand on: one for each of them and each variable that is written inside.
        joins = 2_000_000, "values", "E0601";
        /// Text of the strings that are computed while compiling.
        folded_bytes = 4 << 20, "bytes", "the rest is computed when the shader runs";
        /// Operations of a compiled shader that is written.
        written_operations = 400_000, "operations", "E0601";
        /// Symbols of a compiled shader that is written.
        written_symbols = 500_000, "symbols", "E0601";
    }
    /// What a program does.
    running: Running {
        /// Instructions of one point that `explain` and `stability` follow.
        trace = 500_000, "instructions", "too long to be followed to its end";
    }
    /// Textures and other images.
    images: Images {
    }
    /// Scenes, meshes and pictures.
    scenes: Scenes {
    }
}
