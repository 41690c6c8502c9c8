//! Displacement: moved points, closed seams, and tolerated errors.

use crate::common::{assert_watertight, cube, cube_with_uvs, grid};
use glam::Vec3;
use osl_exec::PointSource;
use osl_hir::hir::Global;
use osl_ir::ir::Axis;
use osl_scene::displace::{Displaced, Displacement, displace};
use osl_scene::mesh::{Mesh, Triangles};
use osl_scene::subdivide::{Detail, Scheme, tessellate};
use osl_scene::surface_points::SurfacePoints;
use std::convert::Infallible;

fn triangles(mesh: &Mesh, scheme: Scheme, level: u32) -> Triangles {
    tessellate(mesh, scheme, &Detail::Level(level)).unwrap().triangles
}

fn run(t: &mut Triangles, f: impl FnOnce(&SurfacePoints) -> Displacement) -> Displaced {
    displace(t, |points| Ok::<_, Infallible>(f(points))).unwrap()
}

/// A height that differs everywhere.
fn rough(points: &SurfacePoints) -> Displacement {
    let height = |p: Vec3| 0.2 * ((p.x * 7.1).sin() + (p.y * 5.3).sin() * (p.z * 9.7).cos());
    Displacement::Along(points.points().iter().map(|point| height(point.p)).collect())
}

#[test]
fn seams_stay_closed() {
    for mesh in [cube(), cube_with_uvs()] {
        for scheme in [Scheme::CatmullClark, Scheme::Linear] {
            let mut t = triangles(&mesh, scheme, 4);
            let before = t.clone();
            let done = run(&mut t, rough);
            assert_eq!((done.points, done.stayed), (1538, 0));
            assert!(done.farthest > 0.1);
            assert_watertight(&t);
            assert_eq!(t.indices, before.indices);
            assert!(t.bounds().radius() != before.bounds().radius());
            assert!(t.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        }
    }
}

#[test]
fn a_swollen_surface_keeps_its_normals() {
    let mut t = triangles(&cube(), Scheme::CatmullClark, 6);
    let before = t.clone();
    run(&mut t, |points| Displacement::Along(vec![0.25; points.count()]));
    for vertex in 0..t.positions.len() {
        let way = t.positions[vertex] - before.positions[vertex];
        assert!(way.distance(before.normals[vertex] * 0.25) < 1e-6);
        // An offset surface has the same normals.
        assert!(t.normals[vertex].dot(before.normals[vertex]) > 0.999, "{}", t.normals[vertex]);
    }
}

#[test]
fn normals_and_tangents_are_those_of_the_new_surface() {
    let mut t = triangles(&grid(4), Scheme::Linear, 5);
    let height = |p: Vec3| 0.3 * (p.x * 2.0).sin() * p.y;
    run(&mut t, |points| {
        Displacement::By(points.points().iter().map(|point| Vec3::Z * height(point.p)).collect())
    });
    for vertex in 0..t.positions.len() {
        let p = t.positions[vertex];
        if p.x < 0.1 || p.y < 0.1 || p.x > 3.9 || p.y > 3.9 {
            continue;
        }
        let (dx, dy) = (0.6 * (p.x * 2.0).cos() * p.y, 0.3 * (p.x * 2.0).sin());
        let exact = Vec3::new(-dx, -dy, 1.0).normalize();
        assert!(t.normals[vertex].distance(exact) < 2e-3, "{p}: {} {exact}", t.normals[vertex]);
        assert!(t.dpdu[vertex].distance(Vec3::new(1.0, 0.0, dx) * 4.0) < 2e-2, "{p}: {}", t.dpdu[vertex]);
        assert!(t.dpdv[vertex].distance(Vec3::new(0.0, 1.0, dy) * 4.0) < 2e-2, "{p}: {}", t.dpdv[vertex]);
    }
}

#[test]
fn points_know_their_surroundings() {
    let t = triangles(&grid(4), Scheme::Linear, 2);
    let points = t.shading_points();
    assert_eq!(points.count(), 17 * 17);
    let mut lanes = vec![0.0; 3 * 17 * 17];
    points.fill_deriv(Global::P, Axis::X, 0, 17 * 17, &mut lanes);
    // Four edges per quarter, and the diagonals.
    assert!(lanes[..17 * 17].iter().all(|dx| (0.25..0.36).contains(dx)), "along u");
    assert!(lanes[17 * 17..].iter().all(|x| x.abs() < 1e-6));
    points.fill_deriv(Global::V, Axis::Y, 0, 17 * 17, &mut lanes);
    assert!(lanes[..17 * 17].iter().all(|dv| (0.0624..0.09).contains(dv)), "v goes to 1 over four units");
    let bare = triangles(&cube(), Scheme::CatmullClark, 1).shading_points();
    assert!(bare.points().iter().all(|p| p.dpdu == Vec3::ZERO), "no coordinates, no tangents");
}

#[test]
fn what_is_not_finite_stays() {
    let mut t = triangles(&cube(), Scheme::CatmullClark, 2);
    let before = t.clone();
    let done = run(&mut t, |points| {
        let mut by = vec![Vec3::X; points.count() - 1];
        by[3].y = f32::NAN;
        by[4].z = f32::INFINITY;
        Displacement::By(by)
    });
    assert_eq!((done.stayed, done.farthest), (3, 1.0), "nan, infinite, missing");
    assert_eq!(t.positions[3], before.positions[3]);
    assert!(t.positions.iter().all(|p| p.is_finite()));
    assert_watertight(&t);
}

#[test]
fn positions_are_taken_as_they_are() {
    let mut t = triangles(&cube(), Scheme::Linear, 3);
    run(&mut t, |points| Displacement::To(points.points().iter().map(|point| point.p.normalize()).collect()));
    assert!(t.positions.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
    assert!(t.normals.iter().zip(&t.positions).all(|(n, p)| n.dot(*p) > 0.95), "a ball");
}

#[test]
fn errors_leave_the_surface_alone() {
    let mut t = triangles(&cube(), Scheme::Linear, 1);
    let before = t.clone();
    assert_eq!(displace(&mut t, |_| Err("no")), Err("no"));
    assert_eq!(t, before);
}
