//! Values as small pictures: how a variable is shown follows from its type and its values, and is said.

use osl_image::Transfer;
use osl_ir::types::{Base, Type};

/// Small pictures of one size, and how to read them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shown {
    /// For each picture its planes, with values from 0 to 1: grey or red, green and blue, and then the share
    /// that covers the background if some points have no value. Empty if all values are the same.
    pub(super) pictures: Vec<Vec<Vec<f32>>>,
    /// The curve from values to integers.
    pub(super) transfer: Transfer,
    /// How to read them.
    pub(super) words: String,
    /// Black and white, if these are not 0 and 1.
    pub(super) range: Option<(f32, f32)>,
    /// How the command line shows the same values.
    pub(super) typed: Typed,
}

/// How the command line shows the values of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::cli) struct Typed {
    /// The options that choose what is black and white, each with a space before it.
    pub(in crate::cli) options: String,
    /// In which way its picture differs; empty if it does not.
    pub(in crate::cli) differs: String,
    /// Whether it writes a second file with the points that get to the line.
    pub(in crate::cli) has_mask: bool,
}

impl Shown {
    pub(super) fn text(words: String) -> Shown {
        let (pictures, transfer) = (Vec::new(), Transfer::Linear);
        Shown { pictures, transfer, words, range: None, typed: Typed::default() }
    }
}

/// The color of NaN and infinity.
const BROKEN: [f32; 3] = [1.0, 0.0, 0.8];
/// The colors of a range with both signs: below zero, zero, above zero.
const SIGNED: [[f32; 3]; 3] = [[0.13, 0.33, 0.75], [0.96, 0.96, 0.94], [0.85, 0.38, 0.06]];
/// The colors of numbers that stand for something.
const IDS: [[f32; 3]; 8] = [
    [0.12, 0.47, 0.71],
    [1.00, 0.50, 0.05],
    [0.17, 0.63, 0.17],
    [0.84, 0.15, 0.16],
    [0.58, 0.40, 0.74],
    [0.55, 0.34, 0.29],
    [0.89, 0.47, 0.76],
    [0.74, 0.74, 0.13],
];
/// How far a length may be from 1 for a direction.
const NEAR_ONE: f32 = 1e-3;
/// Grey values of a condition: false, both in turns, true.
const CONDITION: [f32; 3] = [0.0, 0.5, 1.0];

/// The values of a variable at some time: a plane for each component, and 0 at points that have none.
#[derive(Clone, Debug, Default)]
pub(super) struct Values {
    pub(super) planes: Vec<Vec<f32>>,
    pub(super) reached: Option<Vec<f32>>,
}

impl Values {
    fn points(&self) -> usize {
        self.planes.first().map_or(0, Vec::len)
    }

    fn counts(&self, at: usize) -> bool {
        self.reached.as_ref().is_none_or(|mask| mask.get(at).is_some_and(|x| *x > 0.0))
    }

    /// The values at a point, if it has any.
    fn at(&self, point: usize) -> Option<[f32; 3]> {
        let own = |component: usize| {
            let plane = self.planes.get(component).or(self.planes.first());
            plane.and_then(|plane| plane.get(point)).copied().unwrap_or(0.0)
        };
        self.counts(point).then(|| [own(0), own(1), own(2)])
    }

    /// Whether a point has values.
    pub(super) fn has_points(&self) -> bool {
        (0..self.points()).any(|point| self.counts(point))
    }
}

