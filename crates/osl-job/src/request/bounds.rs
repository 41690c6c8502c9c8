//! `--max-error`: an error in the units of the outputs or as a share of their range, for all outputs or for
//! some of them.

use super::values::error;
use crate::Failure;
use osl_measure::sample::Reach;
use serde::Serialize;

/// An error bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// In the units of the output.
    Absolute(f32),
    /// Percent of the output's range.
    Percent(f32),
}

/// The bounds of a command line: one for each of some outputs, and one for all others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    others: Option<Bound>,
    each: Vec<(String, Bound)>,
}

/// The bound of an output, in its units.
#[derive(Clone, Debug, Serialize)]
pub struct Resolved {
    /// The name of the output.
    pub output: String,
    /// The error that its pixels may have.
    pub bound: f32,
}

/// Reads `0.01`, `2%`, or `color=2%,mask=0.01`.
pub fn bounds(text: &str) -> Result<Bounds, String> {
    let mut bounds = Bounds::default();
    for item in text.split(',') {
        let Some((name, value)) = item.split_once('=') else {
            if bounds.others.replace(bound(item.trim())?).is_some() {
                return Err(
                    "two errors without the name of an output; `NAME=ERROR` is for one output".to_string()
                );
            }
            continue;
        };
        let name = name.trim();
        if name.is_empty() {
            return Err(format!("`{item}` names no output: NAME=ERROR"));
        }
        if bounds.each.iter().any(|(known, _)| known == name) {
            return Err(format!("the output `{name}` is named twice"));
        }
        bounds.each.push((name.to_string(), bound(value.trim())?));
    }
    Ok(bounds)
}

fn bound(text: &str) -> Result<Bound, String> {
    let Some(number) = text.strip_suffix('%') else { return error(text).map(Bound::Absolute) };
    let share = number.trim().parse().ok().filter(|percent: &f32| *percent > 0.0 && *percent <= 100.0);
    let share = share.map(Bound::Percent);
    share
        .ok_or_else(|| format!("a share of the range is above 0 % and up to 100 %, such as 2%, not `{text}`"))
}

/// An error of the light of a picture as a screen shows it, from 0 to 1: a number, or a share of this range.
pub fn displayed(bounds: &Bounds) -> Result<f32, String> {
    let number = match bounds {
        Bounds { others: Some(Bound::Absolute(number)), each } if each.is_empty() => *number,
        Bounds { others: Some(Bound::Percent(percent)), each } if each.is_empty() => percent / 100.0,
        _ => {
            return Err("of a picture with light it is one number for all: its pixels show the light, not the outputs"
                .to_string());
        }
    };
    let wrong = || format!("a number above 0 and up to 1, or a share such as 2%, not `{number}`");
    Some(number).filter(|x| *x <= 1.0).ok_or_else(wrong)
}

/// The same for an option of which the text is not read yet.
pub fn displayed_error(text: &str) -> Result<f32, String> {
    displayed(&bounds(text)?)
}

impl Bounds {
    /// Whether the ranges of the outputs must be known.
    pub fn needs_ranges(&self) -> bool {
        let all = self.each.iter().map(|(_, bound)| bound).chain(&self.others);
        all.into_iter().any(|bound| matches!(bound, Bound::Percent(_)))
    }

    /// The bounds of the outputs, of all those that have one.
    pub fn of(&self, outputs: &[Reach]) -> Result<Vec<(usize, Resolved)>, Failure> {
        if let Some((name, _)) = self.each.iter().find(|(name, _)| !outputs.iter().any(|o| *o.name == **name))
        {
            let names: Vec<&str> = outputs.iter().map(|output| &*output.name).collect();
            return Err(Failure::new(format!(
                "--max-error: `{name}` is no output of this picture; its outputs are {}",
                names.join(", ")
            )));
        }
        let own = |output: &Reach| {
            let named = self.each.iter().find(|(name, _)| *output.name == **name).map(|(_, bound)| *bound);
            Some(match named.or(self.others)? {
                Bound::Absolute(bound) => bound,
                Bound::Percent(percent) => share(percent, output),
            })
        };
        let found = outputs.iter().enumerate();
        let found = found.filter_map(|(at, output)| {
            Some((at, Resolved { output: output.name.to_string(), bound: own(output)? }))
        });
        Ok(found.collect())
    }

