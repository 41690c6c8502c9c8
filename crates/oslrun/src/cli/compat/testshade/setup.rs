//! Builds the group that a command line of `testshade` describes, step by step, with the tool's messages.

use super::super::Console;
use super::super::folders::Folders;
use super::super::group::GroupBuilder;
use super::job::{Job, Step};
use crate::cli::options::limits::LimitArgs;
use crate::cli::source::group_text;
use osl_hir::hir::Program;
use osl_image::TextureCache;
use osl_job::request::Reading;
use osl_job::source::input;
use osl_limits::Limits;
use osl_lower::group::{Connection, Group};
use osl_syntax::Options;
use osl_syntax::source::SourceMap;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Builds the group.
///
/// # Errors
/// The message to print before the tool ends; empty if it was printed already.
pub(super) fn group<'a>(
    job: &Job,
    files: &'a Folders,
    options: &'a Options,
    console: &mut Console<'_>,
) -> Result<(Group, SourceMap), String> {
    let mut groups = 1;
    let name = |count: usize| job.group_name.clone().unwrap_or_else(|| format!("unnamed_group_{count}"));
    let mut builder = GroupBuilder::new(&name(groups), files, options, &job.settings);
    let mut expressions = 0;
    for step in &job.steps {
        match step {
            Step::Value(statement) => builder.value(statement.clone()),
            Step::Shader { shader, layer } => {
                builder.shader(shader, layer.as_deref(), console);
            }
            Step::Expr { text, layer } => {
                let shader = format!("expr_{expressions}");
                expressions += 1;
                if job.verbose {
                    let text = expression(&shader, text);
                    let _ = write!(console.out, "Expression-based shader text is:\n---\n{text}---\n");
                }
                if !builder.written(&shader, layer.as_deref(), console) {
                    return Err(String::new());
                }
            }
            Step::Group(given) => {
                groups += 1;
                builder.restart(&name(groups));
                let path = Path::new(given);
                let text = if path.is_file() {
                    input::read_text(path, &Reading::within(console.limits.limits()))?
                } else {
                    given.clone()
                };
                if job.verbose {
                    let _ = write!(console.out, "Processing group specification:\n---\n{text}\n---\n");
                }
                if !builder.text(&text, console) {
                    return Err("ERROR: Invalid shader group. Exiting testshade.".to_string());
                }
            }
        }
    }
    let waiting = builder.waiting();
    if !waiting.is_empty() {
        return Err(format!(
            "ERROR: Pending parameters without a shader: {}\nDid you mistakenly put --param after the shader declaration?",
            waiting.join(" ")
        ));
    }
    for [from, output, to, input] in &job.connections {
        let _ = writeln!(console.out, "Connect {from}.{output} to {to}.{input}");
        if !builder.connect((from, output), (to, input), console) {
            return Err(String::new());
        }
    }
    let (mut group, sources) = builder.finish();
    group.rules = job.settings.rules();
    if job.verbose || job.query {
        describe(&group, job.query, console);
    }
    if let Some(file) = &job.archive {
        osl_files::replace(Path::new(file), serialized(&group).as_bytes())
            .map_err(|why| format!("ERROR: cannot write {file}: {}", why.error.reason()))?;
    }
    Ok((group, sources))
}

/// Prints the layers and outputs that are entries, and returns the layers that run; nothing without entries.
///
/// # Errors
/// The message to print before the tool ends; empty if it was printed already.
pub(super) fn entries(
    group: &Group,
    job: &Job,
    console: &mut Console<'_>,
) -> Result<Option<Vec<usize>>, String> {
    let named: Vec<Option<usize>> = job.entries.iter().map(|name| group.find(name)).collect();
    if !named.is_empty() {
        let shown = |(name, index): (&String, &Option<usize>)| {
            format!(" {name}({})", index.map_or_else(|| "-1".to_string(), |i| i.to_string()))
        };
        let list: String = job.entries.iter().zip(&named).map(shown).collect();
        let _ = writeln!(console.out, "Entry layers:{list}");
    }
    let mut layers: Vec<usize> = named.into_iter().flatten().collect();
    if !job.entry_outputs.is_empty() {
        let _ = write!(console.out, "Entry outputs:");
        let mut owners = Vec::new();
        for output in &job.entry_outputs {
            let Some(owner) = entry_output(group, job, &layers, output) else {
                let _ = writeln!(console.out, "\nEntry output {output} not found. Abording.");
                return Err(String::new());
            };
            let _ = write!(console.out, " {output}");
            owners.push(owner);
        }
        let _ = writeln!(console.out);
        // Only entries can run by themselves.
        owners.retain(|owner| layers.contains(owner));
        layers = owners;
    }
    let mut seen = HashSet::new();
    layers.retain(|layer| seen.insert(*layer));
    Ok((!job.entries.is_empty()).then_some(layers))
}

