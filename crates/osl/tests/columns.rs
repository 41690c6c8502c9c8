//! Data, rays and messages in columns: the results are those of points that are asked one by one.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl::{Column, CompileOptions, Group, Outputs, Points, Ray, Renderer, RendererServices, RunOptions};
use osl::{Shader, Value};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

const COUNT: usize = 3000;

const TEXT: &str = r#"surface s(
    float wear = 9 [[ int lockgeom = 0 ]], int id = -1 [[ int lockgeom = 0 ]], color paint = 0.5 [[ int lockgeom = 0 ]],
    float gone = 7 [[ int lockgeom = 0 ]],
    output float w = 0, output int i = 0, output color c = 0, output float g = 0, output float heat = 0,
    output float dx = 0, output int hits = 0, output float distance = -1, output vector side = 0, output int wrong = 4)
{
    w = wear; i = id; c = paint; g = gone; dx = Dx(wear);
    getattribute("lamp", "heat", heat);
    getattribute("wear", wrong);
    if (u > 0.3 && trace(P, vector(u, 1, 0))) {
        hits = 1;
        getmessage("trace", "hitdist", distance);
        getmessage("trace", "N", side);
    }
}"#;

/// Answers in columns or one by one, and counts how often it was asked.
struct Scene {
    columns: bool,
    asked: Arc<AtomicUsize>,
}

impl Scene {
    fn wear(point: usize) -> f32 {
        point as f32 * 0.25
    }

    fn heat(point: usize) -> f32 {
        (point % 17) as f32
    }

    fn count(&self) {
        self.asked.fetch_add(1, Ordering::Relaxed);
    }
}

impl RendererServices for Scene {
    fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
        self.count();
        ((object, name) == ("lamp", "heat")).then(|| Scene::heat(point).into())
    }

    fn user_data(&self, name: &str, point: usize) -> Option<Value> {
        self.count();
        match name {
            "wear" => Some(Scene::wear(point).into()),
            "id" => Some((point as i32 - 5).into()),
            "paint" => Some([point as f32, 1.0, -0.5].into()),
            _ => None,
        }
    }

    fn attributes(&self, object: &str, name: &str, points: Range<usize>) -> Option<Column<'_>> {
        self.count();
        let is_heat = self.columns && (object, name) == ("lamp", "heat");
        is_heat.then(|| points.map(Scene::heat).collect::<Vec<f32>>().into())
    }

    fn is_uniform(&self, object: &str, name: &str) -> bool {
        self.columns && object.is_empty() && name == "gone"
    }

    fn trace(&self, ray: &Ray) -> bool {
        self.count();
        ray.point % 3 != 1 && ray.direction[0] < 0.9
    }

    fn trace_all(&self, rays: &[Ray], hits: &mut [bool]) {
        self.count();
        let one = |ray: &Ray| ray.point % 3 != 1 && ray.direction[0] < 0.9;
        hits.iter_mut()
            .zip(rays)
            .for_each(|(hit, ray)| *hit = if self.columns { one(ray) } else { self.trace(ray) });
    }

    fn message(&self, source: &str, name: &str, point: usize) -> Option<Value> {
        self.count();
        match (source, name) {
            ("trace", "hitdist") => Some((point as f32).sqrt().into()),
            ("trace", "N") => Some([0.0, point as f32, 1.0].into()),
            _ => None,
        }
    }

    fn messages(&self, source: &str, name: &str, points: &[usize]) -> Option<Column<'_>> {
        let values = |of: &dyn Fn(f32) -> [f32; 3]| points.iter().map(|p| of(*p as f32)).collect::<Vec<_>>();
        match (source, name) {
            ("trace", "hitdist") if self.columns => {
                Some(points.iter().map(|p| (*p as f32).sqrt()).collect::<Vec<f32>>().into())
            }
            ("trace", "N") if self.columns => Some(values(&|p| [0.0, p, 1.0]).into()),
            _ => None,
        }
    }
}

/// The outputs, and how often the renderer was asked.
fn shade(columns: bool) -> (Outputs, usize) {
    let shader = Shader::compile("s.osl", TEXT).unwrap();
    let group = Group::new().layer("s", &shader);
    let program = group.compile_with(&CompileOptions::default().traces(true)).unwrap();
    let ramp: Vec<f32> = (0..COUNT).map(|at| at as f32 / COUNT as f32).collect();
    let mut points = Points::new(COUNT).u(ramp);
    if columns {
        let wear: Vec<f32> = (0..COUNT).map(Scene::wear).collect();
        let id: Vec<i32> = (0..COUNT as i32).map(|at| at - 5).collect();
        let paint: Vec<[f32; 3]> = (0..COUNT).map(|at| [at as f32, 1.0, -0.5]).collect();
        points = points.data_with_derivs("wear", wear, vec![0.0; COUNT], vec![0.0; COUNT]);
        points = points.data("id", id).data("paint", paint);
    }
    let asked = Arc::new(AtomicUsize::new(0));
    let renderer = Renderer::new(Scene { columns, asked: asked.clone() });
    let outputs = program.run_with(&points, &renderer, &RunOptions::default().threads(1)).unwrap();
    (outputs, asked.load(Ordering::Relaxed))
}

#[test]
fn columns_have_the_values_of_points() {
    let ((one_by_one, often), (columns, seldom)) = (shade(false), shade(true));
    assert_eq!(one_by_one.names(), columns.names());
    for name in columns.names() {
        assert_eq!(columns.ints(name), one_by_one.ints(name), "{name}");
        assert_eq!(columns.floats(name), one_by_one.floats(name), "{name}");
        assert_eq!(columns.triples(name), one_by_one.triples(name), "{name}");
    }
    assert_eq!(columns.floats("w").unwrap()[7], 1.75);
    assert_eq!(columns.floats("heat").unwrap()[18], 1.0);
    assert_eq!(columns.floats("g").unwrap(), vec![7.0; COUNT]);
    assert_eq!(columns.ints("wrong").unwrap()[0], 4, "a float is no int");
    // The points 901 to 2699, except every third.
    assert_eq!(columns.ints("hits").unwrap().iter().sum::<i32>(), 1799 - 600);
    assert_eq!(columns.triples("side").unwrap()[1002], [0.0, 1002.0, 1.0]);
    assert!(often > 10 * COUNT / 2 && seldom < 200, "asked {often} and {seldom} times");
}

#[test]
fn derivatives_of_data_are_given() {
    let text = "shader s(float t = 0 [[ int lockgeom = 0 ]], output float x = 0, output float y = 0) {
        x = Dx(2 * t); y = Dy(t * t); }";
    let program = Group::new().layer("s", &Shader::compile("s.osl", text).unwrap()).compile(&[]).unwrap();
    let points = Points::new(2).data_with_derivs("t", vec![1.0, 3.0], vec![0.5, 0.25], vec![1.0, 2.0]);
    let out = program.run(&points).unwrap();
    assert_eq!((out.floats("x"), out.floats("y")), (Some(vec![1.0, 0.5]), Some(vec![2.0, 12.0])));
    let short = Points::new(2).data("t", vec![1.0_f32]);
    assert_eq!(program.run(&short).unwrap_err().to_string(), "there are 2 points, but 1 values of t");
}
