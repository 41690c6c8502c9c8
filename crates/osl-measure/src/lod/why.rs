//! Why a shader has no levels, in sentences.

use super::errors::{Cause, Fault};
use super::ground::Sides;
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
        Failed::Written(fault) => format!("the written shader: {}", reason(fault, compared)),
    }
}

/// The sides of pixels in words.
fn shape([x, y]: Sides) -> String {
    if x == y { format!("footprint {x}") } else { format!("pixels of {x} by {y}") }
}

fn reason(fault: &Fault, (outputs, count): (&[String], u32)) -> String {
    let Fault { cause, output, sides, shares } = fault;
    let (name, at) = (outputs.get(*output).map_or("", String::as_str), shape(*sides));
    let [own, other] = shares.map(percent);
    let original = format!("{} of the original", samples(count));
    match cause {
        Cause::Larger => format!("`{name}` has a larger error at {at}: {own}, and {other} with {original}"),
        Cause::Unsure => format!(
            "the error of `{name}` at {at} is not certain to be smaller: {own}, and {other} with {original}"
        ),
        Cause::Above => {
            format!("the error of `{name}` at {at} is {own}, above the bound of {other} (--error)")
        }
        Cause::Shifted => format!(
            "the mean of `{name}` over the picture would be off by {own} at {at}; {other} is within the \
             tolerance and chance"
        ),
        Cause::Unlike => format!(
            "a pixel of the given image would be off by {own} in `{name}` at {at}, and no pixel elsewhere by \
             more than {other}: the shader does not look the same everywhere"
        ),
    }
}
