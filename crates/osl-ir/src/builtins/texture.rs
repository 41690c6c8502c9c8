//! Texture lookups and queries.

use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Const, Kernel, Kind, LaneOp, TextureOption, ValueId};
use crate::types::Type;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "texture",
        &[
            "f(s,f,f,*)",
            "c(s,f,f,*)",
            "v(s,f,f,*)",
            "f(s,f,f,f,f,f,f,*)",
            "c(s,f,f,f,f,f,f,*)",
            "v(s,f,f,f,f,f,f,*)",
        ],
        texture,
        "Channels of an image file at (s, t); (0, 0) is the corner of its first pixel and t grows downward.",
    )
    .derivatives("along s and t")
    .extremes(
        "A file that is missing is an error of the run and gives 0, unless missingcolor or \
               errormessage is given. Coordinates beyond the image follow the wrap mode, black by default; \
               inf and nan give a color, never a failure. Huge derivatives read the smallest image of the \
               pyramid.",
    )
    .example("string trouble = \"\"; color c = texture(\"tex64.png\", u, v, \"errormessage\", trouble);"),
    Builtin::compose(
        "texture3d",
        &["f(s,p,*)", "c(s,p,*)", "v(s,p,*)", "f(s,p,v,v,v,*)", "c(s,p,v,v,v,*)", "v(s,p,v,v,v,*)"],
        texture3d,
        "Channels of a volume; volume files are not read, so it reports an error and gives 0.",
    )
    .derivatives("zero")
    .extremes("Always 0, with an error of the run or the text in errormessage.")
    .example("string trouble = \"\"; color c = texture3d(\"smoke.vdb\", P, \"errormessage\", trouble);"),
    Builtin::compose(
        "environment",
        &["f(s,v,*)", "c(s,v,*)", "v(s,v,*)", "f(s,v,v,v,*)", "c(s,v,v,v,*)", "v(s,v,v,v,*)"],
        environment,
        "Channels of an image of all directions in latitude and longitude; y is up and the middle looks \
         along -z.",
    )
    .derivatives("zero")
    .extremes(
        "The zero vector, inf and nan give a color, never a failure. A missing file is an error of \
               the run and gives 0, unless missingcolor or errormessage is given.",
    )
    .example(
        "string trouble = \"\"; color c = environment(\"sky.exr\", vector(0, 1, 0), \"errormessage\", \
              trouble);",
    ),
    Builtin::compose(
        "gettextureinfo",
        &["i(s,s,o?)", "i(s,s,o?[])", "i(s,f,f,s,o?)", "i(s,f,f,s,o?[])"],
        info,
        "A datum of a texture's header: exists, resolution, channels, averagecolor and others; 1 if it has \
         it.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "A datum that is not there gives 0 and leaves the output. So does a missing file, with an \
               error of the run, except for \"exists\", which answers 0 in the output.",
    )
    .example("int there = 0; int answered = gettextureinfo(\"tex64.png\", \"exists\", there);"),
];

fn kind_of(s: &Site<'_>) -> Kind {
    if s.signature.ret == Type::FLOAT { Kind::Float } else { Kind::Triple }
}

/// The optional arguments behind the first `from`: options with their values, and where outputs go.
#[derive(Default)]
struct Rest {
    options: Vec<TextureOption>,
    values: Vec<ValueId>,
    alpha: Option<usize>,
    message: Option<usize>,
}

fn rest(b: &mut Builder, s: &Site<'_>) -> Rest {
    let mut rest = Rest::default();
    let from = s.signature.params.len();
    for index in (from..s.args.len().saturating_sub(1)).step_by(2) {
        let Some(name) = s.literal(index) else { continue };
        let (at, value) = (index + 1, s.arg(index + 1));
        match &**name {
            "alpha" => rest.alpha = Some(at),
            "errormessage" => rest.message = Some(at),
            // Filtering over time and depth, and color management, have nothing to work on.
            "time" | "rwidth" | "rblur" | "rwrap" | "colorspace" => {}
            _ => match option(name, b.body.kind(value)) {
                Some((option, kind)) => {
                    let number = b.body.kind(value) == Kind::Int && kind == Kind::Float;
                    rest.values.push(if number { b.lane(LaneOp::ToFloat, &[value]) } else { value });
                    rest.options.push(option);
                }
                None => {
                    let text = format!("Unknown texture option: \"{name}\"").into();
                    b.kernel_of(Kernel::Report { text, places: Vec::new() }, &[], &[]);
                }
            },
        }
    }
    rest
}

