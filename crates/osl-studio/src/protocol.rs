//! The messages between server and page. docs/studio.md describes them for other programs.
//!
//! The page sends JSON. The server sends JSON too, except for pictures: the length of a JSON header in four
//! bytes, the lowest first, the header, and the samples.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha1::{Digest, Sha1};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Maximum size of a message from the page in bytes.
pub(crate) const MAX_MESSAGE: usize = 256 << 10;

/// What the page wants to see. Everything has a default, which the command line sets.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct State {
    /// The file, relative to the folder of the file on the command line.
    pub file: Option<String>,
    /// The values of parameters, as after `-p`. An empty list sets none, not even those of the command line.
    pub params: Option<Vec<(String, String)>>,
    /// The output to show, or a tap: `42:dist` is the variable `dist` after line 42.
    pub output: Option<String>,
    /// The surface that is shaded: a name, or `patch` for the grid.
    pub on: Option<String>,
    /// Whether the surface is shown with light, on a floor.
    pub lit: bool,
    /// The values that become black and white, as after `--range`; a picture with light has none.
    pub range: Option<String>,
    /// What covers the picture: `outside` marks the values that it does not show, `difference` shows how much
    /// it differs from the pinned one, `samples` where the samples of a picture with an error bound are, and
    /// `rounding` the digits lost to rounding.
    pub layer: Option<String>,
    /// The error that the pixels may have, as after `--max-error`.
    pub max_error: Option<String>,
}

/// A message from the page.
#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(crate) enum Request {
    /// Show this state.
    State {
        /// Comes back with the answers.
        id: u64,
        state: State,
    },
    /// Explain a point of the present state.
    Point { id: u64, at: [usize; 2] },
    /// Show what a line of the present state does.
    Line { id: u64, line: u32 },
    /// Keep the values of the present state, or forget those that are kept.
    Pin { id: u64, pinned: bool },
    /// Write the present state as the text of a group.
    Group { id: u64 },
    /// Show a file with this text in place of the one on the disk, or with that one again.
    Unsaved(Unsaved),
    /// Save a text as the file of the present state.
    Save {
        id: u64,
        #[serde(flatten)]
        edit: Edit,
    },
}

/// A shader as the page shows it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Shader {
    /// The file, relative to the folder.
    pub file: String,
    /// Other files of the folder that can be shown.
    pub files: Vec<String>,
    /// The path of the file as messages name it.
    pub path: String,
    /// The text of the file on the disk.
    pub text: String,
    /// Whether all that follows is about another text, which a page has not saved.
    pub unsaved: bool,
    /// Why a page cannot save the file; none if it can.
    pub locked: Option<String>,
    /// The words of the command line that makes the same picture, without what the state says.
    pub command: Vec<String>,
    /// The values of parameters that the command line gives.
    pub given: Vec<(String, String)>,
    /// The output that the command line names.
    pub output: Option<String>,
    /// The surface that the command line names.
    pub on: Option<String>,
    /// The surfaces that the page offers.
    pub surfaces: Vec<String>,
    /// Columns and rows of the picture.
    pub size: [usize; 2],
    /// The shader, or the layers of a group, the last one last; none if there are errors.
    pub layers: Vec<Layer>,
    /// The outputs that can be shown.
    pub outputs: Vec<Output>,
    /// The lines that set variables, or have a condition or a loop.
    pub lines: Vec<u32>,
    /// Errors and warnings, as `--message-format json` prints them.
    pub diagnostics: Vec<Value>,
    /// The lessons of their codes, as `oslrun explain-error` prints them.
    pub lessons: BTreeMap<String, String>,
    /// Names of image files that a parameter can have as its value.
    pub images: Vec<String>,
}

/// A layer of a group, or a shader.
#[derive(Clone, Debug, Serialize)]
pub struct Layer {
    /// The name before the parameters; empty for the last layer, whose parameters have no prefix.
    pub name: String,
    /// What `oslrun info --json` prints.
    pub description: Value,
}

/// An output.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: String,
}

/// A variable that a line sets, a condition or a loop, with a small picture.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Thumbnail {
    /// The tap that makes the picture, for the output of a state; a condition and a loop have none.
    pub tap: Option<String>,
    /// Its name.
    pub name: String,
    /// Its type; empty for a condition and a loop.
    #[serde(rename = "type")]
    pub ty: String,
    /// Its range, and how to read the colors.
    pub words: String,
    /// The values that are black and white, if these are not 0 and 1.
    pub range: Option<[f32; 2]>,
    /// The picture as the address of a PNG (`data:`); none if all values are the same.
    pub picture: Option<String>,
    /// In a loop, the pictures of the first rounds.
    pub rounds: Vec<String>,
}

/// A picture.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// The name of the output.
    pub output: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples of a pixel: 1 is grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha.
    pub channels: usize,
    /// The samples, pixel by pixel from the first row on, as an image file stores them.
    pub samples: Vec<u8>,
    /// Messages of the run, as objects with `severity`, `message`, and perhaps `file` and `line`.
    pub messages: Vec<Value>,
    /// Text that the shader printed.
    pub text: String,
    /// The seconds that parts of the work took, each with its name.
    pub phases: Vec<(&'static str, f64)>,
}

