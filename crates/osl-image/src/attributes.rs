//! The metadata of an image file: values by name, under the names that texture tools use.
//!
//! A file may have any number of them, so both their number and their size are bounded. This module must not
//! know formats.

use osl_limits::Images;

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Integers; a single one is a list of one.
    Ints(Vec<i32>),
    /// Floats; a single one is a list of one.
    Floats(Vec<f32>),
    /// Three floats that form a unit, such as a vector.
    Triple([f32; 3]),
    /// A matrix, row by row.
    Matrix([f32; 16]),
    /// Text.
    Text(String),
}

/// The attributes of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Attributes {
    list: Vec<(String, Attribute)>,
    /// Maximum number of attributes, and maximum length of each.
    most: (u64, u64),
}

impl Default for Attributes {
    fn default() -> Self {
        Self::within(&Images::default())
    }
}

impl Attributes {
    /// No attributes, with the bounds from the limits.
    pub(crate) fn within(limits: &Images) -> Self {
        Self { list: Vec::new(), most: (limits.attributes, limits.attribute_length) }
    }

    /// Approximate size in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let of = |(name, value): &(String, Attribute)| {
            let own = match value {
                Attribute::Ints(list) => list.len() * 4,
                Attribute::Floats(list) => list.len() * 4,
                Attribute::Text(text) => text.len(),
                Attribute::Triple(_) | Attribute::Matrix(_) => 0,
            };
            (name.len() + own + size_of::<(String, Attribute)>()) as u64
        };
        self.list.iter().map(of).sum()
    }

    /// The attribute with a name, ignoring case.
    pub fn get(&self, name: &str) -> Option<&Attribute> {
        self.list.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| value)
    }

    /// The text of an attribute, if it is a text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.get(name)? {
            Attribute::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The numbers of an attribute, which is either a text with commas or a list of floats.
    pub(crate) fn numbers(&self, name: &str) -> Option<Vec<f32>> {
        match self.get(name)? {
            Attribute::Text(text) => text.split(',').map(|word| word.trim().parse().ok()).collect(),
            Attribute::Floats(list) => Some(list.clone()),
            _ => None,
        }
    }

    /// Sets an attribute, unless there are too many or it is too large.
    pub(crate) fn set(&mut self, name: impl Into<String>, value: Attribute) {
        let name = name.into();
        let length = match &value {
            Attribute::Ints(list) => list.len(),
            Attribute::Floats(list) => list.len(),
            Attribute::Text(text) => text.len(),
            Attribute::Triple(_) | Attribute::Matrix(_) => 0,
        };
        if length.max(name.len()) as u64 > self.most.1 {
            return;
        }
        if let Some((_, old)) = self.list.iter_mut().find(|(known, _)| known.eq_ignore_ascii_case(&name)) {
            *old = value;
        } else if (self.list.len() as u64) < self.most.0 {
            self.list.push((name, value));
        }
    }

    pub(crate) fn set_text(&mut self, name: &str, text: impl Into<String>) {
        self.set(name, Attribute::Text(text.into()));
    }

    pub(crate) fn set_int(&mut self, name: &str, value: i32) {
        self.set(name, Attribute::Ints(vec![value]));
    }

    pub(crate) fn set_float(&mut self, name: &str, value: f32) {
        self.set(name, Attribute::Floats(vec![value]));
    }

    pub(crate) fn remove(&mut self, name: &str) {
        self.list.retain(|(known, _)| !known.eq_ignore_ascii_case(name));
    }

    /// Moves the `oiio:NAME=VALUE` entries that texture tools write into a description out of it. They become
    /// attributes; the rest stays the description.
    pub(crate) fn take_from_description(&mut self) {
        let Some(text) = self.text("ImageDescription").map(str::to_owned) else { return };
        let mut rest = Vec::new();
        for word in text.split_whitespace() {
            let pair = word.split_once('=');
            match pair.filter(|(name, _)| {
                ["AverageColor", "ConstantColor", "SHA-1"].contains(&name.trim_start_matches("oiio:"))
            }) {
                Some((name, value)) => {
                    self.set_text(&format!("oiio:{}", name.trim_start_matches("oiio:")), value);
                }
                None => rest.push(word),
            }
        }
        if rest.is_empty() {
            self.remove("ImageDescription");
        } else if rest.len() < text.split_whitespace().count() {
            self.set_text("ImageDescription", rest.join(" "));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_hold_colors() {
        let mut attributes = Attributes::default();
        attributes
            .set_text("ImageDescription", "a  cup oiio:ConstantColor=0.1,1 SHA-1=AB oiio:AverageColor=x");
        attributes.take_from_description();
        assert_eq!(attributes.text("imagedescription"), Some("a cup"));
        assert_eq!(attributes.numbers("oiio:ConstantColor"), Some(vec![0.1, 1.0]));
        assert_eq!(attributes.text("oiio:SHA-1"), Some("AB"));
        assert_eq!(attributes.numbers("oiio:AverageColor"), None);
    }

    #[test]
    fn number_and_size_are_bounded() {
        let mut attributes = Attributes::default();
        for i in 0..3000 {
            attributes.set_int(&format!("a{i}"), i);
        }
        attributes.set_text("A5", "again");
        attributes.set_text("a6", "x".repeat((1 << 16) + 1));
        assert_eq!(attributes.list.len(), 1024);
        assert_eq!(attributes.text("a5"), Some("again"));
        assert_eq!(attributes.get("a6"), Some(&Attribute::Ints(vec![6])));
    }
}
