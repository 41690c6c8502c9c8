//! Finds which of a few cells each lane is in. Neighbouring lanes mostly share a few cells, and data about a
//! cell need be computed only once for all lanes in it.
//!
//! [`find`] numbers the cells of some lanes; [`Isa::look_up`] gives each lane its cell's word. The key of
//! a cell is any number of words.

use osl_simd::{Isa, Kernel};

/// Maximum number of distinct cells: their words fit in one vector.
pub const MAX_CELLS: usize = 16;

/// The index of a lane without a cell so far.
const OPEN: u32 = u32::MAX;

/// The cells that were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    /// Number of cells: 1 to [`MAX_CELLS`].
    pub count: usize,
    /// A lane in each cell; entries from `count` on are a lane in the first cell.
    pub lanes: [usize; MAX_CELLS],
}

/// Numbers the cells of lanes: lanes with equal words in all `keys` get the same number in `index`. Lanes
/// whose `index` is already 0 are skipped; the others must be [`u32::MAX`]. `scratch`, `index` and the keys
/// have the same length. Returns `None` if there are more than [`MAX_CELLS`] cells or no lanes; the index is
/// then meaningless.
pub fn find(isa: Isa, keys: &[&[u32]], index: &mut [u32], scratch: &mut [u32]) -> Option<Cells> {
    isa.dispatch(Find { keys, index, scratch })
}

struct Find<'a> {
    keys: &'a [&'a [u32]],
    index: &'a mut [u32],
    scratch: &'a mut [u32],
}

impl Kernel for Find<'_> {
    type Output = Option<Cells>;

    #[inline(always)]
    fn run(self) -> Option<Cells> {
        let Find { keys, index, scratch } = self;
        let n = keys.iter().map(|k| k.len()).min()?.min(index.len()).min(scratch.len());
        let index = &mut index[..n];
        let first = index.iter().position(|i| *i == OPEN)?;
        let mut cells = Cells { count: 0, lanes: [first; MAX_CELLS] };
        let mut lane = first;
        let mut before = n;
        for cell in 0..MAX_CELLS {
            cells.lanes[cell] = lane;
            // All lanes before this one have a cell.
            let start = lane - lane % MAX_CELLS;
            let (index, number) = (&mut index[start..], cell as u32);
            let open = match *keys {
                [a] => join([&a[start..n]], [a[lane]], index, number),
                [a, b] => join([&a[start..n], &b[start..n]], [a[lane], b[lane]], index, number),
                [a, b, c] => {
                    let words = [a[lane], b[lane], c[lane]];
                    join([&a[start..n], &b[start..n], &c[start..n]], words, index, number)
                }
                [a, b, c, d] => {
                    let words = [a[lane], b[lane], c[lane], d[lane]];
                    join([&a[start..n], &b[start..n], &c[start..n], &d[start..n]], words, index, number)
                }
                _ => {
                    let differs = &mut scratch[start..n];
                    differences(keys, lane, start, differs);
                    join([differs], [0], index, number)
                }
            };
            if open == 0 {
                cells.count = cell + 1;
                return Some(cells);
            }
            // If cells have about one lane each, there will be too many of them.
            if cell == 3 && open > n - n / 8 || open >= before {
                return None;
            }
            before = open;
            lane = start + next_open(index, lane - start)?;
        }
        None
    }
}

/// Assigns a cell to the open lanes with these words. Returns the number of lanes that remain open.
#[inline(always)]
fn join<const K: usize>(keys: [&[u32]; K], words: [u32; K], index: &mut [u32], cell: u32) -> usize {
    let n = index.len();
    let keys = keys.map(|key| &key[..n]);
    let mut open = 0;
    for i in 0..n {
        let mut differs = index[i] ^ OPEN;
        for k in 0..K {
            differs |= keys[k][i] ^ words[k];
        }
        index[i] = if differs == 0 { cell } else { index[i] };
        open += u32::from(index[i] == OPEN);
    }
    open as usize
}

/// Marks the lanes from `start` on whose words differ from those of a lane in any key.
#[inline(always)]
fn differences(keys: &[&[u32]], lane: usize, start: usize, differs: &mut [u32]) {
    differs.fill(0);
    let n = differs.len();
    for key in keys {
        let (word, key) = (key[lane], &key[start..][..n]);
        for i in 0..n {
            differs[i] |= key[i] ^ word;
        }
    }
}

/// The first lane from `from` on without a cell.
#[inline(always)]
fn next_open(index: &[u32], from: usize) -> Option<usize> {
    let mut start = from - from % MAX_CELLS;
    while start < index.len() {
        let group = &index[start..index.len().min(start + MAX_CELLS)];
        if group.iter().fold(false, |any, i| any | (*i == OPEN)) {
            return group.iter().position(|i| *i == OPEN).map(|at| start + at);
        }
        start += MAX_CELLS;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(isa: Isa, keys: &[&[u32]], index: &mut [u32]) -> Option<Cells> {
        find(isa, keys, index, &mut vec![0; index.len()])
    }

    #[test]
    fn lanes_of_equal_keys_are_in_one_cell() {
        for isa in Isa::all() {
            let a: Vec<u32> = (0..100).map(|i| i / 40).collect();
            let b: Vec<u32> = (0..100).map(|i| i % 4).collect();
            let mut index = vec![OPEN; 100];
            let found = cells(isa, &[&a, &b], &mut index).expect("twelve cells");
            assert_eq!(found.count, 12, "{isa:?}");
            for i in 0..100 {
                let lane = found.lanes[index[i] as usize];
                assert_eq!((a[lane], b[lane]), (a[i], b[i]));
                assert!(index[i] < 12);
            }
            assert!(found.lanes[12..].iter().all(|l| *l == 0));
        }
    }

    #[test]
    fn more_cells_than_a_vector_holds_are_none() {
        let keys: Vec<u32> = (0..256).map(|i| i / 15).collect();
        assert_eq!(cells(Isa::detect(), &[&keys], &mut [OPEN; 256]), None);
        let keys: Vec<u32> = (0..256).map(|i| i / 16).collect();
        assert_eq!(cells(Isa::detect(), &[&keys], &mut [OPEN; 256]).map(|c| c.count), Some(16));
    }

    #[test]
    fn lanes_left_out_make_no_cell() {
        let keys: Vec<u32> = (0..64).collect();
        let mut index = vec![0; 64];
        assert_eq!(cells(Isa::detect(), &[&keys], &mut index), None);
        index[7] = OPEN;
        let found = cells(Isa::detect(), &[&keys], &mut index).expect("one cell");
        assert_eq!((found.count, found.lanes[0], index[7]), (1, 7, 0));
    }

    #[test]
    fn each_lane_gets_the_word_of_its_cell() {
        let table: [u32; MAX_CELLS] = std::array::from_fn(|i| 1000 + i as u32);
        let index: Vec<u32> = (0..75).map(|i| i * 7 % 16).collect();
        for isa in Isa::all() {
            let mut out = vec![0; 75];
            isa.look_up(&table, &index, &mut out);
            assert!(out.iter().zip(&index).all(|(o, i)| *o == 1000 + i), "{isa:?}");
        }
    }
}
