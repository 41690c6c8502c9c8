//! Catmull-Clark surfaces against limit masks, splines and deep subdivision; irregular meshes.

use crate::common::{assert_watertight, cube, cube_with_uvs, edges, grid};
use glam::{DVec3, Mat4, Vec2, Vec3};
use osl_limits::{Halt, Limits};
use osl_scene::camera::Camera;
use osl_scene::mesh::{Mesh, MeshError, Oddities, Triangles};
use osl_scene::shape::Shape;
use osl_scene::subdivide::{Detail, Scheme, Tessellated, longest_edge, tessellate, tessellate_within};
use proptest::prelude::*;

fn smooth(mesh: &Mesh, level: u32) -> Triangles {
    tessellate(mesh, Scheme::CatmullClark, &Detail::Level(level)).unwrap().triangles
}

fn find(triangles: &Triangles, near: Vec3) -> (Vec3, Vec3) {
    let distance = |at: &usize| triangles.positions[*at].distance(near);
    let at = (0..triangles.positions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
    (triangles.positions[at], triangles.normals[at])
}

#[test]
fn the_cube_goes_to_its_limit_at_every_level() {
    for level in 0..=5 {
        let t = smooth(&cube(), level);
        // Corner: (9 v + 4 Σ edges + Σ faces) / 24 of the cube itself, which is v / 2.
        let (p, n) = find(&t, Vec3::ONE);
        assert!(p.distance(Vec3::splat(0.5)) < 1e-7, "level {level}: {p}");
        assert!(n.distance(Vec3::ONE.normalize()) < 1e-6, "level {level}: {n}");
        if level == 0 {
            continue;
        }
        // Middle of a face: (16 f + 4 Σ edges + Σ corners) / 36 of level 1, where f = 1, edges are at 3/4 and
        // corners at 5/9: 68/81.
        let (p, n) = find(&t, Vec3::X);
        assert!(p.distance(Vec3::X * (68.0 / 81.0)) < 1e-7, "level {level}: {p}");
        assert!(n.distance(Vec3::X) < 1e-6, "level {level}: {n}");
        // Middle of an edge: a regular vertex of level 1 at (3/4, 3/4, 0), between two corners at 5/9 and two
        // faces at 1, with four more midpoints of edges after them: (16 · 3/4 + 4 (2 · 5/9 + 1) + 2 · 3/4) /
        // 36 = 395/648.
        let (p, _) = find(&t, Vec3::new(1.0, 1.0, 0.0));
        let expected = Vec3::new(395.0 / 648.0, 395.0 / 648.0, 0.0);
        assert!(p.distance(expected) < 1e-7, "level {level}: {p} {expected}");
    }
}

#[test]
fn levels_lie_on_one_surface() {
    // Vertices on the limit surface at level 2 keep their position at level 4.
    let (coarse, deep) = (smooth(&cube(), 2), smooth(&cube(), 4));
    for p in &coarse.positions {
        let (near, _) = find(&deep, *p);
        assert!(near.distance(*p) < 1e-6, "{p} {near}");
    }
}

#[test]
fn limit_normals_are_those_of_fine_triangles() {
    // A pyramid on a pentagon: valences 3 and 5, and a face with five corners.
    let ring = |i: i32| {
        let angle = i as f32 * std::f32::consts::TAU / 5.0;
        Vec3::new(angle.cos(), angle.sin(), 0.3 * (i % 2) as f32)
    };
    let mut mesh = Mesh { positions: (0..5).map(ring).collect(), ..Mesh::default() };
    mesh.positions.push(Vec3::Z * 1.5);
    for i in 0..5 {
        mesh.face_sizes.push(3);
        mesh.corners.extend([i, (i + 1) % 5, 5]);
    }
    mesh.face_sizes.push(5);
    mesh.corners.extend([4, 3, 2, 1, 0]);
    let t = smooth(&mesh, 6);
    assert_watertight(&t);
    let around = t.place_normals();
    for (n, place) in t.normals.iter().zip(&t.places) {
        assert!((n.length() - 1.0).abs() < 1e-5);
        assert!(n.dot(around[*place as usize]) > 0.9995, "{n} {}", around[*place as usize]);
    }
}

#[test]
fn a_border_is_a_spline_and_its_normals_are_exact() {
    // Bent along x and constant along y: the surface is the cubic spline of the profile.
    let mut mesh = grid(6);
    mesh.positions.iter_mut().for_each(|p| p.z = 0.1 * p.x * p.x);
    let t = smooth(&mesh, 3);
    // A uniform cubic spline through values 0.1 k² is 0.1 x² + 0.1/3.
    for (p, n) in t.positions.iter().zip(&t.normals) {
        let inside = p.x > 1.0 && p.x < 5.0;
        if inside {
            assert!((p.z - (0.1 * p.x * p.x + 0.1 / 3.0)).abs() < 1e-5, "{p}");
            let exact = DVec3::new(-0.2 * f64::from(p.x), 0.0, 1.0).normalize().as_vec3();
            // Except at the border, whose vertices have no tangent of their own across it.
            assert!(n.distance(exact) < 2e-4, "{p}: {n} {exact}");
        }
    }
    let open = edges(&t).into_values().filter(|uses| *uses != [1, 1]).count();
    assert_eq!(open, 4 * 6 * 8, "the border has the edges of six faces a side, each in eight");
}

#[test]
fn creases_keep_edges_sharp_for_so_many_levels() {
    let mut mesh = cube();
    let sharp = |mesh: &mut Mesh, s: f32| {
        mesh.creases = (0..8_u32)
            .flat_map(|v| [1, 2, 4].map(|bit| [v, v ^ bit]))
            .filter(|[a, b]| a < b)
            .map(|ends| (ends, s))
            .collect();
    };
    sharp(&mut mesh, f32::INFINITY);
    let hard = smooth(&mesh, 3);
    assert_eq!(find(&hard, Vec3::ONE).0, Vec3::ONE, "three sharp edges hold a corner");
    assert!(hard.positions.iter().all(|p| (p.abs().max_element() - 1.0).abs() < 1e-6), "the cube stays one");
    let mut last = 0.5;
    for s in [0.5, 1.0, 2.0, 3.0] {
        sharp(&mut mesh, s);
        let corner = find(&smooth(&mesh, 5), Vec3::ONE).0.x;
        assert!(corner > last && corner < 1.0, "sharpness {s}: {corner} after {last}");
        last = corner;
    }
}

#[test]
fn coordinates_are_linear_and_tangents_follow_them() {
    let t = smooth(&cube_with_uvs(), 4);
    assert_watertight(&t);
    assert_eq!(t.positions.len(), 6 * 17 * 17, "each face has its own coordinates");
    assert_eq!(t.place_count(), 1538);
    for vertex in 0..t.positions.len() {
        let (u, v, n) = (t.dpdu[vertex], t.dpdv[vertex], t.normals[vertex]);
        assert!(u.dot(n).abs() < 1e-3 && v.dot(n).abs() < 1e-3);
        assert!(u.cross(v).dot(n) > 0.0, "coordinates turn as the face does");
    }
    let flat = tessellate(&grid(2), Scheme::Linear, &Detail::Level(2)).unwrap().triangles;
    for vertex in 0..flat.positions.len() {
        assert_eq!(flat.uvs[vertex], Vec2::new(flat.positions[vertex].x, flat.positions[vertex].y) / 2.0);
        assert!(flat.dpdu[vertex].distance(Vec3::X * 2.0) < 1e-5);
        assert!(flat.dpdv[vertex].distance(Vec3::Y * 2.0) < 1e-5);
    }
}

fn camera(distance: f32) -> Camera {
    Camera {
        position: Vec3::new(0.3, 0.4, 1.0).normalize() * distance,
        look_at: Vec3::ZERO,
        up: Vec3::Y,
        fov_degrees: 30.0,
        resolution: [320, 240],
    }
}

#[test]
fn edges_are_as_short_as_asked_and_no_shorter_than_needed() {
    let mut before = u32::MAX;
    for distance in [4.0, 16.0, 64.0, 1000.0] {
        let view = camera(distance).view().unwrap();
        let pixels = 8.0;
        let detail = Detail::Pixels { view: &view, edge: pixels };
        let Tessellated { triangles, level, fine, .. } =
            tessellate(&cube(), Scheme::CatmullClark, &detail).unwrap();
        assert!(fine && longest_edge(&triangles, &view) <= pixels, "distance {distance}");
        if level > 0 {
            assert!(longest_edge(&smooth(&cube(), level - 1), &view) > pixels, "distance {distance}");
        }
        assert!(level < before, "farther is coarser: {level} after {before}");
        before = level;
        // Between vertices, the triangles deviate from the limit surface by far less than an edge.
        let deep = smooth(&cube(), level + 3);
        for triangle in (0..triangles.indices.len()).step_by(triangles.indices.len() / 12) {
            let [a, b, c] = triangles.corners(triangle);
            let middle = (a + b + c) / 3.0;
            let (near, _) = find(&deep, middle);
            let spacing = a.distance(b).max(b.distance(c)).max(c.distance(a)) / 8.0;
            // Pixels for a unit of length there: the image is 320 wide and 30 degrees.
            let pixel = 160.0 / (15.0_f32.to_radians().tan() * view.depth(middle) as f32);
            assert!((near.distance(middle) - spacing) * pixel < 0.5 * pixels as f32);
        }
    }
    assert_eq!(before, 0, "from far away the cube itself does");
}

#[test]
fn a_camera_on_the_surface_ends() {
    let view = Camera { position: Vec3::new(0.5, 0.5, 0.5), ..camera(1.0) }.view().unwrap();
    let detail = Detail::Pixels { view: &view, edge: 1e-3 };
    let found = tessellate(&grid(40), Scheme::Linear, &detail).unwrap();
    assert!(!found.fine && found.triangles.indices.len() <= 1 << 24);
}

#[test]
fn odd_meshes_are_survived_and_counted() {
    // Three faces share one edge.
    let mut fin = grid(2);
    fin.positions.push(Vec3::new(1.0, 0.0, 1.0));
    fin.positions.push(Vec3::new(1.0, 1.0, 1.0));
    fin.face_sizes.push(4);
    fin.corners.extend([1, 4, 10, 9]);
    (fin.uvs, fin.uv_corners) = (Vec::new(), Vec::new());
    let found = tessellate(&fin, Scheme::CatmullClark, &Detail::Level(2)).unwrap();
    assert_eq!(found.oddities.bad_edges, 1);
    assert!(found.oddities.to_string().starts_with("1 edges that"), "{}", found.oddities);

    // Two cubes that touch in a corner.
    let (mut two, other) = (cube(), cube());
    two.face_sizes.extend(&other.face_sizes);
    two.corners.extend(other.corners.iter().map(|v| if *v == 0 { 7 } else { v + 7 }));
    two.positions.extend(other.positions[1..].iter().map(|p| *p + 2.0));
    let found = tessellate(&two, Scheme::CatmullClark, &Detail::Level(3)).unwrap();
    assert_eq!(found.oddities, Oddities { bad_vertices: 1, ..Oddities::default() });
    assert_watertight(&found.triangles);

    // Faces without area are left out, and repeated corners are merged.
    let mut flat = cube();
    flat.face_sizes.extend([2, 3, 1]);
    flat.corners.extend([0, 1, 0, 1, 0, 5]);
    let found = tessellate(&flat, Scheme::CatmullClark, &Detail::Level(1)).unwrap();
    assert_eq!(found.oddities, Oddities { degenerate_faces: 3, ..Oddities::default() });
    assert_watertight(&found.triangles);

    // An inverted face makes its border sharp and leaves no gap.
    let mut turned = cube();
    turned.corners[0..4].reverse();
    let found = tessellate(&turned, Scheme::CatmullClark, &Detail::Level(2)).unwrap();
    assert_eq!(found.oddities.bad_edges, 4);
    assert!(edges(&found.triangles).into_values().all(|uses| uses[0] + uses[1] == 2));
}

#[test]
fn wrong_meshes_are_errors() {
    let wrong = |mesh: Mesh| tessellate(&mesh, Scheme::CatmullClark, &Detail::Level(1)).unwrap_err();
    assert_eq!(wrong(Mesh::default()), MeshError::Empty);
    let mut mesh = cube();
    mesh.corners[3] = 8;
    assert_eq!(wrong(mesh), MeshError::Index { what: "vertex", index: 8, count: 8 });
    let mut mesh = cube();
    mesh.face_sizes.pop();
    assert_eq!(wrong(mesh), MeshError::Corners { sizes: 20, corners: 24 });
    let mut mesh = cube();
    mesh.positions[5].y = f32::NAN;
    assert_eq!(wrong(mesh), MeshError::NotFinite { what: "vertex", index: 5 });
    let mut mesh = cube();
    mesh.positions[5].y = -1.8e25;
    assert_eq!(wrong(mesh), MeshError::Far { index: 5 });
    let mut mesh = cube_with_uvs();
    mesh.uv_corners.pop();
    assert_eq!(wrong(mesh), MeshError::Count { what: "surface coordinates", corners: 24, count: 23 });
    let mesh = Mesh { face_sizes: vec![2], corners: vec![0, 1], ..cube() };
    assert_eq!(wrong(mesh), MeshError::Empty, "nothing is left");
    let deep = tessellate(&cube(), Scheme::CatmullClark, &Detail::Level(30));
    assert_eq!(deep.unwrap_err(), MeshError::TooFine { most: 1 << 22 });
}

#[test]
fn subdivision_stops() {
    let limits = Limits::default();
    let cut = |detail| tessellate_within(&cube(), Scheme::CatmullClark, &detail, &limits);
    assert!(cut(Detail::Level(3)).is_ok());
    limits.halt(Halt::Time);
    assert_eq!(cut(Detail::Level(3)).unwrap_err(), MeshError::Halted(Halt::Time));
    let sphere = Shape::Sphere { radius: 1.0 };
    let shape = sphere.triangles_within(&Mat4::IDENTITY, &Detail::Level(2), &limits);
    assert!(matches!(shape, Err(MeshError::Halted(Halt::Time))));
}

proptest! {
    /// Random faces over a few vertices give a result or an error: finite, with normals of length 1, and
    /// every face covered.
    #[test]
    fn any_faces_are_survived(
        sizes in prop::collection::vec(0_u32..6, 1..8),
        vertices in prop::collection::vec(0_u32..7, 48),
        sharp in prop::collection::vec((0_u32..7, 0_u32..7, prop::num::f32::ANY), 0..4),
        level in 0_u32..3,
        smooth in any::<bool>(),
    ) {
        let corners: u32 = sizes.iter().sum();
        let mesh = Mesh {
            positions: (0..7).map(|i| Vec3::new(i as f32, (i * i % 5) as f32, (i % 3) as f32)).collect(),
            face_sizes: sizes,
            corners: vertices[..corners as usize].to_vec(),
            creases: sharp.into_iter().map(|(a, b, s)| ([a, b], s)).collect(),
            ..Mesh::default()
        };
        let scheme = if smooth { Scheme::CatmullClark } else { Scheme::Linear };
        if let Ok(found) = tessellate(&mesh, scheme, &Detail::Level(level)) {
            let t = found.triangles;
            prop_assert!(t.positions.iter().chain(&t.normals).all(|p| p.is_finite()));
            prop_assert!(t.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
            prop_assert!(t.indices.iter().flatten().all(|v| (*v as usize) < t.positions.len()));
            let bounds = t.bounds();
            // The surface is inside the hull of its vertices.
            prop_assert!(bounds.min.min_element() > -1e-3 && bounds.max.max_element() < 6.001);
        }
    }

    /// Flat stays flat and closed stays closed, whatever the heights of the corners.
    #[test]
    fn bumpy_cubes_stay_closed(moves in prop::collection::vec(-0.4_f32..0.4, 24), level in 0_u32..4) {
        let mut mesh = cube();
        for (p, by) in mesh.positions.iter_mut().zip(moves.chunks(3)) {
            *p += Vec3::from_slice(by);
        }
        assert_watertight(&smooth(&mesh, level));
    }
}
