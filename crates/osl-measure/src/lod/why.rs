//! Why a shader has no levels, in sentences.
//!
//! This module must not know how the tests are made.

use super::off::{Cause, Fault};
use super::search::Failed;
use super::words::{percent, samples};

/// A sentence for each kind of level that was tried. `count` is the number of samples that levels are
/// compared with.
pub(super) fn sentences(failed: &[Failed], outputs: &[String], count: u32) -> Vec<String> {
    failed.iter().map(|failed| sentence(failed, (outputs, count))).collect()
}

fn sentence(failed: &Failed, compared: (&[String], u32)) -> String {
    match failed {
        Failed::NoMean(name) => {
            format!("all outputs: `{name}` is no number and no triple, so it has no mean")
        }
        Failed::Cheap => {
            "all outputs: the shader costs no more than the test of how large a pixel is".to_string()
        }
        Failed::Outputs(fault) => format!("all outputs by their means: {}", reason(fault, compared)),
        Failed::Linear(fault) => {
            format!("all outputs by their means or linear forms: {}", reason(fault, compared))
        }
        Failed::NoStatements => {
            "single values: no statement outside of loops computes a float or a triple".to_string()
        }
        Failed::NoGain => "single values: their means would save too little".to_string(),
        Failed::Value(name, fault, others) => {
            let rest = match others {
                0 => String::new(),
                1 => "; one other value fails too".to_string(),
                n => format!("; {n} other values fail too"),
            };
            format!("single values: with the mean of `{name}`, {}{rest}", reason(fault, compared))
        }
        Failed::Written(fault) => format!("the written shader: {}", reason(fault, compared)),
    }
}

fn reason(fault: &Fault, (outputs, count): (&[String], u32)) -> String {
    let Fault { cause, output, footprint, shares } = fault;
    let name = outputs.get(*output).map_or("", String::as_str);
    let [own, other] = shares.map(percent);
    let original = format!("{} of the original", samples(count));
    match cause {
        Cause::Larger => format!(
            "`{name}` has a larger error at footprint {footprint}: {own}, and {other} with {original}"
        ),
        Cause::Unsure => format!(
            "the error of `{name}` at footprint {footprint} is not certain to be smaller: {own}, and {other} \
             with {original}"
        ),
        Cause::Shifted => format!(
            "the mean of `{name}` over the picture would be off by {own} at footprint {footprint}; {other} is \
             within the tolerance and chance"
        ),
        Cause::Unlike => format!(
            "a pixel of the given image would be off by {own} in `{name}` at footprint {footprint}, and no pixel \
             elsewhere by more than {other}: the shader does not look the same everywhere"
        ),
    }
}
