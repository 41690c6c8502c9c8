//! Chooses the subdivision level at which edges are short enough in the picture.
//!
//! All faces of a mesh have the same level, so that there are no cracks.

use crate::camera::View;
use crate::mesh::{MeshError, Triangles};
use glam::{DVec2, Vec3};

/// Edges are cut at this fraction of their distance in front of the camera plane.
const NEAR: f64 = 1e-4;

/// The first level at which no edge in the picture is longer than `edge` pixels, up to `most`. Also returns
/// whether that was reached.
pub(crate) fn choose(
    at_level: impl Fn(u32) -> Result<Triangles, MeshError>,
    most: u32,
    view: &View,
    edge: f64,
) -> Result<(Triangles, u32, bool), MeshError> {
    let mut level = 0;
    loop {
        let triangles = at_level(level)?;
        let longest = longest_edge(&triangles, view);
        let fine = longest <= edge;
        if fine || level >= most {
            return Ok((triangles, level, fine));
        }
        // Each level roughly halves edges, so one level less than estimated is certainly not too fine. For
        // NaN there is no limit.
        let levels = libm::log2(longest / edge).floor();
        let further = if levels.is_finite() { levels.max(1.0) as u32 } else { most };
        level = level.saturating_add(further).min(most);
    }
}

/// The length of the longest edge in the picture, in pixels; only the visible part of an edge counts.
pub fn longest_edge(triangles: &Triangles, view: &View) -> f64 {
    let mut longest = 0.0_f64;
    for triangle in 0..triangles.indices.len() {
        let [a, b, c] = triangles.corners(triangle);
        for (a, b) in [(a, b), (b, c), (c, a)] {
            longest = longest.max(seen_length(a, b, view));
        }
    }
    longest
}

/// The visible length of an edge, in pixels.
fn seen_length(a: Vec3, b: Vec3, view: &View) -> f64 {
    let near = NEAR * f64::from(a.distance(view.position()).max(b.distance(view.position())));
    let (depth_a, depth_b) = (view.depth(a), view.depth(b));
    if depth_a < near && depth_b < near {
        return 0.0;
    }
    // An end behind the camera is moved to where the edge comes in front of it.
    let ahead = |behind: Vec3, depth: f64, other: Vec3, other_depth: f64| {
        if depth >= near {
            return behind;
        }
        behind.lerp(other, ((near - depth) / (other_depth - depth)) as f32)
    };
    let (a, b) = (ahead(a, depth_a, b, depth_b), ahead(b, depth_b, a, depth_a));
    match (view.project(a), view.project(b)) {
        (Some(a), Some(b)) => inside(a, b, view.resolution().map(|n| n as f64)),
        _ => 0.0,
    }
}

/// The length of the part of a line inside the picture.
fn inside(a: DVec2, b: DVec2, [width, height]: [f64; 2]) -> f64 {
    let way = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (start, step, end) in [(a.x, way.x, width), (a.y, way.y, height)] {
        if step == 0.0 {
            if !(0.0..=end).contains(&start) {
                return 0.0;
            }
            continue;
        }
        let (enter, leave) = ((0.0 - start) / step, (end - start) / step);
        from = from.max(enter.min(leave));
        to = to.min(enter.max(leave));
    }
    if from < to { way.length() * (to - from) } else { 0.0 }
}
