//! A document as a flat tree, and the search of it.
//!
//! The tree lists elements in the order of the document: an element comes first, then all elements within it.
//! The text of an element, with the text of all elements within it, is therefore one range of the text of the
//! document. A tree takes memory in proportion to the length of its document, however deep that is nested.

use super::path::{Axis, Part, Step, Test};
use super::{BYTES_A_STEP, too_long};
use osl_limits::Limits;
use std::ops::Range;

/// Steps for each element that a search examines.
const ELEMENT: u64 = 1;

/// A range in the text pool of a tree.
type TextRange = (u32, u32);

#[derive(Clone, Copy, Debug)]
struct Element {
    name: TextRange,
    /// Its range in the list of attributes.
    attributes: (u32, u32),
    /// Text of the element and its descendants.
    text: TextRange,
    /// The first element after its descendants.
    end: u32,
}

/// A parsed document; element 0 is above the root.
#[derive(Debug, Default)]
pub(super) struct Tree {
    elements: Vec<Element>,
    /// Names and values.
    attributes: Vec<(TextRange, TextRange)>,
    /// Names of elements, names and values of attributes.
    words: String,
    /// The text of all elements.
    texts: String,
}

fn piece(pool: &str, (start, end): TextRange) -> &str {
    pool.get(start as usize..end as usize).unwrap_or("")
}

fn push(pool: &mut String, text: &str) -> TextRange {
    let start = pool.len() as u32;
    pool.push_str(text);
    (start, pool.len() as u32)
}

/// Whether a text would take the parser much time or memory: it compares all attributes of an element with
/// each other, and gives each element all namespaces above it.
fn is_knotty(text: &str, most: u64) -> bool {
    let attributes =
        text.as_bytes().split(|b| *b == b'<').map(|tag| tag.iter().filter(|b| **b == b'=').count());
    attributes.max().unwrap_or(0) as u64 > most || text.matches("xmlns").count() as u64 > most
}

impl Tree {
    /// Parses a document.
    ///
    /// # Errors
    /// It is malformed, or exceeds a limit.
    pub(super) fn parse(text: &str, limits: &Limits) -> Result<Tree, String> {
        let running = &limits.running;
        if text.len() as u64 > running.xml_bytes.min(u64::from(u32::MAX / 2)) {
            return Err(too_long(running.xml_bytes));
        }
        if is_knotty(text, running.xml_attributes) {
            return Err(format!("an XML element has more than {} attributes", running.xml_attributes));
        }
        let document = roxmltree::Document::parse(text).map_err(|e| format!("XML parse error: {e}"))?;
        let mut tree = Tree::default();
        let top = Element { name: (0, 0), attributes: (0, 0), text: (0, 0), end: 0 };
        tree.elements.push(top);
        let root = document.root_element();
        tree.enter(root);
        let (mut node, mut open) = (root, vec![1_usize]);
        // In document order: down, then to the next sibling, then up.
        loop {
            if node.is_text()
                && let Some(text) = node.text()
            {
                tree.texts.push_str(text);
            }
            if let Some(child) = node.first_child() {
                node = child;
                if node.is_element() {
                    open.push(tree.enter(node));
                }
                continue;
            }
            loop {
                if node.is_element()
                    && let Some(at) = open.pop()
                {
                    tree.leave(at);
                }
                if node == root {
                    tree.leave(0);
                    return Ok(tree);
                }
                if let Some(next) = node.next_sibling() {
                    node = next;
                    if node.is_element() {
                        open.push(tree.enter(node));
                    }
                    break;
                }
                match node.parent() {
                    Some(parent) => node = parent,
                    None => return Ok(tree),
                }
            }
        }
    }

    /// Adds an element.
    fn enter(&mut self, node: roxmltree::Node<'_, '_>) -> usize {
        let first = self.attributes.len() as u32;
        for a in node.attributes() {
            let (name, value) = (push(&mut self.words, a.name()), push(&mut self.words, a.value()));
            self.attributes.push((name, value));
        }
        let attributes = (first, self.attributes.len() as u32);
        let (name, start) = (push(&mut self.words, node.tag_name().name()), self.texts.len() as u32);
        self.elements.push(Element { name, attributes, text: (start, start), end: 0 });
        self.elements.len() - 1
    }

    /// Ends an element.
    fn leave(&mut self, at: usize) {
        let (text, end) = (self.texts.len() as u32, self.elements.len() as u32);
        if let Some(element) = self.elements.get_mut(at) {
            (element.text.1, element.end) = (text, end);
        }
    }

    /// Its approximate size in bytes, the same on every machine.
    pub(super) fn bytes(&self) -> u64 {
        let (elements, attributes) = (self.elements.len() as u64, self.attributes.len() as u64);
        28 * elements + 16 * attributes + (self.words.len() + self.texts.len()) as u64
    }

    fn name(&self, element: usize) -> &str {
        self.elements.get(element).map_or("", |e| piece(&self.words, e.name))
    }

    /// The text of an element and its descendants.
    pub(super) fn text(&self, element: usize) -> &str {
        self.elements.get(element).map_or("", |e| piece(&self.texts, e.text))
    }

