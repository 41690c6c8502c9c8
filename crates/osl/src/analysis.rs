//! The analysis of a text, for editors: everything that is known of it, with or without errors.

use crate::diagnostic::{self, Diagnostic};
use crate::files::{Files, Includes};
use crate::implied::{self, Implied};
use crate::stages::{self, Checked};
use crate::{Error, Levels, ReadOptions, Shader, Symbols};
use osl_hir::lint::{self, Level};
use osl_limits::Limits;
use osl_syntax::source::SourceMap;
use std::fmt;

/// A text that was read and checked.
///
/// ```
/// use osl::{Analysis, Levels, NoFiles, ReadOptions, Severity};
///
/// let text = "shader a(output float o = 0) { float x = 1; o = v; }";
/// let analysis = Analysis::of("a.osl", text, &NoFiles, &ReadOptions::default());
/// let found = analysis.diagnostics(&Levels::default());
/// assert_eq!((found[0].name, found[0].severity), ("unused-variable", Severity::Warning));
/// assert_eq!(found[0].line_column(), (1, 38));
/// assert!(analysis.diagnostics(&Levels::default().allow("unused-variable")).is_empty());
/// let shader = analysis.shader()?;
/// # Ok::<(), osl::Error>(())
/// ```
pub struct Analysis {
    checked: Checked,
    limits: Limits,
}

impl Analysis {
    /// Reads and checks a text. `name` is the file name in diagnostics; a name that ends in `.oso` means that
    /// the text is a compiled shader. Never fails: every problem becomes a diagnostic.
    pub fn of(name: &str, text: &str, files: &dyn Files, options: &ReadOptions) -> Analysis {
        let checked = stages::check(name, text, &Includes(files), &options.inner());
        Analysis { checked, limits: options.limits.clone() }
    }

    /// The analysis of a text that was checked by [`stages::check`], with limits for its lints.
    pub fn of_checked(checked: Checked, limits: &Limits) -> Analysis {
        Analysis { checked, limits: limits.clone() }
    }

    /// What was checked, for [`stages`].
    pub fn checked(&self) -> &Checked {
        &self.checked
    }

    /// Whether the text has errors.
    pub fn has_errors(&self) -> bool {
        self.checked.program.is_none()
    }

    /// Errors and warnings, in the order of the stages that found them, followed by lints. Lints are examined
    /// only in a text without errors. `levels` decide which warnings are hidden, and which are errors.
    pub fn diagnostics(&self, levels: &Levels) -> Vec<Diagnostic> {
        let Analysis { checked, limits } = self;
        let severe = |lint: &lint::Lint| !levels.only_severe || lint.level == Level::Always;
        let list: Vec<_> =
            stages::judge(checked, levels, severe, limits).into_iter().map(|(d, _)| d).collect();
        diagnostic::diagnostics(&list, &checked.sources)
    }

    /// The symbols of the text and the types of its expressions, also of a text with errors. A compiled
    /// shader has none.
    pub fn symbols(&self) -> Symbols {
        Symbols::of(&self.checked, &self.limits)
    }

    /// What the compiler adds to the text: conversions and the choice of overloads. Nothing of a text with
    /// errors.
    ///
    /// ```
    /// use osl::{Analysis, Implied, NoFiles, ReadOptions};
    ///
    /// let text = "shader a(int n = 1, output float o = 0) { o = n; }";
    /// let implied = Analysis::of("a.osl", text, &NoFiles, &ReadOptions::default()).implied();
    /// let [Implied::Conversion { range, to }] = &implied[..] else { panic!("{implied:?}") };
    /// assert_eq!((range.start.offset, to.as_str()), (46, "float"));
    /// ```
    pub fn implied(&self) -> Vec<Implied> {
        implied::of(&self.checked)
    }

    /// The byte of the main file at a position as the language server protocol counts: line and UTF-16 code
    /// unit, both from 0. A position after the end of a line is its end; `None` if there is no such line.
    pub fn offset(&self, line: u32, utf16: u32) -> Option<usize> {
        let file = self.checked.sources.files().first()?;
        let (start, text) = (file.line_start(line.checked_add(1)?)?, file.line(line + 1)?);
        let mut units = 0;
        let before = text.char_indices().find(|(_, c)| {
            units += c.len_utf16() as u32;
            units > utf16
        });
        Some(start + before.map_or(text.len(), |(at, _)| at))
    }

    /// The texts that were read: names and contents. The first is the main file, and included files follow.
    pub fn files(&self) -> impl Iterator<Item = (&str, &str)> {
        self.checked.sources.files().iter().map(|file| (file.name.as_str(), &*file.text))
    }

    /// The shader.
    ///
    /// # Errors
    /// The text has errors.
    pub fn shader(self) -> Result<Shader, Error> {
        let Checked { program, sources, diagnostics, .. } = self.checked;
        match program {
            Some(program) => Ok(Shader::new(program, sources, &diagnostics)),
            None => Err(Error::of(&diagnostics, &sources)),
        }
    }
}

/// A source text in the one style of the formatter: only white space between tokens changes.
///
/// ```
/// let text = osl::format("a.osl", "shader a(float x=1){float y=x*2;}", &osl::Limits::default())?;
/// assert_eq!(text, "shader a(float x = 1) {\n    float y = x * 2;\n}\n");
/// # Ok::<(), osl::Error>(())
/// ```
///
/// # Errors
/// The text has invalid tokens, or strings, comments, conditionals or brackets without an end. Other errors
/// do not matter; check them with [`Analysis`] first.
pub fn format(name: &str, text: &str, limits: &Limits) -> Result<String, Error> {
    osl_syntax::format::format_within(name, text, limits).map_err(|list| {
        let mut sources = SourceMap::default();
        let _ = sources.add(name, text.into());
        Error::of(&list, &sources)
    })
}

impl fmt::Debug for Analysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Analysis").field("diagnostics", &self.checked.diagnostics).finish_non_exhaustive()
    }
}
