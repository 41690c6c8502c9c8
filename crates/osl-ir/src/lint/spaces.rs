//! Checks names of spaces that are literals.
//!
//! A renderer may define further spaces, so these are questions rather than errors; the run reports names
//! that are really unknown. Source of the names: OSL language specification, geometric and color functions.

use super::walk::{Event, Walk};
use super::{Findings, Options, codes};
use crate::hir::{BuiltinCall, Expr, ExprKind};
use crate::types::Type;
use osl_syntax::diagnostic::{Code, Edit};
use osl_syntax::spelling::closest;

const SPACES: &[&str] = &["common", "world", "object", "shader", "camera", "screen", "raster", "NDC"];

/// Color spaces for constructors.
const COLORS: &[&str] = &["rgb", "RGB", "hsv", "hsl", "YIQ", "XYZ", "xyY"];

/// Color spaces for conversions.
const CONVERTED: &[&str] = &["rgb", "RGB", "hsv", "hsl", "YIQ", "XYZ", "xyY", "sRGB", "linear"];

/// Reports literals that do not name a usual space.
pub(super) fn run(walk: &Walk<'_>, options: &Options, found: &mut Findings<'_>) {
    walk.everything(&mut |event| {
        if let Event::Expr(Expr { kind: ExprKind::Builtin(call), .. }) = event {
            judge(call, options, found);
        }
    });
}

fn judge(call: &BuiltinCall, options: &Options, found: &mut Findings<'_>) {
    let (code, known): (Code, &[&str]) = match call.row.name {
        "transform" | "getmatrix" | "point in space" | "vector in space" | "normal in space"
        | "matrix in space" | "matrix from spaces" => (codes::UNKNOWN_SPACE, SPACES),
        "color in space" => (codes::UNKNOWN_COLOR_SPACE, COLORS),
        "transformc" => (codes::UNKNOWN_COLOR_SPACE, CONVERTED),
        _ => return,
    };
    for arg in call.args.iter().take(2).filter(|a| a.ty == Type::STRING) {
        let ExprKind::Str(name) = &arg.kind else { continue };
        if known.contains(&&**name) || options.known_spaces.iter().any(|k| **k == **name) {
            continue;
        }
        let mut d = codes::unknown_space(code, arg.span, name, known);
        if let Some(close) = closest(name, known.iter().copied())
            && found.text(arg.span) == format!("\"{name}\"")
        {
            let text = format!("\"{close}\"");
            d = d.fix(format!("write {text}"), vec![Edit { span: arg.span, text }]);
        }
        found.report(d);
    }
}
