//! The open texts and the files beside them: what osl-editor asks of the world.

use super::settings::Settings;
use crate::cli::source::fix;
use gen_lsp_types::Uri;
use osl::stages::{self, Checked};
use osl::{Analysis, Levels};
use osl_editor::World;
use osl_job::source::input::{self, Files};
use osl_syntax::source::{About, SourceProvider};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// The texts that an editor has open, by the names of their files, with their addresses.
pub(super) type Buffers = BTreeMap<String, (Uri, Arc<str>)>;

/// The open texts with the settings.
pub(super) struct Desk<'a> {
    pub(super) buffers: &'a Buffers,
    pub(super) settings: &'a Settings,
}

/// Finds included files, those of open texts first.
struct Includes<'a> {
    files: Files,
    buffers: &'a Buffers,
}

impl SourceProvider for Includes<'_> {
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let open = |name: &str| self.buffers.get(name).map(|(_, text)| text.clone());
        match self.files.include(name, quoted, from) {
            Ok((path, text)) => {
                let path = tidy(&path);
                let text = open(&path).unwrap_or(text);
                Ok((path, text))
            }
            // A new text that is not saved yet.
            Err(why) => {
                let beside = Path::new(from).parent().filter(|_| quoted).map(|folder| folder.join(name));
                let beside = beside.map(|path| tidy(&path.display().to_string()));
                beside.and_then(|path| Some((path.clone(), open(&path)?))).ok_or(why)
            }
        }
    }

    fn names(&self, from: &str) -> Vec<String> {
        self.files.names(from)
    }

    fn about(&self, name: &str) -> About {
        self.files.about(name)
    }

    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        self.files.standard()
    }
}

impl Desk<'_> {
    fn includes(&self, name: &str) -> Includes<'_> {
        let main = Path::new(name).parent().map(Path::to_path_buf).unwrap_or_default();
        Includes { files: input::includes(&main, &self.settings.reading), buffers: self.buffers }
    }

    /// Reads and checks a text.
    pub(super) fn checked(&self, name: &str, text: &str) -> Checked {
        stages::check(name, text, &self.includes(name), &input::options(&self.settings.reading))
    }
}

impl World for Desk<'_> {
    fn check(&self, name: &str, text: &str) -> Analysis {
        Analysis::of_checked(self.checked(name, text), &self.settings.reading.limits)
    }

    fn expanded(&self, name: &str, text: &str) -> String {
        osl_syntax::preprocessed(name, text, &self.includes(name), &input::options(&self.settings.reading))
    }

    fn fixed(&self, name: &str, text: &str) -> String {
        let limits = &self.settings.reading.limits;
        let judge = |checked: &Checked| {
            let judged = stages::judge(checked, self.levels(), |_| true, limits);
            judged.into_iter().map(|(found, _)| found).collect()
        };
        fix::fix(text, |text| self.checked(name, text), judge).text
    }

    fn uri(&self, name: &str) -> Option<Uri> {
        let open = self.buffers.get(name).map(|(uri, _)| uri.clone());
        open.or_else(|| Path::new(name).is_absolute().then(|| uri_of(name)))
    }

    fn headers(&self, name: &str) -> Vec<String> {
        let mut names = self.includes(name).names(name);
        names.extend(osl_syntax::header_names().map(str::to_string));
        names.sort();
        names.dedup();
        names
    }

    fn included(&self, name: &str, include: &str, quoted: bool) -> Option<String> {
        self.includes(name).include(include, quoted, name).ok().map(|(path, _)| path)
    }

    fn levels(&self) -> &Levels {
        &self.settings.levels
    }

    fn lessons(&self) -> Option<&str> {
        self.settings.asked.lessons.as_deref()
    }
}

/// A path without `.` and `..`.
fn tidy(path: &str) -> String {
    let mut out = PathBuf::new();
    for part in Path::new(path).components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if out.file_name().is_some() => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out.display().to_string()
}

/// The name of the file with an address; the address itself if it is not that of a file.
pub(super) fn name_of(uri: &Uri) -> String {
    let Some(path) = uri.as_ref().strip_prefix("file://") else { return uri.as_ref().to_string() };
    let mut bytes = Vec::new();
    let mut at = 0;
    while let Some(byte) = path.as_bytes().get(at) {
        let digits = path.get(at + 1..at + 3).filter(|_| *byte == b'%');
        let value = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(value.unwrap_or(*byte));
        at += if value.is_some() { 3 } else { 1 };
    }
    let path = String::from_utf8_lossy(&bytes).into_owned();
    // `/c:/folder` is the path of a drive.
    let drive = path.strip_prefix('/').filter(|path| path.as_bytes().get(1) == Some(&b':'));
    tidy(drive.unwrap_or(&path))
}

/// The address of a file.
fn uri_of(path: &str) -> Uri {
    let mut uri = String::from("file://");
    let path = tidy(path).replace('\\', "/");
    if !path.starts_with('/') {
        uri.push('/');
    }
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_those_of_files() {
        assert_eq!(name_of(&"file:///a%20b/%C3%BC%/x.osl".into()), "/a b/ü%/x.osl");
        assert_eq!(uri_of("/a b/./c/../ü/x.osl").as_ref(), "file:///a%20b/%C3%BC/x.osl");
        assert_eq!(name_of(&"untitled:Untitled-1".into()), "untitled:Untitled-1");
    }
}
