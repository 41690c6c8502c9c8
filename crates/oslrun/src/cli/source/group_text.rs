//! Writes a group as text, in the form that `osl_lower::group::text` reads.

use osl_ir::ir::Const;
use osl_lower::group::{Connection, Group, Layer};
use osl_lower::params;

/// The text of a group: before each layer its values, after it the connections to it. `shader` is the name
/// of a layer's shader.
pub(in crate::cli) fn serialized(group: &Group, shader: impl Fn(usize, &Layer) -> String) -> String {
    let mut text = String::new();
    for (index, layer) in group.layers().iter().enumerate() {
        let program = &layer.program;
        for (name, values) in layer.values.given(program) {
            let Some(ty) = params::type_of(program, name) else { continue };
            text += &format!("param {} {name}{}", program.structs.show(ty), words(values));
            if layer.values.is_interpolated(name) {
                text += " [[int interpolated=1]]";
            }
            text += " ;\n";
        }
        text += &format!("shader {} {} ;\n", word(&shader(index, layer)), layer.name);
        for Connection { from, to } in group.connections().iter().filter(|c| c.to.layer == index) {
            text += &format!("connect {} {} ;\n", group.show(from), group.show(to));
        }
    }
    text
}

/// Values in the form of a group's text, each after a blank.
fn words(values: &[Const]) -> String {
    let numbers = |list: &[f32]| list.iter().map(|x| format!(" {x}")).collect::<String>();
    let text = |value: &Const| match value {
        Const::Int(n) => format!(" {n}"),
        Const::Float(x) => numbers(&[*x]),
        Const::Triple(x) => numbers(x),
        Const::Matrix(x) => numbers(&x[..]),
        Const::Str(text) => format!(" {}", quoted(text)),
        Const::Null => String::new(),
    };
    values.iter().map(text).collect()
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}

/// A name, in quotes if it needs them.
fn word(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/' | ':');
    if !name.is_empty() && name.chars().all(is_plain) { name.to_string() } else { quoted(name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_texts_are_quoted_where_the_reader_of_groups_needs_it() {
        assert_eq!(word("a-b.2"), "a-b.2");
        assert_eq!(word("two words"), "\"two words\"");
        assert_eq!(quoted("a\\b\"c\nd"), r#""a\\b\"c\nd""#);
        let values =
            [Const::Float(0.1), Const::Int(-2), Const::Triple([1.0, 0.5, 1e-7]), Const::Str("x y".into())];
        assert_eq!(words(&values), " 0.1 -2 1 0.5 0.0000001 \"x y\"");
    }
}
