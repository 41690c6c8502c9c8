//! The layer that shows the work that each pixel takes.

use super::samples::Counted;
use crate::cli::picture::compare::color;
use osl_exec::{Frame, STEPS};

/// The picture of the steps of each pixel; none if they were not counted.
pub(super) fn shown(frame: &Frame) -> Option<Counted> {
    let plane = frame.planes.last().filter(|plane| &*plane.output == STEPS)?;
    let steps = || plane.words.iter().map(|word| f64::from(*word));
    let (least, most) = (steps().fold(f64::INFINITY, f64::min), steps().fold(0.0, f64::max));
    let mean = steps().sum::<f64>() / plane.words.len().max(1) as f64;
    let samples = steps().flat_map(|x| color(x, most.max(1.0))).map(|x| (x * 255.0).round() as u8).collect();
    let words = if least < most {
        format!(
            "the work of each pixel, from black (none) over purple, red and yellow to white ({most} steps): at least \
             {least}, on average {mean:.0}; `--steps` writes them"
        )
    } else {
        format!("the work of each pixel is {most} steps; `--steps` writes them")
    };
    Some(Counted { samples, words })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use osl_exec::Plane;
    use osl_ir::ir::Kind;
    use osl_ir::types::Type;

    #[test]
    fn the_most_expensive_pixel_is_white() {
        let plane = |words: Vec<u32>| Plane {
            output: STEPS.into(),
            ty: Type::INT,
            component: 0,
            kind: Kind::Int,
            words: words.into(),
            wide: Vec::new(),
        };
        let frame = |words| Frame { planes: vec![plane(words)], ..Frame::default() };
        let found = shown(&frame(vec![0, 30, 60])).unwrap();
        assert_eq!((&found.samples[..3], &found.samples[6..]), (&[0; 3][..], &[255; 3][..]));
        assert!(found.words.contains("white (60 steps): at least 0, on average 30"), "{}", found.words);
        assert!(shown(&frame(vec![7, 7])).unwrap().words.contains("each pixel is 7 steps"));
        assert!(shown(&Frame::default()).is_none());
    }
}
