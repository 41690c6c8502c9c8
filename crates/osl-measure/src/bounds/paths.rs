//! Paths: where a tile does not decide a branch, or a whole number has few values, the points of the tile may
//! be walked apart, each case with what holds in it. So values stay together that belong together: the start
//! and the end of the cell that a point is in. A path is a case of each such place, in the order of the walk.

/// The maximum number of paths of a tile.
const PATHS: usize = 100;

/// The cases of a path, and those that follow.
#[derive(Debug)]
pub(super) struct Paths {
    /// The case of each place that this path has passed, and the number of its cases.
    cases: Vec<(usize, usize)>,
    /// The number of places that the current walk has passed.
    passed: usize,
    most: usize,
}

impl Paths {
    /// One path, in which no place has cases.
    pub(super) fn joined() -> Paths {
        Paths { cases: Vec::new(), passed: 0, most: 1 }
    }

    /// The first of the paths of a tile.
    pub(super) fn apart() -> Paths {
        Paths { most: PATHS, ..Paths::joined() }
    }

    /// Whether no place has had cases.
    pub(super) fn is_single(&self) -> bool {
        self.cases.is_empty()
    }

    /// The case of the next place, which has some; `None` if there would be too many paths. The decision
    /// depends on the cases before, so that it is the same in each walk that has them.
    pub(super) fn case(&mut self, count: usize) -> Option<usize> {
        if let Some((case, _)) = self.cases.get(self.passed) {
            self.passed += 1;
            return Some(*case);
        }
        // Each path counts as the share of all points that it would have if all cases had the same share.
        let ways: usize = self.cases.iter().map(|(_, count)| *count).product();
        if ways * count > self.most {
            return None;
        }
        self.cases.push((0, count));
        self.passed += 1;
        Some(0)
    }

    /// Goes to the next path; false if this was the last one.
    pub(super) fn next(&mut self) -> bool {
        self.passed = 0;
        while let Some((case, count)) = self.cases.pop() {
            if case + 1 < count {
                self.cases.push((case + 1, count));
                return true;
            }
        }
        false
    }
}
