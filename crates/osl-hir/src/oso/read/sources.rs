//! The locations of operations: the source lines named by hints, as files of a source map.
//!
//! A compiled shader contains the file and line of its operations and quotes some of the lines. These become
//! files with the quoted lines and empty lines in between, so that messages refer to the source as if it were
//! run.

use super::file::File;
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The span of each operation, in the source if that is known. Sources have at most `most` lines in total;
/// later lines keep their location in the compiled shader.
pub(super) fn places(file: &File<'_>, sources: &mut SourceMap, most: u64) -> Vec<Span> {
    let mut last: FxHashMap<&str, u32> = FxHashMap::default();
    let mut order: Vec<&str> = Vec::new();
    let mut total = 0u64;
    for (name, line) in file.ops.iter().filter_map(|op| op.place) {
        let reached = last.entry(name).or_insert_with(|| {
            order.push(name);
            0
        });
        let more = u64::from(line.saturating_sub(*reached));
        if more <= most.saturating_sub(total) {
            total += more;
            *reached = (*reached).max(line);
        }
    }
    let mut quoted: FxHashMap<&str, BTreeMap<u32, &str>> = FxHashMap::default();
    for (name, line, text) in &file.quoted {
        quoted.entry(name).or_default().insert(*line, text);
    }
    let mut spans: FxHashMap<&str, Vec<Span>> = FxHashMap::default();
    for name in order {
        let count = last.get(name).copied().unwrap_or(0);
        spans.insert(name, add(sources, name, count, quoted.get(name)));
    }
    let place = |op: &super::file::Op<'_>| {
        let (name, line) = op.place?;
        spans.get(name)?.get(line.checked_sub(1)? as usize).copied()
    };
    file.ops.iter().map(|op| place(op).unwrap_or(op.span)).collect()
}

/// Adds a file with a number of lines. Returns the span of each.
fn add(sources: &mut SourceMap, name: &str, count: u32, quoted: Option<&BTreeMap<u32, &str>>) -> Vec<Span> {
    let mut text = String::new();
    let mut lines = Vec::new();
    for number in 1..=count {
        let line = quoted.and_then(|q| q.get(&number)).copied().unwrap_or_default();
        let indent = line.len() - line.trim_start().len();
        lines.push((text.len() + indent, text.len() + line.len()));
        text.push_str(line);
        text.push('\n');
    }
    let Some(base) = sources.add(name, Arc::from(text)).and_then(|_| sources.files().last()).map(|f| f.base)
    else {
        return Vec::new();
    };
    lines.into_iter().map(|(start, end)| Span::new(base + start as u32, base + end as u32)).collect()
}
