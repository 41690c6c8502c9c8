//! What a file says about itself beside its pixels: values by name, under the names that texture tools use.
//!
//! A file may hold any number of them, so both their number and their size are bounded. It must not know formats.

/// The most attributes that are kept of a file.
const MAX_ATTRIBUTES: usize = 1024;

/// The longest text, and the most numbers, that are kept of an attribute.
const MAX_LENGTH: usize = 1 << 16;

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Integers; a single one is a list of one.
    Ints(Vec<i32>),
    /// Floats; a single one is a list of one.
    Floats(Vec<f32>),
    /// Three floats that belong together, as those of a vector.
    Triple([f32; 3]),
    /// A matrix, row by row.
    Matrix([f32; 16]),
    /// Text.
    Text(String),
}

/// The attributes of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    list: Vec<(String, Attribute)>,
}

impl Attributes {
    /// The attribute of a name, in capitals or not.
    pub fn get(&self, name: &str) -> Option<&Attribute> {
        self.list.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| value)
    }

    /// The text of an attribute that is one.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.get(name)? {
            Attribute::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The numbers that an attribute lists, as a text with commas or as floats.
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
        if length > MAX_LENGTH || name.len() > MAX_LENGTH {
            return;
        }
        if let Some((_, old)) = self.list.iter_mut().find(|(known, _)| known.eq_ignore_ascii_case(&name)) {
            *old = value;
        } else if self.list.len() < MAX_ATTRIBUTES {
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

    /// Takes what texture tools write as `oiio:NAME=VALUE` into a description out of it. The values become attributes,
    /// and what remains stays the description.
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
        attributes.set_text("a6", "x".repeat(MAX_LENGTH + 1));
        assert_eq!(attributes.list.len(), MAX_ATTRIBUTES);
        assert_eq!(attributes.text("a5"), Some("again"));
        assert_eq!(attributes.get("a6"), Some(&Attribute::Ints(vec![6])));
    }
}
