//! The values that lookups can give, wherever they look: filters only average texels, so that the smallest
//! and the largest texel of a channel bound them.

use crate::lookup::{LookupOptions, is_black_outside};
use crate::texels::{Texel, Texels};
use crate::texture::{Reach, Texture};

/// The error of a weighted mean relative to the largest texel. Each of up to 64 probes rounds once when it is
/// added, and each of 16 texels of two levels; the weights of a texel have errors of a few units in the last
/// place.
const ROUNDING: f32 = 2e-5;
/// The error of means that are denormal.
const TINY: f32 = 1e-37;

impl Texture {
    /// What lookups of `n_channels` channels give at finite coordinates, for any footprint, any finite width
    /// and any finite blur that is not negative.
    ///
    /// The options count except for interpolation, width and blur. A lookup at infinite or NaN coordinates
    /// gives 0, which may be outside. All levels are read, and computed if the file has none.
    pub fn reach(&self, n_channels: usize, options: &LookupOptions) -> [Reach; 4] {
        self.reach_of(n_channels, options, is_black_outside(self, options), true)
    }

    /// As [`Texture::reach`] for lookups by direction, in which the image has no outside.
    pub fn directional_reach(&self, n_channels: usize, options: &LookupOptions) -> [Reach; 4] {
        // Near the poles, values fade to the mean of a row by a difference, which may round below 0.
        self.reach_of(n_channels, options, false, false)
    }

    fn reach_of(
        &self,
        n_channels: usize,
        options: &LookupOptions,
        may_be_black: bool,
        is_sum: bool,
    ) -> [Reach; 4] {
        let extremes = self.extremes();
        std::array::from_fn(|i| {
            if i >= n_channels || self.width() == 0 {
                return Some([-0.0, 0.0]);
            }
            let texels = match extremes.get(options.first_channel.saturating_add(i)) {
                Some(texels) => *texels,
                None => Some([options.fill; 2]).filter(|_| options.fill.is_finite()),
            };
            let [lo, hi] = texels?;
            let (lo, hi) = if may_be_black { (lo.min(0.0), hi.max(0.0)) } else { (lo, hi) };
            let room = lo.abs().max(hi.abs()) * ROUNDING + TINY;
            let (mut least, mut most) = (lo - room, hi + room);
            // Close to the largest float, a sum or a difference may overflow.
            if !(most - least).is_finite() {
                return None;
            }
            // A sum of terms of one sign keeps that sign.
            if is_sum && lo >= 0.0 {
                least = least.max(-0.0);
            }
            if is_sum && hi <= 0.0 {
                most = most.min(0.0);
            }
            Some([least, most])
        })
    }

    /// The smallest and the largest texel of each channel, of all levels, and the color that the file states
    /// for all texels.
    fn extremes(&self) -> &[Reach] {
        self.extremes.get_or_init(|| {
            let n_channels = self.channels().len();
            let mut extremes = vec![[f32::INFINITY, f32::NEG_INFINITY]; n_channels];
            for level in std::iter::once(self.finest()).chain(self.coarser()) {
                match &level.texels {
                    Texels::U8(list) => scan(list, &mut extremes),
                    Texels::U16(list) => scan(list, &mut extremes),
                    Texels::Half(list) => scan(list, &mut extremes),
                    Texels::Float(list) => scan(list, &mut extremes),
                }
            }
            if let Some(color) = self.constant_color().and_then(|color| color.get(..n_channels)) {
                scan(color, &mut extremes);
            }
            let reach = |[lo, hi]: [f32; 2]| Some([lo, hi]).filter(|_| lo.is_finite() && hi.is_finite());
            extremes.into_iter().map(reach).collect()
        })
    }
}

