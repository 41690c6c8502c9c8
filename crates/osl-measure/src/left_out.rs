//! What no tool of this crate examines: it is said in the first line of a report.

use osl_ir::ir::{Body, Kernel, Kind, Op};
use osl_ir::types::Base;

/// What is not examined of a lowered program, in words: strings, and parameters of closures that are no
/// numbers.
pub(crate) fn left_out(body: &Body) -> Vec<String> {
    let strings = body.outputs.iter().filter(|output| output.ty.base == Base::String);
    let mut all: Vec<String> = strings.map(|output| format!("the string `{}`", output.name)).collect();
    let constants: Vec<_> = body.constants().map(|(value, _)| value).collect();
    let closes = body.outputs.iter().any(|output| output.ty.base == Base::Closure);
    for inst in body.insts().filter(|_| closes) {
        let Op::Kernel(Kernel::Component { name, .. }, args) = &inst.op else { continue };
        for (at, arg) in args.iter().enumerate().filter(|(_, arg)| !constants.contains(arg)) {
            let what = match body.kind(*arg) {
                Kind::Int => "an int",
                Kind::Matrix => "a matrix",
                Kind::Str => "a string",
                Kind::Float | Kind::Triple | Kind::Closure => continue,
            };
            let said = format!("argument {} of `{name}`, which is {what}", at + 1);
            if !all.contains(&said) {
                all.push(said);
            }
        }
    }
    all
}

/// The end of the first line of a report.
pub(crate) fn said(left_out: &[String]) -> String {
    if left_out.is_empty() { String::new() } else { format!("; not examined: {}", left_out.join(", ")) }
}
