//! Analytic shapes against finite differences, and rays against the formula.

use crate::common::{assert_watertight, edges};
use glam::{DVec3, Mat4, Vec3};
use osl_scene::camera::Camera;
use osl_scene::mesh::SurfacePoint;
use osl_scene::shape::{Placed, Shape, Solid, Surface};
use osl_scene::subdivide::{Detail, longest_edge};
use osl_scene::surface_points::Footprint;
use proptest::prelude::*;

fn all() -> Vec<Shape> {
    let mut all: Vec<Shape> = Shape::NAMED.iter().map(|(_, shape)| *shape).collect();
    all.extend([
        Shape::Sphere { radius: 3.5 },
        Shape::Cylinder { radius: 0.5, height: 7.0 },
        Shape::Torus { major: 5.0, minor: 0.25 },
        Shape::Plane { size: 0.1, bounded: false },
    ]);
    all
}

/// Numbers strictly between 0 and 1.
fn inside() -> impl Strategy<Value = f64> {
    0.02..0.98
}

proptest! {
    #[test]
    fn tangents_are_finite_differences_and_normals_their_cross_product(
        which in 0..9_usize, face in 0..6_usize, u in inside(), v in inside(),
    ) {
        let shape = all()[which];
        let point = shape.point(face, [u, v]);
        let h = 1.0 / 64.0;
        let at = |u: f64, v: f64| shape.point(face, [u, v]).p.as_dvec3();
        // Central differences of two steps, so that the error is of fourth order.
        let slope = |to: &dyn Fn(f64) -> DVec3| {
            let wide = (to(h) - to(-h)) / (2.0 * h);
            let half = (to(h / 2.0) - to(-h / 2.0)) / h;
            ((half * 4.0 - wide) / 3.0).as_vec3()
        };
        let dpdu = slope(&|d| at(u + d, v));
        let dpdv = slope(&|d| at(u, v + d));
        let scale = shape.bounds().radius().min(100.0);
        prop_assert!(dpdu.distance(point.dpdu) < 1e-3 * scale, "{dpdu} {}", point.dpdu);
        prop_assert!(dpdv.distance(point.dpdv) < 1e-3 * scale, "{dpdv} {}", point.dpdv);
        let n = point.dpdu.cross(point.dpdv).normalize();
        prop_assert!(n.distance(point.n) < 1e-5, "{n} {}", point.n);
        prop_assert!((point.n.length() - 1.0).abs() < 1e-6);
        if !matches!(shape, Shape::Plane { .. } | Shape::Torus { .. }) {
            prop_assert!(point.n.dot(point.p) > 0.0, "outwards");
        }
    }

    /// A ray from outside towards a point of the shape hits that point or an earlier one on the shape.
    #[test]
    fn rays_find_points(
        which in 0..9_usize, face in 0..6_usize, u in inside(), v in inside(),
        away in (-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0), far in 0.5_f32..50.0,
    ) {
        let shape = all()[which];
        let target = shape.point(face, [u, v]);
        let away = Vec3::new(away.0, away.1, away.2);
        prop_assume!(away.dot(target.n).abs() > 0.05);
        let origin = target.p + away * far;
        let (t, found) = shape.hit(origin, -away, 0.0..f32::INFINITY).unwrap();
        let scale = target.p.length() + far;
        prop_assert!(t <= far + 1e-4 * scale);
        prop_assert!((origin - away * t).distance(found.p) < 2e-5 * scale, "{t} {found:?}");
        if (t - far).abs() < 1e-3 {
            prop_assert!((f64::from(found.uv.x) - u).abs() < 1e-3 * f64::from(scale) / f64::from(target.dpdu.length()));
            prop_assert!(found.n.distance(target.n) < 1e-3 * scale);
        }
        prop_assert_eq!(shape.hit(origin, -away, 0.0..t * 0.999), None, "nothing is before it");
    }

    #[test]
    fn wild_rays_are_survived(
        which in 0..9_usize,
        o in prop::array::uniform3(prop::num::f32::ANY), d in prop::array::uniform3(prop::num::f32::ANY),
    ) {
        if let Some((t, point)) = all()[which].hit(Vec3::from(o), Vec3::from(d), 0.0..f32::INFINITY) {
            prop_assert!(t >= 0.0 && point.n.is_finite());
        }
    }
}

