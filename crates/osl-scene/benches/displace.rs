//! From a cube to a displaced surface: the control mesh of `nonlinear_noise.ass` at level 7, 98,306 vertices,
//! moved by osl/nonlinear_noise.osl with the parameters of the scene and with its most expensive kind of
//! noise. Expect: both together take well under half a second on two cores.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use osl::stages::{self, Compiled};
use osl_exec::{Plane, PointSource, RunOptions, Services};
use osl_ir::passes;
use osl_scene::displace::{Displacement, displace};
use osl_scene::glam::Vec3;
use osl_scene::mesh::{Bvh, Mesh, Triangles};
use osl_scene::subdivide::{Detail, Scheme, tessellate};
use osl_scene::surface_points::SurfacePoints;
use osl_syntax::NoFiles;
use std::convert::Infallible;
use std::path::Path;

/// The cube of the scene: 500 wide, standing on y = 0.
fn cube() -> Mesh {
    let corner = |i: i32| {
        let (x, z) = [(-1, -1), (1, -1), (1, 1), (-1, 1)][i as usize % 4];
        Vec3::new(250.0 * x as f32, if i < 4 { 0.0 } else { 500.0 }, 250.0 * z as f32)
    };
    Mesh {
        positions: (0..8).map(corner).collect(),
        face_sizes: vec![4; 6],
        corners: vec![0, 4, 5, 1, 1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0, 3, 0, 1, 2, 4, 7, 6, 5],
        ..Mesh::default()
    }
}

fn compile(kind: &str) -> Compiled {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/nonlinear_noise.osl");
    let text = std::fs::read_to_string(&path).unwrap();
    let checked = stages::check("nonlinear_noise.osl", &text, &NoFiles, &osl_syntax::Options::default());
    let values = [("type", kind), ("freq", "0.025"), ("amplitude", "80"), ("bloom", "1")];
    let values = values.map(|(name, value)| (name.to_string(), value.to_string()));
    let body = stages::lower(&checked.program.unwrap(), &values).unwrap();
    let points = SurfacePoints::default();
    let options = passes::Options {
        outputs: Some(vec!["disp".into()]),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        ..passes::Options::default()
    };
    stages::finish(body, &options)
}

fn smooth() -> Triangles {
    tessellate(&cube(), Scheme::CatmullClark, &Detail::Level(7)).unwrap().triangles
}

fn moved(triangles: &mut Triangles, compiled: &Compiled, services: &Services) {
    let shade = |points: &SurfacePoints| {
        let options = RunOptions::default();
        let frame = osl_exec::run(&compiled.program, services, points, &options, &|_| ()).unwrap();
        let values: Vec<Vec<f32>> = frame.planes.iter().map(Plane::floats).collect();
        let [x, y, z] = values.as_slice() else { panic!("a vector") };
        let by = x.iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(*x, *y, *z)).collect();
        Ok::<_, Infallible>(Displacement::By(by))
    };
    let done = displace(triangles, shade).unwrap();
    assert_eq!((done.points, done.stayed), (98_306, 0));
}

fn surfaces(c: &mut Criterion) {
    let mut group = c.benchmark_group("surfaces");
    group.sample_size(20);
    let services = Services::default();
    group.bench_function("tessellate to level 7", |b| b.iter(smooth));
    for kind in ["perlin", "recursive"] {
        let compiled = compile(kind);
        group.bench_function(format!("tessellate and displace, {kind}"), |b| {
            b.iter(|| {
                let mut triangles = smooth();
                moved(&mut triangles, &compiled, &services);
                triangles
            });
        });
    }
    let mut triangles = smooth();
    moved(&mut triangles, &compile("perlin"), &services);
    group.bench_function("sort into boxes", |b| b.iter(|| Bvh::new(&triangles)));
    group.finish();
}

criterion_group!(benches, surfaces);
criterion_main!(benches);
