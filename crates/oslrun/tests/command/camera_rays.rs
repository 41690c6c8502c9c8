//! The rays of camera shaders: of the examples, against formulas, and of shaders that make no sense.

use osl_job::picture::camera::CameraShader;
use osl_job::source::load::{self, Request};
use osl_job::{Image, NoSink};
use osl_scene::camera::{Camera, View};
use osl_scene::glam::Vec3;
use osl_scene::lens::{Aim, Lens, LensRay, Rays, rays};
use std::path::Path;

fn view(fov_degrees: f32, resolution: [usize; 2]) -> View {
    let (position, look_at) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.5, -5.0));
    Camera { position, look_at, up: Vec3::Y, fov_degrees, resolution }.view().unwrap()
}

fn lens(file: &Path, params: &[(&str, &str)], view: &View) -> Lens {
    let mut image = Image::default();
    image.shader.file = Some(file.to_path_buf());
    image.shader.params = params.iter().map(|(n, v)| ((*n).to_string(), (*v).to_string())).collect();
    let mut loaded = load::load(&Request::of(&image), &mut NoSink).unwrap_or_else(|e| panic!("{}", e.text));
    let camera = CameraShader::of(&image, &mut loaded, &mut NoSink).unwrap_or_else(|e| panic!("{}", e.text));
    camera.lens(&image, view)
}

fn example(name: &str, params: &[(&str, &str)], view: &View) -> Lens {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/cameras");
    lens(&folder.join(name), params, view)
}

/// The rays of a shader of this text at some places of the image.
fn of_text(text: &str, view: &View, places: &[[f32; 2]]) -> Rays {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.osl");
    std::fs::write(&file, text).unwrap();
    let aims: Vec<Aim> = places.iter().map(|place| Aim { place: *place, sample: [0.25, 0.75] }).collect();
    rays(view, Some(&lens(&file, &[], view)), &aims).unwrap()
}

/// Places of a picture with 64 by 48 pixels.
fn places() -> Vec<[f32; 2]> {
    (0..24).map(|n| [(n % 6) as f32 * 12.5, (n / 6) as f32 * 15.5]).collect()
}

fn equal(own: &LensRay, view: &View, place: [f32; 2]) {
    let ray = view.ray(place[0], place[1]);
    assert!(own.ray.origin.distance(ray.origin) < 1e-6, "{place:?}");
    assert!(own.ray.direction.distance(ray.direction) < 3e-7, "{place:?}: {own:?} {ray:?}");
    for (a, b) in own.ray.direction_derivs.iter().zip(ray.direction_derivs) {
        assert!(a.distance(b) < 1e-4 * b.length(), "{place:?}: {a} {b}");
    }
    assert_eq!(own.ray.origin_derivs, [Vec3::ZERO; 2]);
}

#[test]
fn the_pinhole_has_the_rays_of_the_perspective_camera() {
    let view = view(47.0, [64, 48]);
    for params in [&[][..], &[("fov", "47")]] {
        let lens = example("pinhole.osl", params, &view);
        let aims: Vec<Aim> = places().iter().map(|place| Aim { place: *place, sample: [0.5; 2] }).collect();
        let found = rays(&view, Some(&lens), &aims).unwrap();
        assert!(found.messages.is_empty());
        for (ray, place) in found.rays.iter().zip(places()) {
            equal(ray.as_ref().unwrap(), &view, place);
        }
    }
}

#[test]
fn the_angle_of_a_fisheye_is_linear_in_the_radius() {
    let view = view(40.0, [200, 100]);
    let lens = example("fisheye.osl", &[("fov", "210")], &view);
    let at = |x: f32, y: f32| {
        let aim = Aim { place: [x, y], sample: [0.5; 2] };
        rays(&view, Some(&lens), &[aim]).unwrap().rays[0]
    };
    let [_, _, ahead] = view.axes();
    for (x, y) in [(100.0, 50.0), (110.0, 50.0), (100.0, 80.0), (130.0, 10.0), (70.0, 90.0)] {
        let radius = f64::hypot(f64::from(x) - 100.0, f64::from(y) - 50.0) / 50.0;
        let ray = at(x, y).unwrap().ray;
        let angle = ray.direction.as_dvec3().dot(ahead).clamp(-1.0, 1.0).acos().to_degrees();
        assert!((angle - 105.0 * radius).abs() < 0.02, "{x} {y}: {angle}");
        assert!(ray.direction_derivs.iter().all(|d| (d.length() - 0.0366).abs() < 0.02), "{ray:?}");
    }
    assert_eq!(at(155.0, 50.0), None, "outside of the circle there is no light");
}

