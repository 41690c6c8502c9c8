//! The values of an image in the type that its file stores: a byte stays a byte in memory.

use half::f16;

use crate::image::StoredType;

/// Values of one image, pixel by pixel. Rare types are kept as floats.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Texels {
    /// Fractions of 255.
    U8(Vec<u8>),
    /// Fractions of 65535.
    U16(Vec<u16>),
    /// 16-bit floats.
    Half(Vec<f16>),
    /// All other types, converted to floats.
    Float(Vec<f32>),
}

/// A stored value.
pub(crate) trait Texel: Copy {
    /// The value that lookups use.
    fn float(self) -> f32;
}

/// Fractions as the reference computes them (measured): the byte times a rounded 1/255. This differs from a
/// division in the last bit of some bytes and still gives exactly 1 for 255.
impl Texel for u8 {
    #[inline]
    fn float(self) -> f32 {
        f32::from(self) * (1.0 / 255.0)
    }
}

/// Fractions of 65535, computed like those of bytes.
impl Texel for u16 {
    #[inline]
    fn float(self) -> f32 {
        f32::from(self) * (1.0 / 65535.0)
    }
}

impl Texel for f16 {
    #[inline]
    fn float(self) -> f32 {
        self.to_f32()
    }
}

impl Texel for f32 {
    #[inline]
    fn float(self) -> f32 {
        self
    }
}

/// The bytes that one value takes in memory.
pub(crate) fn bytes_of(stored: StoredType) -> u64 {
    match stored {
        StoredType::U8 => 1,
        StoredType::U16 | StoredType::Half => 2,
        StoredType::U32 | StoredType::I8 | StoredType::I16 | StoredType::I32 | StoredType::Float => 4,
    }
}

impl Texels {
    /// As many zeros, in the type in which stored values are kept.
    pub(crate) fn zeros(stored: StoredType, n: usize) -> Self {
        match stored {
            StoredType::U8 => Self::U8(vec![0; n]),
            StoredType::U16 => Self::U16(vec![0; n]),
            StoredType::Half => Self::Half(vec![f16::ZERO; n]),
            _ => Self::Float(vec![0.0; n]),
        }
    }

    /// The bytes of integers and floats, for a decoder to fill; none of 16-bit floats.
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::U8(list) => list,
            Self::U16(list) => bytemuck::cast_slice_mut(list),
            Self::Half(_) => &mut [],
            Self::Float(list) => bytemuck::cast_slice_mut(list),
        }
    }

    /// An empty list with room for some values.
    pub(crate) fn with_capacity(like: &Texels, capacity: usize) -> Self {
        match like {
            Self::U8(_) => Self::U8(Vec::with_capacity(capacity)),
            Self::U16(_) => Self::U16(Vec::with_capacity(capacity)),
            Self::Half(_) => Self::Half(Vec::with_capacity(capacity)),
            Self::Float(_) => Self::Float(Vec::with_capacity(capacity)),
        }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::U8(list) => list.len(),
            Self::U16(list) => list.len(),
            Self::Half(list) => list.len(),
            Self::Float(list) => list.len(),
        }
    }

    /// The bytes of all values.
    pub(crate) fn bytes(&self) -> u64 {
        let each = match self {
            Self::U8(_) => 1,
            Self::U16(_) | Self::Half(_) => 2,
            Self::Float(_) => 4,
        };
        self.len() as u64 * each
    }

    /// One value; 0 if it does not exist.
    pub(crate) fn get(&self, at: usize) -> f32 {
        match self {
            Self::U8(list) => list.get(at).map_or(0.0, |v| v.float()),
            Self::U16(list) => list.get(at).map_or(0.0, |v| v.float()),
            Self::Half(list) => list.get(at).map_or(0.0, |v| v.float()),
            Self::Float(list) => list.get(at).copied().unwrap_or(0.0),
        }
    }

    /// All values as floats.
    pub(crate) fn into_floats(self) -> Vec<f32> {
        match self {
            Self::U8(list) => list.into_iter().map(Texel::float).collect(),
            Self::U16(list) => list.into_iter().map(Texel::float).collect(),
            Self::Half(list) => list.into_iter().map(Texel::float).collect(),
            Self::Float(list) => list,
        }
    }

    /// One value in the unit in which means are rounded: integers as integers, so that ties are exact.
    /// `stored` is the type of the file, which matters if values are kept as floats.
    pub(crate) fn in_stored_units(&self, at: usize, stored: StoredType) -> f64 {
        let of_float = |sample: f32| match stored {
            StoredType::U8 => (f64::from(sample) * 255.0).round(),
            StoredType::U16 => (f64::from(sample) * 65535.0).round(),
            StoredType::I8 => (f64::from(sample) * 127.0).round(),
            StoredType::I16 => (f64::from(sample) * 32767.0).round(),
            StoredType::U32 | StoredType::I32 | StoredType::Half | StoredType::Float => f64::from(sample),
        };
        match self {
            Self::U8(list) => list.get(at).map_or(0.0, |v| f64::from(*v)),
            Self::U16(list) => list.get(at).map_or(0.0, |v| f64::from(*v)),
            Self::Half(list) => list.get(at).map_or(0.0, |v| v.to_f64()),
            Self::Float(list) => list.get(at).map_or(0.0, |v| of_float(*v)),
        }
    }

    /// Appends a mean in that unit, rounded to the type of the file.
    pub(crate) fn push_rounded(&mut self, mean: f64, stored: StoredType) {
        match self {
            // The casts saturate; a mean lies between its values.
            Self::U8(list) => list.push((mean + 0.5).floor() as u8),
            Self::U16(list) => list.push((mean + 0.5).floor() as u16),
            Self::Half(list) => list.push(f16::from_f64(mean)),
            Self::Float(list) => list.push(match stored {
                StoredType::U8 => (mean + 0.5).floor() as f32 * (1.0 / 255.0),
                StoredType::U16 => (mean + 0.5).floor() as f32 * (1.0 / 65535.0),
                StoredType::U32 => (mean + 0.5).floor() as f32,
                StoredType::Half => f16::from_f64(mean).to_f32(),
                StoredType::I8 => mean.round() as f32 * (1.0 / 127.0),
                StoredType::I16 => mean.round() as f32 * (1.0 / 32767.0),
                // A float has fewer digits than these integers.
                StoredType::I32 | StoredType::Float => mean as f32,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values are kept in the type of the file, which has no effect on results.
    #[test]
    fn values_and_means_do_not_depend_on_where_they_are_kept() {
        let bytes: Vec<u8> = (0..=255).collect();
        let floats = Texels::Float(Texels::U8(bytes.clone()).into_floats());
        let bytes = Texels::U8(bytes);
        let (mut a, mut b) = (Texels::with_capacity(&bytes, 4), Texels::with_capacity(&floats, 4));
        for at in 0..256 {
            assert_eq!(bytes.get(at).to_bits(), floats.get(at).to_bits());
            let mean = |texels: &Texels| {
                let value = |at| texels.in_stored_units(at, StoredType::U8);
                0.25 * (value(at) + value(at / 2) + value(at / 3) + value(255 - at))
            };
            assert_eq!(mean(&bytes), mean(&floats));
            a.push_rounded(mean(&bytes), StoredType::U8);
            b.push_rounded(mean(&floats), StoredType::U8);
        }
        assert_eq!((a.bytes(), b.bytes()), (256, 1024));
        assert_eq!(a.into_floats(), b.into_floats());
    }
}
