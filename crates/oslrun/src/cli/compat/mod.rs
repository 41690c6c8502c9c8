//! The command lines of the reference's tools: `oslrun testshade …`, or the same binary under the tool's
//! name.
//!
//! They accept the options of those tools, use their defaults, write the same files and print the same lines,
//! so that existing scripts keep working. Sources of the options: the OSL documentation and the tools' own
//! help.

mod folders;
mod group;
mod options;
mod oslc;
mod oslinfo;
pub(in crate::cli) mod settings;
mod testrender;
mod testshade;
mod told;

use super::options::limits::LimitArgs;
use osl_ir::ir::Const;
use osl_ir::text::{self, Flavour, Value};
use osl_job::{Event, Sink};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

/// The output streams and the limits of a tool.
struct Console<'a> {
    out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    limits: &'a LimitArgs,
}

impl Sink for Console<'_> {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Printed(text) = event {
            let _ = self.out.write_all(text.as_bytes());
        }
    }
}

impl Console<'_> {
    /// Reports an error.
    fn error(&mut self, text: &str) {
        let _ = writeln!(self.err, "ERROR: {text}");
    }

    /// Reports a warning.
    fn warning(&mut self, text: &str) {
        let _ = writeln!(self.err, "WARNING: {text}");
    }

    /// Reports a diagnostic from reading a shader.
    fn diagnostic(&mut self, d: &Diagnostic, sources: &SourceMap) {
        let place = sources.place(d.span).map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
        let text = format!("{place}{}", d.message);
        if d.is_error() { self.error(&text) } else { self.warning(&text) }
    }
}

/// The tools, by name.
const TOOLS: [&str; 4] = ["oslc", "oslinfo", "testrender", "testshade"];

/// Runs the tool that the binary's name or the first argument names, and returns its exit code.
pub(super) fn run(args: &[OsString], out: &mut dyn Write, err: &mut dyn Write) -> Option<u8> {
    let name = |arg: &OsString| Path::new(arg).file_stem().map(|s| s.to_string_lossy().into_owned());
    let tool = |arg: Option<&OsString>| {
        let name = name(arg?)?;
        TOOLS.into_iter().find(|tool| *tool == name)
    };
    let (tool, rest) = match (tool(args.first()), tool(args.get(1))) {
        (Some(found), _) => (found, args.get(1..)),
        (None, Some(found)) if args.get(1).is_some_and(|a| a == found) => (found, args.get(2..)),
        _ => return None,
    };
    let rest = rest.unwrap_or(&[]).iter().map(|a| a.to_string_lossy().into_owned()).collect();
    let (limits, rest) = match LimitArgs::taken_from(rest) {
        Ok(found) => found,
        Err(why) => {
            let _ = writeln!(err, "{tool}: {why}");
            return Some(1);
        }
    };
    let mut console = Console { out, err, limits: &limits };
    Some(match tool {
        "oslc" => oslc::main(&rest, &mut console),
        "oslinfo" => oslinfo::main(&rest, &mut console),
        "testrender" => testrender::main(&rest, &mut console),
        _ => testshade::main(&rest, &mut console),
    })
}

/// A number with six digits, in the form that the tools print.
fn number(x: f32) -> String {
    text::format("%g", &[Value::Consts(vec![Const::Float(x)])], Flavour::Print, 64)
}
