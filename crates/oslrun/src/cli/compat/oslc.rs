//! `oslc`: compiles shaders to `.oso` files.

use super::Console;
use crate::cli::args::ReadArgs;
use crate::cli::input;
use crate::pipeline::{self, Checked};
use osl_ir::oso;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::path::{Path, PathBuf};

const HELP: &str = "oslc [options] file…
Compile shaders to .oso files.

Options:
  --help           Print this
  -o FILE          Name of the compiled shader
  -v               Say more
  -q               Say nothing of what is compiled
  -IDIR            Folder to look for #include files in
  -DNAME[=VALUE]   Define a macro
  -UNAME           Forget a macro
  -E               Print the preprocessed source
  -Werror          Make errors of warnings
  -MD, -MMD        Write the files that were read beside the compiled shader, as a rule for make
  -M, -MM          The same, and compile nothing
  -MF FILE         Name of the file of that rule
  -MT NAME         Name of its target

Accepted and without effect: -O -O0 -O1 -O2 -d -buffer -embed-source
";

#[derive(Default)]
struct Job {
    output: Option<PathBuf>,
    quiet: bool,
    preprocess: bool,
    werror: bool,
    rule: bool,
    rule_only: bool,
    rule_file: Option<PathBuf>,
    rule_target: Option<String>,
    read: ReadArgs,
}

/// Runs the tool.
pub(super) fn main(args: &[String], console: &mut Console<'_>) -> u8 {
    let (mut job, mut files) = (Job::default(), Vec::new());
    let mut rest = args.iter();
    if args.is_empty() {
        let _ = write!(console.out, "{HELP}");
    }
    while let Some(arg) = rest.next() {
        let Some(option) = arg.strip_prefix("--").or_else(|| arg.strip_prefix('-')) else {
            files.push(PathBuf::from(arg));
            continue;
        };
        let mut word = || rest.next().cloned().ok_or_else(|| format!("oslc: {arg} needs a word behind it"));
        let result = match option {
            "help" | "h" => {
                let _ = write!(console.out, "{HELP}");
                return 0;
            }
            "o" => word().map(|w| job.output = Some(w.into())),
            "MF" => word().map(|w| job.rule_file = Some(w.into())),
            "MT" => word().map(|w| job.rule_target = Some(w)),
            _ => flag(&mut job, arg, option),
        };
        if let Err(why) = result {
            let _ = writeln!(console.err, "{why}");
            return 1;
        }
    }
    // As the tool does it, the first file that fails ends the run.
    u8::from(!files.iter().all(|file| compile(file, &job, console)))
}

fn flag(job: &mut Job, arg: &str, option: &str) -> Result<(), String> {
    match option {
        "q" => job.quiet = true,
        "E" => job.preprocess = true,
        "Werror" => job.werror = true,
        "MD" | "MMD" => job.rule = true,
        "M" | "MM" => (job.rule, job.rule_only) = (true, true),
        "v" | "d" | "O" | "O0" | "O1" | "O2" | "buffer" | "embed-source" => {}
        _ => match (option.get(..1), option.get(1..)) {
            (Some("I"), Some(folder)) => job.read.include.push(folder.into()),
            (Some("D"), Some(define)) => job.read.define.push(define.to_string()),
            (Some("U"), Some(name)) => job.read.define.retain(|d| d.split('=').next() != Some(name)),
            _ => return Err(format!("oslc: unknown option \"{arg}\" (oslc --help lists what there is)")),
        },
    }
    Ok(())
}

/// Compiles a file; whether that went well.
fn compile(file: &Path, job: &Job, console: &mut Console<'_>) -> bool {
    match compiled(file, job, console) {
        Ok(Some(path)) => {
            if !job.quiet {
                let _ = writeln!(console.out, "Compiled {} -> {}", file.display(), path.display());
            }
            true
        }
        Ok(None) => true,
        Err(why) => {
            if !why.is_empty() {
                let _ = writeln!(console.err, "{}: error: {why}", file.display());
            }
            let _ = writeln!(console.out, "FAILED {}", file.display());
            false
        }
    }
}

fn compiled(file: &Path, job: &Job, console: &mut Console<'_>) -> Result<Option<PathBuf>, String> {
    let input = input::read(file, &job.read).map_err(|failure| failure.0)?;
    if job.preprocess {
        let _ = write!(
            console.out,
            "{}",
            osl_syntax::preprocessed(&input.name, &input.text, &input.files, &input.options)
        );
        return Ok(None);
    }
    let Checked { sources, diagnostics, program, .. } =
        pipeline::check(&input.name, &input.text, &input.files, &input.options);
    let bad = told(&diagnostics, &sources, job, console);
    let program = program.filter(|_| !bad).ok_or_else(String::new)?;
    // Compiled beside where the tool runs, under the name of the file.
    let output = job.output.clone();
    let output =
        output.unwrap_or_else(|| PathBuf::from(file.file_name().unwrap_or_default()).with_extension("oso"));
    if job.rule {
        rule(&output, &sources, job)?;
    }
    if job.rule_only {
        return Ok(None);
    }
    let text = oso::write(&program, &sources).map_err(|list| {
        told(&list, &sources, job, console);
        String::new()
    })?;
    osl_image::replace_file(&output, text.as_bytes()).map_err(|e| e.to_string())?;
    Ok(Some(output))
}

/// Prints diagnostics as the tool does; whether one is an error.
fn told(list: &[Diagnostic], sources: &SourceMap, job: &Job, console: &mut Console<'_>) -> bool {
    let mut bad = false;
    for d in list {
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

/// Writes the files that were read as a rule for make.
fn rule(output: &Path, sources: &SourceMap, job: &Job) -> Result<(), String> {
    let target = job.rule_target.clone().unwrap_or_else(|| output.display().to_string());
    // The standard header is built in.
    let names = sources.files().iter().map(|f| f.name.as_str());
    let files: Vec<&str> = names.filter(|f| Path::new(f).is_file()).collect();
    let text = format!("{target}: {}\n", files.join(" \\\n  "));
    let path = job.rule_file.clone().unwrap_or_else(|| output.with_extension("d"));
    osl_image::replace_file(&path, text.as_bytes()).map_err(|e| e.to_string())
}