/// Behind a lens of radius r that is sharp at distance f, a point at distance z is blurred to a circle of
/// radius r |z - f| / z in the plane of focus, and a ray is off by r |1 - z / f| at distance z.
#[test]
fn the_circle_of_confusion_has_its_size() {
    let view = view(40.0, [64, 48]);
    let (radius, focus) = (0.2_f64, 5.0_f64);
    let lens = example("thin_lens.osl", &[("radius", "0.2"), ("focus", "5"), ("blades", "0")], &view);
    let sample = |n: usize| [(n % 16) as f32 / 16.0 + 0.06, (n / 16) as f32 / 16.0];
    let place = [50.0, 10.0];
    let aims: Vec<Aim> = (0..256).map(|n| Aim { place, sample: sample(n) }).collect();
    let found = rays(&view, Some(&lens), &aims).unwrap().rays;
    let [right, up, ahead] = view.axes();
    let (eye, straight) = (view.position().as_dvec3(), view.ray(50.0, 10.0).direction.as_dvec3());
    for z in [1.0, 2.5, 5.0, 20.0] {
        let middle = straight * (z / straight.dot(ahead));
        let mut largest = 0.0_f64;
        for ray in &found {
            let ray = ray.as_ref().unwrap().ray;
            let (start, way) = (ray.origin.as_dvec3() - eye, ray.direction.as_dvec3());
            let off = start + way * (z / way.dot(ahead)) - middle;
            let off = f64::hypot(off.dot(right), off.dot(up));
            let own = f64::hypot(start.dot(right), start.dot(up)) * (1.0 - z / focus).abs();
            assert!((off - own).abs() < 1e-5 * z.max(1.0), "{z}: {off} {own}");
            largest = largest.max(off);
        }
        let circle = radius * (1.0 - z / focus).abs();
        assert!(
            largest <= circle + 1e-5 * z && largest > 0.95 * circle - 1e-5 * z,
            "{z}: {largest} {circle}"
        );
    }
}

#[test]
fn cameras_in_common_space_have_a_range_and_a_message() {
    let view = view(2.0 * 0.5_f32.atan().to_degrees(), [48, 48]);
    for way in ["I + cross(I, N) * (u - 0.5) + N * (v - 0.5)", "point(\"camera\", u - 0.5, v - 0.5, -1) - P"]
    {
        let text = format!(
            "shader c(output point pos = P, output vector dir = 0, output float tMax = 4) {{ float uv[2] = {{-1, -1}};
             dir = 2 * ({way}); if (!getattribute(\"hit:uv\", 2, uv) || uv[0] != u || uv[1] != v) dir = 0;
             if (u > 0.9) tMax = 0; setmessage(\"octane:throughput\", color(0.5, 0.25, 1)); }}"
        );
        let places: Vec<_> = places().into_iter().filter(|[_, y]| *y < 47.0).collect();
        let found = of_text(&text, &view, &places);
        let said: Vec<&str> = found.messages.iter().map(|said| &*said.message.text).collect();
        assert_eq!(said, ["the range of the ray is empty, so it sees nothing"]);
        for (ray, place) in found.rays.iter().zip(places) {
            if place[0] > 44.0 {
                assert_eq!(*ray, None, "an empty range is no ray");
                continue;
            }
            let ray = ray.unwrap();
            equal(&ray, &view, place);
            assert_eq!(ray.throughput, Vec3::new(0.5, 0.25, 1.0));
            // The range is in units of the direction, which is longer towards the corners.
            let [near, far] = ray.range;
            assert!(near == 0.0 && (8.0..10.0).contains(&far), "{far}");
        }
    }
    let found = of_text("shader c(output point a = P, output vector b = 0) {}", &view, &[[1.0, 1.0]]);
    assert!(found.rays == [None] && found.messages.is_empty(), "no direction is no ray");
    let text = "shader c(output point a = P, output vector b = I, output float clip[2] = {1, 3}) {}";
    assert_eq!(of_text(text, &view, &[[1.0, 1.0]]).rays[0].unwrap().range, [1.0, 3.0]);
}

#[test]
fn rays_that_make_no_sense_are_reported() {
    let view = view(40.0, [64, 48]);
    let camera = |outputs: &str, body: &str| {
        let text = format!(
            "shader c(output point position = 0, output vector direction = vector(0, 0, 1){outputs}) {{ {body} }}"
        );
        of_text(&text, &view, &[[1.0, 1.0], [40.0, 1.0]])
    };
    let throughput = ", output color throughput = 1";
    for body in [
        "direction = 0;",
        "float big = 1e38 * (P[0] + 1e38); direction = big - big;",
        "position = 1e38 * (P[0] + 1e38);",
    ] {
        let found = camera(throughput, body);
        assert_eq!(found.rays, [None; 2], "{body}");
        let said: Vec<_> = found.messages.iter().map(|said| (said.points, said.first)).collect();
        assert_eq!(said, [(Some(2), 0)], "{body}");
    }
    let found = camera(throughput, "if (P[0] > 0.5) direction = 0;");
    assert!(found.rays[0].is_some() && found.rays[1].is_none() && found.messages[0].first == 1);
    let found = camera(throughput, "throughput = -1; direction = 0;");
    assert!(found.rays == [None; 2] && found.messages.is_empty(), "without light, no ray is wanted");
    let found = camera("", "");
    assert!(found.rays == [None; 2], "a camera without this output is black");
    let given = camera(&format!("{throughput}, output vector dDdx = vector(0.5, 0, 0.5)"), "");
    let derivs = given.rays[0].unwrap().ray.direction_derivs;
    assert!((derivs[0].length() - 0.5).abs() < 1e-6 && derivs[1] == Vec3::ZERO, "{derivs:?}");
}
