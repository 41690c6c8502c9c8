//! Runs the examples in the documentation of this crate.

use crate::shader::walk;
use crate::value::Value;
use osl_hir::hir::Global;
use osl_hir::resolve::resolve_parsed;
use osl_syntax::{NoFiles, Options};

/// What a shader with this body prints at a point whose globals are 0; behind it, what it reports, each on a
/// line of its own. For a body without a meaning, the reason.
///
/// ```
/// assert_eq!(osl_walker::printed(r#"printf("%d", 1 + 1);"#), "2");
/// assert_eq!(osl_walker::printed("int x = zero;"), "variable `zero` is not declared");
/// ```
pub fn printed(body: &str) -> String {
    let options = Options::default();
    let parsed =
        osl_syntax::parse("example.osl", &format!("shader example() {{ {body} }}"), &NoFiles, &options);
    let resolved = resolve_parsed(&parsed, options.reports, &options.limits);
    let Ok(program) = resolved.program else {
        let all = parsed.diagnostics.iter().chain(&resolved.diagnostics);
        return all.map(|diagnostic| diagnostic.message.as_str()).collect::<Vec<_>>().join("\n");
    };
    let zero = |global| match global {
        Global::U | Global::V | Global::Time | Global::Dtime => Value::Float(0.0),
        _ => Value::Triple([0.0; 3]),
    };
    match walk(&program, &zero) {
        Ok(outcome) => outcome.printed + &Vec::from_iter(outcome.messages).join("\n"),
        Err(error) => error.to_string(),
    }
}
