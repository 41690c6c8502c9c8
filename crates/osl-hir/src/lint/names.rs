//! Names that are literals and that a function does not know: of a noise, a wrap mode, an interpolation, a
//! microfacet distribution, a standard attribute.
//!
//! Unlike spaces, renderers do not add to the first four; attributes are theirs, so only a name that almost
//! is a standard one is reported. Source: OSL language specification, noise and texture functions, closures,
//! attributes of renderers.

use super::walk::{Event, Walk};
use super::{Findings, codes_of_slips as codes};
use crate::hir::{BuiltinCall, Expr, ExprKind};
use osl_syntax::diagnostic::Edit;
use osl_syntax::spelling::closest;

const NOISES: &[&str] =
    &["perlin", "snoise", "uperlin", "noise", "cell", "hash", "simplex", "usimplex", "gabor"];
/// Further names of the same noises.
const OTHER_NOISES: &[&str] =
    &["psnoise", "pnoise", "cellnoise", "hashnoise", "simplexnoise", "usimplexnoise", "null", "unull"];
const WRAPS: &[&str] = &["default", "black", "clamp", "periodic", "mirror"];
const INTERPOLATIONS: &[&str] = &["smartcubic", "cubic", "linear", "closest"];
const DISTRIBUTIONS: &[&str] = &["ggx", "beckmann"];
/// Further names that renderers know.
const OTHER_DISTRIBUTIONS: &[&str] = &[
    "default",
    "sharp",
    "",
    "GGX",
    "Beckmann",
    "blinn",
    "phong",
    "ward",
    "gtr",
    "multi_ggx",
    "ashikhmin_shirley",
];
const ATTRIBUTES: &[&str] = &[
    "osl:version",
    "shader:shadername",
    "shader:layername",
    "shader:groupname",
    "camera:resolution",
    "camera:pixelaspect",
    "camera:projection",
    "camera:fov",
    "camera:clip",
    "camera:clip_near",
    "camera:clip_far",
    "camera:shutter",
    "camera:shutter_open",
    "camera:shutter_close",
    "camera:screen_window",
];

/// Reports literals that are not among the known names.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    walk.everything(&mut |event| {
        if let Event::Expr(Expr { kind: ExprKind::Builtin(call), .. }) = event {
            judge(call, found);
        }
    });
}

fn literal(arg: &Expr) -> Option<&str> {
    match &arg.kind {
        ExprKind::Str(text) => Some(text),
        _ => None,
    }
}

fn judge(call: &BuiltinCall, found: &mut Findings<'_>) {
    match call.row.name {
        "noise" | "pnoise" => {
            if let Some(first) = call.args.first() {
                word(first, ("noise", "the run fails"), (NOISES, OTHER_NOISES), found);
            }
        }
        "microfacet" => {
            if let Some(first) = call.args.first() {
                let effect = "a renderer takes another distribution instead";
                word(first, ("distribution", effect), (DISTRIBUTIONS, OTHER_DISTRIBUTIONS), found);
            }
        }
        "getattribute" => attribute(call, found),
        _ => {}
    }
    if call.row.facts.lookup {
        options(call, found);
    }
}

/// The values of texture options.
fn options(call: &BuiltinCall, found: &mut Findings<'_>) {
    let n_params = call.row.signatures().get(call.overload).map_or(0, |s| s.params.len());
    for pair in call.args.get(n_params..).unwrap_or_default().chunks_exact(2) {
        let [name, value] = pair else { continue };
        let kind = match literal(name) {
            Some("wrap" | "swrap" | "twrap" | "rwrap") => ("wrap mode", WRAPS),
            Some("interp") => ("interpolation", INTERPOLATIONS),
            _ => continue,
        };
        word(value, (kind.0, "ignored: the default is taken"), (kind.1, &["default"]), found);
    }
}

/// Reports a literal that is not among the usual names or the further ones.
fn word(
    arg: &Expr,
    (kind, effect): (&str, &str),
    (usual, further): (&[&str], &[&str]),
    found: &mut Findings<'_>,
) {
    let Some(name) = literal(arg) else { return };
    if usual.contains(&name) || further.contains(&name) {
        return;
    }
    let mut d = codes::unknown_word(arg.span, kind, name, effect, usual);
    if let Some(close) = closest(name, usual.iter().copied())
        && found.text(arg.span) == format!("\"{name}\"")
    {
        let text = format!("\"{close}\"");
        d = d.suggest(format!("write {text}"), vec![Edit { span: arg.span, text }]);
    }
    found.report(d);
}

fn attribute(call: &BuiltinCall, found: &mut Findings<'_>) {
    // `getattribute(name, …)` or `getattribute(object, name, …)`.
    let names = call.args.iter().take(2).filter_map(|arg| Some((arg, literal(arg)?)));
    for (arg, name) in names {
        if ATTRIBUTES.contains(&name) || !name.contains(':') {
            continue;
        }
        let Some(close) = closest(name, ATTRIBUTES.iter().copied()) else { continue };
        // `user:resolution` is another attribute, not a slip.
        let slip = name.split(':').next() == close.split(':').next() && name.len().abs_diff(close.len()) <= 2;
        let mut d = codes::misspelt_attribute(arg.span, name, close);
        if found.text(arg.span) == format!("\"{name}\"") {
            let text = format!("\"{close}\"");
            d = d.suggest(format!("write {text}"), vec![Edit { span: arg.span, text }]);
        }
        if slip {
            found.report(d);
        }
    }
}
