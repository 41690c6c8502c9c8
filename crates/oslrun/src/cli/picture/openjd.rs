//! `--openjd FILE`: writes a job template in place of a run, for the engines that run Open Job Description.
//!
//! The template has one step, whose tasks are chunks of the frames or squares (extension `TASK_CHUNKING` of
//! <https://github.com/OpenJobDescription/openjd-specifications>, revision 2023-09). Each task runs the same
//! command in the folder in which the template was made. JSON is YAML too, so one form serves both names.

use super::numbers::Numbers;
use super::words::Left;
use crate::cli::options::heading;
use crate::cli::print::Console;
use clap::Args;
use osl_job::Failure;
use serde_json::json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A job template.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct JobArgs {
    /// Compute nothing: write a job template (Open Job Description, .yaml or .json) whose tasks are the
    /// frames or squares of this command. They run in this folder.
    #[arg(long, value_name = "FILE", help_heading = heading::FILES)]
    openjd: Option<PathBuf>,
    /// Frames or squares in one task of the template.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "openjd", value_parser = clap::value_parser!(u32).range(1..=100_000), help_heading = heading::FILES)]
    chunk: u32,
}

impl JobArgs {
    /// The file of the template.
    pub(super) fn file(&self) -> Option<&Path> {
        self.openjd.as_deref()
    }
}

/// The options of the command that are not part of a task's command.
const OWN: Left = Left { valued: &["--openjd", "--chunk", "--frames", "--udim"], alone: &["--dry-run"] };

/// What differs between the tasks.
pub(super) struct Task<'a> {
    /// The option that has the numbers of a task.
    pub(super) option: &'static str,
    /// The name of the parameter in the template.
    pub(super) name: &'static str,
    /// The numbers of all tasks.
    pub(super) numbers: &'a Numbers,
}

/// Writes the template for a command line.
///
/// # Errors
/// A word of the command line has a meaning in templates, or the file cannot be written.
pub(super) fn write(
    file: &Path,
    task: &Task<'_>,
    job: &JobArgs,
    line: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let folder = std::env::current_dir().map_err(|error| Failure::new(format!("the folder: {error}")))?;
    let template = template(task, job.chunk, line, &folder)?;
    let text = serde_json::to_string_pretty(&template).map_err(|error| Failure::new(error.to_string()))?;
    osl_files::replace(file, format!("{text}\n").as_bytes()).map_err(Failure::new)?;
    console.wrote(file);
    Ok(())
}

fn template(
    task: &Task<'_>,
    chunk: u32,
    line: &[OsString],
    folder: &Path,
) -> Result<serde_json::Value, Failure> {
    let words = line.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    let mut words = OWN.removed(words);
    let folder = folder.display().to_string();
    if let Some(word) = words.iter().chain([&folder]).find(|word| word.contains("{{")) {
        return Err(Failure::new(format!("`{word}` cannot be in a template: `{{{{` begins its own names")));
    }
    let name = words.iter().find(|word| word.ends_with(".osl") || word.ends_with(".oso"));
    let name = name.and_then(|word| Path::new(word).file_name()?.to_str()).unwrap_or("oslrun").to_string();
    words.extend([task.option.to_string(), format!("{{{{Task.Param.{}}}}}", task.name)]);
    // A task begins in a folder of the engine, and its words are handed on as they are.
    let script = "cd \"$1\" && shift && exec oslrun \"$@\"";
    let args = ["-c".to_string(), script.to_string(), "oslrun".to_string(), folder];
    Ok(json!({
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": name,
        "steps": [{
            "name": task.name,
            "parameterSpace": { "taskParameterDefinitions": [{
                "name": task.name,
                "type": "CHUNK[INT]",
                "range": task.numbers.to_string(),
                "chunks": { "defaultTaskCount": chunk, "rangeConstraint": "NONCONTIGUOUS" },
            }] },
            "script": { "actions": { "onRun": {
                "command": "sh",
                "args": args.into_iter().chain(words).collect::<Vec<_>>(),
            } } },
        }],
    }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use crate::cli::picture::numbers::frames;

    #[test]
    fn a_task_has_the_words_of_the_command_and_its_own_numbers() {
        let line = |text: &str| text.split(' ').map(OsString::from).collect::<Vec<_>>();
        let numbers = frames("1-3,7").unwrap();
        let task = Task { option: "--frames", name: "Frame", numbers: &numbers };
        let words = line("oslrun a/b.osl --frames=1-3,7 -o x.##.png --openjd j.yaml --chunk 2 -p a=1");
        let found = template(&task, 2, &words, Path::new("/x y")).unwrap();
        let args = &found["steps"][0]["script"]["actions"]["onRun"]["args"];
        let args: Vec<&str> = args.as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect();
        let expected =
            ["oslrun", "/x y", "a/b.osl", "-o", "x.##.png", "-p", "a=1", "--frames", "{{Task.Param.Frame}}"];
        assert_eq!(args[2..], expected);
        let space = &found["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0];
        assert_eq!((&space["range"], &found["name"]), (&"1-3,7".into(), &"b.osl".into()));
        assert!(template(&task, 1, &line("oslrun a.osl -p {{x}}=1"), Path::new("/")).is_err());
    }
}
