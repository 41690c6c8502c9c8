//! Dictionaries: XML that a shader searches.
//!
//! A document is parsed once a thread and kept as a plain tree. Paths are a subset of XPath: steps over children (`/`)
//! and descendants (`//`), names and `*`, and predicates `[2]`, `[last()]`, `[@a]`, `[@a='x']`, `[a]`, `[a='x']`. Numbers of nodes are
//! hashes of document, path and place, so that they do not depend on which point asked first. This module must not know
//! lanes or files.

use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// Documents that a thread keeps.
const MAX_DOCUMENTS: usize = 256;
/// Nodes that a thread has numbered.
const MAX_NODES: usize = 1 << 16;
/// Nodes that one path may find.
const MAX_FOUND: usize = 1 << 14;

#[derive(Debug, Default)]
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
    /// Text of the element and all in it.
    text: String,
    children: Vec<usize>,
}

/// A parsed document; element 0 is above the root.
#[derive(Debug)]
struct Tree {
    elements: Vec<Element>,
}

/// A node that a path found: one of a list.
#[derive(Clone, Debug)]
struct Found {
    tree: Arc<Tree>,
    element: usize,
    next: i32,
}

/// Where a search starts.
pub(crate) enum Start<'a> {
    /// The root of a document.
    Document(&'a str),
    /// A node that an earlier search found.
    Node(i32),
}

/// The documents and numbered nodes of a thread.
#[derive(Debug, Default)]
pub(crate) struct Dictionaries {
    documents: FxHashMap<Arc<str>, Result<Arc<Tree>, String>>,
    nodes: FxHashMap<i32, Found>,
}

impl Dictionaries {
    /// The first match of a path: its number, or 0 where there is none.
    ///
    /// # Errors
    /// The document or the path is malformed; a node number is none.
    pub(crate) fn find(&mut self, start: &Start<'_>, path: &str) -> Result<i32, String> {
        let mut hasher = FxHasher::default();
        let (tree, element) = match start {
            Start::Document(text) => {
                text.hash(&mut hasher);
                (self.document(text)?, 0)
            }
            Start::Node(number) => {
                number.hash(&mut hasher);
                let Some(found) = self.nodes.get(number) else { return Ok(0) };
                (found.tree.clone(), found.element)
            }
        };
        path.hash(&mut hasher);
        let steps = steps(path).ok_or_else(|| format!("unsupported path \"{}\"", path.escape_debug()))?;
        let found = tree.search(element, &steps);
        if self.nodes.len() + found.len() > MAX_NODES {
            self.nodes.clear();
        }
        let number = |index: usize| {
            let mut hasher = hasher.clone();
            index.hash(&mut hasher);
            (hasher.finish() >> 33) as i32 | 1
        };
        for (index, element) in found.iter().enumerate() {
            let next = if index + 1 < found.len() { number(index + 1) } else { 0 };
            self.nodes.insert(number(index), Found { tree: tree.clone(), element: *element, next });
        }
        Ok(if found.is_empty() { 0 } else { number(0) })
    }

    /// The match behind a node, 0 if it is the last.
    pub(crate) fn next(&self, node: i32) -> i32 {
        self.nodes.get(&node).map_or(0, |found| found.next)
    }

    /// An attribute of a node, or its text where the name is empty.
    pub(crate) fn value(&self, node: i32, name: &str) -> Option<&str> {
        let found = self.nodes.get(&node)?;
        let element = found.tree.elements.get(found.element)?;
        if name.is_empty() {
            return Some(&element.text);
        }
        element.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    fn document(&mut self, text: &str) -> Result<Arc<Tree>, String> {
        if let Some(known) = self.documents.get(text) {
            return known.clone();
        }
        if self.documents.len() >= MAX_DOCUMENTS {
            self.documents.clear();
        }
        let tree = Tree::parse(text).map(Arc::new);
        self.documents.insert(text.into(), tree.clone());
        tree
    }
}

impl Tree {
    fn parse(text: &str) -> Result<Tree, String> {
        let document = roxmltree::Document::parse(text).map_err(|e| format!("XML parse error: {e}"))?;
        let mut tree = Tree { elements: vec![Element::default()] };
        let mut open = vec![(document.root_element(), 0)];
        while let Some((node, parent)) = open.pop() {
            let at = tree.elements.len();
            tree.elements.push(Element {
                name: node.tag_name().name().to_string(),
                attributes: node
                    .attributes()
                    .map(|a| (a.name().to_string(), a.value().to_string()))
                    .collect(),
                text: node.descendants().filter_map(|n| n.text().filter(|_| n.is_text())).collect(),
                children: Vec::new(),
            });
            tree.elements[parent].children.push(at);
            let children: Vec<_> = node.children().filter(roxmltree::Node::is_element).collect();
            open.extend(children.into_iter().rev().map(|child| (child, at)));
        }
        Ok(tree)
    }