/// A point of a surface at a position on the image.
fn seen(surface: &dyn Surface, camera: &Camera, x: f32, y: f32) -> Option<(SurfacePoint, Footprint)> {
    let ray = camera.view().unwrap().ray(x, y);
    let (_, point) = surface.hit(ray.origin, ray.direction, 0.0..f32::INFINITY)?;
    Some((point, Footprint::of(&point, &ray)))
}

fn camera() -> Camera {
    Camera {
        position: Vec3::new(1.5, 2.0, 5.0),
        look_at: Vec3::ZERO,
        up: Vec3::Y,
        fov_degrees: 40.0,
        resolution: [512, 512],
    }
}

#[test]
fn footprints_are_differences_between_neighbouring_pixels() {
    for (name, shape) in Shape::NAMED {
        let mut compared = 0;
        for (x, y) in [(250.5, 250.5), (200.5, 280.5), (300.5, 240.5), (270.5, 330.5), (350.5, 200.5)] {
            let step = 0.25;
            let Some((here, footprint)) = seen(&shape, &camera(), x, y) else { continue };
            let neighbours = [(x + step, y), (x, y - step)];
            for (axis, (x, y)) in neighbours.into_iter().enumerate() {
                let Some((there, _)) = seen(&shape, &camera(), x, y) else { continue };
                if here.n.distance(there.n) > 0.02 {
                    continue;
                }
                let dp = (there.p - here.p) / step;
                let duv = (there.uv - here.uv) / step;
                assert!(dp.distance(footprint.p[axis]) < 0.03 * dp.length(), "{name} {dp} {footprint:?}");
                assert!(duv.distance(footprint.uv[axis]) < 0.04 * duv.length(), "{name} {duv} {footprint:?}");
                compared += 1;
            }
            let normal = footprint.p[0].cross(footprint.p[1]).normalize();
            assert!(normal.distance(here.ng) < 1e-3, "slopes turn towards the camera: {name} {normal}");
        }
        assert!(compared >= 2, "{name}");
    }
}

#[test]
fn what_is_moved_is_hit_where_it_is() {
    let matrix = Mat4::from_rotation_y(0.7)
        * Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0))
        * Mat4::from_scale(Vec3::new(1.0, 2.0, 0.5));
    for (name, shape) in Shape::NAMED {
        let placed = Placed::new(shape, matrix).unwrap();
        let triangles = shape.triangles(&matrix, &Detail::Level(6)).unwrap().0;
        let solid = Solid::new(triangles);
        let bounds = placed.bounds();
        let camera = Camera {
            position: bounds.center() + Vec3::new(2.0, 5.0, 9.0),
            look_at: bounds.center(),
            ..camera()
        };
        let mut compared = 0;
        for i in 0..1600_u32 {
            let (x, y) = ((i % 40) as f32 * 12.5, (i / 40) as f32 * 12.5);
            let (Some((a, fa)), Some((b, fb))) = (seen(&placed, &camera, x, y), seen(&solid, &camera, x, y))
            else {
                continue;
            };
            // At silhouettes, the triangles may be far behind the surface.
            if a.n.dot(camera.position - a.p) < 1.0 {
                continue;
            }
            assert!(a.p.distance(b.p) < 0.01, "{name} {a:?} {b:?}");
            assert!(a.n.distance(b.n) < 0.02 && a.ng.distance(b.ng) < 0.1, "{name}");
            let seam = (a.uv.x - b.uv.x).abs() > 0.5;
            assert!(seam || a.uv.distance(b.uv) < 0.01, "{name}");
            assert!(a.dpdu.distance(b.dpdu) < 0.02 * a.dpdu.length() + 0.05, "{name} {} {}", a.dpdu, b.dpdu);
            assert!(fa.p[0].distance(fb.p[0]) < 0.2 * fa.p[0].length(), "{name}");
            compared += 1;
        }
        assert!(compared > 20, "{name}: {compared}");
        let (a, b) = (placed.area(), solid.area());
        assert!((a - b).abs() < 0.01 * a, "{name}: {a} {b}");
    }
    assert!(Placed::new(Shape::named("cube").unwrap(), Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0))).is_none());
}

