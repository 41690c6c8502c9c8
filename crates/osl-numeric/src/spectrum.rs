//! Colors of light with a single wavelength, and of black bodies.
//!
//! Observer: the CIE 1931 color matching functions from 380 to 780 nm in steps of 5 nm. Single precision
//! throughout, in the reference's order. Colors are in the RGB system with a number, see
//! [`super::color::SYSTEMS`].

use super::color::{ColorSystem, SYSTEMS};
use super::geometry::Triple;
use super::int::Int;
use super::real::{Number, Real, Scalar};
use super::strict;
use pxfm::f_pow;
use std::sync::{LazyLock, OnceLock};

/// Colder bodies are a faint red, and hotter ones than the table are computed; in between, a table is
/// interpolated. Kelvin.
const COLDEST: f32 = 800.0;
const HOTTEST: f32 = 12_000.0;

/// Light of one wavelength in nanometres; black outside the table.
#[inline(always)]
pub fn wavelength_color<R: Real>(nanometres: R) -> Triple<R> {
    wavelength_in(nanometres, R::Int::lit(0))
}

/// The same in another RGB system.
#[inline(always)]
pub fn wavelength_in<R: Real>(nanometres: R, system: R::Int) -> Triple<R> {
    light(
        nanometres,
        system,
        #[inline(always)]
        |x, system| {
            let at = (x - 380.0) / 5.0;
            let index = at.to_int();
            let Some([low, high]) =
                usize::try_from(index).ok().and_then(|i| MATCHING.get(i..i + 2)?.first_chunk())
            else {
                return [0.0; 3];
            };
            let t = at - index as f32;
            let mixed = between(low, high, t);
            rgb_from(mixed, system).map(|x| not_negative(x * (1.0 / 2.52)))
        },
    )
}

/// Light of a black body, by its temperature in kelvin: power per area, not normalised.
#[inline(always)]
pub fn blackbody<R: Real>(kelvin: R) -> Triple<R> {
    blackbody_in(kelvin, R::Int::lit(0))
}

/// The same in another RGB system.
#[inline(always)]
pub fn blackbody_in<R: Real>(kelvin: R, system: R::Int) -> Triple<R> {
    light(
        kelvin,
        system,
        #[inline(always)]
        |t, system| {
            if !(COLDEST..HOTTEST).contains(&t) {
                return beyond_table(t, system);
            }
            let root = strict::cbrt((t - COLDEST) / 2.0);
            let at = root * root;
            let table = table(system);
            let index = (at as usize).min(ENTRIES - 2);
            let f = at - index as f32;
            between(&table[index], &table[index + 1], f).map(|x| (x * x) * (x * x) * x)
        },
    )
}

/// A black body whose temperature is not in the table.
#[cold]
#[inline(never)]
fn beyond_table(kelvin: f32, system: i32) -> Triple<f32> {
    if kelvin < COLDEST { [1e-6, 0.0, 0.0] } else { planck_rgb(kelvin, system) }
}

/// Applies a single-precision function of a number and an RGB system, whatever the arithmetic.
#[inline(always)]
fn light<R: Real>(x: R, system: R::Int, f: impl Fn(f32, i32) -> Triple<f32>) -> Triple<R> {
    R::by_value(
        [system],
        [x],
        #[inline(always)]
        |[system], [x]| f(x.to_f32(), system).map(Number::lit),
    )
}

#[inline(always)]
fn between(low: &Triple<f32>, high: &Triple<f32>, t: f32) -> Triple<f32> {
    [(1.0 - t) * low[0] + t * high[0], (1.0 - t) * low[1] + t * high[1], (1.0 - t) * low[2] + t * high[2]]
}

/// RGB in the system with a number. The systems are computed once.
#[inline(always)]
fn rgb_from(xyz: Triple<f32>, system: i32) -> Triple<f32> {
    static ALL: LazyLock<[ColorSystem<f32>; SYSTEMS.len()]> =
        LazyLock::new(|| std::array::from_fn(|number| ColorSystem::numbered(number as i32)));
    ALL[place(system)].to_rgb(xyz)
}

/// The place of a system in lists of them: that of the default for any other number.
#[inline(always)]
fn place(system: i32) -> usize {
    if (0..SYSTEMS.len() as i32).contains(&system) { system as usize } else { 0 }
}

fn not_negative(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// Number of entries of the table of black bodies.
const ENTRIES: usize = 318;

/// Fifth roots of the colors at 800 + 2 i^1.5 kelvin, so that the steps look uniform.
#[inline(always)]
fn table(system: i32) -> &'static [Triple<f32>; ENTRIES] {
    static TABLES: [OnceLock<[Triple<f32>; ENTRIES]>; SYSTEMS.len()] =
        [const { OnceLock::new() }; SYSTEMS.len()];
    TABLES[place(system)].get_or_init(|| made_table(system))
}

#[cold]
#[inline(never)]
fn made_table(system: i32) -> [Triple<f32>; ENTRIES] {
    std::array::from_fn(|i| {
        let root = f32::sqrt(i as f32);
        planck_rgb(root * root * root * 2.0 + COLDEST, system)
            .map(|x| f_pow(f64::from(x), f64::from(0.2_f32)) as f32)
    })
}