    fn children(&self, element: usize) -> &[usize] {
        self.elements.get(element).map_or(&[], |e| &e.children)
    }

    /// Elements below one, in the order of the document.
    fn descendants(&self, element: usize) -> Vec<usize> {
        let mut found = Vec::new();
        let mut open: Vec<usize> = self.children(element).iter().rev().copied().collect();
        while let Some(at) = open.pop() {
            found.push(at);
            open.extend(self.children(at).iter().rev());
        }
        found
    }

    fn search(&self, from: usize, steps: &[Step]) -> Vec<usize> {
        let mut here = vec![from];
        for step in steps {
            let mut next = Vec::new();
            for element in here {
                let candidates =
                    if step.deep { self.descendants(element) } else { self.children(element).to_vec() };
                let mut kept: Vec<usize> = candidates
                    .into_iter()
                    .filter(|e| step.name == "*" || self.elements[*e].name == step.name)
                    .collect();
                for test in &step.tests {
                    kept = self.kept(kept, test);
                }
                next.append(&mut kept);
            }
            next.sort_unstable();
            next.dedup();
            next.truncate(MAX_FOUND);
            here = next;
        }
        here
    }

    fn kept(&self, list: Vec<usize>, test: &Test) -> Vec<usize> {
        let equal = |value: &str, wanted: &Option<String>| wanted.as_ref().is_none_or(|w| w == value);
        match test {
            Test::Place(n) => list.get(n.wrapping_sub(1)).copied().into_iter().collect(),
            Test::Last => list.last().copied().into_iter().collect(),
            Test::Attribute(name, wanted) => list
                .into_iter()
                .filter(|e| self.elements[*e].attributes.iter().any(|(n, v)| n == name && equal(v, wanted)))
                .collect(),
            Test::Child(name, wanted) => list
                .into_iter()
                .filter(|e| {
                    let children = self.children(*e).iter().filter_map(|c| self.elements.get(*c));
                    children.into_iter().any(|c| c.name == *name && equal(&c.text, wanted))
                })
                .collect(),
        }
    }
}

/// One step of a path.
struct Step {
    /// Whether it goes to descendants rather than children.
    deep: bool,
    name: String,
    tests: Vec<Test>,
}

enum Test {
    Place(usize),
    Last,
    Attribute(String, Option<String>),
    Child(String, Option<String>),
}

/// The steps of a path; `None` where it is beyond the subset.
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

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "<a><b name=\"n1\" k=\"3\">hi<c>deep</c></b><b name=\"n2\">yo</b><d><b name=\"n3\"/></d></a>";

    fn names(path: &str) -> Vec<String> {
        let mut all = Dictionaries::default();
        let mut node = all.find(&Start::Document(TEXT), path).unwrap_or(-1);
        let mut names = Vec::new();
        while node > 0 {
            names.push(all.value(node, "name").unwrap_or("?").to_string());
            node = all.next(node);
        }
        names
    }

    #[test]
    fn paths_find_in_order() {
        assert_eq!(names("//b"), ["n1", "n2", "n3"]);
        assert_eq!(names("/a/b"), ["n1", "n2"]);
        assert_eq!(names("a/*/b"), ["n3"]);
        assert_eq!(names("//b[@name='n2']"), ["n2"]);
        assert_eq!(names("/a/b[2]"), ["n2"]);
        assert_eq!(names("/a/b[last()]"), ["n2"]);
        assert_eq!(names("//b[@k]"), ["n1"]);
        assert_eq!(names("//b[c='deep']"), ["n1"]);
        assert_eq!(names("//zz"), Vec::<String>::new());
    }

    #[test]
    fn text_and_nodes_below() {
        let mut all = Dictionaries::default();
        let b = all.find(&Start::Document(TEXT), "/a/b").unwrap_or(0);
        assert_eq!(all.value(b, ""), Some("hideep"));
        assert_eq!(all.value(b, "none"), None);
        let c = all.find(&Start::Node(b), "c").unwrap_or(0);
        assert_eq!(all.value(c, ""), Some("deep"));
        assert!(all.find(&Start::Document("<a"), "/a").is_err());
        assert!(all.find(&Start::Document(TEXT), "//b[position()<2]").is_err());
        assert_eq!(all.find(&Start::Node(12345), "b"), Ok(0));
    }
}
