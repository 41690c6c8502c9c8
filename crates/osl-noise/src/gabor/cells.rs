//! The impulses around a point: a random number of them at random positions in each of the 27 nearby cells,
//! one lane per cell.
//!
//! A cell's random sequence depends only on its corner, so every nearby point sees the same impulses. The
//! sequence multiplies a nonzero word by an odd number. Products of such draws fall below any positive bound
//! after a few dozen steps from any start, so every loop here ends.

use super::neighbourhood::{Impulse, Neighbourhood};
use super::params::Params;
use crate::cell::wrap;
use crate::hash::{cell, hash, unit};

/// Cells that a kernel around a point may reach.
pub(super) const CELLS: usize = 27;
/// Lanes for the cells; the remaining lanes are unused.
pub(super) const WIDTH: usize = 32;

const MULTIPLIER: u32 = 3_039_177_861;

/// The next word of a sequence and its value, above 0 and up to 1.
#[inline(always)]
pub(super) fn draw(seed: &mut u32) -> f32 {
    *seed = seed.wrapping_mul(MULTIPLIER);
    unit(*seed)
}

/// Offset of each cell from the one of the point, x fastest.
const OFFSETS: [[f32; WIDTH]; 3] = {
    let mut offsets = [[0.0; WIDTH]; 3];
    let mut l = 0;
    while l < CELLS {
        offsets[0][l] = (l % 3) as f32 - 1.0;
        offsets[1][l] = (l / 3 % 3) as f32 - 1.0;
        offsets[2][l] = (l / 9) as f32 - 1.0;
        l += 1;
    }
    offsets
};

/// The position of a neighbourhood, and its field.
#[derive(Clone, Copy)]
pub(super) struct CellBlock {
    /// Corner of the cell in the middle.
    pub(super) corner: [f32; 3],
    /// Period of each axis in cells.
    pub(super) periods: Option<[f32; 3]>,
    /// One field for each seed.
    pub(super) seed: u32,
    /// Probability of an empty cell.
    pub(super) empty: f32,
}

impl CellBlock {
    fn words(&self) -> [u32; 9] {
        let [a, b, c] = self.corner.map(f32::to_bits);
        let [d, e, f] = self.periods.unwrap_or([0.0; 3]).map(f32::to_bits);
        [a, b, c, d, e, f, u32::from(self.periods.is_some()), self.seed, self.empty.to_bits()]
    }
}

/// The number of impulses in each cell, and the state of its sequence after counting them.
pub(super) struct Cells {
    seeds: [u32; WIDTH],
    counts: [u32; WIDTH],
    most: u32,
    of: Option<[u32; 9]>,
}

impl Cells {
    pub(super) fn new() -> Cells {
        Cells { seeds: [1; WIDTH], counts: [0; WIDTH], most: 0, of: None }
    }

    /// Moves to another position, unless it is the same.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]
    pub(super) fn visit(&mut self, place: &CellBlock) {
        let words = place.words();
        if self.of == Some(words) {
            return;
        }
        self.of = Some(words);
        let mut lattice = [[0; WIDTH]; 3];
        for (axis, lanes) in lattice.iter_mut().enumerate() {
            let corner = place.corner[axis];
            for (lane, offset) in lanes.iter_mut().zip(OFFSETS[axis]) {
                let c = corner + offset;
                let c = match place.periods {
                    Some(periods) => wrap(c, periods[axis]),
                    None => c,
                };
                *lane = cell(c) as u32;
            }
        }
        for l in 0..WIDTH {
            let word = hash([lattice[0][l], lattice[1][l], lattice[2][l], place.seed]);
            self.seeds[l] = if word == 0 { 1 } else { word };
        }
        self.count(place.empty);
    }

    /// Draws Poisson numbers with Knuth's product of uniform numbers, all cells in lockstep.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]
    fn count(&mut self, empty: f32) {
        let mut left = [0.0; WIDTH];
        self.counts = [0; WIDTH];
        self.most = 0;
        for l in 0..CELLS {
            left[l] = draw(&mut self.seeds[l]);
        }
        loop {
            let mut going = 0;
            for l in 0..WIDTH {
                let goes = left[l] > empty;
                let mut seed = self.seeds[l];
                let factor = draw(&mut seed);
                self.seeds[l] = if goes { seed } else { self.seeds[l] };
                left[l] = if goes { left[l] * factor } else { left[l] };
                self.counts[l] += u32::from(goes);
                going |= u32::from(goes);
            }
            if going == 0 {
                return;
            }
            self.most += 1;
        }
    }

