//! `oslc`: compiles a shader to a `.oso` file.
//!
//! Each argument that is not an option names the file; the last one counts. Diagnostics have the form
//! `FILE:LINE: error: …` and are repeated as often as in the reference. Lints are not reported.

use super::Console;
use crate::cli::options::reading::version;
use osl::stages::{self, Checked};
use osl_files::{SaveError, Unsaved};
use osl_hir::oso;
use osl_job::request::{Reach, Reading};
use osl_job::source::input;
use osl_syntax::Reports;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::path::{Path, PathBuf};

const HELP: &str = "oslc [options] FILE
Compile a shader to a .oso file.

Options:
  --help            Print this
  -o FILE           Name of the compiled shader; else the shader's name with .oso, in the working directory
  -q                Do not print a line for each compiled file
  -IDIR             Folder to look for #include files in
  -DNAME[=VALUE]    Define a macro
  -UNAME            Undefine a macro
  -E                Print the preprocessed source
  --osl-version N   Version of the language: 1.13 (the usual one) or 1.15
  -Werror           Make errors of warnings
  -M, -MM           Print the files that were read as a rule for make, and compile silently; -MM leaves stdosl.h out
  -MD, -MMD         The same into a file: that of the source with the ending .d
  -MF FILE          Name of the file of that rule
  -MT NAME          Name of its target; else that of -o, else the source with the ending .oso
  --dependencies, --user-dependencies, --write-dependencies, --write-user-dependencies
                    Long names of -M, -MM, -MD, -MMD
  --limit NAME=N, --max-time SECONDS, --max-memory MIB
                    As oslrun has them: docs/limits.md

-MF and -MT take the next word, or the rest of their own word. An unknown option counts as the name of the file, and the last name counts.

Accepted and without effect: -O -O0 -O1 -O2 -d -v -buffer -embed-source
";

/// Warnings that the reference does not have: lints, and notes on code that it accepts silently.
const OURS: [&str; 8] = ["W0006", "W0207", "W0209", "W0210", "W0211", "W0212", "W0213", "W0214"];

/// A rule for make.
#[derive(Default)]
struct Rule {
    wanted: bool,
    /// Whether it is written to a file rather than to the standard output.
    to_file: bool,
    /// Whether it lists `stdosl.h`.
    standard: bool,
    file: Option<PathBuf>,
    target: Option<String>,
}

#[derive(Default)]
struct Job {
    file: Option<PathBuf>,
    output: Option<PathBuf>,
    quiet: bool,
    preprocess: bool,
    werror: bool,
    rule: Rule,
    read: Reading,
}

/// Runs the tool.
pub(super) fn main(args: &[String], console: &mut Console<'_>) -> u8 {
    if args.is_empty() || args.iter().any(|a| ["--help", "-help", "-h"].contains(&a.as_str())) {
        let _ = write!(console.out, "{HELP}");
        return 0;
    }
    let read = Reading::within(console.limits.limits()).plain();
    let mut job = Job { read, ..Job::default() };
    let mut rest = args.iter();
    while let Some(arg) = rest.next() {
        let word = match arg.as_str() {
            "-o" | "-MF" | "-MT" | "--osl-version" => rest.next().map(String::as_str).ok_or(arg),
            _ => Ok(""),
        };
        match word {
            Ok(word) if arg == "--osl-version" => match version(word) {
                Ok(version) => job.read.version = Some(version),
                Err(why) => {
                    let _ = writeln!(console.err, "error: {why}");
                    return 1;
                }
            },
            Ok(word) => job.argument(arg, word),
            Err(option) => {
                let _ = writeln!(console.err, "error: {option} needs a word after it");
                return 1;
            }
        }
    }
    let Some(file) = job.file.take() else {
        let _ = writeln!(console.err, "error: no shader file is named");
        return 1;
    };
    u8::from(!compile(&file, &job, console))
}

impl Job {
    /// Handles one argument, and the word after it if the option has one.
    fn argument(&mut self, arg: &str, word: &str) {
        let long = arg.strip_prefix('-').filter(|rest| rest.starts_with('-')).unwrap_or(arg);
        match long {
            "-o" => self.output = Some(word.into()),
            "-MF" if arg == long => self.rule.file = Some(word.into()),
            "-MT" if arg == long => self.rule.target = Some(word.to_string()),
            "-q" => self.quiet = true,
            "-E" => self.preprocess = true,
            "-Werror" => self.werror = true,
            "-M" | "-dependencies" => self.rule.ask(false, true),
            "-MM" | "-user-dependencies" => self.rule.ask(false, false),
            "-MD" | "-write-dependencies" => self.rule.ask(true, true),
            "-MMD" | "-write-user-dependencies" => self.rule.ask(true, false),
            "-v" | "-d" | "-O" | "-O0" | "-O1" | "-O2" | "-buffer" | "-embed-source" => {}
            _ => self.glued(arg),
        }
    }

    /// Handles options that are joined to their word; any other word is the file.
    fn glued(&mut self, arg: &str) {
        let after = |option| arg.strip_prefix(option).map(str::to_string);
        if let Some(name) = after("-MF") {
            self.rule.file = Some(name.into());
        } else if let Some(name) = after("-MT") {
            self.rule.target = Some(name);
        } else if let Some(folder) = after("-I") {
            self.read.include.push(folder.into());
        } else if let Some(define) = after("-D") {
            self.read.define.push(define);
        } else if let Some(name) = after("-U") {
            self.read.define.retain(|d| d.split('=').next() != Some(name.as_str()));
        } else {
            self.file = Some(arg.into());
        }
    }
}

