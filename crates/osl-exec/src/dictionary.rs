//! Dictionaries: XML that a shader searches.
//!
//! A document is parsed once per run and kept as a flat tree. Paths are a subset of XPath: steps over
//! children (`/`), descendants (`//`), `.`, `..` and the axes with names (`descendant::`), names and `*`,
//! predicates `[2]`, `[last()]`, `[position()<3]`, `[@a]`, `[@a='x']`, `[@a>=2]`, `[a]`, `[a!='x']`,
//! `[.='x']`, and unions `a|b`. Numbers of nodes are hashes of document, path and position, so that they do
//! not depend on which point searched first; and a point knows only the nodes that it found itself.

mod path;
mod tree;

use osl_limits::Limits;
use path::paths;
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};
use tree::{Tree, tidy};

/// Steps for each byte of a parsed document, and bytes of text that one step searches or copies.
const PARSING: u64 = 2;
const BYTES_A_STEP: u64 = 16;
/// Bytes charged for a node that a point knows.
const NODE_BYTES: u64 = 64;

/// A parsed document, or the reason why it is invalid.
type Parsed = Result<Arc<Tree>, Arc<str>>;

/// The documents of all threads of a run: the most recently used ones, as far as there is room. The choice
/// affects the time of a search, but not its counted cost.
#[derive(Debug)]
pub(crate) struct Documents {
    limits: Limits,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    list: FxHashMap<Arc<str>, Parsed>,
    /// The keys of the list, the oldest first.
    order: VecDeque<Arc<str>>,
    bytes: u64,
}

impl Documents {
    /// An empty list.
    pub(crate) fn new(limits: &Limits) -> Documents {
        Documents { limits: limits.clone(), kept: Mutex::default() }
    }

    /// The document for a key, parsed if necessary from the text that `read` returns. Only one is parsed at a
    /// time, since parsing takes many times the memory of the text.
    fn get(&self, key: &str, read: impl FnOnce() -> Result<Arc<str>, String>) -> Parsed {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept.list.get(key) {
            return known.clone();
        }
        let parsed: Parsed = match read().and_then(|text| Tree::parse(&text, &self.limits)) {
            Ok(tree) => Ok(Arc::new(tree)),
            Err(why) => Err(why.into()),
        };
        let bytes = |key: &str, parsed: &Parsed| {
            key.len() as u64 + NODE_BYTES + parsed.as_ref().map_or(0, |tree| tree.bytes())
        };
        let key: Arc<str> = key.into();
        kept.bytes += bytes(&key, &parsed);
        kept.list.insert(key.clone(), parsed.clone());
        kept.order.push_back(key);
        while kept.bytes > self.limits.running.xml_cache_bytes && kept.order.len() > 1 {
            let Some(oldest) = kept.order.pop_front() else { break };
            if let Some(gone) = kept.list.remove(&oldest) {
                kept.bytes = kept.bytes.saturating_sub(bytes(&oldest, &gone));
            }
        }
        parsed
    }
}

/// A node found by a path: one of a list.
#[derive(Clone)]
struct ListedNode {
    tree: Arc<Tree>,
    list: Arc<[u32]>,
    index: usize,
    /// The state from which its number is computed, together with its index in the list.
    hasher: FxHasher,
}

/// Where a search starts.
pub(crate) enum Start<'a> {
    /// The root of a document, given as text.
    Document(&'a str),
    /// The root of a file, given by name, with a function that reads it.
    File(&'a str, &'a dyn Fn(u64) -> Result<String, String>),
    /// A node that an earlier search found.
    Node(i32),
}

/// The cost of a lookup for its point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cost {
    /// Steps.
    pub(crate) steps: u64,
    /// Bytes that are kept until the point ends.
    pub(crate) bytes: u64,
}

/// The nodes known to the points of a batch: each point knows those that it found, and those found for all
/// points.
pub(crate) struct Dictionaries<'a> {
    documents: &'a Documents,
    nodes: FxHashMap<(Option<usize>, i32), ListedNode>,
    /// Hashes of the texts whose documents the batch holds.
    held: FxHashSet<u64>,
}

impl<'a> Dictionaries<'a> {
    /// An empty set.
    pub(crate) fn new(documents: &'a Documents) -> Self {
        Dictionaries { documents, nodes: FxHashMap::default(), held: FxHashSet::default() }
    }

