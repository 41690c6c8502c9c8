//! What is shown: the questions that the server asks about a shader.

use crate::protocol::{Edit, Line, Picture, Saved, Shader, State, Unsaved};
use osl_files::Stamp;
use osl_limits::Cancel;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Files that were read or looked for, and their state at that time; `None` if there was no such file. The
/// answer is outdated when one of them changes.
pub type Files = BTreeMap<PathBuf, Option<Stamp>>;

/// Cancels the work on the state before, and returns what cancels the work on the new one, for which a file
/// has the text that is given. A file that a page may not save keeps its own.
pub type Outdate = Box<dyn Fn(Option<&Unsaved>) -> Cancel + Send>;

/// Something that can be shown on the page.
///
/// Each connection has its own. The server asks one question at a time.
pub trait Subject: Send {
    /// Makes a function that is called when the page wants another state, or when a file has changed.
    fn outdate(&self) -> Outdate;

    /// Describes the shader, also if it has errors. Adds the files that it reads.
    ///
    /// # Errors
    /// The file cannot be read, or may not be.
    fn shader(&mut self, state: &State, files: &mut Files) -> Result<Shader, Stop>;

    /// Makes the picture; with `first`, a smaller one before it. Adds the files that it reads.
    ///
    /// # Errors
    /// The shader has errors, the run fails, or the work was cancelled.
    fn picture(
        &mut self,
        state: &State,
        first: Option<First<'_>>,
        cancel: &Cancel,
        files: &mut Files,
    ) -> Result<Picture, Stop>;

    /// Keeps the values of the picture of a state, in place of others, for a layer that shows the difference
    /// to them; without a state, keeps none. A picture without values of its own, such as one with light, has
    /// none to keep.
    ///
    /// # Errors
    /// The shader has errors, the run fails, or the work was cancelled.
    fn pin(&mut self, state: Option<&State>, cancel: &Cancel) -> Result<(), Stop>;

    /// Explains the point at a column and a row of the whole picture: the text of a JSON value.
    ///
    /// # Errors
    /// There is no such point, the run fails, or the work was cancelled.
    fn explain(&mut self, state: &State, at: [usize; 2], cancel: &Cancel) -> Result<String, Stop>;

    /// Shows what a line of the source does; lines are counted from 1.
    ///
    /// # Errors
    /// The shader has errors, its lines have no pictures, the run fails, or the work was cancelled.
    fn line(&mut self, state: &State, line: u32, cancel: &Cancel) -> Result<Line, Stop>;

    /// The text of a group that makes the picture of a state.
    ///
    /// # Errors
    /// The shader has errors, it has no such text, or the work was cancelled.
    fn group(&mut self, state: &State, cancel: &Cancel) -> Result<String, Stop>;

    /// Replaces the text of the file of a state, unless the file has changed since the page read it.
    ///
    /// # Errors
    /// The edit is of another file, or the file may not be written.
    fn save(&mut self, state: &State, edit: &Edit) -> Result<Saved, Stop>;
}

/// A small picture that is shown until the whole one is ready.
pub struct First<'a> {
    /// Columns and rows of the whole picture for each pixel of the small one.
    pub step: usize,
    /// Shows the small picture. It is called once, or not at all if there is no small picture.
    pub show: &'a mut dyn FnMut(Picture),
}

/// Why there is no answer.
#[derive(Clone, Debug)]
pub enum Stop {
    /// The work was cancelled: nobody waits for the answer.
    Cancelled,
    /// Errors, as objects like those of [`Picture::messages`].
    Failed(Vec<Value>),
}

impl Stop {
    /// A single error.
    pub fn error(text: impl std::fmt::Display) -> Stop {
        Stop::Failed(vec![serde_json::json!({ "severity": "error", "message": text.to_string() })])
    }
}
