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
        /// Size of one file.
        file_bytes = 2 << 30, "bytes", "--limit images.file_bytes";
        /// Size of the header of an EXR or HDR file.
        header_bytes = 1 << 20, "bytes", "--limit images.header_bytes";
        /// Values of one image: width times height times channels.
        samples = 1 << 30, "values", "--limit images.samples";
        /// Memory for textures, with their coarser levels, in the type that their files store. A single texture that is larger
        /// cannot be read; of several, those that were not used for longest are read again when they are wanted.
        texture_memory = 1 << 30, "bytes", "--limit images.texture_memory";
        /// Memory that decoding may take beyond that. Where several threads decode, they wait for each other.
        working_memory = 64 << 20, "bytes", "--limit images.working_memory";
        /// Values of an image of which a file stores a part. Coarser levels of larger ones are not made.
        partial_samples = 1 << 28, "values", "the finest level is used";
        /// Pages of a TIFF file that are looked at.
        pages = 1 << 10, "pages", "there is no subimage";
        /// Attributes of an image that are kept.
        attributes = 1 << 10, "attributes", "the attribute is not there";
        /// Length of the name of an attribute, and of its text, and numbers that it has.
        attribute_length = 1 << 16, "bytes", "the attribute is not there";
        /// Names of textures that are remembered. Beyond, those that are not in use are looked for again.
        names = 1 << 16, "names", "the file is looked for again";
        /// Names that stand for many files (`<UDIM>`), and folders, that are remembered. Beyond, they are looked for again.
        patterns = 1 << 10, "names", "the files are looked for again";
    }
    /// Scenes, meshes and pictures.
    scenes: Scenes {
        /// Files of a scene, with those that it includes.
        files = 256, "files", "too many files include each other";
        /// Files within files.
        file_depth = 16, "files", "too many files include each other";
        /// Size of all files of a scene together.
        bytes = 64 << 20, "bytes", "a scene has at most";
        /// Elements of an array in a scene, counting the components of points.
        elements = 1 << 24, "numbers", "--limit scenes.elements";
        /// Surfaces, lights, skies and shader nodes of a scene: each ray may ask each of them.
        nodes = 1 << 14, "nodes", "--limit scenes.nodes";
        /// Shader nodes on the way from a node to one that it needs.
        node_depth = 128, "nodes", "needs itself, or too many others";
        /// Messages that are kept about a scene.
        messages = 100, "messages", "later messages are not shown";
        /// Corners, and vertices, of a mesh before it is subdivided.
        corners = 1 << 24, "corners", "--limit scenes.corners";
        /// Times that a mesh of a scene is subdivided at most.
        subdivisions = 9, "times", "subdivisions are too many";
        /// Triangles of all surfaces together, some 200 bytes each.
        triangles = 1 << 22, "triangles", "--limit scenes.triangles";
        /// Triangles that a surface is cut into for the sake of pixels.
        pixel_triangles = 1 << 21, "triangles", "it is cut less finely";
        /// Pixels of a picture, some 60 bytes each.
        pixels = 1 << 24, "pixels", "--limit scenes.pixels";
        /// Spheres and quads of a scene of testrender: each ray asks them all.
        shapes = 1 << 14, "shapes", "shapes";
        /// Elements of XML that contain each other.
        xml_depth = 256, "elements", "Elements are nested too deeply";
        /// Side of the table by which testrender chooses directions of a background.
        background = 1 << 11, "cells", "the table has this side";
    }
}
