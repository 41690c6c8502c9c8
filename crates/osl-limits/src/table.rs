//! The table.

use crate::halt::Flag;

/// A limit, as shown in `docs/limits.md`.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// `GROUP.NAME`, as in `--limit`.
    pub name: &'static str,
    /// What it bounds.
    pub meaning: &'static str,
    /// The unit of the count.
    pub unit: &'static str,
    /// Its default value.
    pub default: u64,
    /// The code of the error that a user sees, or the start of its message, or the behaviour instead of an
    /// error.
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

        /// The limits of all inputs. A copy shares only the order to stop.
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
        /// Text of all files of a program, each counted for every inclusion.
        included_bytes = 64 << 20, "bytes", "E0017";
        /// Files that are open at a time: the source, and the headers that include one another.
        include_depth = 64, "files", "E0002";
        /// Inclusions in total.
        includes = 4096, "files", "E0003";
        /// Tokens that macros produce; each 16 bytes of their text count as one more.
        expansion = 1 << 20, "tokens", "E0014";
        /// Nested parentheses and signs in a condition of the preprocessor; the condition itself is one
        /// level.
        condition_depth = 100, "levels", "E0010";
        /// Tokens after preprocessing.
        tokens = 1 << 20, "tokens", "E0016";
        /// Text of all tokens after preprocessing: macros can repeat a long name or string.
        token_bytes = 64 << 20, "bytes", "E0016";
        /// Nested constructs, and calls of macros nested in their arguments.
        nesting = 256, "levels", "E0113";
        /// Errors that are reported for a file, and the same number of warnings.
        diagnostics = 64, "messages", "E0120";
        /// Tokens that the parser reads again to continue after errors.
        recovery = 4 << 20, "tokens", "later errors are not reported";
        /// Tokens that the search for lost brackets reads.
        repair = 2 << 20, "tokens", "no repair is offered";
        /// Words in the text of a group.
        group_words = 2 << 20, "words", "E0801";
        /// Layers of a group.
        layers = 4096, "layers", "E0803";
        /// Symbols of a compiled shader, and the same number of operations.
        oso_lines = 1 << 20, "lines", "E0601";
        /// Nested blocks in a compiled shader.
        oso_depth = 512, "levels", "E0601";
        /// Nested structs in a compiled shader.
        oso_structs = 32, "levels", "E0601";
        /// Elements of constant arrays in a compiled shader, each array counted for every section that uses
        /// it, and of copies between arrays of different lengths.
        oso_elements = 1 << 20, "elements", "E0601";
        /// Lines of the sources that a compiled shader quotes.
        oso_quoted = 1 << 20, "lines", "messages name the line of the compiled shader";
    }
    /// From the syntax tree to a program.
    compiling: Compiling {
        /// Functions of one name in one scope: each call compares all of them.
        overloads = 256, "functions", "E0208";
        /// Nested structs.
        struct_depth = 256, "levels", "E0310";
        /// Nested indices: some are evaluated twice, together with the indices inside.
        index_depth = 8, "levels", "E0308";
        /// Nested calls.
        call_depth = 128, "calls", "E0601";
        /// Nested blocks that the compiler makes of a list of statements with jumps: what follows a jump goes
        /// into a block of its own, inside the block before.
        nested_jumps = 64, "blocks", "what follows is put beside these blocks, under a flag";
        /// Blocks around a list of statements. A list that is nested deeper gets no blocks of its own for its
        /// jumps.
        jump_depth = 192, "blocks", "what follows a jump tests a flag";
        /// Values of a program after its functions are inlined.
        values = 500_000, "values", "E0601";
        /// Variables of a program after its functions are inlined; each part of a struct counts separately.
        variables = 500_000, "variables", "E0601";
        /// Names of the variables of a program after its functions are inlined.
        name_bytes = 64 << 20, "bytes", "E0601";
        /// Words of arrays that a program has for each point.
        array_words = 1 << 20, "words", "E0601";
        /// Values that branches and loops pass on: one for each of them and each variable that is written
        /// inside.
        joins = 2_000_000, "values", "E0601";
        /// Text of the strings that are computed at compile time.
        folded_bytes = 4 << 20, "bytes", "the rest is computed when the shader runs";
        /// Operations of a compiled shader on output.
        written_operations = 400_000, "operations", "E0601";
        /// Symbols of a compiled shader on output.
        written_symbols = 500_000, "symbols", "E0601";
        /// Variables without initial value that the lints watch at a time.
        watched = 256, "variables", "other variables are not watched";
        /// Elements of an array that `debug_uninit` watches.
        marked = 4096, "elements", "other elements are not watched";
        /// Warnings of the lints about one file; the first ones are kept.
        findings = 200, "warnings", "later warnings are not shown";
    }
    /// What a program does.
    running: Running {
        /// Instructions of one point that `explain`, `sanitize` and `stability` follow.
        trace = 500_000, "instructions", "too long to be followed to its end";
        /// Steps of a point, as described above; `--max-steps` sets it as well.
        point_steps = 1 << 23, "steps", "takes more than";
        /// Memory that a point creates: strings, messages, closures, nodes of dictionaries, printed text.
        point_memory = 16 << 20, "bytes", "strings, messages and closures";
        /// Registers and arrays of all threads; batches become smaller, and threads fewer, to fit it.
        memory = 128 << 20, "bytes", "the arrays of a point take";
        /// Outputs of the points that are in memory at a time: some rows of the image if it becomes an EXR
        /// file, a tile of it if a run without `-o` needs only the ranges, and otherwise the whole image.
        /// Each number takes 4 bytes (12 in double precision).
        frame_bytes = 256 << 20, "bytes", "take more than";
        /// Text that all points print.
        printed_bytes = 128 << 20, "bytes", "all points together print more than";
        /// The closures of all points, if they are kept.
        closure_bytes = 256 << 20, "bytes", "all points together yield closures of more than";
        /// An XML text or file that is searched.
        xml_bytes = 4 << 20, "bytes", "the XML text has more than";
        /// Attributes of an XML element, and namespaces of a document.
        xml_attributes = 256, "", "an XML element has more than";
        /// Elements that one search of an XML text finds.
        xml_found = 1 << 14, "elements", "the rest is not found";
        /// Instructions that `stability` follows at all points together.
        traces = 2_000_000, "instructions", "other points are not followed";
        /// Steps of a point at each of the many settings that `stability` tries besides the given one.
        tried_steps = 128 << 10, "steps", "takes more than";
        /// Length of one string.
        string_bytes = 1 << 20, "bytes", "the string is cut";
        /// Size of a compiled regular expression.
        regex_bytes = 1 << 20, "bytes", "malformed regular expression";
        /// Backtracking steps of the match of a regular expression.
        regex_retries = 4_000, "steps", "there is no match";
        /// Different messages that a run keeps: those of the first points.
        messages = 1000, "messages", "later messages are not shown";
        /// Text of all messages that a run keeps.
        message_bytes = 1 << 20, "bytes", "later messages are not shown";
        /// Points of a grid, or pixels of a view.
        points = 1 << 30, "points", "--limit running.points";
        /// Pixels of an image that `tradeoff` measures: it keeps the image and the oracle in memory.
        measured_pixels = 1 << 24, "pixels", "--limit running.measured_pixels";
        /// Pictures on a page of `picture-book`, without the first rounds of loops.
        book_pictures = 400, "pictures", "the page counts what it leaves out";
        /// XML documents that are kept for other points.
        xml_cache_bytes = 32 << 20, "bytes", "the oldest are parsed again";
    }
    /// Textures and other images.
    images: Images {
        /// Size of one file.
        file_bytes = 2 << 30, "bytes", "--limit images.file_bytes";
        /// Size of the header of an EXR, HDR or PNM file.
        header_bytes = 1 << 20, "bytes", "--limit images.header_bytes";
        /// Values of one image: width times height times channels.
        samples = 1 << 30, "values", "--limit images.samples";
        /// Memory for textures, with their coarser levels, in the type that their files store. A single
        /// texture that is larger cannot be read. If all textures together do not fit, the least recently
        /// used are dropped and read again on demand.
        texture_memory = 1 << 30, "bytes", "--limit images.texture_memory";
        /// Memory that decoding may take beyond that. Where several threads decode, they wait for each other.
        working_memory = 64 << 20, "bytes", "--limit images.working_memory";
        /// Values of an image of which a file stores a part. Coarser levels of larger ones are not made.
        partial_samples = 1 << 28, "values", "the finest level is used";
        /// Pages of a TIFF file that are read.
        pages = 1 << 10, "pages", "there is no subimage";
        /// Attributes of an image that are kept. The header of an HDR file has no more lines.
        attributes = 1 << 10, "attributes", "the attribute is not there";
        /// Length of the name of an attribute, and of its text, and numbers that it has.
        attribute_length = 1 << 16, "bytes", "the attribute is not there";
        /// Names of textures that are remembered. Beyond, those that are not in use are looked for again.
        names = 1 << 16, "names", "the file is looked for again";
        /// Names that stand for many files (`<UDIM>`), and folders, that are remembered. Beyond, they are
        /// looked for again.
        patterns = 1 << 10, "names", "the files are looked for again";
    }
    /// Scenes, meshes and pictures.
    scenes: Scenes {
        /// Files of a scene, with those that it includes.
        files = 256, "files", "too many files include each other";
        /// Nested inclusions of scene files.
        file_depth = 16, "files", "too many files include each other";
        /// Size of all files of a scene together.
        bytes = 64 << 20, "bytes", "a scene has at most";
        /// Elements of an array in a scene, counting the components of points.
        elements = 1 << 24, "numbers", "--limit scenes.elements";
        /// Surfaces, lights, skies and shader nodes of a scene: each ray may be tested with each of them.
        nodes = 1 << 14, "nodes", "--limit scenes.nodes";
        /// Length of a chain of shader nodes, each of which needs the next.
        node_depth = 128, "nodes", "needs itself, or too many others";
        /// Messages that are kept about a scene.
        messages = 100, "messages", "later messages are not shown";
        /// Corners, and vertices, of a mesh before it is subdivided.
        corners = 1 << 24, "corners", "--limit scenes.corners";
        /// Subdivisions of a mesh of a scene.
        subdivisions = 9, "times", "subdivisions are too many";
        /// Triangles of all surfaces together, some 200 bytes each.
        triangles = 1 << 22, "triangles", "--limit scenes.triangles";
        /// Triangles of a surface that is cut until its edges are short in the picture.
        pixel_triangles = 1 << 21, "triangles", "it is cut less finely";
        /// Pixels of a picture, some 60 bytes each.
        pixels = 1 << 24, "pixels", "--limit scenes.pixels";
        /// Spheres, quads and meshes of a scene of testrender: each ray is tested with all of them.
        shapes = 1 << 14, "shapes", "shapes";
        /// Nested elements of the XML of a scene of testrender.
        xml_depth = 256, "elements", "Elements are nested too deeply";
        /// Paths per pixel, whatever the scene or the command requests.
        samples = 1 << 16, "paths", "fewer paths are followed";
        /// Surfaces on a path of testrender, whatever the scene requests.
        bounces = 1 << 12, "surfaces", "paths end there";
        /// Texts that the shaders of testrender print.
        printed = 1 << 16, "texts", "later texts are not printed";
        /// Side length of the table with which testrender chooses directions of a background.
        background = 1 << 11, "cells", "the table has this side";
    }
}
