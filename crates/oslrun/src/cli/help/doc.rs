//! `oslrun doc [NAME]`: the reference of the language: functions, closures, globals, types, statements,
//! nodes.

use super::reference;
use crate::cli::source::info::{self, Metadatum, Shader};
use clap::Args;
use osl::reference::{Elsewhere, Function, Topic, closest, elsewhere, find, functions, topic, topics};
use osl::stages;
use osl_job::Failure;
use osl_job::source::nodes;
use osl_syntax::{NoFiles, Options};
use serde_json::{Value, json};
use std::io::Write;

/// What to describe.
#[derive(Debug, Args)]
pub(in crate::cli) struct DocArgs {
    /// A function, a closure, a global, a type, a statement or a built-in node: smoothstep, diffuse, P,
    /// point, for, remap (default: list all).
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Print the whole reference of the functions as Markdown: docs/builtins.md.
    #[arg(long, conflicts_with_all = ["name", "json"])]
    markdown: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Prints the list, the entries of a name, or the whole reference as a page.
pub(in crate::cli) fn doc(args: &DocArgs, out: &mut dyn Write) -> Result<(), Failure> {
    let text = match &args.name {
        _ if args.markdown => reference::markdown(),
        None if args.json => {
            let nodes: Vec<Shader> = nodes::names().filter_map(node).collect();
            entries(&functions(), &topics(), &nodes)?
        }
        None => reference::list(),
        Some(name) => {
            let name = name.trim();
            match (about(name, args.json)?, elsewhere(name)) {
                (Some(text), _) => text,
                (None, Some(word)) => of_elsewhere(name, word, args.json)?,
                (None, None) => return Err(Failure::new(unknown(name))),
            }
        }
    };
    let _ = write!(out, "{text}");
    Ok(())
}

/// The entries of a name of OSL.
fn about(name: &str, as_json: bool) -> Result<Option<String>, Failure> {
    let (functions, topic, node) = (find(name), topic(name), node(name));
    if functions.is_empty() && topic.is_none() && node.is_none() {
        return Ok(None);
    }
    if as_json {
        return entries(&functions, topic.as_slice(), node.as_slice()).map(Some);
    }
    let functions = functions.iter().map(reference::entry);
    let topic = topic.iter().map(reference::topic);
    let node = node.iter().map(about_node);
    Ok(Some(topic.chain(functions).chain(node).collect::<Vec<_>>().join("\n")))
}

/// What OSL has instead of a word of another language, with the entry of that.
fn of_elsewhere(name: &str, word: Elsewhere, as_json: bool) -> Result<String, Failure> {
    let entry = word.instead.map(|name| about(name, as_json)).transpose()?.flatten();
    if as_json {
        return match entry {
            Some(entry) => Ok(entry),
            None => entries(&[], &[], &[]),
        };
    }
    let text = format!("`{name}` is not a name in OSL: {}.\n", word.advice);
    Ok(entry.map_or(text.clone(), |entry| format!("{text}\n{entry}")))
}

/// The description of a built-in node.
fn node(name: &str) -> Option<Shader> {
    let text = nodes::names().find(|node| *node == name).and_then(nodes::find)?;
    let checked = stages::check(&format!("{name}.osl"), text, &NoFiles, &Options::default());
    checked.program.as_ref().map(info::describe)
}

/// The text about a node: what it does, and its parameters with their help.
fn about_node(node: &Shader) -> String {
    let help = |list: &[Metadatum]| {
        let found = list.iter().find(|datum| datum.name == "help").and_then(|datum| datum.value.as_str());
        found.map(str::to_string).unwrap_or_default()
    };
    let mut text = format!("{} (built-in node)\n\n{}.\n\n", node.name, help(&node.metadata));
    for parameter in &node.parameters {
        let default =
            if parameter.default.is_null() { "computed".to_string() } else { parameter.default.to_string() };
        let (output, ty, name) =
            (if parameter.output { "output " } else { "" }, &parameter.ty, &parameter.name);
        let help = help(&parameter.metadata);
        text += &format!("    {output}{ty} {name} = {default}\n");
        if !help.is_empty() {
            text += &format!("        {help}\n");
        }
    }
    text + &format!("\nA group uses it by its name: `--layer a={}`.\n", node.name)
}

/// Entries as JSON.
fn entries(functions: &[Function], topics: &[Topic], nodes: &[Shader]) -> Result<String, Failure> {
    let functions: Vec<Value> = functions
        .iter()
        .map(|f| {
            let signatures: Vec<&str> = f.signatures.iter().map(|s| s.text.as_str()).collect();
            json!({
                "name": f.name, "family": f.family, "source": f.source, "signatures": signatures, "about": f.about,
                "derivatives": f.derivatives, "extremes": f.extremes, "example": f.example,
            })
        })
        .collect();
    let topics: Vec<Value> = topics
        .iter()
        .map(|t| json!({ "name": t.name, "kind": t.kind, "form": t.form, "about": t.about, "example": t.example }))
        .collect();
    let all = json!({ "functions": functions, "words": topics, "nodes": nodes });
    Ok(serde_json::to_string_pretty(&all).map_err(Failure::new)? + "\n")
}

fn unknown(name: &str) -> String {
    match closest(name).or_else(|| osl_syntax::spelling::closest(name, nodes::names())) {
        Some(close) => format!("nothing is called `{name}`; did you mean `{close}`?"),
        None => format!("nothing is called `{name}`; `oslrun doc` lists all names"),
    }
}