    /// Forgets all nodes.
    pub(crate) fn clear(&mut self) {
        self.nodes.clear();
        self.held.clear();
    }

    /// A node with a number, for a point or for all points.
    fn node(&self, of: Option<usize>, number: i32) -> Option<&ListedNode> {
        self.nodes.get(&(of, number)).or_else(|| self.nodes.get(&(None, number)))
    }

    /// The first match of a path: its number, or 0 if there is none. It becomes known to a point, or to all.
    /// `affords` gets the steps of the next operation and tells whether to continue.
    ///
    /// # Errors
    /// The document or the path is malformed.
    pub(crate) fn find(
        &mut self,
        of: Option<usize>,
        start: &Start<'_>,
        path: &str,
        affords: &mut dyn FnMut(Cost) -> bool,
    ) -> Result<i32, String> {
        let mut hasher = FxHasher::default();
        let mut document = None;
        let (tree, element) = match start {
            Start::Document(text) => {
                if text.len() as u64 > self.documents.limits.running.xml_bytes {
                    return Err(too_long(self.documents.limits.running.xml_bytes));
                }
                let steps = PARSING * text.len() as u64;
                if !affords(Cost { steps, bytes: 0 }) {
                    return Ok(0);
                }
                text.hash(&mut hasher);
                document = Some(hasher.finish());
                (self.documents.get(text, || Ok((*text).into())).map_err(|why| why.to_string())?, 0)
            }
            Start::File(name, read) => {
                let most = self.documents.limits.running.xml_bytes;
                name.hash(&mut hasher);
                // A text cannot be both a document and the name of a file.
                let tree = self.documents.get(name, || read(most).map(Into::into));
                (tree.map_err(|why| why.to_string())?, 0)
            }
            Start::Node(number) => {
                number.hash(&mut hasher);
                let Some(found) = self.node(of, *number) else { return Ok(0) };
                let Some(element) = found.list.get(found.index) else { return Ok(0) };
                (found.tree.clone(), *element as usize)
            }
        };
        path.hash(&mut hasher);
        let paths = paths(path).ok_or_else(|| format!("unsupported path \"{}\"", path.escape_debug()))?;
        if !affords(Cost { steps: path.len() as u64, bytes: 0 }) {
            return Ok(0);
        }
        let most = self.documents.limits.running.xml_found as usize;
        let mut visit = |steps| affords(Cost { steps, bytes: 0 });
        let mut list = Vec::new();
        for steps in &paths {
            let Some(mut found) = tree.search(element, steps, most, &mut visit) else { return Ok(0) };
            list.append(&mut found);
        }
        tidy(&mut list, most);
        if list.is_empty() {
            return Ok(0);
        }
        if let Some(key) = document
            && self.held.insert(key)
            && !affords(Cost { steps: 0, bytes: tree.bytes() })
        {
            return Ok(0);
        }
        Ok(self.know(of, ListedNode { tree, list: list.into(), index: 0, hasher }, affords))
    }

    /// Gives a node its number.
    fn know(&mut self, of: Option<usize>, found: ListedNode, affords: &mut dyn FnMut(Cost) -> bool) -> i32 {
        let mut hasher = found.hasher.clone();
        found.index.hash(&mut hasher);
        let number = (hasher.finish() >> 33) as i32 | 1;
        if self.nodes.contains_key(&(of, number)) {
            return number;
        }
        let list = if found.index == 0 { 4 * found.list.len() as u64 } else { 0 };
        if !affords(Cost { steps: 4, bytes: NODE_BYTES + list }) {
            return 0;
        }
        self.nodes.insert((of, number), found);
        number
    }

    /// The next match after a node; 0 if it is the last one.
    pub(crate) fn next(
        &mut self,
        of: Option<usize>,
        node: i32,
        affords: &mut dyn FnMut(Cost) -> bool,
    ) -> i32 {
        let Some(found) = self.node(of, node) else { return 0 };
        let next = ListedNode { index: found.index + 1, ..found.clone() };
        if next.index < next.list.len() { self.know(of, next, affords) } else { 0 }
    }

