//! Transfer curves: from linear values to the integers in an image file.
//!
//! Only correctly rounded operations are used (no `powf`), so that the same values give the same bytes on
//! every machine.

use std::sync::LazyLock;

/// How a linear value becomes a fraction of the largest stored integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// The piecewise curve of IEC 61966-2-1, for colors that people look at.
    Srgb,
    /// The value itself, for masks, distances and other numbers that are not light.
    Linear,
}

impl Transfer {
    /// The integer in `0..=max` that stores `linear`: clamped to 0..=1, through the curve, halves rounded up.
    /// NaN is stored as 0.
    pub fn quantize(self, linear: f32, max: u16) -> u16 {
        let clamped = f64::from(linear).clamp(0.0, 1.0);
        let encoded = match self {
            Self::Srgb => srgb_from_linear(clamped),
            Self::Linear => clamped,
        };
        // The cast truncates, which is the floor here, and turns NaN into 0.
        (encoded * f64::from(max) + 0.5) as u16
    }

    /// The byte that stores `linear`: [`quantize`](Self::quantize) with 255, many times as fast.
    pub fn byte(self, linear: f32) -> u8 {
        match self {
            Self::Srgb => SRGB_BYTES.of(linear),
            Self::Linear => self.quantize(linear, 255) as u8,
        }
    }
}

/// The bytes of the sRGB curve, as ranges of linear values.
static SRGB_BYTES: LazyLock<SrgbBytes> = LazyLock::new(SrgbBytes::new);

struct SrgbBytes {
    /// The smallest value that is stored as each byte.
    least: [f32; 256],
    /// The byte of the smallest value of each bucket: values with the same upper half of their bits.
    first: Vec<u8>,
}

/// Bits that the values of a bucket do not share. A bucket spans at most two bytes or so.
const BUCKET_BITS: u32 = 16;

impl SrgbBytes {
    fn new() -> SrgbBytes {
        let mut least = [0.0; 256];
        let end = 1.0_f32.to_bits();
        // The bits of positive floats are in the order of their values.
        let mut from = 0;
        for (byte, least) in (0..).zip(&mut least) {
            let (mut low, mut high) = (from, end);
            while low < high {
                let middle = low.midpoint(high);
                let is_enough = Transfer::Srgb.quantize(f32::from_bits(middle), 255) >= byte;
                if is_enough { high = middle } else { low = middle + 1 }
            }
            *least = f32::from_bits(low);
            from = low;
        }
        let first = |bucket: u32| {
            let value = f32::from_bits(bucket << BUCKET_BITS);
            (least.partition_point(|least| *least <= value).max(1) - 1) as u8
        };
        SrgbBytes { least, first: (0..=end >> BUCKET_BITS).map(first).collect() }
    }

    fn of(&self, linear: f32) -> u8 {
        // NaN is not above 0.
        let clamped = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
        let bucket = (clamped.to_bits() >> BUCKET_BITS) as usize;
        let mut byte = self.first.get(bucket).copied().unwrap_or(u8::MAX);
        while byte < u8::MAX && self.least.get(usize::from(byte) + 1).is_some_and(|next| clamped >= *next) {
            byte += 1;
        }
        byte
    }
}

/// The sRGB encoding of a value in 0..=1.
fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        return 12.92 * linear;
    }
    // linear^(1/2.4) = (linear^(1/12))^5.
    let twelfth = cube_root(linear.sqrt().sqrt());
    let square = twelfth * twelfth;
    1.055 * (square * square * twelfth) - 0.055
}

/// The cube root of a value in 0.2..=1, to the last bits of an `f64`: Newton's method from a fixed start,
/// which converges in five steps on this interval.
fn cube_root(value: f64) -> f64 {
    let mut root = 0.8;
    for _ in 0..6 {
        root = (2.0 * root + value / (root * root)) / 3.0;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_agrees_with_the_defining_power() {
        for i in 0..=100_000 {
            let x = f64::from(i) / 100_000.0;
            let expected = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            assert!((srgb_from_linear(x) - expected).abs() < 4e-16 * 4.0, "{x}");
        }
    }

    #[test]
    fn ends_and_oddities() {
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            for max in [255, 65535] {
                assert_eq!(transfer.quantize(0.0, max), 0);
                assert_eq!(transfer.quantize(1.0, max), max);
                assert_eq!(transfer.quantize(-1.0, max), 0);
                assert_eq!(transfer.quantize(7.0, max), max);
                assert_eq!(transfer.quantize(f32::NAN, max), 0);
                assert_eq!(transfer.quantize(f32::INFINITY, max), max);
                assert_eq!(transfer.quantize(f32::NEG_INFINITY, max), 0);
            }
        }
    }

    #[test]
    fn known_values() {
        assert_eq!(Transfer::Srgb.quantize(0.5, 255), 188);
        assert_eq!(Transfer::Srgb.quantize(0.18, 255), 118);
        assert_eq!(Transfer::Srgb.quantize(0.002, 255), 7);
        assert_eq!(Transfer::Linear.quantize(0.5, 255), 128, "127.5 rounds up");
        assert_eq!(Transfer::Linear.quantize(0.498, 255), 127);
    }

    /// Compares the table with the curve at these values.
    fn check_bytes(bits: impl Iterator<Item = u32>) {
        for value in bits.map(f32::from_bits) {
            assert_eq!(
                u16::from(Transfer::Srgb.byte(value)),
                Transfer::Srgb.quantize(value, 255),
                "{value:e}"
            );
        }
    }

    #[test]
    fn bytes_are_those_of_the_curve() {
        check_bytes((0..=u32::MAX).step_by(9973));
        // Around each place where the byte changes, and where buckets meet.
        let places = SRGB_BYTES.least.iter().map(|value| value.to_bits());
        let places = places.chain((0..=0x3f80).map(|bucket| bucket << BUCKET_BITS));
        check_bytes(places.flat_map(|at| at.saturating_sub(3)..=at + 3));
    }

    /// Run it with `cargo test --release -p osl-image all_bytes -- --ignored`.
    #[test]
    #[ignore = "takes ten seconds"]
    fn all_bytes_are_those_of_the_curve() {
        check_bytes(0..=1.0_f32.to_bits());
    }

    #[test]
    fn encoding_never_decreases() {
        let codes: Vec<u16> =
            (0..=65535_u32).map(|i| Transfer::Srgb.quantize(i as f32 / 65535.0, 65535)).collect();
        assert!(codes.is_sorted());
    }
}
