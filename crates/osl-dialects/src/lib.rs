//! Dialects: what each renderer adds to the language, as data.
//!
//! A dialect is a folder below `dialects`. Its `dialect.toml` has the names: signs by which a file shows
//! that it is written for this renderer, attributes with types and defaults, spaces, kinds of rays,
//! metadata, roles of outputs, and what the renderer lacks. Its `headers` are OSL: the prelude that is read
//! before a shader, and the files that shaders include. A folder without `dialect.toml` is no dialect; other
//! `*.toml` files beside it are read by the parts that they belong to ([`Dialect::file`]).
//!
//! The crate knows neither files on the disk nor how a shader is compiled or run: osl-job brings a dialect
//! and a shader together. No compiler crate knows this one.

mod names;
mod page;
mod signs;

pub use names::{Attribute, Error, Lacks, Names, Output, Quirks, Role, Rule, Signs, Source, Value};
pub use signs::{Reason, Sign, declared, words_of};

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};

/// The files of the built-in dialects: name of the dialect, path in its folder, text.
const FILES: &[(&str, &str, &str)] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// The name of the file with the names.
pub const NAMES: &str = "dialect.toml";
/// The folder of the headers.
const HEADERS: &str = "headers/";
/// The dialect of plain files.
pub const NONE: &str = "none";

/// A dialect.
#[derive(Debug)]
pub struct Dialect {
    /// Its name, as `--dialect` has it: the name of its folder.
    pub name: String,
    /// Its names.
    pub names: Names,
    /// The texts of its files, by the path in its folder.
    files: BTreeMap<String, String>,
}

impl Dialect {
    /// A dialect from the files of its folder, by path.
    ///
    /// # Errors
    /// There is no `dialect.toml`, or it has a mistake; the text says which and where.
    pub fn new(name: &str, files: BTreeMap<String, String>) -> Result<Dialect, Error> {
        let wrong = |why: String| Error { dialect: name.to_string(), why };
        let text = files.get(NAMES).ok_or_else(|| wrong(format!("it has no {NAMES}")))?;
        let names: Names = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        let dialect = Dialect { name: name.to_string(), names, files };
        dialect.check().map_err(wrong)?;
        Ok(dialect)
    }

    fn check(&self) -> Result<(), String> {
        if let Some(prelude) = &self.names.prelude
            && self.header(prelude).is_none()
        {
            return Err(format!("the prelude headers/{prelude} is missing"));
        }
        self.names.check()
    }

    /// The text of a file of its folder.
    pub fn file(&self, path: &str) -> Option<&str> {
        self.files.get(path).map(String::as_str)
    }

    /// The text of a header, by the name that an `#include` has.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.file(&format!("{HEADERS}{name}"))
    }

    /// The names of its headers, in order.
    pub fn headers(&self) -> impl Iterator<Item = &str> {
        self.files.keys().filter_map(|path| path.strip_prefix(HEADERS))
    }

    /// The strings and words of a text whose meaning is not public, each once, with what happens here.
    pub fn unknown_in(&self, text: &str) -> Vec<(String, String)> {
        let unknown = &self.names.unknown;
        let found = signs::names(text).filter_map(|name| unknown.get_key_value(name));
        let found: BTreeMap<_, _> = found.map(|(name, why)| (name.clone(), why.clone())).collect();
        found.into_iter().collect()
    }

    /// The name and text of the header that is read before every shader.
    pub fn prelude(&self) -> Option<(&str, &str)> {
        let name = self.names.prelude.as_deref()?;
        Some((name, self.header(name)?))
    }

    /// The functions, closures and macros of its headers.
    pub fn declared(&self) -> BTreeSet<&str> {
        self.headers().filter_map(|header| self.header(header)).flat_map(signs::declared).collect()
    }

    /// The attribute of an object with a name; the object is empty for attributes of the surface.
    pub fn attribute(&self, object: &str, name: &str) -> Option<&Attribute> {
        match object {
            "" => self.names.attributes.get(name),
            object => self.names.objects.get(object)?.get(name),
        }
    }
}

/// Several dialects, the most used first.
#[derive(Clone, Debug, Default)]
pub struct Dialects {
    list: Vec<Arc<Dialect>>,
    words: signs::Words,
}

/// The order of the built-in dialects: by their use in published files.
const ORDER: [&str; 12] = [
    "materialx",
    "cycles",
    "renderman",
    "gaffer",
    "3delight",
    "octane",
    "3dsmax",
    "appleseed",
    "vray",
    "redshift",
    "arnold",
    NONE,
];

impl Dialects {
    /// The built-in ones. A test reads each of them, so none is left out.
    pub fn built_in() -> &'static Dialects {
        static ALL: LazyLock<Dialects> = LazyLock::new(|| {
            let mut folders: BTreeMap<&str, BTreeMap<String, String>> = BTreeMap::new();
            for (dialect, path, text) in FILES {
                folders.entry(dialect).or_default().insert((*path).to_string(), (*text).to_string());
            }
            let mut list: Vec<_> = folders
                .into_iter()
                .filter_map(|(name, files)| Dialect::new(name, files).ok())
                .map(Arc::new)
                .collect();
            let place = |dialect: &Arc<Dialect>| ORDER.iter().position(|name| *name == dialect.name);
            list.sort_by_key(|dialect| place(dialect).unwrap_or(ORDER.len()));
            Dialects::of(list)
        });
        &ALL
    }

    /// The same, with others that take precedence; one with the name of a known dialect replaces it.
    #[must_use]
    pub fn with(&self, own: Vec<Dialect>) -> Dialects {
        let kept =
            self.list.iter().filter(|known| !own.iter().any(|other| other.name == known.name)).cloned();
        let kept: Vec<_> = kept.collect();
        Dialects::of(own.into_iter().map(Arc::new).chain(kept).collect())
    }

    fn of(list: Vec<Arc<Dialect>>) -> Dialects {
        let words = signs::words(&list);
        Dialects { list, words }
    }

    /// The words that are signs.
    fn words(&self) -> &signs::Words {
        &self.words
    }

    /// All, in the order of precedence.
    pub fn list(&self) -> &[Arc<Dialect>] {
        &self.list
    }

    /// The dialect with a name.
    pub fn named(&self, name: &str) -> Option<&Arc<Dialect>> {
        self.list.iter().find(|dialect| dialect.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_folder_is_a_dialect() {
        for (name, path, _) in FILES {
            if *path == NAMES {
                let own = FILES.iter().filter(|(dialect, ..)| dialect == name);
                let files = own.map(|(_, path, text)| ((*path).to_string(), (*text).to_string())).collect();
                assert!(
                    Dialect::new(name, files).is_ok_and(|dialect| !dialect.names.title.is_empty()),
                    "{name}: {:?}",
                    Dialect::new(name, BTreeMap::new()).err()
                );
            }
        }
        let names: Vec<&str> =
            Dialects::built_in().list().iter().map(|dialect| dialect.name.as_str()).collect();
        assert!(names.contains(&"cycles") && names.last() == Some(&NONE), "{names:?}");
    }
}
