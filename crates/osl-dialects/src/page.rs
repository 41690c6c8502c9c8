//! The tables of dialects as Markdown: for `oslrun dialects` and docs/dialects.md.

use crate::{Attribute, Dialect, Dialects};
use std::collections::BTreeMap;
use std::fmt::Write as _;

impl Dialects {
    /// One line for each dialect.
    pub fn list_text(&self) -> String {
        let width = self.list().iter().map(|dialect| dialect.name.len()).max().unwrap_or(0);
        let line = |d: &std::sync::Arc<Dialect>| format!("{:width$}  {}\n", d.name, d.names.title);
        self.list().iter().map(line).collect()
    }

    /// The tables of all dialects, with a heading of this level for each.
    pub fn page(&self) -> String {
        let sections =
            self.list().iter().map(|d| format!("## {} (`{}`)\n\n{}", d.names.title, d.name, d.page()));
        sections.collect::<Vec<_>>().join("\n")
    }
}

impl Dialect {
    /// Its tables.
    pub fn page(&self) -> String {
        let names = &self.names;
        let mut out = format!("{}\n", names.about.trim());
        let sources = names.sources.join("; ");
        lines(&mut out, "Sources", (!sources.is_empty()).then_some(sources));
        let signs = &names.signs;
        let all =
            [&signs.includes, &signs.calls, &signs.attributes, &signs.metadata, &signs.outputs, &signs.words];
        let whole = |sign: &String| if sign.contains('(') { format!("{sign}…)") } else { sign.clone() };
        lines(&mut out, "A file shows it by", code(all.into_iter().flatten().map(whole)));
        lines(&mut out, "Read before a shader", names.prelude.as_ref().map(|name| format!("`{name}`")));
        lines(&mut out, "Headers", code(self.headers()));
        lines(&mut out, "Kinds of rays", code(&names.rays));
        let objects = names.objects.iter().map(|(object, list)| (format!("\"{object}\", "), list));
        let rows: Vec<String> = std::iter::once((String::new(), &names.attributes))
            .chain(objects)
            .flat_map(|(object, list)| list.iter().map(move |(name, row)| attribute(&object, name, row)))
            .collect();
        if !rows.is_empty() {
            let _ = write!(
                out,
                "\n| attribute | type | value here | meaning |\n|---|---|---|---|\n{}",
                rows.concat()
            );
        }
        table(&mut out, "space", &names.spaces);
        table(&mut out, "message", &names.messages);
        table(&mut out, "metadata", &names.metadata);
        let outputs =
            names.outputs.iter().map(|(name, output)| (name.clone(), output.about.clone())).collect();
        table(&mut out, "output", &outputs);
        table(&mut out, "meaning not public", &names.unknown);
        table(&mut out, "what it lacks", &names.lacks.all());
        out
    }
}

/// A row for an attribute. A value that is a choice of this project has a star.
fn attribute(object: &str, name: &str, row: &Attribute) -> String {
    let value = match (&row.source, row.value()) {
        (Some(source), _) => source.words().to_string(),
        (None, Some(value)) => format!("`{value}`{}", if row.choice { " *" } else { "" }),
        (None, None) => "not answered".to_string(),
    };
    let name = if object.is_empty() { name.to_string() } else { format!("{object}\"{name}\"") };
    format!("| `{name}` | {} | {value} | {} |\n", row.ty, row.about)
}

/// A line with a label, if there is something to say.
fn lines(out: &mut String, label: &str, text: Option<String>) {
    if let Some(text) = text {
        let _ = write!(out, "\n{label}: {text}.\n");
    }
}

/// Names as code, separated by commas; `None` without any.
fn code(names: impl IntoIterator<Item = impl AsRef<str>>) -> Option<String> {
    let all: Vec<String> = names.into_iter().map(|name| format!("`{}`", name.as_ref())).collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// A table of names with their meaning, if there are any.
fn table(out: &mut String, head: &str, rows: &BTreeMap<String, String>) {
    if rows.is_empty() {
        return;
    }
    let _ = write!(out, "\n| {head} | |\n|---|---|\n");
    for (name, text) in rows {
        let _ = writeln!(out, "| `{}` | {} |", name.replace('|', "\\|"), text.replace('|', "\\|"));
    }
}
