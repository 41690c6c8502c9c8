//! Paths: the subset of XPath that a search understands.

/// One step of a path.
#[derive(Debug, PartialEq)]
pub(super) struct Step {
    pub(super) axis: Axis,
    /// `*` is any name.
    pub(super) name: String,
    pub(super) tests: Vec<Test>,
}

/// Where a step looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    Children,
    Descendants,
    /// The element itself and its descendants.
    Within,
    Parent,
    Itself,
}

/// A predicate of a step.
#[derive(Debug, PartialEq)]
pub(super) enum Test {
    /// Compares the position among the elements that the step has found.
    Place(Relation, f64),
    Last,
    /// The element has the part.
    Has(Part),
    /// One of the values of the part compares as given.
    Compares(Part, Relation, Value),
}

/// What a predicate looks at.
#[derive(Debug, PartialEq)]
pub(super) enum Part {
    Attribute(String),
    Child(String),
    /// The element's own text, with that of its descendants.
    Text,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    Equal,
    Unequal,
    Less,
    AtMost,
    More,
    AtLeast,
}

/// What a part is compared with.
#[derive(Debug, PartialEq)]
pub(super) enum Value {
    Text(String),
    Number(f64),
}

impl Relation {
    /// Whether two numbers stand in the relation.
    pub(super) fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Relation::Equal => a == b,
            Relation::Unequal => a != b,
            Relation::Less => a < b,
            Relation::AtMost => a <= b,
            Relation::More => a > b,
            Relation::AtLeast => a >= b,
        }
    }
}

impl Value {
    /// Whether a text stands in the relation to the value. Only equality compares texts as such.
    pub(super) fn compares(&self, text: &str, relation: Relation) -> bool {
        let number = |text: &str| text.trim().parse().unwrap_or(f64::NAN);
        match (self, relation) {
            (Value::Text(own), Relation::Equal) => own == text,
            (Value::Text(own), Relation::Unequal) => own != text,
            (Value::Text(own), _) => relation.holds(number(text), number(own)),
            (Value::Number(own), _) => relation.holds(number(text), *own),
        }
    }

    /// The length of a text.
    pub(super) fn bytes(&self) -> usize {
        if let Value::Text(text) = self { text.len() } else { 0 }
    }
}

/// The paths of a union `a | b`, each as its steps; `None` if it is not in the subset.
pub(super) fn paths(text: &str) -> Option<Vec<Vec<Step>>> {
    let (mut quote, mut start, mut found) = (None, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (_, Some(open)) if c == open => quote = None,
            ('|', None) => {
                found.push(steps(text.get(start..at)?)?);
                start = at + 1;
            }
            _ => {}
        }
    }
    // An empty text is the document; an empty part of a union is no path.
    let last = text.get(start..)?;
    if start > 0 && last.trim().is_empty() {
        return None;
    }
    found.push(steps(last)?);
    Some(found)
}

fn steps(path: &str) -> Option<Vec<Step>> {
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
        rest = rest.get(slashes..)?;
        let end = rest.find(['/', '[']).unwrap_or(rest.len());
        let (axis, name) = axis(rest.get(..end)?.trim())?;
        rest = rest.get(end..)?;
        let mut tests = Vec::new();
        while let Some(inner) = rest.strip_prefix('[') {
            let (text, after) = inner.split_once(']')?;
            tests.push(test(text.trim())?);
            rest = after;
        }
        let name = name.to_string();
        let places = tests.iter().any(|t| matches!(t, Test::Place(..) | Test::Last));
        match axis {
            Axis::Children if deep && !places => steps.push(Step { axis: Axis::Descendants, name, tests }),
            _ => {
                if deep {
                    // Places count among the elements below one parent.
                    steps.push(Step { axis: Axis::Within, name: "*".into(), tests: Vec::new() });
                }
                steps.push(Step { axis, name, tests });
            }
        }
    }
    Some(steps)
}

/// The axis and the name of a step.
fn axis(text: &str) -> Option<(Axis, &str)> {
    let (axis, name) = match text.split_once("::") {
        None if text == "." => return Some((Axis::Itself, "*")),
        None if text == ".." => return Some((Axis::Parent, "*")),
        None => (Axis::Children, text),
        Some((axis, name)) => {
            let axis = match axis.trim() {
                "child" => Axis::Children,
                "descendant" => Axis::Descendants,
                "descendant-or-self" => Axis::Within,
                "parent" => Axis::Parent,
                "self" => Axis::Itself,
                _ => return None,
            };
            let name = name.trim();
            (axis, if name == "node()" && axis != Axis::Children { "*" } else { name })
        }
    };
    (name == "*" || is_name(name)).then_some((axis, name))
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':'))
}

fn test(text: &str) -> Option<Test> {
    if let Ok(place) = text.parse::<u32>() {
        return Some(Test::Place(Relation::Equal, place.into()));
    }
    let (left, right) = match relation(text) {
        None => (text, None),
        Some((at, len, relation)) => {
            let value = text.get(at + len..)?.trim();
            (text.get(..at)?.trim(), Some((relation, value)))
        }
    };
    let part = match left {
        "last()" => return right.is_none().then_some(Test::Last),
        "position()" => {
            let (relation, value) = right?;
            return match value {
                "last()" if relation == Relation::Equal => Some(Test::Last),
                _ => Some(Test::Place(relation, value.parse().ok()?)),
            };
        }
        "." => Part::Text,
        _ => match left.strip_prefix('@') {
            Some(name) => is_name(name).then(|| Part::Attribute(name.to_string()))?,
            None => is_name(left).then(|| Part::Child(left.to_string()))?,
        },
    };
    let Some((relation, value)) = right else {
        return (part != Part::Text).then_some(Test::Has(part));
    };
    let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'));
    let value = match quote {
        Some(quote) => Value::Text(value.strip_prefix(quote)?.strip_suffix(quote)?.to_string()),
        None => Value::Number(value.parse().ok().filter(|n: &f64| n.is_finite())?),
    };
    Some(Test::Compares(part, relation, value))
}

/// The first relation outside of quotes: its place, its length and what it is.
fn relation(text: &str) -> Option<(usize, usize, Relation)> {
    let before_quote = text.find(['"', '\'']).unwrap_or(text.len());
    let at = text.get(..before_quote)?.find(['=', '!', '<', '>'])?;
    let rest = text.get(at..)?;
    let all = [
        ("!=", Relation::Unequal),
        ("<=", Relation::AtMost),
        (">=", Relation::AtLeast),
        ("=", Relation::Equal),
        ("<", Relation::Less),
        (">", Relation::More),
    ];
    all.into_iter()
        .find(|(sign, _)| rest.starts_with(sign))
        .map(|(sign, relation)| (at, sign.len(), relation))
}
