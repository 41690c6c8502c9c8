//! Texture lookups and queries.

use super::{Builtin, Emitted, Site};
use osl_ir::ir::{Builder, Kernel, Kind, LaneOp, TextureOption, ValueId};
use osl_ir::types::Type;

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
        "filename, s, t, dsdx, dtdx, dsdy, dtdy",
        texture,
        "Returns channels of the image file `filename` at (`s`, `t`). (0, 0) is the corner of the \
         first pixel, and `t` grows downward.",
    )
    .lookup()
    .derivatives(
        "the slopes of the filtered image along s and t, times the changes of s and t: those given as \
         arguments, else the derivatives of s and t",
    )
    .extremes(
        "A missing file is a run-time error and gives the value of \"fill\", unless \"missingcolor\", \
         \"missingalpha\" or \"errormessage\" is given. Coordinates beyond the image follow the wrap \
         mode, which is black by default. inf and nan give a color, never a failure. Huge derivatives \
         read the smallest image of the pyramid.",
    )
    .example("string trouble = \"\"; color c = texture(\"tex64.png\", u, v, \"errormessage\", trouble);"),
    Builtin::compose(
        "texture3d",
        &["f(s,p,*)", "c(s,p,*)", "v(s,p,*)", "f(s,p,v,v,v,*)", "c(s,p,v,v,v,*)", "v(s,p,v,v,v,*)"],
        "filename, p, dpdx, dpdy, dpdz",
        texture3d,
        "Returns channels of the volume file `filename` at `p`. Volume files cannot be read: every \
         file counts as missing.",
    )
    .lookup()
    .derivatives("zero")
    .extremes(
        "The result is always \"missingcolor\" and \"missingalpha\" if one of them is given. \
         Otherwise it is \"fill\", with a run-time error or with a text in \"errormessage\".",
    )
    .example("string trouble = \"\"; color c = texture3d(\"smoke.vdb\", P, \"errormessage\", trouble);"),
    Builtin::compose(
        "environment",
        &["f(s,v,*)", "c(s,v,*)", "v(s,v,*)", "f(s,v,v,v,*)", "c(s,v,v,v,*)", "v(s,v,v,v,*)"],
        "filename, R, dRdx, dRdy",
        environment,
        "Returns channels of an image of all directions, in the direction `R`. The image has latitude \
         and longitude as its axes; y is up, and the middle of the image looks along -z.",
    )
    .lookup()
    .derivatives("zero")
    .extremes(
        "The zero vector, inf and nan give a color, never a failure. A missing file is a run-time \
         error and gives the value of \"fill\", unless \"missingcolor\", \"missingalpha\" or \
         \"errormessage\" is given.",
    )
    .example(
        "string trouble = \"\"; color c = environment(\"sky.exr\", vector(0, 1, 0), \"errormessage\", \
         trouble);",
    ),
    Builtin::compose(
        "gettextureinfo",
        &["i(s,s,o?)", "i(s,s,o?[])", "i(s,f,f,s,o?)", "i(s,f,f,s,o?[])"],
        "texturename, s, t, paramname, destination | texturename, paramname, destination",
        info,
        "Stores a property of a texture in `destination`. Returns 1 if the texture has it, else 0. \
         The properties are exists, resolution, channels, averagecolor, and every attribute of the \
         file.",
    )
    .query()
    .derivatives("none: the result is an int")
    .extremes(
        "If the texture has no such property, the result is 0 and `destination` is unchanged. The \
         same holds for a missing file, which is also a run-time error; only \"exists\" stores 0 in \
         `destination` and returns 1.",
    )
    .example("int there = 0; int answered = gettextureinfo(\"tex64.png\", \"exists\", there);"),
];

fn kind_of(s: &Site<'_>) -> Kind {
    if s.signature.ret == Type::FLOAT { Kind::Float } else { Kind::Triple }
}

/// The optional arguments after the first `from`: options with their values, and the destinations of outputs.
#[derive(Default)]
struct Rest {
    options: Vec<TextureOption>,
    values: Vec<ValueId>,
    alpha: Option<usize>,
    message: Option<usize>,
}

