//! Names that stand for a grid of files, one per unit square of texture space.

use std::fmt::Write;

/// The number of the first square when squares are numbered in rows of ten, and the last number with four
/// digits.
const FIRST: u32 = 1001;
const LAST: u32 = 9999;
const COLUMNS: u32 = 10;

/// The parts of a name that are replaced by the number of a square.
const MARKS: [(&str, Numbering); 8] = [
    ("<UDIM>", Numbering::Udim),
    ("%(UDIM)d", Numbering::Udim),
    ("<UVTILE>", Numbering::Both),
    ("%(UVTILE)d", Numbering::Both),
    ("<u>", Numbering::Column(0)),
    ("<v>", Numbering::Row(0)),
    ("<U>", Numbering::Column(1)),
    ("<V>", Numbering::Row(1)),
];

#[derive(Clone, Copy)]
enum Numbering {
    /// 1001 plus the column plus ten times the row.
    Udim,
    /// `u` and the column, counted from this number.
    Column(u32),
    /// `v` and the row, counted from this number.
    Row(u32),
    /// `u` and the column, `_v` and the row, both counted from 1.
    Both,
}

/// A unit square of texture space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Square {
    column: u32,
    row: u32,
}

impl Square {
    /// The square of a point, and the point's coordinates in it. Points left of or above the first squares,
    /// and NaN, belong to those squares.
    pub(crate) fn of(s: f32, t: f32) -> (Self, f32, f32) {
        // The cast gives 0 for NaN, and the largest integer for larger values.
        let (column, row) = (s.floor().max(0.0) as u32, t.floor().max(0.0) as u32);
        (Self { column, row }, s - column as f32, t - row as f32)
    }

    /// The number of this square, if it has one.
    fn udim(self) -> Option<u32> {
        let number = self.row.checked_mul(COLUMNS)?.checked_add(self.column.saturating_add(FIRST))?;
        (self.column < COLUMNS && number <= LAST).then_some(number)
    }

    /// The name of this square's file; `None` if there cannot be one.
    pub(crate) fn name(self, pattern: &str) -> Option<String> {
        let number = self.udim()?;
        let mut name = String::with_capacity(pattern.len());
        let mut rest = pattern;
        while let Some(start) = rest.find(['<', '%']) {
            name.push_str(&rest[..start]);
            rest = &rest[start..];
            let Some((mark, numbering)) = mark_at(rest) else {
                // Both marks are single bytes.
                name.push_str(&rest[..1]);
                rest = &rest[1..];
                continue;
            };
            let _ = match numbering {
                Numbering::Udim => write!(name, "{number}"),
                Numbering::Column(from) => write!(name, "u{}", self.column + from),
                Numbering::Row(from) => write!(name, "v{}", self.row + from),
                Numbering::Both => write!(name, "u{}_v{}", self.column + 1, self.row + 1),
            };
            rest = &rest[mark.len()..];
        }
        name.push_str(rest);
        Some(name)
    }

    /// The squares of the first ten rows.
    pub(crate) fn usual() -> impl Iterator<Item = Self> {
        (0..COLUMNS * 10).map(|i| Self { column: i % COLUMNS, row: i / COLUMNS })
    }
}

/// Whether a name stands for a grid of files.
pub(crate) fn is_pattern(name: &str) -> bool {
    name.match_indices(['<', '%']).any(|(start, _)| mark_at(&name[start..]).is_some())
}

fn mark_at(text: &str) -> Option<(&'static str, Numbering)> {
    MARKS.into_iter().find(|(mark, _)| text.starts_with(mark))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_squares() {
        let (square, ..) = Square::of(2.5, 1.25);
        let name = |pattern| square.name(pattern).unwrap_or_default();
        assert_eq!(name("a.<UDIM>.exr"), "a.1013.exr");
        assert_eq!(name("%(UDIM)d/<UDIM>"), "1013/1013");
        assert_eq!(name("a_<u>_<v>.png"), "a_u2_v1.png");
        assert_eq!(name("a_<U>_<V>.png"), "a_u3_v2.png");
        assert_eq!(name("<UVTILE> %(UVTILE)d"), "u3_v2 u3_v2");
        assert_eq!(name("é<é%<UDIM"), "é<é%<UDIM");
        for (name, expected) in [("a.exr", false), ("a<b>%d", false), ("<udim>", false), ("é%<v>", true)] {
            assert_eq!(is_pattern(name), expected, "{name}");
        }
    }

    #[test]
    fn coordinates_are_within_the_square() {
        assert_eq!(Square::of(2.5, 1.25), (Square { column: 2, row: 1 }, 0.5, 0.25));
        assert_eq!(Square::of(1.0, 0.0), (Square { column: 1, row: 0 }, 0.0, 0.0));
        assert_eq!(Square::of(-0.25, 3.0), (Square { column: 0, row: 3 }, -0.25, 0.0));
        assert_eq!(Square::of(f32::NAN, 0.0).0, Square { column: 0, row: 0 });
        for (s, t) in [(10.0, 0.0), (9.0, 899.0), (f32::INFINITY, 0.0), (0.0, 1e30)] {
            assert_eq!(Square::of(s, t).0.name("<UDIM>"), None, "{s} {t}");
        }
        assert_eq!(Square::of(8.5, 899.5).0.name("<UDIM>").as_deref(), Some("9999"));
    }
}
