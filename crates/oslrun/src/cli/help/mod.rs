//! Commands that explain: the language, its errors, and the command itself.

pub(super) mod doc;
pub(super) mod explain_error;
pub(super) mod misspelt;
pub(super) mod pages;
pub mod reference;

pub(super) mod version;
