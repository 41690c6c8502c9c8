//! Bounds of calls that need more than a lane's arithmetic. A noise is bounded by its range, and on a small
//! tile by its value in the middle and its steepest slope. A call with known arguments runs. Lookups in
//! textures are bounded by their texels (`textures`), and conversions of colors by their operations. All
//! other calls may have any result.

use super::domain::{Tile, shaped};
use super::textures;
use crate::trace::{NoiseCall, OnePoint, run_call};
use osl_exec::{PointSource, Services};
use osl_ir::ir::{Body, Const, Inst, Kernel, Kind, ValueId};
use osl_limits::Limits;
use osl_noise::bounds::{largest, steepest};
use osl_numeric::interval::{Enclosure, Interval, Whole, eval};
use osl_numeric::spaces::Path;
use rustc_hash::FxHashMap;
use std::sync::Mutex;

/// Coordinates up to here have fractions that are fine enough for the slope of a noise.
const FINE: f32 = 65_536.0;
/// Beyond this, cells are no ints.
const CELLS: f32 = 1e9;

/// Runs and bounds calls.
pub(super) struct Calls<'a> {
    pub(super) body: &'a Body,
    pub(super) services: &'a Services,
    pub(super) points: &'a dyn PointSource,
    pub(super) limits: &'a Limits,
    /// The first call with known arguments of each instruction.
    known: Mutex<FxHashMap<ValueId, KnownCall>>,
}

/// The arguments of a call, and its results.
type KnownCall = (Vec<Const>, Vec<Const>);

impl<'a> Calls<'a> {
    pub(super) fn new(
        body: &'a Body,
        services: &'a Services,
        points: &'a dyn PointSource,
        limits: &'a Limits,
    ) -> Calls<'a> {
        Calls { body, services, points, limits, known: Mutex::default() }
    }

    /// The results of a call; `read` is the array that it reads.
    pub(super) fn results(
        &self,
        kernel: &Kernel,
        given: &[Enclosure],
        kinds: &[Kind],
        read: Option<&[Enclosure]>,
        tile: &Tile,
        inst: &Inst,
    ) -> Vec<Enclosure> {
        if kinds.is_empty() {
            return Vec::new();
        }
        let any = || kinds.iter().map(|kind| Enclosure::any(*kind)).collect();
        if let Some(results) = noise(kernel, given, kinds) {
            return results;
        }
        match kernel {
            Kernel::IsConstant => return vec![Enclosure::point(&Const::Int(0))],
            Kernel::Attribute { kind, count, has_derivs } => {
                match self.attribute(given, (*kind, *count, *has_derivs), tile) {
                    Attribute::Coordinate(results) => return results,
                    Attribute::Shared => {}
                    Attribute::Unknown => return any(),
                }
            }
            // Nodes of dictionaries are numbers that have a meaning in one run only.
            Kernel::DictFind | Kernel::DictNext | Kernel::DictValue { .. } => return any(),
            _ if kernel.is_varying() || kernel.has_effect() || kernel.writes().is_some() => return any(),
            _ => {}
        }
        let args: Option<Vec<Const>> = given.iter().map(Enclosure::value).collect();
        let array: Option<Vec<Const>> = read.unwrap_or_default().iter().map(Enclosure::value).collect();
        let (Some(args), Some(array)) = (args, array) else {
            let converted = || converted(kernel, given).map(|color| vec![color]);
            let found = textures::lookup(self.services, kernel, given, kinds).or_else(converted);
            return found.unwrap_or_else(any);
        };
        let results = self.run(kernel, args, kinds, &array, inst);
        results.map_or_else(any, |results| results.iter().map(Enclosure::point).collect())
    }

    fn run(
        &self,
        kernel: &Kernel,
        args: Vec<Const>,
        kinds: &[Kind],
        array: &[Const],
        inst: &Inst,
    ) -> Option<Vec<Const>> {
        let id = inst.results.first()?;
        let is_same = |known: &[Const]| {
            known.len() == args.len() && known.iter().zip(&args).all(|(a, b)| a.same_bits(b))
        };
        if array.is_empty()
            && let Ok(known) = self.known.lock()
            && let Some((_, results)) = known.get(id).filter(|(known, _)| is_same(known))
        {
            return Some(results.clone());
        }
        let point = OnePoint { source: self.points, point: 0 };
        let results = run_call((self.services, point, self.limits), kernel, &args, kinds, array, self.body)?;
        if let Ok(mut known) = self.known.lock() {
            known.entry(*id).or_insert_with(|| (args, results.clone()));
        }
        Some(results)
    }

    /// What is known of a datum of the points.
    fn attribute(&self, given: &[Enclosure], form: (Kind, u8, bool), tile: &Tile) -> Attribute {
        let [Enclosure::Str(Some(object)), Enclosure::Str(Some(name)), Enclosure::Int(element)] = given
        else {
            return Attribute::Unknown;
        };
        let Some(element) = element.value() else { return Attribute::Unknown };
        let element = usize::try_from(element).ok();
        if self.points.attribute_is_shared(object, name, element) {
            return Attribute::Shared;
        }
        // The patch has the texture coordinates s and t, which are u and v.
        let axis = osl_scene::Grid::texture_axis(object, name, element);
        let (Some(axis), (Kind::Float, 0, has_derivs)) = (axis, form) else { return Attribute::Unknown };
        let mut results = vec![Enclosure::Float(tile.side(axis)), Enclosure::point(&Const::Int(1))];
        if has_derivs {
            let global = if axis == 0 { osl_ir::global::Global::U } else { osl_ir::global::Global::V };
            let along = |axis| shaped(self.points.deriv(global, axis), Some(Kind::Float));
            results.extend(osl_ir::ir::Axis::BOTH.map(along));
        }
        Attribute::Coordinate(results)
    }
}

