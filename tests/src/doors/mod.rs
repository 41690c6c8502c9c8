//! The doors: all ways in which text or bytes come from outside, each as one function of bytes.
//!
//! A door processes its bytes as the product does with such input, and then checks the required properties.
//! It panics if one is violated. Fuzz targets (`tests/fuzz`), mutated inputs ([`crate::fuzz`]) and ordinary
//! tests call the same functions. A door must not know its caller, and must not write outside a temporary
//! folder.

mod arguments;
mod data;
mod programs;
mod proven;
mod scenes;
mod shaders;
mod source;
mod textures;

pub use arguments::arguments;
pub use data::attributes;
pub use programs::{compiled, generate, told};
pub use proven::{bounds, lod};
pub use scenes::{scene, testrender};
pub use shaders::{group, oso};
pub use source::{fmt, mutate, parse};
pub use textures::textures;

use std::path::{Path, PathBuf};

/// A door.
#[derive(Debug)]
pub struct Door {
    /// Its name.
    pub name: &'static str,
    /// The kind of input.
    pub what: &'static str,
    /// Processes bytes. The result identifies the kind of outcome: an input with a new kind is worth mutating
    /// further.
    pub enter: fn(&[u8]) -> u64,
    /// Inputs to start from.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words of the format.
    pub words: &'static [&'static str],
    /// Maximum length of an input in bytes.
    pub max_len: usize,
    /// Whether the bytes are choices of a generator, so that all bytes are equally valid.
    pub is_choices: bool,
    /// Number of executions in the ordinary tests: about four seconds in a test build.
    pub runs: u64,
}

/// A door for image files.
const fn image(name: &'static str, what: &'static str, seeds: fn() -> Vec<Vec<u8>>) -> Door {
    Door {
        name,
        what,
        enter: textures,
        seeds,
        words: textures::WORDS,
        max_len: 13_000,
        is_choices: false,
        runs: 300,
    }
}

/// All doors.
pub const ALL: &[Door] = &[
    Door {
        name: "parse",
        what: "any text, to the preprocessor and the parser with its recovery",
        enter: parse,
        seeds: source::seeds,
        words: source::WORDS,
        max_len: 1500,
        is_choices: false,
        runs: 3000,
    },
    Door {
        name: "mutate",
        what: "texts near real shaders: checked, linted, compiled and run",
        enter: mutate,
        seeds: source::seeds,
        words: source::WORDS,
        max_len: 4000,
        is_choices: false,
        runs: 800,
    },
    Door {
        name: "fmt",
        what: "texts near real shaders, to the formatter",
        enter: fmt,
        seeds: source::seeds,
        words: source::WORDS,
        max_len: 4000,
        is_choices: false,
        runs: 1500,
    },
    Door {
        name: "generate",
        what: "choices of the generator of valid programs: every way to compile and run yields the same bits",
        enter: generate,
        seeds: Vec::new,
        words: &[],
        max_len: 600,
        is_choices: true,
        runs: 300,
    },
    Door {
        name: "compiled",
        what: "the same choices: the program, written as a compiled shader and loaded, yields the same bits",
        enter: compiled,
        seeds: Vec::new,
        words: &[],
        max_len: 600,
        is_choices: true,
        runs: 300,
    },
    Door {
        name: "told",
        what: "the same choices: what `explain`, `sanitize` and `stability` say of the program",
        enter: told,
        seeds: Vec::new,
        words: &[],
        max_len: 300,
        is_choices: true,
        runs: 60,
    },
    Door {
        name: "bounds",
        what: "the same choices: what `bounds` proves holds at random points",
        enter: bounds,
        seeds: Vec::new,
        words: &[],
        max_len: 400,
        is_choices: true,
        runs: 60,
    },
    Door {
        name: "lod",
        what: "the same choices: what `lod` writes compiles, and has the bits of the original where it runs",
        enter: lod,
        seeds: Vec::new,
        words: &[],
        max_len: 300,
        is_choices: true,
        runs: 40,
    },
    Door {
        name: "oso",
        what: "the text of a compiled shader: read, compiled, run, written again",
        enter: oso,
        seeds: shaders::compiled_seeds,
        words: shaders::OSO_WORDS,
        max_len: 6000,
        is_choices: false,
        runs: 800,
    },
    Door {
        name: "group",
        what: "the text of a group, with a few shaders at hand",
        enter: group,
        seeds: shaders::group_seeds,
        words: shaders::GROUP_WORDS,
        max_len: 1500,
        is_choices: false,
        runs: 1500,
    },
    Door {
        name: "attributes",
        what: "the JSON of `--attributes`",
        enter: attributes,
        seeds: data::seeds,
        words: data::WORDS,
        max_len: 1000,
        is_choices: false,
        runs: 600,
    },
    Door { runs: 1500, ..image("textures", "the bytes of an image of any format", textures::seeds) },
    image("exr", "the bytes of an EXR file", || textures::of("exr")),
    image("png", "the bytes of a PNG file", || textures::of("png")),
    image("jpeg", "the bytes of a JPEG file", || textures::of("jpeg")),
    image("tiff", "the bytes of a TIFF file", || textures::of("tiff")),
    image("hdr", "the bytes of a Radiance HDR file", || textures::of("hdr")),
    image("tga", "the bytes of a TGA file", || textures::of("tga")),
    image("bmp", "the bytes of a BMP file", || textures::of("bmp")),
    image("gif", "the bytes of a GIF file", || textures::of("gif")),
    image("webp", "the bytes of a WebP file", || textures::of("webp")),
    image("pnm", "the bytes of a PNM file", || textures::of("pnm")),
    image("dds", "the bytes of a DDS file", || textures::of("dds")),
    Door {
        name: "scene",
        what: "the text of a scene: read, built, and rendered in a few pixels",
        enter: scene,
        seeds: scenes::seeds,
        words: scenes::WORDS,
        max_len: 3000,
        is_choices: false,
        runs: 600,
    },
    Door {
        name: "testrender",
        what: "the XML of a scene of `testrender`",
        enter: testrender,
        seeds: scenes::xml_seeds,
        words: scenes::XML_WORDS,
        max_len: 2000,
        is_choices: false,
        runs: 300,
    },
    Door {
        name: "arguments",
        what: "a command line, a word a line",
        enter: arguments,
        seeds: arguments::seeds,
        words: arguments::WORDS,
        max_len: 600,
        is_choices: false,
        runs: 500,
    },
];

