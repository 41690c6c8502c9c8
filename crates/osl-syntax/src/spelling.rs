//! Suggests the known name that a misspelt one probably meant.
//!
//! All suggestions of the project use [`closest`] and thus the same rule: no suggestion is better than a
//! wrong one. Names are compared by optimal string alignment distance, ignoring case. Input cannot make this
//! slow: long names are not compared, and the number of comparisons is limited.

/// Longer names, in bytes, are not compared: they need no suggestion, and a comparison takes time
/// proportional to the product of the lengths.
const MAX_NAME: usize = 64;

/// Maximum number of names of about the right length to compare.
const MAX_COMPARED: usize = 1000;

/// The name most similar to `name`, among those that differ from it in at most a third of the letters of the
/// shorter one. If several are equally similar, a name that `name` becomes by adding letters comes first, and
/// then the alphabetically first.
pub fn closest<'n>(name: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    if name.len() > MAX_NAME {
        return None;
    }
    let lower = name.to_lowercase();
    let limit = |candidate: &str| name.len().min(candidate.len()) / 3;
    names
        .into_iter()
        .filter(|candidate| {
            candidate.len() <= MAX_NAME && candidate.len().abs_diff(name.len()) <= limit(candidate)
        })
        .filter(|candidate| *candidate != name)
        .take(MAX_COMPARED)
        .map(|candidate| {
            let known = candidate.to_lowercase();
            (strsim::damerau_levenshtein(&lower, &known), !lacks_letters(&lower, &known), candidate)
        })
        .filter(|(distance, _, candidate)| *distance <= limit(candidate))
        .min()
        .map(|(_, _, candidate)| candidate)
}

/// Whether letters of `known` in their order make the name.
fn lacks_letters(name: &str, known: &str) -> bool {
    let mut rest = known.chars();
    name.chars().all(|letter| rest.any(|other| other == letter))
}

#[cfg(test)]
mod tests {
    use super::closest;

    #[test]
    fn a_third_of_the_letters_may_be_wrong() {
        assert_eq!(closest("smothstep", ["step", "smoothstep", "linearstep"]), Some("smoothstep"));
        assert_eq!(closest("COS", ["sin", "cos"]), Some("cos"));
        assert_eq!(closest("lerp", ["exp", "log"]), None);
        assert_eq!(closest("x", ["y", "z"]), None);
        assert_eq!(closest("same", ["same"]), None);
        assert_eq!(closest("rmap", ["ramp", "remap"]), Some("remap"));
    }

    #[test]
    fn long_names_are_not_compared() {
        let long = "a".repeat(60_000);
        assert_eq!(closest(&long, [format!("{long}b").as_str()]), None);
        assert_eq!(closest("a", [long.as_str()]), None);
    }
}