enum Attribute {
    Coordinate(Vec<Enclosure>),
    /// The same at all points.
    Shared,
    Unknown,
}

/// A color between spaces with known names: the operations by way of RGB. `None` for other calls.
fn converted(kernel: &Kernel, given: &[Enclosure]) -> Option<Enclosure> {
    let (Kernel::ColorBetween, [Enclosure::Str(Some(from)), Enclosure::Str(Some(to)), color, system @ ..]) =
        (kernel, given)
    else {
        return None;
    };
    let number = match system {
        [] => None,
        [Enclosure::Int(number)] => Some(number.value()?),
        _ => return None,
    };
    // An unknown space is an error and leaves the color unchanged.
    let Some(path) = Path::between(from, to, number) else { return Some(color.clone()) };
    let mut value = color.clone();
    for (op, number) in path.steps() {
        let mut operands = vec![value];
        operands.extend(number.map(|number| Enclosure::Int(Whole::point(number))));
        value = eval(op, &operands)?;
    }
    // From a space to itself, some forms of the program convert to RGB and back, and others do nothing.
    Some(if from == to { value.hull(color) } else { value })
}

/// The results of a noise; `None` for other calls, and for Gabor noise and unknown names.
fn noise(kernel: &Kernel, given: &[Enclosure], kinds: &[Kind]) -> Option<Vec<Enclosure>> {
    let name = match given.first() {
        Some(Enclosure::Str(Some(name))) => vec![Const::Str(name.clone())],
        _ => Vec::new(),
    };
    let call = NoiseCall::of(kernel, &name)?;
    if let Some(known) = given.iter().map(Enclosure::value).collect::<Option<Vec<Const>>>() {
        return Some(call.strict(&known, kinds).iter().map(Enclosure::point).collect());
    }
    let inputs: Vec<Interval> =
        given.iter().skip(call.skip).flat_map(|arg| arg.numbers().iter().copied()).collect();
    let dims = call.dims;
    let count = if call.has_derivs { 2 * dims } else { 0 };
    let (plain, derivs) = inputs.split_at(inputs.len().checked_sub(count)?);
    let coords = plain.get(..dims)?;
    let values = value(&call, given, coords, plain, kinds);
    let mut results = vec![values];
    // How the noise changes from pixel to pixel: its slope times the change of its coordinates.
    for axis in 0..kinds.len().saturating_sub(1) {
        let slope = match steepest(call.field, dims) {
            Some(slope) if coords.iter().all(|x| x.is_within(-CELLS, CELLS)) => f64::from(slope),
            Some(_) => f64::INFINITY,
            None => 0.0,
        };
        let changes = derivs.get(axis * dims..(axis + 1) * dims).unwrap_or_default();
        let is_plain = changes.iter().all(|x| !x.may_be_nan() && !x.has_infinity());
        let size: f64 = changes.iter().map(|x| f64::from(x.magnitude())).sum();
        // Twice the slope leaves room for coordinates without fine fractions.
        let most = 2.0 * slope * size * (1.0 + 1e-5) + 1e-37;
        let part = match (slope == 0.0, is_plain && most.is_finite() && most < 1e38) {
            (true, _) => Interval::new(-0.0, 0.0),
            (_, true) => Interval::new(-most as f32, most as f32),
            _ => Interval::ANY,
        };
        results.push(filled(kinds[0], part));
    }
    results.truncate(kinds.len());
    Some(results)
}

