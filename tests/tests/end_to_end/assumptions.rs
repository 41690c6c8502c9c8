//! Assumptions of a compiled program about its points: points that vary more are refused, points that vary
//! less have the same values.

use osl_exec::{Arithmetic, Frame, PointSource, Program, RunError, RunOptions};
use osl_hir::hir::Global;
use osl_ir::ir::Axis;
use osl_ir::passes;
use osl_tests::run;

/// Four points: a varying value is the number of the point, and its change is twice that number. Uniform
/// values are 7.
#[derive(Default)]
struct Points {
    varying: Vec<Global>,
    derivs: Vec<Global>,
    traces: bool,
}

impl PointSource for Points {
    fn count(&self) -> usize {
        4
    }

    fn varying(&self) -> &[Global] {
        &self.varying
    }

    fn uniform(&self, _: Global) -> [f32; 3] {
        [7.0; 3]
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [7.0; 3]
    }

    fn fill(&self, _: Global, first: usize, width: usize, lanes: &mut [f32]) {
        lanes.iter_mut().enumerate().for_each(|(at, lane)| *lane = (first + at % width).min(3) as f32);
    }

    fn varying_derivs(&self) -> &[Global] {
        &self.derivs
    }

    fn fill_deriv(&self, _: Global, _: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        lanes.iter_mut().enumerate().for_each(|(at, lane)| *lane = 2.0 * (first + at % width).min(3) as f32);
    }

    fn traces(&self) -> bool {
        self.traces
    }

    fn trace(&self, _: [f32; 3], _: [f32; 3], point: usize) -> bool {
        point % 2 == 1
    }
}

/// Compiles a shader that sets `out`.
fn compile(text: &str, options: &passes::Options) -> Program {
    let text = format!("shader s(output float out = 0) {{ {text} }}");
    run::compile("s.osl", &text, &[], options).unwrap().program
}

fn shade(program: &Program, points: &Points) -> Result<Frame, RunError> {
    osl_exec::run(program, &run::services(), points, &RunOptions::default(), &|_| ())
}

fn values(program: &Program, points: &Points) -> Vec<f32> {
    shade(program, points).unwrap().planes[0].floats()
}

/// A program for points on which these globals and these changes differ.
fn of(varying: &[Global], derivs: &[Global]) -> passes::Options {
    passes::Options { varying: varying.to_vec(), derivs: derivs.to_vec(), ..passes::Options::default() }
}

#[test]
fn globals_that_vary_more_are_refused() {
    let program = compile("out = u + v;", &of(&[Global::U], &[]));
    let points = Points { varying: vec![Global::U, Global::V], ..Points::default() };
    let error = shade(&program, &points).unwrap_err();
    assert_eq!(error, RunError::VariesMore(Global::V));
    assert_eq!(
        error.to_string(),
        "`v` differs from point to point, and the program was compiled for points that share it"
    );
    let points = Points { varying: vec![Global::U], ..Points::default() };
    assert_eq!(values(&program, &points), [7.0, 8.0, 9.0, 10.0]);
}

#[test]
fn changes_that_vary_more_are_refused() {
    let program = compile("out = Dx(u) + Dx(v);", &of(&Global::ALL, &[Global::U]));
    let points = Points { derivs: vec![Global::U, Global::V], ..Points::default() };
    let error = shade(&program, &points).unwrap_err();
    assert_eq!(error, RunError::DerivsVaryMore(Global::V));
    assert_eq!(
        error.to_string(),
        "the change of `v` from pixel to pixel differs from point to point, and the program was compiled for points that \
         share it"
    );
    let points = Points { derivs: vec![Global::U], ..Points::default() };
    assert_eq!(values(&program, &points), [7.0, 9.0, 11.0, 13.0]);
}