    /// An attribute of a node, or its text if the name is empty.
    pub(crate) fn value(&self, of: Option<usize>, node: i32, name: &str) -> Option<&str> {
        let found = self.node(of, node)?;
        let element = *found.list.get(found.index)? as usize;
        if name.is_empty() { Some(found.tree.text(element)) } else { found.tree.attribute(element, name) }
    }
}

/// The error for a document that has too many bytes.
fn too_long(most: u64) -> String {
    format!("the XML text has more than {most} bytes")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test says what must hold")]
    use super::*;

    const TEXT: &str =
        "<a><b name=\"n1\" k=\"3\">hi<c>deep</c></b><b name=\"n2\">yo</b><d><b name=\"n3\"/></d></a>";

    fn names(path: &str) -> Vec<String> {
        let documents = Documents::new(&Limits::default());
        let mut all = Dictionaries::new(&documents);
        let mut node = all.find(None, &Start::Document(TEXT), path, &mut |_| true).unwrap_or(-1);
        let mut names = Vec::new();
        while node > 0 {
            names.push(all.value(None, node, "name").unwrap_or("?").to_string());
            node = all.next(None, node, &mut |_| true);
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
        assert_eq!(names("//b[1]"), ["n1", "n3"]);
        assert_eq!(names("//c/.."), ["n1"]);
        assert_eq!(names("/a/d/../b[2]"), ["n2"]);
        assert_eq!(names("/a/descendant::b"), ["n1", "n2", "n3"]);
        assert_eq!(names("/a/child::b/self::b"), ["n1", "n2"]);
        assert_eq!(names("/a/b[position()>=2]"), ["n2"]);
        assert_eq!(names("/a/b[position()=last()]"), ["n2"]);
        assert_eq!(names("//b[@k>2.5]"), ["n1"]);
        assert_eq!(names("//b[@k<=2.5]"), Vec::<String>::new());
        assert_eq!(names("//b[@name!='n2']"), ["n1", "n3"]);
        assert_eq!(names("//b[.='yo']"), ["n2"]);
        assert_eq!(names("//d/b | /a/b[@name='a|b'] | /a/b[1]"), ["n1", "n3"]);
    }

    #[test]
    fn text_and_nodes_below() {
        let documents = Documents::new(&Limits::default());
        let mut all = Dictionaries::new(&documents);
        let mut find = |start: &Start<'_>, path: &str| all.find(Some(3), start, path, &mut |_| true);
        let b = find(&Start::Document(TEXT), "/a/b").unwrap_or(0);
        let c = find(&Start::Node(b), "c").unwrap_or(0);
        assert!(find(&Start::Document("<a"), "/a").is_err());
        for path in ["//b[contains(@k,'3')]", "ancestor::a", "/a/b/@k", "/a/b/text()", "/a|", "/a/...", "b c"]
        {
            assert!(find(&Start::Document(TEXT), path).is_err(), "{path}");
        }
        assert_eq!(find(&Start::Node(12345), "b"), Ok(0));
        assert_eq!(all.value(Some(3), b, ""), Some("hideep"));
        assert_eq!(all.value(Some(3), b, "none"), None);
        assert_eq!(all.value(Some(3), c, ""), Some("deep"));
        // Each point knows only the nodes that it found.
        assert_eq!(all.value(Some(4), c, ""), None);
    }

    #[test]
    fn deep_and_knotty_documents_are_no_harm() {
        let n = 50_000;
        let deep = format!("<r>{}{}t{}</r>", "<a>".repeat(n), "t".repeat(n), "</a>".repeat(n));
        let limits = Limits::default();
        let tree = Tree::parse(&deep, &limits).unwrap();
        assert!(tree.bytes() < 3_000_000);
        let attributes: String = (0..n).map(|i| format!(" a{i}=''")).collect();
        assert!(Tree::parse(&format!("<r{attributes}/>"), &limits).is_err());
        assert!(Tree::parse(&"<a xmlns:b='c'>".repeat(n), &limits).is_err());
        // Each step of a search is charged for what it examines, whether it finds anything or not.
        let steps = paths("//a//a//a").unwrap().remove(0);
        let mut left = 200_000_u64;
        let mut affords = |steps: u64| {
            left = left.saturating_sub(steps);
            left > 0
        };
        assert!(tree.search(0, &steps, 1 << 14, &mut affords).is_none());
    }
}
