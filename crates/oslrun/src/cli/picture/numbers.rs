//! Lists of numbers as farms write them: `1-3,5,7-11:2`.

use std::fmt;
use std::ops::RangeInclusive;

/// The numbers of a list, in its order: ranges with their steps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Numbers(Vec<(RangeInclusive<u32>, usize)>);

impl Numbers {
    /// The numbers.
    pub(super) fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().flat_map(|(range, step)| range.clone().step_by(*step))
    }

    /// The smallest and the largest number.
    pub(super) fn ends(&self) -> (u32, u32) {
        let first = self.0.iter().map(|(range, _)| *range.start()).min();
        (first.unwrap_or(0), self.0.iter().map(|(range, _)| *range.end()).max().unwrap_or(0))
    }
}

/// The list as it is read, and as the range expressions of Open Job Description have it.
impl fmt::Display for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, (range, step)) in self.0.iter().enumerate() {
            let comma = if at > 0 { "," } else { "" };
            match (range.start(), range.end(), step) {
                (first, last, _) if first == last => write!(f, "{comma}{first}")?,
                (first, last, 1) => write!(f, "{comma}{first}-{last}")?,
                (first, last, step) => write!(f, "{comma}{first}-{last}:{step}")?,
            }
        }
        Ok(())
    }
}

/// Reads the frames of a film.
pub(super) fn frames(text: &str) -> Result<Numbers, String> {
    list(text, ("frame", "1-24"))
}

/// Reads a list. `what` names one of its numbers and has an example of a range.
pub(super) fn list(text: &str, what: (&str, &str)) -> Result<Numbers, String> {
    text.split(',').map(|part| range(part.trim(), what)).collect::<Result<_, _>>().map(Numbers)
}

/// Reads `FIRST-LAST:STEP`, of which the last two may be missing.
fn range(text: &str, (what, example): (&str, &str)) -> Result<(RangeInclusive<u32>, usize), String> {
    let (range, step) = text.split_once([':', 'x']).unwrap_or((text, "1"));
    let (first, last) = range.split_once('-').unwrap_or((range, range));
    match (first.trim().parse::<u32>(), last.trim().parse::<u32>(), step.trim().parse::<usize>()) {
        (_, _, Ok(0)) => Err(format!("the step between {what}s is at least 1")),
        (Ok(first), Ok(last), Ok(step)) if first <= last => Ok((first..=last, step)),
        (Ok(_), Ok(_), Ok(_)) => Err(format!("the last {what} comes before the first")),
        _ => Err(format!("{what}s are FIRST-LAST, such as {example}, or a list, 1-3,5,7-11:2, not `{text}`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_list_of_ranges() {
        let numbers = |text| frames(text).map(|list| list.iter().collect::<Vec<_>>());
        assert_eq!(numbers("1-4"), Ok(vec![1, 2, 3, 4]));
        assert_eq!(numbers("7"), Ok(vec![7]));
        assert_eq!(numbers("1-3,5, 7-11:2"), Ok(vec![1, 2, 3, 5, 7, 9, 11]));
        assert_eq!(numbers("0-9x5"), Ok(vec![0, 5]));
        for wrong in ["5-2", "-3", "a-b", "", "1,", "1-5:0", "1-5:", "1-4294967296"] {
            assert!(frames(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn lists_are_written_as_they_are_read() {
        for text in ["1-4", "7", "1-3,5,7-11:2"] {
            assert_eq!(frames(text).map(|list| list.to_string()).as_deref(), Ok(text));
        }
        assert_eq!(frames("5,1-3").map(|list| list.ends()), Ok((1, 5)));
    }
}
