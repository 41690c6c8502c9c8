//! The symbols of a text: what an editor shows for a name, where it is declared, and where it is used.

use crate::diagnostic::{Range, range};
use crate::stages::{self, Checked};
use osl_hir::symbols as inner;
#[doc(inline)]
pub use osl_hir::symbols::SymbolKind;
use osl_limits::Limits;
use osl_syntax::span::Span;

/// A name with everything that is known about it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Symbol {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// The declaration on one line, without values: `float f(color, output int)`, `vector v`, `struct slot`.
    pub text: String,
    /// The name in the declaration; `None` for globals and built-in functions, which
    /// [`reference`](mod@crate::reference) describes.
    pub declared: Option<Range>,
    /// The name where it is used, in order of position. A use within a macro has the location of the macro.
    pub uses: Vec<Range>,
}

/// The symbols of a text, and the types of its expressions. A text with errors has the symbols that could be
/// bound.
///
/// ```
/// use osl::{Analysis, NoFiles, ReadOptions};
///
/// let text = "shader a(float size = 1, output float o = 0) { o = size * noise(P); }";
/// let symbols = Analysis::of("a.osl", text, &NoFiles, &ReadOptions::default()).symbols();
/// let at = text.find("size *").unwrap();
/// let size = symbols.at(at).ok_or("no symbol")?;
/// assert_eq!((size.text.as_str(), size.uses.len()), ("float size", 1));
/// assert_eq!(symbols.type_at(text.find("P)").unwrap()).as_deref(), Some("point"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug)]
pub struct Symbols {
    inner: inner::Symbols,
    list: Vec<Symbol>,
}

impl Symbols {
    pub(crate) fn of(checked: &Checked, limits: &Limits) -> Symbols {
        let inner = stages::symbols(checked, limits);
        let place = |span: Span| range(span, &checked.sources);
        let symbol = |s: &inner::Symbol| Symbol {
            name: s.name.to_string(),
            kind: s.kind,
            text: s.text.clone(),
            declared: s.declared.and_then(place),
            uses: s.uses.iter().filter_map(|span| place(*span)).collect(),
        };
        let list = inner.list().iter().map(symbol).collect();
        Symbols { inner, list }
    }

    /// All symbols: declared ones in order of their declarations, then used globals and built-in functions.
    pub fn list(&self) -> &[Symbol] {
        &self.list
    }

    /// The symbol whose name is at a byte of the main file.
    pub fn at(&self, offset: usize) -> Option<&Symbol> {
        let found = self.inner.at(u32::try_from(offset).ok()?)?;
        let index = self.inner.list().iter().position(|symbol| std::ptr::eq(symbol, found))?;
        self.list.get(index)
    }

    /// The signature that was chosen for the built-in function whose name is at a byte of the main file, with
    /// the names of its parameters: the text of one of the [signatures](crate::reference::Signature::text).
    pub fn signature_at(&self, offset: usize) -> Option<String> {
        self.inner.signature_at(u32::try_from(offset).ok()?)
    }

    /// The type of the innermost expression at a byte of the main file, or of the variable or field that is
    /// declared there, as written in the language; `None` if there is none, or if an error hides it.
    pub fn type_at(&self, offset: usize) -> Option<String> {
        self.inner.type_at(u32::try_from(offset).ok()?).map(|ty| self.inner.show(ty))
    }
}