/// Shows the values of a variable at several times in the same colors; the words about points are those of
/// the first.
pub(super) fn show(ty: Type, times: &[Values]) -> Shown {
    let Some(main) = times.first() else { return Shown::text(String::new()) };
    let count = main.points();
    let all: Vec<[f32; 3]> =
        times.iter().flat_map(|values| (0..count).filter_map(|point| values.at(point))).collect();
    let reached = (0..count).filter(|point| main.counts(*point)).count();
    let somewhere = if reached < count { format!(", at {}", share(reached, count)) } else { String::new() };
    let is_finite = |triple: &[f32; 3]| triple.iter().all(|x| x.is_finite());
    let components = main.planes.len().clamp(1, 3);
    let text = |triple: &[f32; 3]| -> String {
        let list: Vec<String> = triple.iter().take(components).map(|x| number(*x)).collect();
        list.join(" ")
    };
    if all.is_empty() {
        return Shown::text("no point gets here".to_string());
    }
    if let Some(constants) = times.iter().map(|values| constant(values, count)).collect::<Option<Vec<_>>>()
        && let Some((last, first)) = constants.split_first()
    {
        let mut words = format!("{} everywhere{somewhere}", text(last));
        if first.iter().any(|triple| triple != last) {
            let first: Vec<String> = first.iter().map(text).collect();
            words += &format!("; first {}", first.join(", then "));
        }
        return Shown::text(words);
    }
    let finite: Vec<[f32; 3]> = all.into_iter().filter(is_finite).collect();
    let (low, high) =
        finite.iter().flatten().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if finite.is_empty() {
        return Shown::text(format!("NaN or infinite everywhere{somewhere}"));
    }
    let map = Map::of(ty, components, &finite, (low, high));
    let broken = (0..count).filter_map(|point| main.at(point)).filter(|triple| !is_finite(triple)).count();
    let mut words = map.words(components, low, high) + &somewhere;
    if broken > 0 {
        words += &format!(", {} NaN or infinite (pink)", share(broken, count));
    }
    let pictures = times.iter().map(|values| map.picture(values)).collect();
    let range = match map {
        Map::Range(low, high) if (low, high) != (0.0, 1.0) => Some((low, high)),
        _ => None,
    };
    Shown { pictures, transfer: map.transfer(), words, range, typed: map.typed(ty, (low, high), broken > 0) }
}

/// The value of all points that have one; nothing if they differ, or are not finite.
fn constant(values: &Values, count: usize) -> Option<[f32; 3]> {
    let mut all = (0..count).filter_map(|point| values.at(point));
    let first = all.next().filter(|triple| triple.iter().all(|x| x.is_finite()))?;
    all.all(|triple| triple == first).then_some(first)
}

/// Shows a condition: how often it was true and false at each point.
pub(super) fn condition(is_true: &[f32], is_false: &[f32]) -> Shown {
    let [no, both, yes] = CONDITION;
    let grey = |(t, f): (&f32, &f32)| match (*t > 0.0, *f > 0.0) {
        (true, true) => Some(both),
        (true, false) => Some(yes),
        (false, true) => Some(no),
        (false, false) => None,
    };
    let points: Vec<Option<f32>> = is_true.iter().zip(is_false).map(grey).collect();
    let count = points.len();
    let share = |wanted: Option<f32>| share(points.iter().filter(|x| **x == wanted).count(), count);
    let sum = |list: &[f32]| list.iter().map(|x| f64::from(*x)).sum::<f64>();
    let often = 100.0 * sum(is_true) / (sum(is_true) + sum(is_false)).max(1.0);
    if points.windows(2).all(|pair| pair.first() == pair.last()) {
        let words = match points.first().copied().flatten() {
            None => "no point gets here".to_string(),
            Some(x) if x == yes => "true at every point".to_string(),
            Some(x) if x == no => "false at every point".to_string(),
            Some(_) => format!("true and false in turns at every point, true {often:.0} % of the times"),
        };
        return Shown::text(words);
    }
    let mut words = format!("true (white) at {}, false (black) at {}", share(Some(yes)), share(Some(no)));
    if points.contains(&Some(both)) {
        words += &format!(", in turns (grey) at {}; true {often:.0} % of the times", share(Some(both)));
    }
    let mut picture = vec![points.iter().map(|x| x.unwrap_or(0.0)).collect()];
    if points.contains(&None) {
        picture.push(points.iter().map(|x| f32::from(u8::from(x.is_some()))).collect());
    }
    Shown { pictures: vec![picture], ..Shown::text(words) }
}

/// How values become colors.
#[derive(Clone, Debug, PartialEq)]
enum Map {
    Color,
    Direction,
    /// Black and white are these.
    Range(f32, f32),
    /// Zero is in the middle; the largest size.
    Signed(f32),
    /// The numbers, in order.
    Ids(Vec<i64>),
}