#[test]
fn areas_are_those_of_the_formulas() {
    use std::f32::consts::{PI, TAU};
    let close = |found: f32, wanted: f32| (found - wanted).abs() <= 1e-6 * wanted;
    let known = [
        (Shape::Sphere { radius: 3.5 }, 4.0 * PI * 3.5 * 3.5),
        (Shape::Cylinder { radius: 0.5, height: 7.0 }, TAU * 0.5 * 7.0),
        (Shape::Torus { major: 5.0, minor: 0.25 }, TAU * TAU * 5.0 * 0.25),
        (Shape::Plane { size: 3.0, bounded: true }, 9.0),
        (Shape::Cube { size: 3.0 }, 54.0),
    ];
    let turned = Mat4::from_rotation_x(1.0) * Mat4::from_translation(Vec3::ONE);
    for (shape, area) in known {
        assert!(close(shape.area(), area), "{shape:?}: {}", shape.area());
        let larger = Placed::new(shape, turned * Mat4::from_scale(Vec3::splat(-3.0))).unwrap();
        assert!(close(larger.area(), 9.0 * area), "{shape:?}: {}", larger.area());
    }
    assert_eq!(Shape::Plane { size: 1.0, bounded: false }.area(), f32::INFINITY);
    // A prolate and an oblate spheroid, and a flat box.
    let stretched = |name: &str, x: f32, y: f32, z: f32| {
        Placed::new(Shape::named(name).unwrap(), Mat4::from_scale(Vec3::new(x, y, z))).unwrap().area()
    };
    let bend = 0.75_f32.sqrt();
    assert!(close(stretched("sphere", 1.0, 2.0, 1.0), TAU * (1.0 + 2.0 / bend * bend.asin())));
    assert!(close(stretched("sphere", 2.0, 1.0, 2.0), TAU * (4.0 + 1.0 / bend * bend.atanh())));
    assert!(close(stretched("cube", 1.0, 0.5, 2.0), 2.0 * (2.0 + 8.0 + 4.0)));
}

#[test]
fn shapes_become_closed_triangles_that_face_outwards() {
    for (name, shape) in Shape::NAMED {
        for level in [0, 1, 4] {
            let (t, ..) = shape.triangles(&Mat4::IDENTITY, &Detail::Level(level)).unwrap();
            match name {
                "sphere" | "torus" | "cube" => assert_watertight(&t),
                _ => assert!(edges(&t).into_values().all(|uses| uses[0] <= 1 && uses[1] <= 1)),
            }
            assert_eq!(t.places.len(), t.positions.len());
            for triangle in 0..t.indices.len() {
                let [a, b, c] = t.corners(triangle);
                let flat = (b - a).cross(c - a);
                assert!(flat.length() > 0.0, "{name} level {level}: a triangle without area");
                let point = t.point(triangle, [1.0 / 3.0, 1.0 / 3.0]);
                assert!(flat.dot(point.n) > 0.0, "{name} level {level}");
            }
        }
        let view = camera().view().unwrap();
        let (t, level, fine) =
            shape.triangles(&Mat4::IDENTITY, &Detail::Pixels { view: &view, edge: 4.0 }).unwrap();
        assert!(fine && longest_edge(&t, &view) <= 4.0, "{name} level {level}");
    }
}
