//! Results, one line each in a file, and what they say together.

use osl_measure::sample::PROMISED;
use std::collections::BTreeMap;

/// The permitted cost relative to the best fixed setting.
pub(crate) const DEARER: f64 = 1.2;

/// What was measured of a case.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub(crate) set: String,
    pub(crate) name: String,
    pub(crate) side: usize,
    /// A share of the range.
    pub(crate) error: f32,
    pub(crate) seed: u32,
    /// The share of the checked pixels above the bound.
    pub(crate) above: f64,
    /// Whether the truth is more accurate than the bound.
    pub(crate) known: bool,
    /// Evaluations for each pixel.
    pub(crate) evaluations: f64,
    /// Processor time in milliseconds.
    pub(crate) time: f64,
    /// The name of the best fixed setting, its evaluations for each pixel, and its time.
    pub(crate) best: Option<(String, f64, f64)>,
}

/// What tells a case from others.
pub(crate) type Key = (String, usize, u32, u32);

impl Measured {
    pub(crate) fn key(&self) -> Key {
        (self.name.clone(), self.side, (1000.0 * self.error).round() as u32, self.seed)
    }

    pub(crate) fn line(&self) -> String {
        let Measured { set, name, side, error, seed, above, known, evaluations, time, best } = self;
        let (best, fixed, fixed_time) = best.clone().unwrap_or(("-".into(), 0.0, 0.0));
        format!(
            "{set}\t{name}\t{side}\t{error}\t{seed}\t{above:.6}\t{known}\t{evaluations:.4}\t{time:.4}\t{best}\t{fixed:.4}\t{fixed_time:.4}\n"
        )
    }

    fn from_line(line: &str) -> Option<Measured> {
        let mut words = line.split('\t');
        let mut next = || words.next();
        let (set, name) = (next()?.to_string(), next()?.to_string());
        let (side, error, seed) = (next()?.parse().ok()?, next()?.parse().ok()?, next()?.parse().ok()?);
        let (above, known) = (next()?.parse().ok()?, next()?.parse().ok()?);
        let (evaluations, time) = (next()?.parse().ok()?, next()?.parse().ok()?);
        let best = (next()?.to_string(), next()?.parse().ok()?, next()?.parse().ok()?);
        let best = (best.0 != "-").then_some(best);
        Some(Measured { set, name, side, error, seed, above, known, evaluations, time, best })
    }

    fn is_kept(&self) -> bool {
        self.above <= PROMISED
    }

    /// Evaluations relative to the best fixed setting.
    fn cost(&self) -> Option<f64> {
        Some(self.evaluations / self.best.as_ref()?.1)
    }

    fn slowness(&self) -> Option<f64> {
        Some(self.time / self.best.as_ref()?.2)
    }
}

/// The results of a file; a later line replaces an earlier one of the same case.
pub(crate) fn read(text: &str) -> Vec<Measured> {
    let mut places: BTreeMap<Key, usize> = BTreeMap::new();
    let mut all: Vec<Measured> = Vec::new();
    for found in text.lines().filter_map(Measured::from_line) {
        match places.get(&found.key()) {
            Some(at) => all[*at] = found,
            None => {
                places.insert(found.key(), all.len());
                all.push(found);
            }
        }
    }
    all
}

/// Cases that any fixed setting can keep: how many are kept, at most `DEARER` times as dear, and how slow.
fn summary(name: &str, some: &[&Measured]) -> String {
    let possible: Vec<&&Measured> = some.iter().filter(|one| one.best.is_some()).collect();
    let count = possible.len().max(1);
    let percent = |n: usize| 100.0 * n as f64 / count as f64;
    let kept = possible.iter().filter(|one| one.is_kept()).count();
    let cheap = possible.iter().filter(|one| one.cost().is_some_and(|cost| cost <= DEARER)).count();
    let sorted = |of: &dyn Fn(&Measured) -> Option<f64>| {
        let mut list: Vec<f64> = possible.iter().filter_map(|one| of(one)).collect();
        list.sort_by(f64::total_cmp);
        list
    };
    let (costs, times) = (sorted(&Measured::cost), sorted(&Measured::slowness));
    let at = |list: &[f64], share: f64| {
        let place = (share * list.len() as f64).ceil() as usize;
        list.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    };
    format!(
        "| {name} | {} | {} | {:.1} % | {:.1} % | {:.2} | {:.2} | {:.2} | {:.1} % |\n",
        some.len(),
        possible.len(),
        percent(kept),
        percent(cheap),
        at(&costs, 0.5),
        at(&times, 0.5),
        at(&times, 0.9),
        percent(times.iter().filter(|time| **time < 2.0).count()),
    )
}

