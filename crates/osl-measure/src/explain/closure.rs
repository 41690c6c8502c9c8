//! Closures as text: `0.5 * diffuse(N = …)`.
//!
//! A closure has no value that could be printed; its text follows the nodes that made it. This module must
//! not know lines.

use super::show::show;
use crate::trace::{Node, NodeId, Trace, What};
use osl_ir::ir::{Const, Kernel, LaneOp};

/// The longest text; the rest of a sum of very many terms is cut.
const MAX_TEXT: usize = 2_000;
/// The largest number of nested terms.
const MAX_DEPTH: usize = 100;

/// The closure of a node, as a run has it.
pub(super) fn text(id: NodeId, trace: &Trace) -> String {
    let mut out = String::new();
    write(id, trace, MAX_DEPTH, &mut out);
    if out.is_empty() { "null".to_string() } else { out }
}

fn write(id: NodeId, trace: &Trace, depth: usize, out: &mut String) {
    if out.len() > MAX_TEXT || depth == 0 {
        if !out.ends_with('…') {
            out.push('…');
        }
        return;
    }
    let node = trace.node(id);
    if node.strict == Some(Const::Null) {
        return;
    }
    let inner = |id: NodeId, out: &mut String| write(id, trace, depth - 1, out);
    match (&node.what, &node.args[..]) {
        (What::Kernel(kernel, _), args) => match (&**kernel, args) {
            (Kernel::ClosureSum, [a, b]) => {
                inner(*a, out);
                let middle = out.len();
                inner(*b, out);
                if middle > 0 && out.len() > middle {
                    out.insert_str(middle, " + ");
                }
            }
            (Kernel::ClosureScale, [closure, by]) => {
                let mut term = String::new();
                inner(*closure, &mut term);
                if term.is_empty() {
                    return;
                }
                let by = trace.node(*by).strict.as_ref().map_or_else(String::new, show);
                let term = if term.contains(" + ") { format!("({term})") } else { term };
                out.push_str(&format!("{by} * {term}"));
            }
            (Kernel::Component { name, shapes }, args) => {
                let mut parts = Vec::new();
                let mut rest = args.iter();
                // Parameters of the language's closures have names; those that a renderer adds have none.
                let fixed = shapes.iter().filter(|shape| shape.key.is_none()).count();
                let mut names = osl::reference::parameter_names(name, fixed).into_iter();
                for shape in shapes {
                    let values: Vec<String> = rest
                        .by_ref()
                        .take(shape.count as usize)
                        .map(|id| argument(*id, trace, depth))
                        .collect();
                    let value = match &values[..] {
                        [one] => one.clone(),
                        several => format!("{{{}}}", several.join(", ")),
                    };
                    match &shape.key {
                        // Built-in closures have a label, also where the source gives none.
                        Some(key) if &**key == "label" && value == "\"\"" => {}
                        Some(key) => parts.push(format!("{key} = {value}")),
                        None => match names.next().filter(|name| !name.is_empty()) {
                            Some(key) => parts.push(format!("{key} = {value}")),
                            None => parts.push(value),
                        },
                    }
                }
                out.push_str(&format!("{name}({})", parts.join(", ")));
            }
            _ => {}
        },
        (What::Lane(LaneOp::KChoose), [cond, yes, no]) => {
            let truth = matches!(trace.node(*cond).strict, Some(Const::Int(n)) if n != 0);
            inner(if truth { *yes } else { *no }, out);
        }
        // The value is the last argument, or the one before it where the arithmetics differ.
        (What::Element, [.., value]) => inner(*value, out),
        (What::Meet, [.., strict, _]) => inner(*strict, out),
        _ => {}
    }
}

fn argument(id: NodeId, trace: &Trace, depth: usize) -> String {
    let node: &Node = trace.node(id);
    if matches!(node.exact, Some(crate::trace::Exact::Closure(_))) {
        let mut out = String::new();
        write(id, trace, depth - 1, &mut out);
        return if out.is_empty() { "null".to_string() } else { out };
    }
    node.strict.as_ref().map_or_else(String::new, show)
}