fn planck_rgb(kelvin: f32, system: i32) -> Triple<f32> {
    let mut xyz = [0.0; 3];
    for (index, matching) in MATCHING.iter().enumerate() {
        let metres = (380.0 + 5.0 * index as f32) * 1e-9;
        let square = metres * metres;
        let fifth = square * square * metres;
        let power = 3.741_83e-16 * (1.0 / fifth) / strict::expm1(1.4388e-2 / (metres * kelvin));
        let weight = power * 5e-9;
        for (sum, m) in xyz.iter_mut().zip(matching) {
            *sum += weight * m;
        }
    }
    ColorSystem::<f32>::numbered(system).to_rgb(xyz).map(not_negative)
}

/// x, y, z of the CIE 1931 observer.
#[rustfmt::skip]
const MATCHING: [[f32; 3]; 81] = [
    [0.0014, 0.0000, 0.0065],
    [0.0022, 0.0001, 0.0105],
    [0.0042, 0.0001, 0.0201],
    [0.0076, 0.0002, 0.0362],
    [0.0143, 0.0004, 0.0679],
    [0.0232, 0.0006, 0.1102],
    [0.0435, 0.0012, 0.2074],
    [0.0776, 0.0022, 0.3713],
    [0.1344, 0.0040, 0.6456],
    [0.2148, 0.0073, 1.0391],
    [0.2839, 0.0116, 1.3856],
    [0.3285, 0.0168, 1.6230],
    [0.3483, 0.0230, 1.7471],
    [0.3481, 0.0298, 1.7826],
    [0.3362, 0.0380, 1.7721],
    [0.3187, 0.0480, 1.7441],
    [0.2908, 0.0600, 1.6692],
    [0.2511, 0.0739, 1.5281],
    [0.1954, 0.0910, 1.2876],
    [0.1421, 0.1126, 1.0419],
    [0.0956, 0.1390, 0.8130],
    [0.0580, 0.1693, 0.6162],
    [0.0320, 0.2080, 0.4652],
    [0.0147, 0.2586, 0.3533],
    [0.0049, 0.3230, 0.2720],
    [0.0024, 0.4073, 0.2123],
    [0.0093, 0.5030, 0.1582],
    [0.0291, 0.6082, 0.1117],
    [0.0633, 0.7100, 0.0782],
    [0.1096, 0.7932, 0.0573],
    [0.1655, 0.8620, 0.0422],
    [0.2257, 0.9149, 0.0298],
    [0.2904, 0.9540, 0.0203],
    [0.3597, 0.9803, 0.0134],
    [0.4334, 0.9950, 0.0087],
    [0.5121, 1.0000, 0.0057],
    [0.5945, 0.9950, 0.0039],
    [0.6784, 0.9786, 0.0027],
    [0.7621, 0.9520, 0.0021],
    [0.8425, 0.9154, 0.0018],
    [0.9163, 0.8700, 0.0017],
    [0.9786, 0.8163, 0.0014],
    [1.0263, 0.7570, 0.0011],
    [1.0567, 0.6949, 0.0010],
    [1.0622, 0.6310, 0.0008],
    [1.0456, 0.5668, 0.0006],
    [1.0026, 0.5030, 0.0003],
    [0.9384, 0.4412, 0.0002],
    [0.8544, 0.3810, 0.0002],
    [0.7514, 0.3210, 0.0001],
    [0.6424, 0.2650, 0.0000],
    [0.5419, 0.2170, 0.0000],
    [0.4479, 0.1750, 0.0000],
    [0.3608, 0.1382, 0.0000],
    [0.2835, 0.1070, 0.0000],
    [0.2187, 0.0816, 0.0000],
    [0.1649, 0.0610, 0.0000],
    [0.1212, 0.0446, 0.0000],
    [0.0874, 0.0320, 0.0000],
    [0.0636, 0.0232, 0.0000],
    [0.0468, 0.0170, 0.0000],
    [0.0329, 0.0119, 0.0000],
    [0.0227, 0.0082, 0.0000],
    [0.0158, 0.0057, 0.0000],
    [0.0114, 0.0041, 0.0000],
    [0.0081, 0.0029, 0.0000],
    [0.0058, 0.0021, 0.0000],
    [0.0041, 0.0015, 0.0000],
    [0.0029, 0.0010, 0.0000],
    [0.0020, 0.0007, 0.0000],
    [0.0014, 0.0005, 0.0000],
    [0.0010, 0.0004, 0.0000],
    [0.0007, 0.0002, 0.0000],
    [0.0005, 0.0002, 0.0000],
    [0.0003, 0.0001, 0.0000],
    [0.0002, 0.0001, 0.0000],
    [0.0002, 0.0001, 0.0000],
    [0.0001, 0.0000, 0.0000],
    [0.0001, 0.0000, 0.0000],
    [0.0001, 0.0000, 0.0000],
    [0.0000, 0.0000, 0.0000],
];

#[cfg(test)]
mod tests {
    use super::*;

    fn close(got: Triple<f32>, want: Triple<f32>) {
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() <= 1e-5 * w.abs(), "{got:?} for {want:?}");
        }
    }

    /// Check values recorded from the reference.
    #[test]
    fn known_lights() {
        close(blackbody(2300.0), [24087.791, 7872.691, 966.5531]);
        close(blackbody(230.0), [1e-6, 0.0, 0.0]);
        close(blackbody(23_000.0), [269_728_860.0, 362_349_020.0, 696_459_900.0]);
        close(wavelength_color(575.0), [0.525_047_1, 0.357_348_95, 0.0]);
        assert_eq!(wavelength_color(200.0), [0.0; 3]);
        assert_eq!(wavelength_color(f32::NAN), [0.0; 3]);
    }
}
