//! All impulses in the cells around some points, in columns: computed once and shared by the points.

use super::{LANES, Lanes};

/// An impulse.
#[derive(Clone, Copy)]
pub(super) struct Impulse {
    /// Offset of its cell from the one of the points, in cells.
    pub(super) offset: [f32; 3],
    /// Its position in the cell.
    pub(super) position: [f32; 3],
    /// The cell's sequence, whose next draws are frequency and phase.
    pub(super) seed: u32,
    /// Lane of the cell.
    pub(super) cell: usize,
}

/// Impulses, cell by cell, those of a cell in the order of its sequence.
#[derive(Default)]
pub(super) struct Neighbourhood {
    impulses: Vec<Impulse>,
    /// Their positions relative to the cell of the points; unused lanes are infinitely far.
    positions: Vec<[Lanes; 3]>,
}

impl Neighbourhood {
    pub(super) fn clear(&mut self) {
        self.impulses.clear();
        self.positions.clear();
    }

    pub(super) fn push(&mut self, impulse: Impulse) {
        let lane = self.impulses.len() % LANES;
        if lane == 0 {
            self.positions.push([[f32::INFINITY; LANES]; 3]);
        }
        if let Some(positions) = self.positions.last_mut() {
            for (axis, lanes) in positions.iter_mut().enumerate() {
                lanes[lane] = impulse.offset[axis] + impulse.position[axis];
            }
        }
        self.impulses.push(impulse);
    }

    /// Collects the impulses whose kernels reach into a box, in order, and perhaps a few others. The box is
    /// given relative to the cell of the points.
    #[inline(always)]
    pub(super) fn near(&self, low: [f32; 3], high: [f32; 3], found: &mut Vec<Impulse>) {
        /// Square of a kernel's radius in cells, with room for rounding.
        const REACH: f32 = 1.001;
        found.clear();
        for (positions, impulses) in self.positions.iter().zip(self.impulses.chunks(LANES)) {
            let mut reaches = [false; LANES];
            for l in 0..LANES {
                let mut square = 0.0;
                for axis in 0..3 {
                    let (below, above) = (low[axis] - positions[axis][l], positions[axis][l] - high[axis]);
                    let outside = if below > above { below } else { above };
                    let outside = if outside > 0.0 { outside } else { 0.0 };
                    square += outside * outside;
                }
                reaches[l] = square < REACH;
            }
            let mut lanes = 0_u32;
            for (l, reaches) in reaches.iter().enumerate() {
                lanes |= u32::from(*reaches) << l;
            }
            while lanes != 0 {
                found.extend(impulses.get(lanes.trailing_zeros() as usize));
                lanes &= lanes - 1;
            }
        }
    }
}