impl Map {
    fn of(ty: Type, components: usize, values: &[[f32; 3]], (low, high): (f32, f32)) -> Map {
        if ty.base == Base::Color {
            return Map::Color;
        }
        if components == 3 && ty.base != Base::Point {
            let length = |triple: &[f32; 3]| triple.iter().map(|x| x * x).sum::<f32>().sqrt();
            let units = values.iter().filter(|triple| (length(triple) - 1.0).abs() <= NEAR_ONE).count();
            if units * 10 >= values.len() * 9 {
                return Map::Direction;
            }
        }
        if ty.base == Base::Int {
            let mut ids: Vec<i64> = values.iter().map(|[x, ..]| *x as i64).collect();
            ids.sort_unstable();
            ids.dedup();
            if ids != [0, 1] && ids.len() <= IDS.len() {
                return Map::Ids(ids);
            }
        }
        if low < 0.0 && high > 0.0 && components == 1 {
            return Map::Signed(high.max(-low));
        }
        if low >= 0.0 && high <= 1.0 { Map::Range(0.0, 1.0) } else { Map::Range(low, high) }
    }

    fn transfer(&self) -> Transfer {
        if *self == Map::Color { Transfer::Srgb } else { Transfer::Linear }
    }

    fn words(&self, components: usize, low: f32, high: f32) -> String {
        let range = format!("{} to {}", number(low), number(high));
        match self {
            Map::Color if low < 0.0 || high > 1.0 => format!("{range}, cut to 0 to 1"),
            Map::Color => range,
            Map::Direction => "direction, as in a normal map".to_string(),
            Map::Range(black, white) if components == 3 => {
                format!("{range}; x, y, z as red, green, blue from {} to {}", number(*black), number(*white))
            }
            Map::Range(0.0, 1.0) => format!("{range}; black is 0, white is 1"),
            Map::Range(..) => format!("{range}, from black to white"),
            Map::Signed(_) => format!("{range}; blue is negative, white 0, orange positive"),
            Map::Ids(ids) => format!("{} different numbers, each with its color, {range}", ids.len()),
        }
    }

    /// How the command line shows the values, which have this range.
    fn typed(&self, ty: Type, (low, high): (f32, f32), has_broken: bool) -> Typed {
        let range = |low: f32, high: f32| format!(" --range {low},{high}");
        let grey = |low: f32, high: f32| {
            format!("its picture is grey, with {} as black and {} as white", number(low), number(high))
        };
        let usual = if ty == Type::NORMAL { (-1.0, 1.0) } else { (0.0, 1.0) };
        let (options, mut differs) = match self {
            Map::Color => (String::new(), String::new()),
            Map::Direction => (" --signed".to_string(), String::new()),
            Map::Range(low, high) if (*low, *high) == usual => (String::new(), String::new()),
            Map::Range(low, high) if low < high => (range(*low, *high), String::new()),
            // One value beside NaN.
            Map::Range(..) => (" --range auto".to_string(), grey(low.min(0.0), high.max(1.0))),
            Map::Signed(most) => (range(-most, *most), grey(-most, *most)),
            Map::Ids(_) => (range(low, high), grey(low, high)),
        };
        if has_broken {
            let start = if differs.is_empty() { "in its picture" } else { &format!("{differs}, and") };
            differs = format!("{start} NaN is black, and infinity black or white");
        }
        Typed { options, differs, has_mask: false }
    }

    /// The planes of a picture.
    fn picture(&self, values: &Values) -> Vec<Vec<f32>> {
        let points: Vec<Option<[f32; 3]>> =
            (0..values.points()).map(|point| values.at(point).map(|triple| self.color(triple))).collect();
        let plane = |component: usize| {
            let own = |color: &Option<[f32; 3]>| color.and_then(|c| c.get(component).copied()).unwrap_or(0.0);
            points.iter().map(own).collect::<Vec<f32>>()
        };
        let is_grey = points.iter().flatten().all(|[r, g, b]| r == g && g == b);
        let mut planes: Vec<Vec<f32>> = if is_grey { vec![plane(0)] } else { (0..3).map(plane).collect() };
        if points.contains(&None) {
            planes.push(points.iter().map(|color| f32::from(u8::from(color.is_some()))).collect());
        }
        planes
    }