    fn attributes(&self, element: usize) -> impl Iterator<Item = (&str, &str)> {
        let (start, end) = self.elements.get(element).map_or((0, 0), |e| e.attributes);
        let list = self.attributes.get(start as usize..end as usize).unwrap_or(&[]);
        list.iter().map(|(name, value)| (piece(&self.words, *name), piece(&self.words, *value)))
    }

    /// An attribute of an element by name.
    pub(super) fn attribute(&self, element: usize, name: &str) -> Option<&str> {
        self.attributes(element).find(|(n, _)| *n == name).map(|(_, value)| value)
    }

    /// The descendants of an element, in document order.
    fn below(&self, element: usize) -> Range<usize> {
        let end = self.elements.get(element).map_or(0, |e| e.end as usize);
        element + 1..end.max(element + 1)
    }

    /// The children of an element.
    fn children(&self, element: usize) -> impl Iterator<Item = usize> {
        let below = self.below(element);
        let mut at = below.start;
        std::iter::from_fn(move || {
            let here = at;
            at = self.elements.get(here)?.end as usize;
            (here < below.end).then_some(here)
        })
    }

    /// The parent of an element: the last one before it that ends after it.
    fn parent(&self, element: usize) -> Option<usize> {
        (0..element).rev().find(|at| self.elements.get(*at).is_some_and(|e| e.end as usize > element))
    }

    /// The matches of a path from an element on, up to a maximum number. `affords` gets the steps for each
    /// examined element; if it returns false, the search ends without a result.
    pub(super) fn search(
        &self,
        from: usize,
        steps: &[Step],
        most: usize,
        affords: &mut dyn FnMut(u64) -> bool,
    ) -> Option<Vec<u32>> {
        let mut here = vec![from as u32];
        for step in steps {
            let mut next: Vec<u32> = Vec::new();
            for element in here {
                let element = element as usize;
                let mut seen = 0;
                let candidates: &mut dyn Iterator<Item = usize> = match step.axis {
                    Axis::Descendants => &mut self.below(element),
                    Axis::Children => &mut self.children(element),
                    Axis::Within => &mut std::iter::once(element).chain(self.below(element)),
                    Axis::Itself => &mut std::iter::once(element),
                    Axis::Parent => {
                        let parent = self.parent(element);
                        seen += ELEMENT * element.saturating_sub(parent.unwrap_or(0)) as u64;
                        &mut parent.into_iter()
                    }
                };
                let mut kept = Vec::new();
                for candidate in candidates {
                    seen += ELEMENT;
                    if seen >= 1024 && !affords(std::mem::take(&mut seen)) {
                        return None;
                    }
                    if step.name == "*" || self.name(candidate) == step.name {
                        kept.push(candidate as u32);
                    }
                }
                if !affords(seen + 1) {
                    return None;
                }
                for test in &step.tests {
                    kept = self.kept(kept, test, affords)?;
                }
                next.append(&mut kept);
                if next.len() > 2 * most {
                    tidy(&mut next, most);
                }
            }
            tidy(&mut next, most);
            here = next;
        }
        Some(here)
    }

    fn kept(&self, list: Vec<u32>, test: &Test, affords: &mut dyn FnMut(u64) -> bool) -> Option<Vec<u32>> {
        match test {
            Test::Place(relation, n) => {
                let here = |place: usize| relation.holds((place + 1) as f64, *n);
                let places = list.iter().enumerate().filter(|(place, _)| here(*place));
                return Some(places.map(|(_, at)| *at).collect());
            }
            Test::Last => return Some(list.last().copied().into_iter().collect()),
            Test::Has(_) | Test::Compares(..) => {}
        }
        let (part, wanted) = match test {
            Test::Compares(part, relation, value) => (part, Some((*relation, value))),
            Test::Has(part) => (part, None),
            Test::Place(..) | Test::Last => return Some(list),
        };
        let suits = |text: &str| wanted.is_none_or(|(relation, value)| value.compares(text, relation));
        let comparing = wanted.map_or(0, |(_, value)| value.bytes() as u64 / BYTES_A_STEP);
        let mut kept = Vec::new();
        for at in list {
            let element = at as usize;
            let mut steps = 1;
            let holds = match part {
                Part::Attribute(name) => self.attributes(element).any(|(n, v)| {
                    steps += ELEMENT;
                    n == name && suits(v)
                }),
                Part::Child(name) => self.children(element).any(|c| {
                    steps += ELEMENT + comparing;
                    self.name(c) == name && suits(self.text(c))
                }),
                Part::Text => {
                    steps += comparing;
                    suits(self.text(element))
                }
            };
            if holds {
                kept.push(at);
            }
            if !affords(steps) {
                return None;
            }
        }
        Some(kept)
    }
}

/// Sorts elements, removes duplicates, and cuts off those beyond the maximum.
pub(super) fn tidy(list: &mut Vec<u32>, most: usize) {
    list.sort_unstable();
    list.dedup();
    list.truncate(most);
}
