//! Rays against triangles: none passes through a closed surface, and the nearest hit is found.

use crate::common::cube_with_uvs;
use glam::Vec3;
use osl_scene::displace::{Displacement, displace};
use osl_scene::mesh::{Bvh, Triangles};
use osl_scene::subdivide::{Detail, Scheme, tessellate};
use proptest::prelude::*;
use std::convert::Infallible;
use std::sync::LazyLock;

/// A bumpy ball with seams, and its tree.
static BALL: LazyLock<(Triangles, Bvh)> = LazyLock::new(|| {
    let mut ball = tessellate(&cube_with_uvs(), Scheme::CatmullClark, &Detail::Level(4)).unwrap().triangles;
    displace(&mut ball, |points| {
        let bump = |p: Vec3| 0.1 * (p.x * 9.0).sin() * (p.y * 8.0).cos() + 0.05 * (p.z * 20.0).sin();
        Ok::<_, Infallible>(Displacement::Along(points.points().iter().map(|point| bump(point.p)).collect()))
    })
    .unwrap();
    let bvh = Bvh::new(&ball);
    (ball, bvh)
});

const ALL: std::ops::Range<f32> = 0.0..f32::INFINITY;

#[test]
fn no_ray_slips_out_between_triangles() {
    let (ball, bvh) = &*BALL;
    let inside = Vec3::new(0.01, -0.02, 0.03);
    // Directly at vertices, at edges, and along the axes.
    let vertices = ball.positions.iter().map(|p| *p - inside);
    let edges = (0..ball.indices.len()).map(|t| {
        let [a, b, _] = ball.corners(t);
        (a + b) * 0.5 - inside
    });
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for direction in vertices.chain(edges).chain(axes) {
        let hit = bvh.hit(inside, direction, ALL);
        assert!(hit.is_some(), "{direction}");
        assert!(bvh.blocked(inside, direction, ALL), "{direction}");
        assert!(!bvh.blocked(inside, direction, 0.0..hit.unwrap().t * 0.999), "{direction}");
    }
}

/// Distance to a triangle by the textbook formula.
fn plain([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<f32> {
    let (e1, e2) = ((b - a).as_dvec3(), (c - a).as_dvec3());
    let (o, d) = ((origin - a).as_dvec3(), direction.as_dvec3());
    let h = d.cross(e2);
    let det = e1.dot(h);
    let u = o.dot(h) / det;
    let q = o.cross(e1);
    let v = d.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t as f32)
}

proptest! {
    #[test]
    fn the_nearest_of_all_triangles_is_found(
        o in prop::array::uniform3(-2.0_f32..2.0), d in prop::array::uniform3(-1.0_f32..1.0),
    ) {
        let (ball, bvh) = &*BALL;
        let (o, d) = (Vec3::from(o), Vec3::from(d));
        let distances = (0..ball.indices.len()).filter_map(|t| plain(ball.corners(t), o, d));
        let expected = distances.fold(f32::INFINITY, f32::min);
        let found = bvh.hit(o, d, ALL);
        prop_assert_eq!(found.is_some(), expected.is_finite());
        if let Some(hit) = found {
            prop_assert!((hit.t - expected).abs() <= 1e-4 * expected.abs() + 1e-5);
            let point = ball.point(hit.triangle, hit.barycentric);
            prop_assert!(point.p.distance(o + d * hit.t) < 1e-4 * (1.0 + hit.t * d.length()));
            prop_assert!((point.n.length() - 1.0).abs() < 1e-4 && point.ng.dot(point.n) >= 0.0);
        }
    }
}
