//! The texture outside the unit square.

/// The texture outside the unit square, for one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// As the file specifies, which EXR and TIFF files can; zero if it does not.
    #[default]
    File,
    /// Zero.
    Black,
    /// The nearest texel of the border.
    Clamp,
    /// The image repeats.
    Periodic,
    /// The image repeats, mirrored every second time.
    Mirror,
}

impl Wrap {
    /// The wrap with this name, as shaders and files spell it; `default` is [`Wrap::File`].
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "default" => Self::File,
            "black" => Self::Black,
            "clamp" => Self::Clamp,
            "periodic" => Self::Periodic,
            "mirror" => Self::Mirror,
            _ => return None,
        })
    }

    /// The wraps of s and t from a file's text: two names with a comma between them, or one for both. An
    /// unknown name means black.
    pub(crate) fn pair_from_file(text: &str) -> (Self, Self) {
        let (s, t) = text.split_once(',').unwrap_or((text, text));
        let one = |name: &str| Self::from_name(name.trim()).unwrap_or_default();
        (one(s), one(t))
    }

    /// This wrap, or the file's wrap for [`Wrap::File`].
    pub(crate) fn or_file(self, file: Self) -> Self {
        if self == Self::File { file } else { self }
    }

    /// The texel for index `i`, in `0..n`; `None` if it is black. `n` is positive.
    pub(crate) fn texel(self, i: i64, n: i64) -> Option<usize> {
        let wrapped = match self {
            _ if (0..n).contains(&i) => i,
            Self::File | Self::Black => return None,
            Self::Clamp => i.clamp(0, n - 1),
            Self::Periodic => i.rem_euclid(n),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        };
        Some(wrapped as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps() {
        let row = |wrap: Wrap| (-4..7).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        let some = |texels: [usize; 11]| texels.map(Some).to_vec();
        assert_eq!(row(Wrap::Clamp), some([0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2]));
        assert_eq!(row(Wrap::Periodic), some([2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]));
        assert_eq!(row(Wrap::Mirror), some([2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]));
        assert_eq!(row(Wrap::Black)[3..8], [None, Some(0), Some(1), Some(2), None]);
    }

    #[test]
    fn file_texts() {
        assert_eq!(Wrap::pair_from_file("periodic, clamp"), (Wrap::Periodic, Wrap::Clamp));
        assert_eq!(Wrap::pair_from_file("mirror"), (Wrap::Mirror, Wrap::Mirror));
        assert_eq!(Wrap::pair_from_file("mirror,what"), (Wrap::Mirror, Wrap::File));
        assert_eq!(Wrap::File.texel(-1, 3), None);
    }
}
