//! Checks names of spaces that are literals.
//!
//! A renderer may define further spaces, so these are questions rather than errors; the run reports names
//! that are really unknown. Source of the names: OSL language specification, geometric and color functions.

use super::walk::{Event, Walk};
use super::{Findings, Options, codes};
use crate::builtins::Spaces;
use crate::hir::{BuiltinCall, Expr, ExprKind};
use osl_ir::types::Type;
use osl_numeric::named;
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
    let Some(spaces) = call.row.facts.spaces else { return };
    let (code, known): (Code, &[&str]) = match spaces {
        Spaces::Coordinates => (codes::UNKNOWN_SPACE, SPACES),
        Spaces::OfColor => (codes::UNKNOWN_COLOR_SPACE, COLORS),
        Spaces::OfConversion => (codes::UNKNOWN_COLOR_SPACE, CONVERTED),
    };
    for arg in call.args.iter().filter(|a| a.ty == Type::STRING) {
        let ExprKind::Str(name) = &arg.kind else { continue };
        let is_color = spaces != Spaces::Coordinates;
        if known.contains(&&**name)
            || options.known_spaces.iter().any(|k| **k == **name)
            || is_color && (named::is_raw(name) || named::number(name, true).is_some())
        {
            continue;
        }
        let mut d = codes::unknown_space(code, arg.span, name, known);
        if let Some(close) = closest(name, known.iter().copied())
            && found.text(arg.span) == format!("\"{name}\"")
        {
            let text = format!("\"{close}\"");
            d = d.suggest(format!("write {text}"), vec![Edit { span: arg.span, text }]);
        }
        found.report(d);
    }
}