/// Adds the texels of a list, pixel by pixel, to the extremes of the channels. NaN counts as infinite.
fn scan<T: Texel>(list: &[T], extremes: &mut [[f32; 2]]) {
    for pixel in list.chunks_exact(extremes.len().max(1)) {
        for ([lo, hi], texel) in extremes.iter_mut().zip(pixel) {
            let value = texel.float();
            (*lo, *hi) = match value.is_nan() {
                true => (f32::NEG_INFINITY, f32::INFINITY),
                false => (lo.min(value), hi.max(value)),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::environment;
    use crate::filter::Interp;
    use crate::footprint::Footprint;
    use crate::image::{Header, ImageData, StoredType};
    use crate::lookup::lookup_values;
    use crate::wrap::Wrap;
    use proptest::prelude::*;

    const WRAPS: [Wrap; 5] = [Wrap::File, Wrap::Black, Wrap::Clamp, Wrap::Periodic, Wrap::Mirror];

    /// A texture of random size and type: whole or a part of a larger image, and with random levels or those
    /// that are computed.
    fn texture() -> impl Strategy<Value = Texture> {
        let stored = [
            StoredType::U8,
            StoredType::U16,
            StoredType::I8,
            StoredType::I16,
            StoredType::Half,
            StoredType::Float,
        ];
        let shape = (1_usize..7, 1_usize..7, 1_usize..6, prop::sample::select(stored.to_vec()));
        let sample = prop_oneof![
            4 => 0.0_f32..1.0,
            2 => Just(0.25_f32),
            1 => -3.0_f32..40.0,
        ];
        let range = (sample.clone(), sample);
        let more = (any::<u64>(), 0_usize..5, 0_usize..5, any::<bool>(), any::<bool>(), 0_u8..3);
        (shape, range, more).prop_map(|((width, height, n, stored), (a, b), more)| {
            let (seed, s, t, is_part, has_levels, kind) = more;
            let mut state = seed | 1;
            let mut next = |of: StoredType| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let share = (state >> 40) as f32 / 16_777_216.0;
                let value = if kind == 0 { a } else { a + (b - a) * share };
                match of {
                    StoredType::U8 => (value.clamp(0.0, 1.0) * 255.0).round() / 255.0,
                    StoredType::U16 => (value.clamp(0.0, 1.0) * 65535.0).round() / 65535.0,
                    StoredType::I8 => (value.clamp(-1.0, 1.0) * 127.0).round() / 127.0,
                    StoredType::I16 => (value.clamp(-1.0, 1.0) * 32767.0).round() / 32767.0,
                    StoredType::Half => half::f16::from_f32(value).to_f32(),
                    _ => value,
                }
            };
            let samples = (0..width * height * n).map(|_| next(stored)).collect();
            let mut header = Header::default();
            if is_part {
                header.data_origin = (1, 2);
                header.display_window = Some([0, 0, width as i32 + 1, height as i32 + 2]);
            } else if has_levels {
                let (w, h) = ((width / 2).max(1), (height / 2).max(1));
                header.coarser = vec![(w, h, (0..w * h * n).map(|_| next(stored)).collect())];
            }
            let channels = (0..n).map(|i| i.to_string()).collect();
            let wraps = (WRAPS[s], WRAPS[t]);
            Texture::new(ImageData { width, height, channels, stored, wraps, n_parts: 1, header, samples })
        })
    }

    fn options() -> impl Strategy<Value = LookupOptions> {
        let interps = [Interp::Closest, Interp::Linear, Interp::Cubic, Interp::SmartCubic];
        let width = prop_oneof![Just(0.0_f32), Just(1.0), -2.0_f32..9.0];
        let blur = prop_oneof![Just(0.0_f32), 0.0_f32..0.3, 0.0_f32..50.0];
        let channels = (0_usize..6, prop_oneof![Just(0.0_f32), -2.0_f32..3.0]);
        ((0_usize..5, 0_usize..5), 0_usize..4, channels, (width.clone(), width), (blur.clone(), blur))
            .prop_map(move |((s, t), interp, (first_channel, fill), width, blur)| LookupOptions {
                wrap_s: WRAPS[s],
                wrap_t: WRAPS[t],
                interp: interps[interp],
                first_channel,
                fill,
                width,
                blur,
            })
    }

    fn is_inside(values: [f32; 4], reach: [Reach; 4]) -> bool {
        values.iter().zip(reach).all(|(x, reach)| {
            reach.is_none_or(|[lo, hi]| !x.total_cmp(&lo).is_lt() && !x.total_cmp(&hi).is_gt())
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn lookups_stay_in_reach(
            texture in texture(),
            options in options(),
            n in 1_usize..5,
            places in prop::collection::vec((-1.5_f32..2.5, -1.5_f32..2.5), 24),
            steps in prop::array::uniform4(prop_oneof![
                Just(0.0_f32), -0.01_f32..0.01, -0.6_f32..0.6, -1e9_f32..1e9, Just(f32::NAN)
            ]),
        ) {
            let reach = texture.reach(n, &options);
            let directional = texture.directional_reach(n, &options);
            let [ds_dx, dt_dx, ds_dy, dt_dy] = steps;
            let footprint = Footprint { ds_dx, dt_dx, ds_dy, dt_dy };
            for (s, t) in places {
                let found = lookup_values(&texture, s, t, &footprint, n, &options);
                prop_assert!(is_inside(found, reach), "{s} {t}: {found:?}, not in {reach:?}");
                let (to_x, to_y) = ([ds_dx, dt_dx, ds_dx], [ds_dy, ds_dy, dt_dy]);
                let direction = [s - 0.5, (t - 0.5) * 4.0, s * t];
                let found = environment(&texture, direction, to_x, to_y, n, &options);
                prop_assert!(is_inside(found, directional), "{direction:?}: {found:?}, not in {directional:?}");
            }
        }
    }

    fn float(samples: Vec<f32>) -> Texture {
        Texture::new(ImageData {
            width: samples.len(),
            height: 1,
            channels: vec!["Y".to_owned()],
            stored: StoredType::Float,
            wraps: (Wrap::File, Wrap::File),
            n_parts: 1,
            header: Header::default(),
            samples,
        })
    }

    #[test]
    fn the_reach_is_that_of_the_texels() {
        let clamped =
            LookupOptions { wrap_s: Wrap::Clamp, wrap_t: Wrap::Clamp, fill: 2.0, ..Default::default() };
        let close = |reach: Reach, lo: f32, hi: f32| {
            let [a, b] = reach.unwrap();
            assert!((a - lo).abs() < 1e-4 && (b - hi).abs() < 1e-4, "{a} {b}");
        };
        let texture = float(vec![0.25, 0.5, 0.75]);
        let reach = texture.reach(2, &clamped);
        close(reach[0], 0.25, 0.75);
        close(reach[1], 2.0, 2.0);
        assert_eq!(reach[2], Some([-0.0, 0.0]));
        // Black surrounds the image.
        close(texture.reach(1, &LookupOptions::default())[0], 0.0, 0.75);
        assert_eq!(float(vec![0.25, f32::NAN]).reach(1, &clamped)[0], None);
        assert_eq!(float(vec![0.25, f32::INFINITY]).reach(1, &clamped)[0], None);
        assert_eq!(float(vec![f32::MIN, f32::MAX]).reach(1, &clamped)[0], None);
    }
}
