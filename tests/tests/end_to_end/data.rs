//! Data of points as columns: values, derivatives and notes are those of points that are asked one by one.

use osl_exec::{Arithmetic, Blocks, Datum, Frame, PointSource, RunOptions};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};
use osl_ir::passes;
use osl_scene::{Crop, Data, Grid, ReferenceRenderer, WithData};
use osl_tests::run;

/// Points that are asked one by one.
struct OneByOne<'a>(&'a dyn PointSource);

impl PointSource for OneByOne<'_> {
    fn count(&self) -> usize {
        self.0.count()
    }
    fn blocks(&self) -> Option<Blocks> {
        self.0.blocks()
    }
    fn pixel(&self, position: usize) -> usize {
        self.0.pixel(position)
    }
    fn varying(&self) -> &[Global] {
        self.0.varying()
    }
    fn uniform(&self, global: Global) -> [f32; 3] {
        self.0.uniform(global)
    }
    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.0.deriv(global, axis)
    }
    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.0.fill(global, first, width, lanes);
    }
    fn varying_derivs(&self) -> &[Global] {
        self.0.varying_derivs()
    }
    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.0.fill_deriv(global, axis, first, width, lanes);
    }
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.0.attribute(object, name, element, point)
    }
}

const TEXT: &str = r#"shader s(
    float s = 7 [[ int lockgeom = 0 ]], float t = 8 [[ int lockgeom = 0 ]], float w = 9 [[ int lockgeom = 0 ]],
    output vector all = 0, output float x = -1, output float y = -2, output vector found = 0,
    output vector dx = 0, output vector dy = 0, output int wrong = 3)
{
    all = vector(s, t, w);
    found = vector(getattribute("s", x), 0, 0);
    if (u > 0.3)
        found[1] = getattribute(v > 0.5 ? "t" : "s", y);
    found[2] = getattribute("t", wrong);
    dx = vector(Dx(s), Dx(t), Dx(x * y));
    dy = vector(Dy(s), Dy(t), Dy(x * y));
}"#;

fn shade(source: &dyn PointSource, arithmetic: Arithmetic, batch: usize) -> Frame {
    let options = passes::Options {
        varying: source.varying().to_vec(),
        derivs: source.varying_derivs().to_vec(),
        traces: source.traces(),
        arithmetic,
        ..passes::Options::default()
    };
    let program = run::compile("s.osl", TEXT, &[], &options).expect("a shader").program;
    let options = RunOptions { batch: Some(batch), ..RunOptions::default() };
    osl_exec::run(&program, &run::services(), source, &options, &|_| ()).expect("a frame")
}

#[test]
fn columns_have_the_values_of_points() {
    let grid = Grid { scale: [2.0, 0.7], offset: [-0.5, 0.1], ..Grid::new(23, 11) };
    let mut data = Data::default();
    data.user.insert("w".into(), Datum::one(Const::Float(2.5)));
    let vary = vec![Global::P, Global::U, Global::V];
    let reference = ReferenceRenderer { vary, ..ReferenceRenderer::new(grid.clone()) };
    let crop = Crop::new(grid.clone(), 3..20, 2..10);
    let sources: [&dyn PointSource; 4] = [&grid, &WithData { points: grid.clone(), data }, &reference, &crop];
    for (index, source) in sources.into_iter().enumerate() {
        for arithmetic in [Arithmetic::Strict, Arithmetic::Double] {
            let asked = shade(&OneByOne(source), arithmetic, 64);
            for batch in [1, 16, 64, 512] {
                let frame = shade(source, arithmetic, batch);
                let words = |frame: &Frame| frame.planes.iter().map(|p| p.words.to_vec()).collect::<Vec<_>>();
                assert_eq!(
                    words(&frame),
                    words(&asked),
                    "source {index}, {arithmetic:?}, batches of {batch}"
                );
                assert_eq!(frame.messages, asked.messages, "source {index}, {arithmetic:?}, {batch}");
            }
        }
    }
}
