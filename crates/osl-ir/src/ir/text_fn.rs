//! The functions of strings that a body can call. [`text`](crate::text) computes them.

use super::Kind;

/// A function of strings without effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextFn {
    /// Two to six strings joined.
    Concat,
    /// Length in bytes.
    Length,
    /// String, start (from the end where negative), length.
    Substring,
    /// String, offset: the byte as a signed number, 0 outside.
    Character,
    /// String, prefix.
    StartsWith,
    /// String, suffix.
    EndsWith,
    /// The int at the start of a string; 0 if there is none.
    ToInt,
    /// The float at the start of a string; 0 if there is none.
    ToFloat,
    /// The hash of a string.
    Hash,
}

impl TextFn {
    /// Kind of the result.
    pub fn result(self) -> Kind {
        match self {
            TextFn::Concat | TextFn::Substring => Kind::Str,
            TextFn::ToFloat => Kind::Float,
            TextFn::Length
            | TextFn::Character
            | TextFn::StartsWith
            | TextFn::EndsWith
            | TextFn::ToInt
            | TextFn::Hash => Kind::Int,
        }
    }

    /// The name in the text of the IR.
    pub fn text(self) -> &'static str {
        match self {
            TextFn::Concat => "concat",
            TextFn::Length => "strlen",
            TextFn::Substring => "substr",
            TextFn::Character => "getchar",
            TextFn::StartsWith => "startswith",
            TextFn::EndsWith => "endswith",
            TextFn::ToInt => "stoi",
            TextFn::ToFloat => "stof",
            TextFn::Hash => "hash",
        }
    }
}