fn filled(kind: Kind, part: Interval) -> Enclosure {
    match kind {
        Kind::Triple => Enclosure::Triple([part; 3]),
        _ => Enclosure::Float(part),
    }
}

/// The value of a noise.
fn value(
    call: &NoiseCall,
    given: &[Enclosure],
    coords: &[Interval],
    plain: &[Interval],
    kinds: &[Kind],
) -> Enclosure {
    let kind = kinds.first().copied().unwrap_or(Kind::Float);
    let is_plain = coords.iter().all(|x| x.is_within(-CELLS, CELLS) && !x.is_empty());
    let Some((lo, hi)) = largest(call.field, call.dims) else { return filled(kind, Interval::ANY) };
    let Some(slope) = steepest(call.field, call.dims) else {
        // Noise that is constant in cells, or has no continuity at all.
        if call.field == osl_noise::Kind::Cell && is_plain {
            let is_cell = coords.iter().all(|x| x.lo().floor() == x.hi().floor());
            let has_periods = plain.len() > coords.len();
            if is_cell
                && !has_periods
                && let Some(one) = at(call, given, kinds, |x| f64::from(x.lo()))
            {
                return one;
            }
        }
        return filled(kind, Interval::new(lo, hi));
    };
    if !is_plain {
        return filled(kind, Interval::ANY);
    }
    let size = coords.iter().map(|x| x.magnitude()).fold(0.0, f32::max);
    if size > FINE {
        // The rounded coordinates of a lattice may count corners that are not next to the point.
        let most = (f64::from(lo).abs().max(f64::from(hi).abs())) * (call.dims + 2) as f64;
        return filled(kind, Interval::new(-most as f32, most as f32));
    }
    let range = filled(kind, Interval::new(lo, hi));
    let middle = |x: Interval| f64::from(x.lo()) / 2.0 + f64::from(x.hi()) / 2.0;
    let reach: f64 = coords
        .iter()
        .map(|x| {
            let middle = f64::from(middle(*x) as f32);
            (f64::from(x.hi()) - middle).max(middle - f64::from(x.lo()))
        })
        .sum();
    let has_known_periods = plain[coords.len()..].iter().all(|x| x.value().is_some());
    // Coordinates are rounded where the lattice is skewed.
    let room = f64::from(slope) * (reach * (1.0 + 1e-6) + 4e-6 * f64::from(size)) + 4e-6;
    if !has_known_periods || room >= f64::from(hi - lo) {
        return range;
    }
    let Some(one) = at(call, given, kinds, middle) else { return range };
    let around = |x: Interval, range: Interval| match x.value() {
        Some(x) => Interval::new((f64::from(x) - room) as f32, (f64::from(x) + room) as f32).meet(range),
        None => range,
    };
    match (one, range) {
        (Enclosure::Triple(t), Enclosure::Triple(r)) => {
            Enclosure::Triple(std::array::from_fn(|i| around(t[i], r[i])))
        }
        (Enclosure::Float(x), Enclosure::Float(r)) => Enclosure::Float(around(x, r)),
        (_, range) => range,
    }
}

/// The value at a point of the intervals of the coordinates.
fn at(
    call: &NoiseCall,
    given: &[Enclosure],
    kinds: &[Kind],
    place: impl Fn(Interval) -> f64,
) -> Option<Enclosure> {
    let number = |x: &Interval| place(*x) as f32;
    let one = |arg: &Enclosure| match arg {
        Enclosure::Float(x) => Const::Float(number(x)),
        Enclosure::Triple(t) => Const::Triple(t.each_ref().map(number)),
        other => other.value().unwrap_or(Const::Int(0)),
    };
    let args: Vec<Const> = given.iter().map(one).collect();
    call.strict(&args, kinds).first().map(Enclosure::point)
}