    fn color(&self, triple: [f32; 3]) -> [f32; 3] {
        let scaled = |x: f32, low: f32, high: f32| {
            let range = f64::from(high) - f64::from(low);
            if range > 0.0 { ((f64::from(x) - f64::from(low)) / range) as f32 } else { 0.5 }
        };
        let [first, ..] = triple;
        match self {
            _ if triple.iter().any(|x| !x.is_finite()) => BROKEN,
            Map::Color => triple.map(|x| x.clamp(0.0, 1.0)),
            Map::Direction => triple.map(|x| scaled(x, -1.0, 1.0).clamp(0.0, 1.0)),
            Map::Range(low, high) => triple.map(|x| scaled(x, *low, *high).clamp(0.0, 1.0)),
            Map::Signed(most) => signed(first / most),
            Map::Ids(ids) => {
                let index = ids.binary_search(&(first as i64)).unwrap_or(0);
                IDS.get(index).copied().unwrap_or(BROKEN)
            }
        }
    }
}

fn signed(x: f32) -> [f32; 3] {
    let [below, [r, g, b], above] = SIGNED;
    let [end_r, end_g, end_b] = if x < 0.0 { below } else { above };
    let share = x.abs().clamp(0.0, 1.0);
    let between = |from: f32, to: f32| from * (1.0 - share) + to * share;
    [between(r, end_r), between(g, end_g), between(b, end_b)]
}

/// A number with few digits.
fn number(x: f32) -> String {
    // There is no negative zero here.
    let x = x + 0.0;
    let size = x.abs();
    match x {
        _ if x == x.trunc() && size < 1e6 => format!("{x:.0}"),
        _ if (0.001..1e5).contains(&size) => {
            let text = format!("{x:.3}");
            text.trim_end_matches('0').trim_end_matches('.').to_string()
        }
        _ => format!("{x:.2e}"),
    }
}

