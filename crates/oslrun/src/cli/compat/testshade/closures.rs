//! The closures that the reference's grid tool knows, and its messages about invalid calls.
//!
//! An unknown closure ends the list of operations that calls it; an unknown keyword is ignored.

use super::super::Console;
use osl_ir::ir::{Body, Kind};
use osl_ir::passes::{self, Pass};
use osl_lower::components::{self, Problem, RendererClosure, Stops};
use osl_lower::group::Group;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use osl_syntax::span::Span;
use std::collections::HashSet;
use std::sync::Arc;

const FLOAT: (Kind, u32) = (Kind::Float, 1);
const INT: (Kind, u32) = (Kind::Int, 1);
const TEXT: (Kind, u32) = (Kind::Str, 1);
const TRIPLE: (Kind, u32) = (Kind::Triple, 1);
const LABEL: &[(&str, Kind, u32)] = &[("label", Kind::Str, 1)];

const fn closure(name: &'static str, params: &'static [(Kind, u32)]) -> RendererClosure {
    RendererClosure { name, params, keywords: &[] }
}

const KNOWN: &[RendererClosure] = &[
    closure("emission", &[]),
    closure("background", &[]),
    RendererClosure { keywords: LABEL, ..closure("diffuse", &[TRIPLE]) },
    closure("oren_nayar", &[TRIPLE, FLOAT]),
    closure("translucent", &[TRIPLE]),
    RendererClosure { keywords: LABEL, ..closure("phong", &[TRIPLE, FLOAT]) },
    closure("ward", &[TRIPLE, TRIPLE, FLOAT, FLOAT]),
    closure("microfacet", &[TEXT, TRIPLE, TRIPLE, FLOAT, FLOAT, FLOAT, INT]),
    closure("reflection", &[TRIPLE, FLOAT]),
    closure("refraction", &[TRIPLE, FLOAT]),
    closure("transparent", &[]),
    closure("debug", &[TEXT]),
    closure("holdout", &[]),
    RendererClosure {
        keywords: &[
            ("int_key", Kind::Int, 1),
            ("float_key", Kind::Float, 1),
            ("color_key", Kind::Triple, 1),
            ("vector_key", Kind::Triple, 1),
            ("string_key", Kind::Str, 1),
        ],
        ..closure(
            "parameter_test",
            &[
                INT,
                FLOAT,
                TRIPLE,
                TRIPLE,
                TEXT,
                (Kind::Int, 5),
                (Kind::Triple, 5),
                (Kind::Triple, 5),
                (Kind::Float, 5),
                (Kind::Str, 5),
            ],
        )
    },
];

/// Lowers the group with its closures in the tool's form, and says what does not suit. Only components that
/// are needed count: for `Ci`, for the outputs of `options`, or for text that is printed.
///
/// # Errors
/// Those of `lower`.
pub(super) fn lower(
    group: &Group,
    options: &passes::Options,
    sources: &SourceMap,
    console: &mut Console<'_>,
    lower: impl Fn(&Group) -> Result<Body, Vec<Diagnostic>>,
) -> Result<Body, Vec<Diagnostic>> {
    let mut body = lower(group)?;
    // Most groups call only closures that the tool knows, with valid arguments.
    if !components::problems(&body, KNOWN).is_empty() {
        let needed = needed(body.clone(), options);
        let problems = components::problems(&needed, KNOWN);
        say(&problems, &needed, sources, console);
        let unknown = problems.into_iter().filter_map(|problem| match problem {
            Problem::Closure { name, span } => Some((name, span)),
            Problem::Keyword { .. } => None,
        });
        let calls: Vec<(Arc<str>, Span)> = unknown.collect();
        if !calls.is_empty() {
            let stops = Stops::new(&needed, calls);
            let mut group = group.clone();
            for index in 0..group.layers().len() {
                let Some(layer) = group.layer_mut(index) else { continue };
                components::stop(Arc::make_mut(&mut layer.program), &stops, layer.base);
            }
            body = lower(&group)?;
        }
    }
    components::fit(&mut body, KNOWN);
    Ok(body)
}

/// The body with only the components that are needed; each call keeps its written form.
fn needed(mut body: Body, options: &passes::Options) -> Body {
    let mut options = options.clone();
    if let Some(outputs) = &mut options.outputs {
        outputs.push("Ci".into());
    }
    options.without.extend([Pass::Unroll, Pass::Cse, Pass::Flatten, Pass::Algebra, Pass::Share, Pass::Fuse]);
    passes::run(&mut body, &options);
    body
}

fn say(problems: &[Problem], body: &Body, sources: &SourceMap, console: &mut Console<'_>) {
    let place = |span| sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut said = HashSet::new();
    for problem in problems {
        let line = match problem {
            Problem::Closure { name, span } => {
                let within = body.names(*span).map_or_else(String::new, |(index, names)| {
                    format!(
                        " in shader \"{}\", layer {index} \"{}\", group \"{}\"",
                        names.shader, names.layer, names.group
                    )
                });
                format!(
                    "ERROR: Closure '{name}' is not supported by the current renderer, called from {}{within}",
                    place(*span)
                )
            }
            Problem::Keyword { key, name, span } => {
                format!("WARNING: Unsupported closure keyword arg \"{key}\" for {name} ({})", place(*span))
            }
        };
        if said.insert(line.clone()) {
            let _ = writeln!(console.err, "{line}");
        }
    }
}
