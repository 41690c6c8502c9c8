//! The arguments and results of each kernel, by their kinds.

use crate::ir::{GaborOption, Kernel, Kind, Note, Shape, Sink, TextFn, ValueId, note_names};

/// The kind of an argument or result; `None` stands for any.
type ExpectedKind = Option<Kind>;

const INT: ExpectedKind = Some(Kind::Int);
const FLOAT: ExpectedKind = Some(Kind::Float);
const TRIPLE: ExpectedKind = Some(Kind::Triple);
const STR: ExpectedKind = Some(Kind::Str);
const CLOSURE: ExpectedKind = Some(Kind::Closure);

/// Whether a kernel takes the arguments and defines the results.
pub(super) fn fits(
    kernel: &Kernel,
    args: &[ValueId],
    results: &[ValueId],
    kind: impl Fn(ValueId) -> Kind,
) -> bool {
    let fits = |wanted: &[ExpectedKind], have: &[ValueId]| {
        let each = |(wanted, v): (&ExpectedKind, &ValueId)| wanted.is_none_or(|wanted| wanted == kind(*v));
        wanted.len() == have.len() && wanted.iter().zip(have).all(each)
    };
    let (wanted_results, same) = match kernel {
        // The result has the kind of the argument.
        Kernel::CheckSet { .. } => {
            (vec![None], args.first().map(|v| kind(*v)) == results.first().map(|v| kind(*v)))
        }
        kernel => (self::results(kernel, results.len()), true),
    };
    same && fits(&arguments(kernel, args.len()), args) && fits(&wanted_results, results)
}

fn coordinates(dims: u8) -> Vec<ExpectedKind> {
    match dims {
        1 => vec![FLOAT],
        2 => vec![FLOAT, FLOAT],
        3 => vec![TRIPLE],
        _ => vec![TRIPLE, FLOAT],
    }
}

/// Coordinates, periods, the values of options, and derivatives along both axes.
fn noise(dims: u8, periodic: bool, options: &[GaborOption], has_derivs: bool) -> Vec<ExpectedKind> {
    let coordinates = coordinates(dims);
    let option = |option: &GaborOption| match option {
        GaborOption::Anisotropic | GaborOption::DoFilter => INT,
        GaborOption::Direction => TRIPLE,
        GaborOption::Bandwidth | GaborOption::Impulses => FLOAT,
    };
    let mut list = coordinates.repeat(1 + usize::from(periodic));
    list.extend(options.iter().map(option));
    list.extend(coordinates.repeat(if has_derivs { 2 } else { 0 }));
    list
}

fn shaped(first: &[ExpectedKind], shapes: &[Shape]) -> Vec<ExpectedKind> {
    let each = |shape: &Shape| std::iter::repeat_n(Some(shape.kind), shape.count as usize);
    first.iter().copied().chain(shapes.iter().flat_map(each)).collect()
}

/// The arguments; `n` is the number of those given, where several numbers are permitted.
fn arguments(kernel: &Kernel, n: usize) -> Vec<ExpectedKind> {
    let lookup = |first: &[ExpectedKind], options: usize, footprint: &[ExpectedKind]| {
        let options = std::iter::repeat_n(None, options);
        first.iter().copied().chain(options).chain(footprint.iter().copied()).collect()
    };
    // One more argument of a kind is permitted.
    let or_more = |list: &[ExpectedKind], more: &[ExpectedKind]| {
        let more = if n > list.len() { more } else { &[] };
        list.iter().chain(more).copied().collect()
    };
    match kernel {
        Kernel::Noise { dims, periodic, has_derivs, .. } => noise(*dims, *periodic, &[], *has_derivs),
        Kernel::NamedNoise { dims, periodic, options, has_derivs, .. } => {
            let mut list = vec![STR];
            list.extend(noise(*dims, *periodic, options, *has_derivs));
            list
        }
        Kernel::SpaceMatrix { .. } | Kernel::FindSpace => vec![STR, STR],
        // Where a system of RGB primaries is set, its number follows.
        Kernel::ColorBetween => or_more(&[STR, STR, TRIPLE], &[INT]),
        Kernel::Texture { options, footprint, .. } => {
            lookup(&[STR, FLOAT, FLOAT], options.len(), if *footprint { &[FLOAT; 4] } else { &[] })
        }
        Kernel::Environment { options, footprint, .. } => {
            lookup(&[STR, TRIPLE], options.len(), if *footprint { &[TRIPLE; 2] } else { &[] })
        }
        Kernel::Volume { options, .. } => lookup(&[STR], options.len(), &[]),
        Kernel::TextureInfo { .. } => or_more(&[STR, STR], &[FLOAT, FLOAT]),
        Kernel::Text(function) => match function {
            TextFn::Concat => vec![STR; n.clamp(2, 6)],
            TextFn::Substring => vec![STR, INT, INT],
            TextFn::Character => vec![STR, INT],
            TextFn::StartsWith | TextFn::EndsWith => vec![STR, STR],
            TextFn::Length | TextFn::ToInt | TextFn::ToFloat | TextFn::Hash => vec![STR],
        },
        Kernel::Format(shapes) => shaped(&[STR], shapes),
        Kernel::Print { sink: Sink::File, shapes } => shaped(&[STR, STR], shapes),
        Kernel::Print { shapes, .. } => shaped(&[STR], shapes),
        Kernel::Split { .. } => vec![STR, STR, INT],
        Kernel::Regex { .. } => vec![STR, STR],
        Kernel::Hash => vec![None; n.clamp(1, 4)],
        Kernel::Attribute { .. } => vec![STR, STR, INT],
        Kernel::Trace => vec![TRIPLE, TRIPLE],
        Kernel::SourceMessage { .. } => vec![STR, STR],
        Kernel::RayType => vec![STR],
        // A text, or a node.
        Kernel::DictFind => vec![None, STR],
        Kernel::DictNext => vec![INT],
        Kernel::DictValue { .. } => vec![INT, STR],
        Kernel::IsConstant | Kernel::CheckFinite { .. } | Kernel::CheckSet { .. } => vec![None],
        Kernel::SplineInverse { has_derivs, .. } => shaped(&[STR, FLOAT, INT], &[])
            .into_iter()
            .chain([FLOAT; 2].into_iter().take(2 * usize::from(*has_derivs)))
            .collect(),
        Kernel::Component { shapes, .. } => shaped(&[], shapes),
        Kernel::ClosureSum => vec![CLOSURE, CLOSURE],
        // By a number or a color.
        Kernel::ClosureScale => vec![CLOSURE, None],
        Kernel::SetMessage(form) if form.array.is_none() => vec![STR, None],
        Kernel::SetMessage(_) | Kernel::GetMessage(_) => vec![STR],
        Kernel::Report { .. } => Vec::new(),
        Kernel::CheckIndex { .. } => vec![INT, INT],
        Kernel::Note { note, .. } => match note {
            Note::Set(_) if n == 2 || n == 4 => [INT, None, None, None].into_iter().take(n).collect(),
            Note::Set(_) => vec![None; if n == 3 { 3 } else { 1 }],
            Note::Call { args, .. } => {
                let args = usize::from(*args);
                vec![None; n.clamp(args, args + 1)]
            }
            Note::Branch(_) => vec![INT],
            Note::Enter { names, .. } | Note::Result { names } => vec![None; note_names(names).count()],
            Note::Reach | Note::Loop | Note::Round | Note::Leave => Vec::new(),
        },
    }
}