#[test]
fn rays_that_the_program_leaves_out_are_refused() {
    let text = "out = trace(P, vector(0, 0, 1));";
    let points = Points { traces: true, ..Points::default() };
    let without = compile(text, &passes::Options::default());
    assert_eq!(shade(&without, &points).unwrap_err(), RunError::Traces);
    assert_eq!(values(&without, &Points::default()), [0.0; 4]);
    let with = compile(text, &passes::Options { traces: true, ..passes::Options::default() });
    assert_eq!(values(&with, &points), [0.0, 1.0, 0.0, 1.0]);
}

/// Between affine spaces, points change like vectors, which is wrong for others.
#[test]
fn spaces_that_are_not_affine_are_refused() {
    let matrix = |w: f32| [1., 0., 0., w, 0., 2., 0., 0., 0., 0., 1., 0., 5., 0., 0., 1.];
    let services = |w: f32| {
        let mut services = run::services();
        services.spaces.set("own", matrix(w));
        services
    };
    let affine = services(0.0).spaces.affine();
    assert!(affine.iter().any(|name| &**name == "own"), "{affine:?}");
    assert!(!services(0.5).spaces.affine().iter().any(|name| &**name == "own"));
    let text =
        "vector a = Dy(transform(\"own\", \"common\", P)), b = Dx(transform(\"own\", P)); out = a[1] + b[0];";
    let program = compile(text, &passes::Options { affine, ..of(&[Global::P], &[]) });
    let points = Points { varying: vec![Global::P], ..Points::default() };
    let shade = |w: f32| osl_exec::run(&program, &services(w), &points, &RunOptions::default(), &|_| ());
    assert_eq!(shade(0.0).unwrap().planes[0].floats(), [14.0 + 7.0; 4]);
    let error = shade(0.5).unwrap_err();
    assert_eq!(error, RunError::NotAffine("own".into()));
    assert_eq!(
        error.to_string(),
        "the matrix of space \"own\" is not affine, and the program was compiled for one that is"
    );
}

/// The refusal does not depend on what the shader reads.
#[test]
fn what_is_refused_does_not_depend_on_the_shader() {
    let program = compile("out = u;", &of(&[Global::U], &[]));
    let points = Points { varying: vec![Global::P, Global::U], ..Points::default() };
    assert_eq!(shade(&program, &points).unwrap_err(), RunError::VariesMore(Global::P));
}

/// In a program compiled without options everything varies, including what only calls can ask for.
#[test]
fn a_program_of_the_usual_options_accepts_all_points() {
    for (call, global) in [("backfacing()", Global::Backfacing), ("surfacearea()", Global::SurfaceArea)] {
        let program = compile(&format!("out = {call};"), &passes::Options::default());
        let points = Points { varying: vec![global], ..Points::default() };
        assert_eq!(values(&program, &points), [0.0, 1.0, 2.0, 3.0], "{call}");
        assert_eq!(values(&program, &Points::default()), [7.0; 4], "{call}");
    }
}

/// A pass that is skipped makes no assumptions.
#[test]
fn without_the_search_for_what_points_share_all_points_are_accepted() {
    let options = passes::Options { without: vec![passes::Pass::Rate], ..of(&[], &[]) };
    let program = compile("out = u + v;", &options);
    let points = Points { varying: vec![Global::U, Global::V], ..Points::default() };
    assert_eq!(values(&program, &points), [0.0, 2.0, 4.0, 6.0]);
}

/// The arithmetic belongs to the program: the same run options give doubles if it was compiled for them.
#[test]
fn a_program_runs_in_the_arithmetic_that_it_was_compiled_for() {
    let points = Points { varying: vec![Global::U], ..Points::default() };
    for arithmetic in Arithmetic::ALL {
        let options = passes::Options { arithmetic, ..passes::Options::default() };
        let program = compile("float third = 1.0 / 3.0; out = u * third;", &options);
        assert_eq!(program.arithmetic(), arithmetic);
        let plane = &shade(&program, &points).unwrap().planes[0];
        assert_eq!(plane.wide.is_empty(), !arithmetic.is_double());
        let expected = if arithmetic.is_double() { 1.0 / 3.0 } else { f64::from(1.0_f32 / 3.0) };
        assert_eq!(plane.doubles()[1], expected, "{}", arithmetic.name());
    }
}
