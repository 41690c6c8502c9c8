//! The settings of an editor, added to the options of the command line.

use osl::Levels;
use osl_editor::Hints;
use osl_job::request::{Lints, Reading};
use serde::Deserialize;
use serde_json::Value;
use std::path::PathBuf;

/// All settings.
pub(super) struct Settings {
    /// How sources are read, by the command line.
    line: Reading,
    /// Which warnings the command line asks for.
    lints: Lints,
    /// How sources are read.
    pub(super) reading: Reading,
    /// Which warnings are shown.
    pub(super) levels: Levels,
    /// What else the editor asks for.
    pub(super) asked: Asked,
}

/// What an editor sets.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Asked {
    include: Vec<PathBuf>,
    define: Vec<String>,
    warn: Vec<String>,
    allow: Vec<String>,
    deny: Vec<String>,
    known_spaces: Vec<String>,
    /// The address of the lessons.
    pub(super) lessons: Option<String>,
    /// The pixel whose values are shown.
    pub(super) probe: Option<Probe>,
    hints: AskedHints,
}

/// A pixel of a square picture of the unit patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub(super) struct Probe {
    /// Column, from 0.
    pub(super) x: usize,
    /// Row, from 0; row 0 has the smallest v.
    pub(super) y: usize,
    /// Pixels of a side.
    #[serde(default = "size")]
    pub(super) size: usize,
}

fn size() -> usize {
    256
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default)]
struct AskedHints {
    conversions: bool,
    results: bool,
    parameters: bool,
}

impl Default for AskedHints {
    fn default() -> AskedHints {
        let Hints { conversions, results, parameters } = Hints::default();
        AskedHints { conversions, results, parameters }
    }
}

impl Settings {
    /// The settings of a command line.
    pub(super) fn new(line: Reading, lints: Lints) -> Settings {
        let reading = line.clone();
        let mut new = Settings { line, lints, reading, levels: Levels::default(), asked: Asked::default() };
        new.set(Asked::default());
        new
    }

    /// Takes what an editor sends: the settings themselves, or an object with those of several programs.
    ///
    /// # Errors
    /// A setting has a wrong type, or names no warning; then nothing changes.
    pub(super) fn read(&mut self, sent: &Value) -> Result<(), String> {
        let own = sent.get("oslrun").unwrap_or(sent);
        if own.is_null() {
            return Ok(());
        }
        let asked = Asked::deserialize(own).map_err(|why| format!("the settings of oslrun: {why}"))?;
        for word in asked.warn.iter().chain(&asked.allow).chain(&asked.deny) {
            osl::check_warning(word).map_err(|why| format!("the settings of oslrun: `{word}`: {why}"))?;
        }
        self.set(asked);
        Ok(())
    }

    fn set(&mut self, asked: Asked) {
        let both = |line: &[String], editor: &[String]| [line, editor].concat();
        self.reading = Reading {
            include: [&self.line.include[..], &asked.include].concat(),
            define: both(&self.line.define, &asked.define),
            ..self.line.clone()
        };
        self.levels.warn = both(&self.lints.warn, &asked.warn);
        self.levels.allow = both(&self.lints.allow, &asked.allow);
        self.levels.deny = both(&self.lints.deny, &asked.deny);
        self.levels.known_spaces = both(&self.lints.known_space, &asked.known_spaces);
        self.asked = asked;
    }

    /// Which hints are shown.
    pub(super) fn hints(&self) -> Hints {
        let AskedHints { conversions, results, parameters } = self.asked.hints;
        Hints { conversions, results, parameters }
    }
}