    /// Which error a share of a range is, and which outputs have no bound: a note each.
    pub fn words(&self, outputs: &[Reach]) -> Vec<String> {
        let note = |output: &Reach| {
            let named = self.each.iter().find(|(name, _)| *output.name == **name).map(|(_, bound)| *bound);
            let (name, [low, high]) = (&output.name, output.ends);
            match named.or(self.others) {
                Some(Bound::Percent(percent)) => Some(format!(
                    "{percent} % of the range of {name} ({} to {} at {} pixels) is an error of {}",
                    short(low),
                    short(high),
                    output.pixels,
                    short(share(percent, output)),
                )),
                Some(Bound::Absolute(_)) => None,
                None => Some(format!("the error of {name} has no bound")),
            }
        };
        outputs.iter().filter_map(note).collect()
    }
}

/// So many percent of the range of an output; above 0.
fn share(percent: f32, output: &Reach) -> f32 {
    (percent / 100.0 * output.size()).max(f32::MIN_POSITIVE)
}

/// A number with three digits.
pub fn short(number: f32) -> String {
    let text = format!("{number:.2e}");
    text.parse::<f32>().map_or(text, |rounded| rounded.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(name: &str, ends: [f32; 2]) -> Reach {
        Reach { name: name.into(), planes: 0..1, ends, pixels: 100 }
    }

    #[test]
    fn numbers_and_shares_are_read() {
        assert_eq!(bounds("0.25"), Ok(Bounds { others: Some(Bound::Absolute(0.25)), each: Vec::new() }));
        assert_eq!(bounds("50 %"), Ok(Bounds { others: Some(Bound::Percent(50.0)), each: Vec::new() }));
        let both = Bounds {
            others: Some(Bound::Absolute(0.25)),
            each: vec![("a.b".into(), Bound::Percent(50.0)), ("m".into(), Bound::Absolute(2.0))],
        };
        assert_eq!(bounds("a.b=50%, m = 2 ,0.25"), Ok(both));
    }

    #[test]
    fn nonsense_is_refused() {
        for (text, word) in [
            ("-2%", "above 0 %"),
            ("abc%", "above 0 %"),
            ("0%", "above 0 %"),
            ("nan%", "above 0 %"),
            ("101%", "up to 100 %"),
            ("%", "above 0 %"),
            ("-1", "above 0"),
            ("", "above 0"),
            ("a=", "above 0"),
            ("=2%", "names no output"),
            ("a=2%,a=1%", "named twice"),
            ("1%,2%", "two errors"),
        ] {
            let said = bounds(text).expect_err(text);
            assert!(said.contains(word), "{text}: {said}");
        }
    }

    #[test]
    fn a_share_is_a_share_of_the_own_range() {
        let outputs = [reach("a", [1.0, 3.0]), reach("b", [0.0, 10.0]), reach("c", [0.0, 1.0])];
        let of = |text: &str| {
            let found = bounds(text).unwrap_or_default().of(&outputs);
            found.map(|list| list.iter().map(|(at, own)| (*at, own.bound)).collect::<Vec<_>>())
        };
        assert_eq!(of("50%").ok(), Some(vec![(0, 1.0), (1, 5.0), (2, 0.5)]));
        assert_eq!(of("b=50%,0.25").ok(), Some(vec![(0, 0.25), (1, 5.0), (2, 0.25)]));
        assert_eq!(of("b=2").ok(), Some(vec![(1, 2.0)]));
        let failure = of("x=2").expect_err("unknown");
        assert!(failure.text.contains("`x` is no output") && failure.text.contains("a, b, c"), "{failure:?}");
    }

    #[test]
    fn the_range_is_named() {
        let own = bounds("a=50%").unwrap_or_default();
        let text = own.words(&[reach("a", [1.0, 3.0]), reach("b", [0.0, 1.0])]);
        assert_eq!(
            text,
            ["50 % of the range of a (1 to 3 at 100 pixels) is an error of 1", "the error of b has no bound"]
        );
    }

    #[test]
    fn light_has_one_error() {
        assert_eq!(displayed_error("2%"), Ok(0.02));
        assert_eq!(displayed_error("0.5"), Ok(0.5));
        assert!(displayed_error("2").is_err_and(|said| said.contains("up to 1")));
        assert!(displayed_error("a=2%").is_err_and(|said| said.contains("one number for all")));
    }
}