/// The layer of an entry output. Measured: the reference does not find outputs of a running layer that are
/// not connected.
fn entry_output(group: &Group, job: &Job, entries: &[usize], output: &str) -> Option<usize> {
    let last = group.layers().len().checked_sub(1)?;
    let (index, name) = match output.split_once('.') {
        Some((layer, name)) => (group.find(layer)?, name),
        None => (last, output),
    };
    let program = &group.layers().get(index)?.program;
    let param =
        program.shader.params.iter().position(|p| {
            p.output && program.vars.get(p.var.0 as usize).is_some_and(|var| &*var.name == name)
        })?;
    let path = format!("{}.{name}", group.layers().get(index)?.name);
    let asked = |wanted: &str| wanted == name || wanted == path;
    let from = |c: &&Connection| c.from.layer == index;
    let runs = if job.entries.is_empty() { index == last } else { entries.contains(&index) };
    let taken = job.outputs.iter().any(|(wanted, _)| asked(wanted))
        || group.connections().iter().filter(from).any(|c| c.from.param == param);
    let idle = !runs && !group.connections().iter().any(|c| from(&c));
    (taken || idle).then_some(index)
}

/// Prints the text of a group and its layers, with their parameters if those are asked for.
fn describe(group: &Group, parameters: bool, console: &mut Console<'_>) {
    let text = serialized(group);
    let mut lines =
        format!("Shader group:\n---\n{text}\n---\n\nShader group \"{}\" layers are:\n", group.name);
    for layer in group.layers() {
        lines += &format!("    {}\n", layer.name);
        if parameters {
            list(&layer.program, &mut lines);
        }
    }
    let _ = writeln!(console.out, "{lines}");
}

/// Lists the parameters of a shader.
fn list(program: &Program, lines: &mut String) {
    for param in &program.shader.params {
        let Some(var) = program.vars.get(param.var.0 as usize) else { continue };
        let output = if param.output { "output " } else { "" };
        *lines += &format!("\t{output}{} {}\n", program.structs.show(var.ty), var.name);
    }
}

/// The text of the shader for an `--expr`.
fn expression(name: &str, body: &str) -> String {
    format!(
        "shader {name} (\n    float s = u [[ int interpolated=1 ]],\n    float t = v [[ int interpolated=1 ]],\n    output color result = 0,\n    output float alpha = 1,\n  )\n{{\n    {body}\n    ;\n}}\n"
    )
}

/// The texture cache. The user's own script names the files, so any path is allowed.
pub(super) fn textures(job: &Job, limits: &Limits) -> TextureCache {
    let mut folders = vec![PathBuf::new()];
    folders.extend(job.texture_path.iter().cloned());
    TextureCache::within(folders, limits).allow_files(true)
}

/// The folders of shaders, with the shaders generated for `--expr`.
pub(super) fn folders(job: &Job, limits: &LimitArgs) -> Folders {
    let texts = job.steps.iter().filter_map(|step| match step {
        Step::Expr { text, .. } => Some(text),
        _ => None,
    });
    // Measured: the reference numbers the lines of such a text from 2.
    let written = |(index, body): (usize, &String)| {
        let name = format!("expr_{index}");
        let text = format!("\n{}", expression(&name, body));
        (name, text)
    };
    Folders::new(job.settings.shader_path.clone(), texts.enumerate().map(written).collect(), limits)
}

/// The text of a group, whose shaders have the names that they declare.
fn serialized(group: &Group) -> String {
    group_text::serialized(group, |_, layer| layer.program.shader.name.to_string())
}
