//! The loop over points: blocks of lanes in arrays of a known length.
//!
//! The compiler turns such a loop into vectors without anything left over. Of a loop over slices it keeps the
//! last vector for a loop of single lanes, which for sixteen points is all of them. Values are computed into
//! arrays first, so that it need not ask whether results overlap with coordinates.

use crate::float::Float;
use crate::unroll::{array, each};

/// Lanes of a block: whole vectors of every instruction set.
pub(crate) const BLOCK: usize = 16;

/// The results of a block. They align the stack, so that no vector on it crosses a cache line.
#[repr(align(64))]
struct Results<T, const E: usize>([[T; BLOCK]; E]);

/// Computes `E` results at each point from `S` sets of `D` numbers. All slices have the length of the first
/// results, and there are at least as many points as in a block.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]
pub(crate) fn map<T: Float, const D: usize, const S: usize, const E: usize>(
    from: [[&[T]; D]; S],
    mut to: [&mut [T]; E],
    f: impl Fn([[T; D]; S]) -> [T; E],
) {
    let n = to[0].len();
    for block in 0..n.div_ceil(BLOCK) {
        // If the last block is not full, it computes some lanes again.
        let start = (block * BLOCK).min(n.saturating_sub(BLOCK));
        let here: [[&[T; BLOCK]; D]; S] = array(
            #[inline(always)]
            |s| {
                array(
                    #[inline(always)]
                    |a| {
                        let (block, _) = from[s][a][start..].as_chunks();
                        &block[0]
                    },
                )
            },
        );
        let mut results = Results([[T::lit(0.0); BLOCK]; E]);
        for i in 0..BLOCK {
            let values = f(array(
                #[inline(always)]
                |s| {
                    array(
                        #[inline(always)]
                        |a| here[s][a][i],
                    )
                },
            ));
            each(
                E,
                #[inline(always)]
                |e| results.0[e][i] = values[e],
            );
        }
        for (to, results) in to.iter_mut().zip(&results.0) {
            match to[start..].first_chunk_mut() {
                Some(to) => *to = *results,
                // There is room for a block. Without this call, the compiler would keep constants in more
                // registers than there are, and points with partials would take a quarter longer.
                None => to[..n].copy_from_slice(&results[..n]),
            }
        }
    }
}
