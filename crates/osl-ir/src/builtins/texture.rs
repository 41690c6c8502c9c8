//! Texture lookups.

use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Kernel, Kind, TextureOption};
use crate::types::Type;

pub(super) static ROWS: &[Builtin] = &[Builtin::compose(
    "texture",
    &["f(s,f,f,*)", "c(s,f,f,*)", "v(s,f,f,*)"],
    texture,
    "Channels of an image file at (s, t); (0, 0) is the corner of its first pixel and t grows downward.",
)];

fn texture(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let kind = if s.signature.ret == Type::FLOAT { Kind::Float } else { Kind::Triple };
    let mut args: Vec<_> = s.args.iter().take(3).copied().collect();
    let mut options = Vec::new();
    for (index, value) in s.args.iter().enumerate().skip(4).step_by(2) {
        let name = s.literals.get(index - 1).and_then(|l| l.as_deref());
        if let Some(option) = name.and_then(option) {
            options.push(option);
            args.push(*value);
        }
    }
    b.kernel(Kernel::Texture { triple: kind == Kind::Triple, options, footprint: false }, &args, kind).into()
}

fn option(name: &str) -> Option<TextureOption> {
    Some(match name {
        "blur" => TextureOption::Blur,
        "sblur" => TextureOption::SBlur,
        "tblur" => TextureOption::TBlur,
        "width" => TextureOption::Width,
        "swidth" => TextureOption::SWidth,
        "twidth" => TextureOption::TWidth,
        "wrap" => TextureOption::Wrap,
        "swrap" => TextureOption::SWrap,
        "twrap" => TextureOption::TWrap,
        "firstchannel" => TextureOption::FirstChannel,
        "fill" => TextureOption::Fill,
        "interp" => TextureOption::Interp,
        _ => return None,
    })
}
