//! What an editor shows of a shader, in the types of the language server protocol.
//!
//! A [`Page`] is one text with its analysis. Each question of the protocol is a method of it, in a module of
//! its own: [`Page::diagnostics`], [`Page::hover`], [`Page::completion`] and so on. Everything that a page
//! must ask comes from a [`World`]: how to check a text, and which address a file has. This crate must not
//! know transports, files or settings; it uses only the public interface of the crate `osl`.
//!
//! Texts are scanned ([`scan`]) besides being analysed, because an editor also asks about texts in the middle
//! of a change: brackets, comments and the words before the cursor are there whatever the grammar says.

mod actions;
mod colors;
mod complete;
mod diagnostics;
mod fields;
mod format;
mod hints;
mod hover;
mod macros;
mod navigate;
mod outline;
mod page;
mod rename;
pub mod scan;
mod signature;
mod text;
mod tokens;
mod words;

pub use colors::presentations;
pub use format::spaces_between;
pub use hints::Hints;
pub use navigate::Target;
pub use page::{Page, World};
pub use text::Text;
pub use tokens::legend;