/// A door by its name.
pub fn find(name: &str) -> Option<&'static Door> {
    ALL.iter().find(|door| door.name == name)
}

/// A number for bytes: FNV-1a (Fowler, Noll and Vo).
pub fn hash(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3))
}

/// The number of an outcome: the set of its codes or words. Only the first two in alphabetical order and the
/// last one count, because otherwise nearly every input would be a kind of its own.
fn outcome<'a>(words: impl IntoIterator<Item = &'a str>) -> u64 {
    let all: std::collections::BTreeSet<&str> = words.into_iter().collect();
    let some = all.iter().take(2).chain(all.iter().next_back().filter(|_| all.len() > 2));
    some.fold(0, |sum: u64, word| sum.rotate_left(7) ^ hash(word.as_bytes()))
}

/// The number of a message: its words without numbers and names, which differ between inputs.
fn message(text: &str) -> u64 {
    let word = |w: &&str| w.len() > 1 && w.bytes().all(|b| b.is_ascii_lowercase());
    text.split_whitespace()
        .filter(word)
        .take(6)
        .fold(0, |sum, word| sum.rotate_left(7) ^ hash(word.as_bytes()))
}

/// The files of a folder of the repository and of those below it that have one of these extensions, in order.
fn files(folder: &str, extensions: &[&str]) -> Vec<PathBuf> {
    fn list(folder: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) {
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        paths.sort();
        for path in paths {
            if path.is_dir() {
                list(&path, extensions, found);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|have| e == *have)) {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    list(&crate::run::root().join(folder), extensions, &mut found);
    found
}

/// The contents of these files.
fn contents(folder: &str, extensions: &[&str]) -> Vec<Vec<u8>> {
    files(folder, extensions).iter().filter_map(|path| std::fs::read(path).ok()).collect()
}

/// The limits under which doors run compiled programs: small, so that they are often reached.
fn tight() -> osl_exec::RunOptions {
    osl_exec::RunOptions {
        batch: Some(16),
        limits: crate::run::steps(1 << 14),
        ..osl_exec::RunOptions::default()
    }
}

/// Panics with the violated property and the input.
#[expect(clippy::panic, reason = "who calls a door expects a panic where something is wrong")]
fn broken(input: &str, what: &str) -> ! {
    panic!("{input}\n{what}")
}