/// Result and outputs of a lookup.
fn finish(rest: &Rest, values: &[ValueId]) -> Emitted {
    let outputs = [(rest.alpha, 1), (rest.message, 2)]
        .into_iter()
        .filter_map(|(at, result)| at.zip(values.get(result).copied()))
        .collect();
    Emitted { result: values.first().copied(), outputs }
}

fn texture(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let kind = kind_of(s);
    let rest = rest(b, s);
    let footprint = s.signature.params.len() == 7;
    let mut args: Vec<_> = s.args.iter().take(3).copied().collect();
    args.extend(&rest.values);
    if footprint {
        args.extend(s.args.get(3..7).unwrap_or(&[]));
    }
    let kernel = Kernel::Texture {
        triple: kind == Kind::Triple,
        options: rest.options.clone(),
        footprint,
        quiet: rest.message.is_some(),
        tangents: false,
    };
    finish(&rest, &b.kernel_of(kernel, &args, &[kind, Kind::Float, Kind::Str]))
}

fn environment(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let kind = kind_of(s);
    let rest = rest(b, s);
    let mut args: Vec<_> = s.args.iter().take(2).copied().collect();
    args.extend(&rest.values);
    let kernel = Kernel::Environment {
        triple: kind == Kind::Triple,
        options: rest.options.clone(),
        quiet: rest.message.is_some(),
    };
    finish(&rest, &b.kernel_of(kernel, &args, &[kind, Kind::Float, Kind::Str]))
}

fn texture3d(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let rest = rest(b, s);
    let text = "texture3d: volume files are not supported";
    if rest.message.is_none() {
        b.kernel_of(Kernel::Report { text: text.into(), places: Vec::new() }, &[], &[]);
    }
    let value = b.constant(Const::zero(kind_of(s)));
    let alpha = b.float(0.0);
    let message = b.constant(Const::Str(text.into()));
    finish(&rest, &[value, alpha, message])
}

fn info(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let last = s.args.len().saturating_sub(1);
    let (kind, count, kinds) = super::scene::wanted(b, s, last);
    let args = [s.arg(0), s.arg(last.saturating_sub(1))];
    let mut values = b.kernel_of(Kernel::TextureInfo { kind, count }, &args, &kinds);
    let Some(found) = values.pop() else { return Emitted::default() };
    super::scene::store_found(b, s, last, found, &values)
}

/// The type of an option that a lookup writes to.
pub(super) fn output_option(function: &str, option: &str) -> Option<Type> {
    let lookup = matches!(function, "texture" | "texture3d" | "environment");
    match option {
        "alpha" if lookup => Some(Type::FLOAT),
        "errormessage" if lookup => Some(Type::STRING),
        _ => None,
    }
}

fn option(name: &str, given: Kind) -> Option<(TextureOption, Kind)> {
    use TextureOption as T;
    let (option, kind) = match name {
        "blur" => (T::Blur, Kind::Float),
        "sblur" => (T::SBlur, Kind::Float),
        "tblur" => (T::TBlur, Kind::Float),
        "width" => (T::Width, Kind::Float),
        "swidth" => (T::SWidth, Kind::Float),
        "twidth" => (T::TWidth, Kind::Float),
        "wrap" => (T::Wrap, Kind::Str),
        "swrap" => (T::SWrap, Kind::Str),
        "twrap" => (T::TWrap, Kind::Str),
        "firstchannel" => (T::FirstChannel, Kind::Int),
        "fill" => (T::Fill, Kind::Float),
        "interp" => (T::Interp, Kind::Str),
        "missingcolor" => (T::MissingColor, Kind::Triple),
        "missingalpha" => (T::MissingAlpha, Kind::Float),
        "subimage" if given == Kind::Str => (T::SubImageName, Kind::Str),
        "subimage" => (T::SubImage, Kind::Int),
        _ => return None,
    };
    let fits = given == kind || (given == Kind::Int && kind == Kind::Float);
    fits.then_some((option, kind))
}
