//! `oslinfo`: prints the parameters of shaders, compiled or not.

use super::options::{self, Item, ToolOption};
use super::{Console, number};
use crate::cli::options::limits::LimitArgs;
use crate::cli::source::info::{self, Metadatum, Parameter, Shader};
use osl::stages;
use osl_job::request::{Reach, Reading};
use osl_job::source::input;
use serde_json::Value;
use std::path::PathBuf;

const fn o(name: &'static str, words: usize, help: &'static str) -> ToolOption {
    ToolOption { name, words, help }
}

const KNOWN: &[ToolOption] = &[
    o("help", 0, "Print this"),
    o("h", 0, "Print this"),
    o("v", 0, "Show defaults and metadata, one a line"),
    o("p", 1, "Folders to look for shaders in, separated by colons"),
    o("path", 1, "The same"),
    o("param", 1, "Show this parameter only"),
    o("runstats", 0, ""),
];

const USAGE: &str = "oslinfo [options] shader…\nList the parameters of shaders.";

/// Runs the tool.
pub(super) fn main(args: &[String], console: &mut Console<'_>) -> u8 {
    let items = match options::parse("oslinfo", args, KNOWN) {
        Ok(items) => items,
        Err(why) => {
            let _ = writeln!(console.err, "{why}");
            return 1;
        }
    };
    let (mut verbose, mut only, mut folders, mut failed) = (false, None, vec![PathBuf::new()], false);
    let mut files = Vec::new();
    for item in items {
        match item {
            Item::Word(file) => files.push(file),
            Item::Option { name: "help" | "h", .. } => {
                let _ = write!(console.out, "{}", options::help(USAGE, KNOWN));
                return 0;
            }
            Item::Option { name: "v", .. } => verbose = true,
            Item::Option { name: "param", words, .. } => only = words.into_iter().next(),
            Item::Option { name: "p" | "path", words, .. } => {
                folders.extend(words.iter().flat_map(|w| w.split(':')).map(PathBuf::from));
            }
            Item::Option { .. } => {}
        }
    }
    for file in &files {
        match read(file, &folders, console.limits) {
            Ok(shader) => show(&shader, verbose, only.as_deref(), console),
            Err(why) => {
                failed = true;
                let _ = writeln!(console.out, "ERROR opening shader \"{file}\" ({why})");
            }
        }
    }
    u8::from(failed)
}

fn read(name: &str, folders: &[PathBuf], limits: &LimitArgs) -> Result<Shader, String> {
    let files = [name.to_string(), format!("{name}.oso"), format!("{name}.osl")];
    let places = folders.iter().flat_map(|folder| files.iter().map(move |file| folder.join(file)));
    let path = places.into_iter().find(|p| p.is_file()).ok_or("there is no such file")?;
    let args = Reading { reach: Reach::Relative, ..Reading::within(limits.limits()).plain() };
    let input = input::read(&path, &args).map_err(|failure| failure.text)?;
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let error = checked.diagnostics.iter().find(|d| d.is_error()).map(|d| d.message.clone());
    checked.program.as_ref().map(info::describe).ok_or_else(|| error.unwrap_or_default())
}

fn show(shader: &Shader, verbose: bool, only: Option<&str>, console: &mut Console<'_>) {
    let name = if verbose { format!("\"{}\"", shader.name) } else { shader.name.clone() };
    if only.is_none() {
        let _ = writeln!(console.out, "{} {name}", shader.kind);
        if verbose {
            metadata(&shader.metadata, console);
        }
    }
    for p in shader.parameters.iter().filter(|p| only.is_none_or(|only| only == p.name)) {
        parameter(p, verbose, console);
    }
}

fn parameter(p: &Parameter, verbose: bool, console: &mut Console<'_>) {
    let output = if p.output { "output " } else { "" };
    let base = p.ty.split('[').next().unwrap_or("");
    let known = ["int", "float", "color", "point", "vector", "normal", "matrix", "string", "closure color"];
    let is_struct = !known.contains(&base);
    let ty = if is_struct { "struct" } else { p.ty.as_str() };
    let _ = if verbose {
        writeln!(console.out, "    \"{}\" \"{output}{ty}\"", p.name)
    } else {
        write!(console.out, "{output}{ty} {} ", p.name)
    };
    let text = match &p.default {
        Value::Object(fields) if is_struct => {
            let fields: Vec<&str> = fields.keys().map(String::as_str).collect();
            let _ = writeln!(
                console.out,
                "{}fields: {{{}}}",
                if verbose { "\t\t" } else { "" },
                fields.join(", ")
            );
            None
        }
        Value::Null if verbose => Some("\t\tUnknown default value".to_string()),
        Value::Null => Some("nodefault".to_string()),
        value => {
            let mut numbers = Vec::new();
            flat(value, &mut numbers);
            let list =
                if value.is_array() { format!("[ {} ]", numbers.join(" ")) } else { numbers.join(" ") };
            Some(format!("{}{list}", if verbose { "\t\tDefault value: " } else { "" }))
        }
    };
    if let Some(text) = text {
        let _ = writeln!(console.out, "{text}");
    }
    if verbose {
        metadata(&p.metadata, console);
    }
}

fn metadata(list: &[Metadatum], console: &mut Console<'_>) {
    for m in list {
        let mut words = Vec::new();
        flat(&m.value, &mut words);
        let _ = writeln!(console.out, "\t\tmetadata: {} {} = {}", m.ty, m.name, words.join(" "));
    }
}

/// Numbers and quoted strings in sequence.
fn flat(value: &Value, out: &mut Vec<String>) {
    match value {
        Value::Array(all) => all.iter().for_each(|v| flat(v, out)),
        Value::String(text) => out.push(format!("\"{}\"", text.escape_default())),
        Value::Number(n) => out.push(match n.as_i64() {
            Some(n) => n.to_string(),
            None => number(n.as_f64().unwrap_or(0.0) as f32),
        }),
        other => out.push(other.to_string()),
    }
}