    /// Calls `full` with the impulses whose kernels reach the point; impulses of a cell keep the order of its
    /// sequence. `way` is the offset from the middle cell's corner to the point, in cells.
    #[inline(always)]
    pub(super) fn near(&self, params: &Params, way: [f32; 3], mut full: impl FnMut(&Impulses)) {
        let skip = skip(params);
        let mut seeds = self.seeds;
        let mut found = Impulses::new();
        for round in 0..self.most {
            let mut r = [[0.0; WIDTH]; 3];
            let mut at = [0; WIDTH];
            let mut inside = [false; WIDTH];
            for l in 0..WIDTH {
                let mut seed = seeds[l];
                let z = draw(&mut seed);
                let y = draw(&mut seed);
                let x = draw(&mut seed);
                let x = params.radius * ((way[0] - OFFSETS[0][l]) - x);
                let y = params.radius * ((way[1] - OFFSETS[1][l]) - y);
                let z = params.radius * ((way[2] - OFFSETS[2][l]) - z);
                inside[l] = (x * x + y * y + z * z < params.radius2) & (round < self.counts[l]);
                (r[0][l], r[1][l], r[2][l]) = (x, y, z);
                at[l] = seed;
                seeds[l] = seed.wrapping_mul(skip);
            }
            let mut lanes = 0_u32;
            for (l, inside) in inside.iter().enumerate() {
                lanes |= u32::from(*inside) << l;
            }
            while lanes != 0 {
                let l = lanes.trailing_zeros() as usize % WIDTH;
                lanes &= lanes - 1;
                found.push(l as u8, [r[0][l], r[1][l], r[2][l]], at[l]);
            }
            let last = round + 1 == self.most;
            if found.len > CAPACITY - WIDTH || (last && found.len > 0) {
                full(&found);
                found.len = 0;
            }
        }
    }

    /// Lists all impulses.
    pub(super) fn list(&self, params: &Params, to: &mut Neighbourhood) {
        let skip = skip(params);
        to.clear();
        for (cell, (seed, count)) in self.seeds.iter().zip(self.counts).enumerate().take(CELLS) {
            let mut seed = *seed;
            for _ in 0..count {
                let mut next = seed;
                let z = draw(&mut next);
                let y = draw(&mut next);
                let x = draw(&mut next);
                let offset = [OFFSETS[0][cell], OFFSETS[1][cell], OFFSETS[2][cell]];
                to.push(Impulse { offset, position: [x, y, z], seed: next, cell });
                seed = next.wrapping_mul(skip);
            }
        }
    }
}

/// The factor that moves a sequence over the draws for an impulse's wave.
#[inline(always)]
fn skip(params: &Params) -> u32 {
    let mut skip = 1_u32;
    for _ in 0..params.waves.draws() {
        skip = skip.wrapping_mul(MULTIPLIER);
    }
    skip
}

/// Capacity of [`Impulses`]; rarely do more impulses meet at a point.
pub(super) const CAPACITY: usize = 64;

/// Some impulses, one column for each property.
pub(super) struct Impulses {
    pub(super) len: usize,
    /// Lane of the cell.
    pub(super) cells: [u8; CAPACITY],
    /// The offset from the impulse to the point.
    pub(super) r: [[f32; CAPACITY]; 3],
    /// The cell's sequence, whose next draws are frequency and phase.
    pub(super) seeds: [u32; CAPACITY],
}

impl Impulses {
    #[inline(always)]
    fn new() -> Impulses {
        Impulses { len: 0, cells: [0; CAPACITY], r: [[0.0; CAPACITY]; 3], seeds: [1; CAPACITY] }
    }

    #[inline(always)]
    fn push(&mut self, cell: u8, r: [f32; 3], seed: u32) {
        let i = self.len % CAPACITY;
        self.cells[i] = cell;
        (self.r[0][i], self.r[1][i], self.r[2][i]) = (r[0], r[1], r[2]);
        self.seeds[i] = seed;
        self.len += 1;
    }
}