/// The tables of docs/accuracy.md.
pub(crate) fn tables(all: &[Measured]) -> String {
    let mut text = "| cases | all | possible | kept | evaluations at most 1.2 times | median | time, median | time, 90 % | time below 2 |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|\n".to_string();
    let mut add = |name: &str, which: &dyn Fn(&Measured) -> bool| {
        let some: Vec<&Measured> = all.iter().filter(|one| which(one)).collect();
        if !some.is_empty() {
            text += &summary(name, &some);
        }
    };
    add("all", &|_| true);
    for set in ["first", "second", "suite", "borders"] {
        add(&format!("{set} set"), &|one| one.set == set);
    }
    let mut sides: Vec<usize> = all.iter().map(|one| one.side).collect();
    sides.sort_unstable();
    sides.dedup();
    for side in sides {
        add(&format!("{side}x{side}"), &|one| one.side == side);
    }
    let errors = [0.05, 0.02];
    for error in errors {
        add(&format!("error {} %", 100.0 * error), &|one| one.error == error);
    }
    let best = |one: &Measured| one.best.as_ref().map_or(String::new(), |best| best.0.clone());
    for rate in ["4x4", "2x2", "2x1", "1x1"] {
        add(&format!("best: {rate}"), &|one| best(one) == rate);
    }
    add("best: 2 to 8 samples", &|one| ["2", "4", "8"].contains(&best(one).as_str()));
    add("best: 16 or more", &|one| best(one).parse::<u32>().is_ok_and(|n| n >= 16));
    text
}

/// How many bounds are kept, and how many cases take at most `DEARER` times the evaluations of the same case
/// in other results; by sizes and by evaluations.
pub(crate) fn counts(all: &[Measured], others: &[Measured]) -> String {
    let mut text = "| cases | number | kept | with others | at most 1.2 times | median | sum |\n".to_string();
    text += &format!("|---|{}\n", "---:|".repeat(6));
    let pairs: Vec<(&Measured, Option<&Measured>)> =
        all.iter().map(|one| (one, others.iter().find(|other| other.key() == one.key()))).collect();
    let mut add = |name: &str, which: &dyn Fn(&Measured) -> bool| {
        let some: Vec<_> = pairs.iter().filter(|(one, _)| which(one)).collect();
        let other = || some.iter().filter_map(|(one, other)| Some((*one, (*other)?)));
        let percent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
        let kept = |some: &[&Measured]| percent(some.iter().filter(|one| one.is_kept()).count(), some.len());
        let mut ratios: Vec<f64> = other().map(|(one, other)| one.evaluations / other.evaluations).collect();
        ratios.sort_by(f64::total_cmp);
        let sums =
            other().fold([0.0; 2], |[a, b], (one, other)| [a + one.evaluations, b + other.evaluations]);
        text += &format!(
            "| {name} | {} | {:.1} % | {:.1} % | {:.1} % | {:.2} | {:.2} |\n",
            some.len(),
            kept(&some.iter().map(|(one, _)| *one).collect::<Vec<_>>()),
            kept(&other().map(|(_, other)| other).collect::<Vec<_>>()),
            percent(ratios.iter().filter(|ratio| **ratio <= DEARER).count(), ratios.len()),
            ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
            sums[0] / sums[1],
        );
    };
    add("all", &|_| true);
    let mut sides: Vec<usize> = all.iter().map(|one| one.side).collect();
    sides.sort_unstable();
    sides.dedup();
    sides.iter().for_each(|side| add(&format!("{side}x{side}"), &|one| one.side == *side));
    add("at most 0.5 evaluations a pixel", &|one| one.evaluations <= 0.5);
    add("0.5 to 2", &|one| one.evaluations > 0.5 && one.evaluations <= 2.0);
    add("more than 2", &|one| one.evaluations > 2.0);
    text
}

/// The cases that miss an aim, the worst first.
pub(crate) fn misses(all: &[Measured]) -> String {
    let mut text = String::new();
    let possible = || all.iter().filter(|one| one.best.is_some());
    for one in possible().filter(|one| !one.is_kept()) {
        text += &format!("not kept: {}", one.line());
    }
    for one in possible().filter(|one| one.cost().is_some_and(|cost| cost > DEARER)) {
        text += &format!("dear {:.2}: {}", one.cost().unwrap_or(0.0), one.line());
    }
    for one in possible().filter(|one| one.slowness().is_some_and(|time| time >= 2.0)) {
        text += &format!("slow {:.2}: {}", one.slowness().unwrap_or(0.0), one.line());
    }
    text
}

/// One line for each shader at one size: over the bounds and patterns, the largest share above the bound, and
/// the largest cost and time.
pub(crate) fn shaders(all: &[Measured], side: usize) -> String {
    let mut text = "| shader | error | kept at | samples per pixel | best fixed | evaluations | time |\n|---|---:|---:|---:|---|---:|---:|\n".to_string();
    for one in all.iter().filter(|one| one.side == side && one.seed == 0) {
        let kept = format!("{:.2} %{}", 100.0 * (1.0 - one.above), if one.known { "" } else { " *" });
        let head = format!("| {} | {} % | {kept} | {:.2} |", one.name, 100.0 * one.error, one.evaluations);
        text += &match (&one.best, one.cost(), one.slowness()) {
            (Some((best, ..)), Some(cost), Some(time)) => {
                format!("{head} {best} | {cost:.2} | {time:.2} |\n")
            }
            _ => format!("{head} none | – | – |\n"),
        };
    }
    text
}