/// The results; `n` is the number of those defined, where several numbers are permitted.
fn results(kernel: &Kernel, n: usize) -> Vec<ExpectedKind> {
    let number = |triple: bool| if triple { TRIPLE } else { FLOAT };
    let values = |kind: Kind, count: u8, more: &[ExpectedKind]| {
        let values = std::iter::repeat_n(Some(kind), usize::from(count.max(1)));
        values.chain(more.iter().copied()).collect::<Vec<_>>()
    };
    match kernel {
        // A named noise takes derivatives also where nothing needs its own, and stays so when its name is
        // resolved.
        Kernel::Noise { triple, has_derivs, .. } | Kernel::NamedNoise { triple, has_derivs, .. } => {
            vec![number(*triple); if *has_derivs && n == 3 { 3 } else { 1 }]
        }
        Kernel::SpaceMatrix { .. } => vec![Some(Kind::Matrix)],
        Kernel::FindSpace => vec![INT, Some(Kind::Matrix)],
        Kernel::ColorBetween => vec![TRIPLE],
        Kernel::Texture { triple, has_derivs: true, .. } => {
            let value = number(*triple);
            vec![value, FLOAT, STR, value, value, FLOAT, FLOAT]
        }
        Kernel::Texture { triple, .. }
        | Kernel::Environment { triple, .. }
        | Kernel::Volume { triple, .. } => {
            vec![number(*triple), FLOAT, STR]
        }
        Kernel::TextureInfo { kind, count } | Kernel::DictValue { kind, count } => {
            values(*kind, *count, &[INT])
        }
        Kernel::Attribute { kind, count, has_derivs } => {
            let derivatives = [INT, Some(*kind), Some(*kind)];
            values(*kind, *count, if *has_derivs { &derivatives } else { &derivatives[..1] })
        }
        Kernel::SourceMessage { kind, count, .. } => values(*kind, *count, &[INT, INT]),
        Kernel::Text(function) => vec![Some(function.result())],
        Kernel::Format(_) => vec![STR],
        Kernel::Split { .. }
        | Kernel::Regex { .. }
        | Kernel::Hash
        | Kernel::Trace
        | Kernel::RayType
        | Kernel::DictFind
        | Kernel::DictNext
        | Kernel::IsConstant => vec![INT],
        Kernel::SplineInverse { has_derivs, .. } => vec![FLOAT; if *has_derivs { 3 } else { 1 }],
        Kernel::Component { .. } | Kernel::ClosureSum | Kernel::ClosureScale => vec![CLOSURE],
        Kernel::GetMessage(form) if form.array.is_none() => vec![INT, None],
        Kernel::GetMessage(_) => vec![INT],
        Kernel::CheckSet { .. } => vec![None; n.min(1)],
        Kernel::Print { .. }
        | Kernel::SetMessage(_)
        | Kernel::Report { .. }
        | Kernel::CheckIndex { .. }
        | Kernel::CheckFinite { .. }
        | Kernel::Note { .. } => Vec::new(),
    }
}