fn share(n: usize, count: usize) -> String {
    let percent = 100.0 * n as f64 / count.max(1) as f64;
    match n {
        0 => "no point".to_string(),
        _ if n == count => "every point".to_string(),
        _ if percent < 1.0 => "less than 1 % of the points".to_string(),
        _ if percent > 99.0 => "more than 99 % of the points".to_string(),
        _ => format!("{percent:.0} % of the points"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(planes: &[&[f32]], reached: Option<&[f32]>) -> Values {
        let planes = planes.iter().map(|plane| plane.to_vec()).collect();
        Values { planes, reached: reached.map(<[f32]>::to_vec) }
    }

    /// The number of planes, and the words.
    fn said(ty: Type, planes: &[&[f32]], reached: Option<&[f32]>) -> (usize, String) {
        let shown = show(ty, &[values(planes, reached)]);
        (shown.pictures.first().map_or(0, Vec::len), shown.words)
    }

    #[test]
    fn the_map_follows_from_type_and_values() {
        let all = |ty, values: &[&[f32]]| said(ty, values, None);
        assert_eq!(all(Type::FLOAT, &[&[0.0, 0.5]]), (1, "0 to 0.5; black is 0, white is 1".into()));
        assert_eq!(all(Type::FLOAT, &[&[2.0, 4.0]]), (1, "2 to 4, from black to white".into()));
        assert_eq!(
            all(Type::FLOAT, &[&[-1.0, 4.0]]),
            (3, "-1 to 4; blue is negative, white 0, orange positive".into())
        );
        assert_eq!(all(Type::FLOAT, &[&[0.25, 0.25]]), (0, "0.25 everywhere".into()));
        assert_eq!(
            all(Type::INT, &[&[3.0, 7.0]]),
            (3, "2 different numbers, each with its color, 3 to 7".into())
        );
        assert_eq!(all(Type::INT, &[&[0.0, 1.0]]), (1, "0 to 1; black is 0, white is 1".into()));
        let unit: [&[f32]; 3] = [&[0.0, 1.0], &[1.0, 0.0], &[0.0, 0.0]];
        assert_eq!(all(Type::NORMAL, &unit), (3, "direction, as in a normal map".into()));
        assert_eq!(all(Type::POINT, &unit).1, "0 to 1; x, y, z as red, green, blue from 0 to 1");
        assert_eq!(all(Type::COLOR, &unit), (3, "0 to 1".into()));
        let half = said(Type::FLOAT, &[&[0.0, 0.5, 9.0, 9.0]], Some(&[1.0, 1.0, 0.0, 0.0]));
        assert_eq!(half, (2, "0 to 0.5; black is 0, white is 1, at 50 % of the points".into()));
        assert_eq!(said(Type::FLOAT, &[&[1.0]], Some(&[0.0])), (0, "no point gets here".into()));
        let broken = all(Type::FLOAT, &[&[0.0, 0.5, f32::NAN, 1.0]]);
        assert_eq!(
            broken,
            (3, "0 to 1; black is 0, white is 1, 25 % of the points NaN or infinite (pink)".into())
        );
        assert_eq!(all(Type::FLOAT, &[&[f32::NAN; 2]]), (0, "NaN or infinite everywhere".into()));
    }

    #[test]
    fn the_command_line_shows_the_same_or_says_what_differs() {
        let typed = |ty, planes: &[&[f32]]| {
            let typed = show(ty, &[values(planes, None)]).typed;
            (typed.options, typed.differs)
        };
        let same = |options: &str| (options.to_string(), String::new());
        let unit: [&[f32]; 3] = [&[0.0, 1.0], &[1.0, 0.0], &[0.0, 0.0]];
        assert_eq!(typed(Type::COLOR, &unit), same(""));
        assert_eq!(typed(Type::VECTOR, &unit), same(" --signed"));
        assert_eq!(typed(Type::FLOAT, &[&[0.0, 0.5]]), same(""));
        assert_eq!(typed(Type::FLOAT, &[&[2.0, 4.5]]), same(" --range 2,4.5"));
        let inside: [&[f32]; 3] = [&[0.0, 0.5], &[0.25, 0.0], &[0.0, 0.0]];
        assert_eq!(typed(Type::NORMAL, &inside), same(" --range 0,1"), "usually a normal goes from -1 to 1");
        let grey = |low, high| format!("its picture is grey, with {low} as black and {high} as white");
        assert_eq!(typed(Type::FLOAT, &[&[-1.0, 4.0]]), (" --range -4,4".into(), grey(-4, 4)));
        assert_eq!(typed(Type::INT, &[&[3.0, 7.0]]), (" --range 3,7".into(), grey(3, 7)));
        let (options, differs) = typed(Type::FLOAT, &[&[2.0, f32::NAN]]);
        assert_eq!((&*options, differs.starts_with(&grey(0, 2))), (" --range auto", true));
        let (options, differs) = typed(Type::FLOAT, &[&[0.0, 1.0, f32::NAN]]);
        assert_eq!((&*options, &*differs), ("", "in its picture NaN is black, and infinity black or white"));
    }

    #[test]
    fn pictures_have_the_right_colors() {
        let shown = show(Type::FLOAT, &[values(&[&[-2.0, 0.0, 2.0, f32::NAN]], None)]);
        let pixel = |at: usize| [0, 1, 2].map(|c: usize| shown.pictures[0][c][at]);
        assert_eq!((pixel(0), pixel(1), pixel(2), pixel(3)), (SIGNED[0], SIGNED[1], SIGNED[2], BROKEN));
        let ids = show(Type::INT, &[values(&[&[7.0, 3.0]], None)]);
        assert_eq!(ids.pictures[0][0], [IDS[1][0], IDS[0][0]]);
        let rounds =
            show(Type::FLOAT, &[values(&[&[4.0, 2.0]], None), values(&[&[3.0, 9.0]], Some(&[1.0, 0.0]))]);
        assert_eq!(rounds.pictures, [vec![vec![1.0, 0.0]], vec![vec![0.5, 0.0], vec![1.0, 0.0]]]);
        assert_eq!(rounds.range, Some((2.0, 4.0)));
        let times = [3.0, 1.0, 2.0].map(|x| values(&[&[x, x]], None));
        assert_eq!(show(Type::INT, &times), Shown::text("3 everywhere; first 1, then 2".to_string()));
    }

    #[test]
    fn conditions_are_true_false_or_both() {
        let shown = condition(&[1.0, 0.0, 2.0, 0.0], &[0.0, 3.0, 1.0, 0.0]);
        assert_eq!(shown.pictures, [vec![vec![1.0, 0.0, 0.5, 0.0], vec![1.0, 1.0, 1.0, 0.0]]]);
        assert_eq!(
            shown.words,
            "true (white) at 25 % of the points, false (black) at 25 % of the points, in turns (grey) at 25 % of the \
             points; true 43 % of the times"
        );
        assert_eq!(condition(&[1.0; 2], &[0.0; 2]), Shown::text("true at every point".to_string()));
        assert_eq!(condition(&[0.0; 2], &[0.0; 2]), Shown::text("no point gets here".to_string()));
    }
}