fn rest(b: &mut Builder, s: &Site<'_>) -> Rest {
    let mut rest = Rest::default();
    let mut unknown = std::collections::HashSet::new();
    let from = s.signature.params.len();
    for index in (from..s.args.len().saturating_sub(1)).step_by(2) {
        let Some(name) = s.literal(index) else { continue };
        // The reference skips an empty name and its value.
        if name.is_empty() {
            continue;
        }
        let (at, value) = (index + 1, s.arg(index + 1));
        let ty = s.types.get(at).copied().unwrap_or(Type::ERROR);
        match OPTIONS.iter().find(|option| option.name == &**name && option.takes(ty)) {
            Some(LookupOption { name: "alpha", .. }) => rest.alpha = Some(at),
            Some(LookupOption { output: true, .. }) => rest.message = Some(at),
            Some(LookupOption { sets: Some(option), ty: wanted, .. }) => {
                let number = ty == Type::INT && *wanted == Type::FLOAT;
                rest.values.push(if number { b.lane(LaneOp::ToFloat, &[value]) } else { value });
                rest.options.push(*option);
            }
            Some(_) => {}
            // Reported once for each name.
            None if !unknown.insert(name) => {}
            None => {
                let text = format!("Unknown texture option: \"{name}\"").into();
                b.kernel_of(Kernel::Report { text, places: Vec::new() }, &[], &[]);
            }
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
        has_derivs: false,
    };
    finish(&rest, &b.kernel_of(kernel, &args, &[kind, Kind::Float, Kind::Str]))
}

fn environment(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let kind = kind_of(s);
    let rest = rest(b, s);
    let footprint = s.signature.params.len() == 4;
    let mut args: Vec<_> = s.args.iter().take(2).copied().collect();
    args.extend(&rest.values);
    if footprint {
        args.extend(s.args.get(2..4).unwrap_or(&[]));
    }
    let kernel = Kernel::Environment {
        triple: kind == Kind::Triple,
        options: rest.options.clone(),
        footprint,
        quiet: rest.message.is_some(),
    };
    finish(&rest, &b.kernel_of(kernel, &args, &[kind, Kind::Float, Kind::Str]))
}

fn texture3d(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let kind = kind_of(s);
    let rest = rest(b, s);
    let mut args = vec![s.arg(0)];
    args.extend(&rest.values);
    let kernel = Kernel::Volume {
        triple: kind == Kind::Triple,
        options: rest.options.clone(),
        quiet: rest.message.is_some(),
    };
    finish(&rest, &b.kernel_of(kernel, &args, &[kind, Kind::Float, Kind::Str]))
}

fn info(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let last = s.args.len().saturating_sub(1);
    let (kind, count, kinds) = super::scene::wanted(b, s, last);
    let mut args = vec![s.arg(0), s.arg(last.saturating_sub(1))];
    if s.signature.params.len() == 5 {
        args.extend([s.arg(1), s.arg(2)]);
    }
    let mut values = b.kernel_of(Kernel::TextureInfo { kind, count }, &args, &kinds);
    let Some(found) = values.pop() else { return Emitted::default() };
    super::scene::store_found(b, s, last, found, &values)
}

/// An option of lookups.
pub(crate) struct LookupOption {
    /// The name that shaders write.
    pub(crate) name: &'static str,
    /// The type of its value.
    pub(crate) ty: Type,
    /// The option that it sets; `None` for outputs, and for options without effect: filtering over time and
    /// depth, and color management.
    sets: Option<TextureOption>,
    /// Whether the lookup writes to the value.
    output: bool,
}

/// The options of lookups. `subimage` is a number or a name.
pub(crate) static OPTIONS: &[LookupOption] = {
    use TextureOption as T;
    const fn sets(name: &'static str, ty: Type, sets: T) -> LookupOption {
        LookupOption { name, ty, sets: Some(sets), output: false }
    }
    const fn idle(name: &'static str, ty: Type) -> LookupOption {
        LookupOption { name, ty, sets: None, output: false }
    }
    const fn output(name: &'static str, ty: Type) -> LookupOption {
        LookupOption { name, ty, sets: None, output: true }
    }
    &[
        sets("blur", Type::FLOAT, T::Blur),
        sets("sblur", Type::FLOAT, T::SBlur),
        sets("tblur", Type::FLOAT, T::TBlur),
        sets("width", Type::FLOAT, T::Width),
        sets("swidth", Type::FLOAT, T::SWidth),
        sets("twidth", Type::FLOAT, T::TWidth),
        sets("fill", Type::FLOAT, T::Fill),
        sets("missingalpha", Type::FLOAT, T::MissingAlpha),
        sets("wrap", Type::STRING, T::Wrap),
        sets("swrap", Type::STRING, T::SWrap),
        sets("twrap", Type::STRING, T::TWrap),
        sets("interp", Type::STRING, T::Interp),
        sets("firstchannel", Type::INT, T::FirstChannel),
        sets("subimage", Type::INT, T::SubImage),
        sets("subimage", Type::STRING, T::SubImageName),
        sets("missingcolor", Type::COLOR, T::MissingColor),
        idle("rblur", Type::FLOAT),
        idle("rwidth", Type::FLOAT),
        idle("time", Type::FLOAT),
        idle("rwrap", Type::STRING),
        idle("colorspace", Type::STRING),
        output("alpha", Type::FLOAT),
        output("errormessage", Type::STRING),
    ]
};

impl LookupOption {
    /// Whether a value of a type fits.
    pub(crate) fn takes(&self, ty: Type) -> bool {
        match self.ty {
            Type::FLOAT => ty.is_number(),
            Type::COLOR => ty.is_triple(),
            own => ty == own,
        }
    }
}

/// The type of an option that a lookup writes to.
pub(super) fn output_option(name: &str) -> Option<Type> {
    OPTIONS.iter().find(|option| option.output && option.name == name).map(|option| option.ty)
}
