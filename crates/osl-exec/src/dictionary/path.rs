//! Paths: the subset of XPath that a search understands.

/// One step of a path.
pub(super) struct Step {
    /// Whether it selects descendants rather than children.
    pub(super) deep: bool,
    pub(super) name: String,
    pub(super) tests: Vec<Test>,
}

pub(super) enum Test {
    Place(usize),
    Last,
    Attribute(String, Option<String>),
    Child(String, Option<String>),
}

/// The steps of a path; `None` if it is not in the subset.
pub(super) fn steps(path: &str) -> Option<Vec<Step>> {
    let mut rest = path.trim();
    let mut steps = Vec::new();
    let mut first = true;
    while !rest.is_empty() {
        let deep = rest.starts_with("//");
        let slashes = if deep { 2 } else { usize::from(rest.starts_with('/')) };
        if slashes == 0 && !first {
            return None;
        }
        first = false;
        rest = &rest[slashes..];
        let end = rest.find(['/', '[']).unwrap_or(rest.len());
        let name = rest[..end].trim();
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':');
        if name != "*" && (name.is_empty() || !name.chars().all(plain)) {
            return None;
        }
        rest = &rest[end..];
        let mut tests = Vec::new();
        while let Some(inner) = rest.strip_prefix('[') {
            let (text, after) = inner.split_once(']')?;
            tests.push(test(text.trim())?);
            rest = after;
        }
        if name != "." {
            steps.push(Step { deep, name: name.to_string(), tests });
        }
    }
    Some(steps)
}

fn test(text: &str) -> Option<Test> {
    if let Ok(place) = text.parse() {
        return Some(Test::Place(place));
    }
    if text == "last()" {
        return Some(Test::Last);
    }
    let (name, wanted) = match text.split_once('=') {
        None => (text, None),
        Some((name, value)) => {
            let value = value.trim();
            let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
            let inner = value.strip_prefix(quote)?.strip_suffix(quote)?;
            (name.trim(), Some(inner.to_string()))
        }
    };
    let plain = |n: &str| {
        !n.is_empty() && n.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':'))
    };
    match name.strip_prefix('@') {
        Some(name) => plain(name).then(|| Test::Attribute(name.to_string(), wanted)),
        None => plain(name).then(|| Test::Child(name.to_string(), wanted)),
    }
}