impl Rule {
    fn ask(&mut self, to_file: bool, standard: bool) {
        *self = Rule { wanted: true, to_file, standard, file: self.file.take(), target: self.target.take() };
    }

    /// Whether the tool prints only the rule.
    fn is_printed(&self) -> bool {
        self.wanted && !self.to_file
    }

    /// Prints the files that were read, or writes them to a file.
    fn write(
        &self,
        source: &Path,
        job: &Job,
        sources: &SourceMap,
        console: &mut Console<'_>,
    ) -> Result<(), String> {
        let output = job.output.clone().unwrap_or_else(|| source.with_extension("oso"));
        let target = self.target.clone().unwrap_or_else(|| escaped(&output.display().to_string()));
        // A header that is built into this program is not a file, and make would stop at its name.
        let is_wanted = |path: &&Path| {
            path.is_file() && (self.standard || path.file_name().is_none_or(|name| name != "stdosl.h"))
        };
        let names = sources.files().iter().map(|f| Path::new(&f.name)).filter(is_wanted);
        let names: Vec<String> = names.map(|path| escaped(&path.display().to_string())).collect();
        let text = format!("{target}: {}\n", names.join(" \\\n  "));
        let file = match (&self.file, self.to_file) {
            (Some(path), _) => Unsaved::new(path),
            (None, true) => derived(&source.with_extension("d")),
            (None, false) => {
                let _ = write!(console.out, "{text}");
                return Ok(());
            }
        };
        file.and_then(|file| file.with(text.as_bytes())?.save()).map_err(|e| e.to_string())
    }
}

/// A file whose name is derived from that of the source.
fn derived(path: &Path) -> Result<Unsaved, SaveError> {
    Unsaved::derived(path.parent().unwrap_or(Path::new("")), path.file_name().unwrap_or_default())
}

/// A name, escaped for make.
fn escaped(name: &str) -> String {
    name.replace('$', "$$").replace(' ', "\\ ").replace('#', "\\#")
}

/// Compiles a file; returns whether that succeeded.
fn compile(file: &Path, job: &Job, console: &mut Console<'_>) -> bool {
    match compiled(file, job, console) {
        Ok(Some(path)) => {
            if !job.quiet && !job.rule.is_printed() {
                let _ = writeln!(console.out, "Compiled {} -> {}", file.display(), path.display());
            }
            true
        }
        Ok(None) => true,
        Err(why) => {
            if !why.is_empty() {
                let _ = writeln!(console.err, "error: {why}");
            }
            let _ = writeln!(console.out, "FAILED {}", file.display());
            false
        }
    }
}

fn compiled(file: &Path, job: &Job, console: &mut Console<'_>) -> Result<Option<PathBuf>, String> {
    if !file.exists() {
        return Err(format!("Input file \"{}\" not found", file.display()));
    }
    // The text of a file that is no header of the shader's own must not get out.
    let reach = if job.preprocess { Reach::Folders } else { Reach::Relative };
    let read = Reading { reach, ..job.read.clone() };
    let mut input = input::read(file, &read).map_err(|failure| failure.text)?;
    input.options.reports = Reports::AsReference;
    if job.preprocess {
        let text = osl_syntax::preprocessed(&input.name, &input.text, &input.files, &input.options);
        let _ = write!(console.out, "{text}");
        return Ok(None);
    }
    if job.output.as_ref().is_some_and(|path| osl_files::is_same(path, file)) {
        return Err("this would write the file that is read: name another one with -o".to_string());
    }
    let Checked { sources, diagnostics, program, .. } =
        stages::check(&input.name, &input.text, &input.files, &input.options);
    let bad = told(&diagnostics, &sources, job, console);
    let program = program.filter(|_| !bad).ok_or_else(String::new)?;
    let output = match &job.output {
        Some(path) => Unsaved::new(path),
        None => {
            let name = format!("{}.oso", program.shader.name);
            if osl_files::is_same(Path::new(&name), file) {
                return Err("this would write the file that is read: name another one with -o".to_string());
            }
            Unsaved::derived(Path::new(""), name)
        }
    };
    let output = output.map_err(|e| e.to_string())?;
    let path = output.path().to_path_buf();
    let text = oso::write(&program, &sources, &job.read.limits).map_err(|list| {
        told(&list, &sources, job, console);
        String::new()
    })?;
    output.with(text.as_bytes()).and_then(Unsaved::save).map_err(|e| e.to_string())?;
    if job.rule.wanted {
        job.rule.write(file, job, &sources, console)?;
    }
    Ok(Some(path))
}

/// Prints diagnostics in the tool's form; returns whether one is an error.
fn told(list: &[Diagnostic], sources: &SourceMap, job: &Job, console: &mut Console<'_>) -> bool {
    let mut bad = false;
    let mut list = list.to_vec();
    stages::hide(&mut list, sources);
    for d in list.iter().filter(|d| d.is_error() || !OURS.contains(&d.code.id)) {
        let is_error = d.is_error() || job.werror;
        bad |= is_error;
        let place = sources.place(d.span).map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
        let kind = if is_error { "error" } else { "warning" };
        let _ = writeln!(console.err, "{place}{kind}: {}", d.message);
        for note in d.notes.iter().chain(&d.help) {
            let _ = writeln!(console.err, "  {note}");
        }
    }
    bad
}
