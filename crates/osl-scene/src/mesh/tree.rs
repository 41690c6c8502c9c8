//! The tree of boxes that rays traverse.
//!
//! Sets of boxes are split where the estimated cost for a ray is smallest (J. D. MacDonald and K. S. Booth,
//! "Heuristics for ray tracing using space subdivision", 1990), among a few positions along the longest axis.
//! If the tree becomes too deep, sets are split into halves of equal size, so that any boxes, however stacked
//! or nested, take at most n log² n time.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

/// Positions along an axis at which a set may be split.
const BINS: usize = 16;
/// Sets at this depth below that of a balanced tree are split evenly.
const UNEVEN: u32 = 12;
/// Boxes in a leaf of the wide tree.
const IN_LEAF: u32 = 3;

/// A range of the boxes that forms a node of the tree.
struct BoxRange {
    node: usize,
    start: usize,
    end: usize,
    depth: u32,
}

/// Builds the tree of boxes; `primitive_indices` lists them in its order.
pub(super) fn tree(boxes: &[Aabb]) -> CwBvh {
    if boxes.is_empty() {
        return CwBvh::default();
    }
    let centers: Vec<Vec3A> = boxes.iter().map(|b| (b.min + b.max) * 0.5).collect();
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * boxes.len() - 1);
    nodes.push(Bvh2Node::default());
    let even_from = boxes.len().ilog2() + UNEVEN;
    let mut open = vec![BoxRange { node: 0, start: 0, end: boxes.len(), depth: 0 }];
    let mut deepest = 0;
    while let Some(part) = open.pop() {
        let list = &mut order[part.start..part.end];
        let around = list.iter().fold(Aabb::empty(), |all, at| all.union(&boxes[*at as usize]));
        deepest = deepest.max(part.depth);
        if let [_] = list {
            nodes[part.node] = Bvh2Node::new(around, 1, part.start as u32);
            continue;
        }
        let first = part_in_two(list, boxes, &centers, part.depth >= even_from);
        let left = nodes.len();
        nodes.extend([Bvh2Node::default(); 2]);
        nodes[part.node] = Bvh2Node::new(around, 0, left as u32);
        let middle = part.start + first;
        open.push(BoxRange { node: left, start: part.start, end: middle, depth: part.depth + 1 });
        open.push(BoxRange { node: left + 1, start: middle, end: part.end, depth: part.depth + 1 });
    }
    let tree = Bvh2 {
        nodes,
        primitive_indices: order,
        children_are_ordered_after_parents: true,
        max_depth: (deepest as usize + 2).max(96),
        ..Bvh2::default()
    };
    bvh2_to_cwbvh(&tree, IN_LEAF, true, false)
}

/// Splits a list of two or more boxes in place. Returns the number of boxes in the first half, which is
/// neither zero nor all.
fn part_in_two(list: &mut [u32], boxes: &[Aabb], centers: &[Vec3A], evenly: bool) -> usize {
    let center = |at: &u32| centers[*at as usize];
    let (low, high) = list
        .iter()
        .map(center)
        .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
    let extent = high - low;
    let axis = (0..3).max_by(|a, b| extent[*a].total_cmp(&extent[*b])).unwrap_or(0);
    let half = list.len() / 2;
    let scale = BINS as f32 / extent[axis];
    if evenly || !scale.is_finite() || list.len() < 4 {
        list.select_nth_unstable_by(half, |a, b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(b)));
        return half;
    }
    let bin = |at: &u32| (((center(at)[axis] - low[axis]) * scale) as usize).min(BINS - 1);
    let mut counts = [0_usize; BINS];
    let mut bounds = [Aabb::empty(); BINS];
    for at in list.iter() {
        let bin = bin(at);
        counts[bin] += 1;
        bounds[bin] = bounds[bin].union(&boxes[*at as usize]);
    }
    // The cost of each split: the number of boxes on either side, weighted by the area around them.
    let mut behind = [0.0_f32; BINS];
    let (mut count, mut around) = (0, Aabb::empty());
    for bin in (1..BINS).rev() {
        (count, around) = (count + counts[bin], around.union(&bounds[bin]));
        behind[bin] = if count > 0 { count as f32 * around.half_area() } else { f32::INFINITY };
    }
    let mut best = (f32::INFINITY, 0);
    (count, around) = (0, Aabb::empty());
    for bin in 0..BINS - 1 {
        (count, around) = (count + counts[bin], around.union(&bounds[bin]));
        let cost = count as f32 * around.half_area() + behind[bin + 1];
        if count > 0 && cost < best.0 {
            best = (cost, bin + 1);
        }
    }
    let (_, cut) = best;
    if cut == 0 {
        list.select_nth_unstable_by(half, |a, b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(b)));
        return half;
    }
    let mut first = 0;
    for at in 0..list.len() {
        if bin(&list[at]) < cut {
            list.swap(first, at);
            first += 1;
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: Vec3A, half: f32) -> Aabb {
        Aabb::new(center - half, center + half)
    }

    /// Each box is in the tree exactly once, for any arrangement.
    #[test]
    fn any_boxes_make_a_tree() {
        let spread = |i: u32| Vec3A::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i % 7) as f32);
        let lists: [Vec<Aabb>; 5] = [
            (0..1000).map(|i| cube(spread(i), 0.5)).collect(),
            vec![cube(Vec3A::ONE, 1.0); 5000],
            (1..5000).map(|i| cube(Vec3A::ZERO, i as f32)).collect(),
            // One shared corner: each box contains all earlier ones.
            (1..5000).map(|i| Aabb::new(Vec3A::ZERO, Vec3A::splat(i as f32))).collect(),
            (0..120).map(|i| cube(Vec3A::X * 2.0_f32.powi(i - 90), 1e-9)).collect(),
        ];
        for boxes in lists {
            let mut order = tree(&boxes).primitive_indices;
            order.sort_unstable();
            assert_eq!(order, (0..boxes.len() as u32).collect::<Vec<_>>());
        }
    }
}
