//! The headers that come with the compiler: the text of each, by name.
//!
//! They are found last, after every file of the provider, as if their folder were at the end of the search
//! path.

/// The name of the header that is read before the first line of every shader.
pub(super) const STANDARD: &str = "stdosl.h";

macro_rules! headers {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../../../osl/", $name)))),*]
    };
}

const HEADERS: &[(&str, &str)] = headers! {
    "stdosl.h" "color2.h" "color4.h" "matrix33.h" "oslutil.h" "vector2.h" "vector4.h"
};

/// The names of the headers.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    HEADERS.iter().map(|(name, _)| *name)
}

/// The text of a header, if the compiler has one with this name.
pub(super) fn text(name: &str) -> Option<&'static str> {
    HEADERS.iter().find(|(of, _)| *of == name).map(|(_, text)| *text)
}