/// A text of a page that is to be saved.
#[derive(Clone, Debug, Deserialize)]
pub struct Edit {
    /// The file, as [`Shader::file`] names it.
    pub file: String,
    /// The [`version`] of the text that was changed.
    pub version: String,
    /// The text.
    pub text: String,
}

/// A text that a page has not saved.
#[derive(Clone, Debug, Deserialize)]
pub struct Unsaved {
    /// The file, as [`Shader::file`] names it.
    pub file: String,
    /// The text; none if the file has its own again.
    pub text: Option<String>,
}

/// Whether a text was saved, with the [`version`] that the file now has.
#[derive(Clone, Debug)]
pub enum Saved {
    /// The file has the text.
    Done(String),
    /// The file has another text than the page read, and was not overwritten.
    Changed(String),
}

/// What a line of the source does.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// The variables that it sets, its conditions and its loops.
    pub pictures: Vec<Thumbnail>,
    /// How many of these are left out.
    pub more: usize,
}

/// The version of a text: a page that saves a text names the version that it changed.
pub fn version(text: &str) -> String {
    let mut version = String::new();
    for byte in Sha1::digest(text.as_bytes()) {
        let _ = write!(version, "{byte:02x}");
    }
    version
}

/// The message with a shader.
pub(crate) fn shader(shader: &Shader) -> String {
    let mut value = serde_json::to_value(shader).unwrap_or_default();
    value["type"] = Value::from("shader");
    value["version"] = Value::from(version(&shader.text));
    value["max_message"] = Value::from(MAX_MESSAGE);
    value.to_string()
}

/// The message that a state has no picture.
pub(crate) fn failed(id: u64, messages: &[Value]) -> String {
    json!({ "type": "failed", "id": id, "messages": messages }).to_string()
}

/// The message with the explanation of a point, which is the text of a JSON value.
pub(crate) fn explanation(id: u64, [x, y]: [usize; 2], explanation: &str) -> String {
    let text = explanation.trim_end();
    format!("{{\"type\":\"explanation\",\"id\":{id},\"at\":[{x},{y}],\"explanation\":{text}}}")
}

/// The message that a point has no explanation.
pub(crate) fn unexplained(id: u64, at: [usize; 2], messages: &[Value]) -> String {
    json!({ "type": "explanation", "id": id, "at": at, "messages": messages }).to_string()
}

/// The message with what a line does.
pub(crate) fn line(id: u64, number: u32, line: &Line) -> String {
    let Line { pictures, more } = line;
    json!({ "type": "line", "id": id, "line": number, "pictures": pictures, "more": more }).to_string()
}

/// The message that values are kept, or not; with the reasons if they should be and are not.
pub(crate) fn pinned(id: u64, pinned: bool, messages: &[Value]) -> String {
    json!({ "type": "pinned", "id": id, "pinned": pinned, "messages": messages }).to_string()
}

/// The message with the text of a group, or with the reasons why there is none.
pub(crate) fn group(id: u64, text: Option<&str>, messages: &[Value]) -> String {
    json!({ "type": "group", "id": id, "text": text, "messages": messages }).to_string()
}

/// The message that a text is saved, or that it is not because the file was changed. `version` is that of the
/// file.
pub(crate) fn saved(id: u64, saved: &Saved) -> String {
    let (is_saved, version) = match saved {
        Saved::Done(version) => (true, version),
        Saved::Changed(version) => (false, version),
    };
    let why = "the file has changed on the disk since the page read it, so it is not overwritten";
    let message = json!({ "severity": "error", "message": why });
    let messages = if is_saved { Vec::new() } else { vec![message] };
    json!({ "type": "saved", "id": id, "saved": is_saved, "version": version, "messages": messages })
        .to_string()
}

/// The message that a text cannot be saved.
pub(crate) fn unsaved(id: u64, messages: &[Value]) -> String {
    json!({ "type": "saved", "id": id, "saved": false, "version": null, "messages": messages }).to_string()
}

/// The message that a line cannot be shown.
pub(crate) fn unshown(id: u64, number: u32, messages: &[Value]) -> String {
    json!({ "type": "line", "id": id, "line": number, "messages": messages }).to_string()
}

/// The message with a picture. `seconds` is the time that it took.
pub(crate) fn picture(id: u64, coarse: bool, seconds: f64, picture: &Picture) -> Vec<u8> {
    let phases: serde_json::Map<String, Value> =
        picture.phases.iter().map(|(name, seconds)| ((*name).to_string(), json!(seconds))).collect();
    let header = json!({
        "type": "picture",
        "id": id,
        "coarse": coarse,
        "output": picture.output,
        "width": picture.width,
        "height": picture.height,
        "channels": picture.channels,
        "seconds": seconds,
        "phases": phases,
        "messages": picture.messages,
        "text": picture.text,
    })
    .to_string();
    let length = u32::try_from(header.len()).unwrap_or(u32::MAX);
    let mut message = Vec::with_capacity(4 + header.len() + picture.samples.len());
    message.extend_from_slice(&length.to_le_bytes());
    message.extend_from_slice(header.as_bytes());
    message.extend_from_slice(&picture.samples);
    message
}
