//! Following a run: what an observer is told, and strict and double precision side by side.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_exec::PointSource;
use osl_exec::{Arithmetic, Frame, Observer, RunOptions, Scope, ScopeKind, Step, Work, observe};
use osl_ir::ir::LaneOp;
use osl_ir::passes;
use osl_scene::Grid;
use osl_tests::run;

/// Notes what it is told, a line for each.
#[derive(Default)]
struct Notes {
    lines: Vec<String>,
    depth: usize,
    flips: u64,
    /// The largest error that a step adds by itself, and what the step is.
    worst: (f64, String),
}

impl Observer for Notes {
    fn step(&mut self, step: &Step<'_>) {
        self.flips += step.flips();
        let lane = step.lanes().first().copied().unwrap_or(0);
        let numbers = |slots: &[osl_exec::Slot]| {
            let each = slots.iter().filter(|s| !s.is_array()).map(|s| step.number(*s, 0, lane).to_string());
            each.collect::<Vec<_>>().join(" ")
        };
        let (args, results) = (numbers(step.args()), numbers(step.results()));
        self.lines.push(format!("{}{} {args} -> {results}", " ".repeat(self.depth), step.name()));
        if let (Some(alone), Some(result)) = (step.alone(0, lane), step.results().first()) {
            let error = (alone - f64::from(step.single(*result, 0, lane))).abs();
            if error > self.worst.0 {
                self.worst = (error, step.name().to_string());
            }
        }
        if let Work::Lane(LaneOp::FAdd) = step.work() {
            assert_eq!((step.args().len(), step.results().len()), (2, 1));
        }
    }

    fn enter(&mut self, scope: &Scope<'_>) {
        let kind = match scope.kind {
            ScopeKind::Then => "then".to_string(),
            ScopeKind::Otherwise => "otherwise".to_string(),
            ScopeKind::Round(round) => format!("round {round}"),
        };
        self.lines.push(format!("{}{kind} of {} lanes", " ".repeat(self.depth), scope.lanes.len()));
        self.depth += 1;
    }

    fn leave(&mut self) {
        self.depth -= 1;
    }
}

fn follow(text: &str, arithmetic: Arithmetic, grid: &Grid) -> (Notes, Frame) {
    let varying = grid.varying().to_vec();
    // As written: no branch becomes a choice, no loop its rounds.
    let without = vec![passes::Pass::Flatten, passes::Pass::Unroll, passes::Pass::Share];
    let options = passes::Options { varying, arithmetic, without, ..passes::Options::default() };
    let compiled = run::compile("s.osl", text, &[], &options).unwrap();
    let mut notes = Notes::default();
    let options = RunOptions { arithmetic, ..RunOptions::default() };
    let points = 0..grid.count();
    let frame = observe(&compiled.program, &run::services(), grid, &options, points, &mut notes).unwrap();
    assert_eq!(notes.depth, 0);
    (notes, frame)
}

#[test]
fn steps_and_their_nesting_are_told() {
    let text = "shader s(output float a = 0) {
        for (int i = 0; i < 3; i++) a += u * i;
        if (v > 0.5) a = a * 2; else a = a - 1;
    }";
    let (notes, frame) = follow(text, Arithmetic::Strict, &Grid { offset: [0.25, 0.0], ..Grid::new(2, 2) });
    let has = |line: &str| notes.lines.iter().any(|l| l == line);
    for line in [
        "round 0 of 4 lanes",
        "round 2 of 4 lanes",
        " fmul 0.25 2 -> 0.5",
        "then of 2 lanes",
        "otherwise of 2 lanes",
        " fsub 0.75 1 -> -0.25",
    ] {
        assert!(has(line), "{line} is not among\n{}", notes.lines.join("\n"));
    }
    assert_eq!(frame.planes[0].floats(), [-0.25, 2.75, 1.5, 7.5]);
}

#[test]
fn both_precisions_side_by_side() {
    let text = "shader s(output float a = 0, output float b = 0) {
        float x = u + 16777216;
        a = x - 16777216;
        if (x > 16777216) b = 1;
    }";
    let grid = Grid { scale: [0.5, 1.0], offset: [0.25, 0.0], ..Grid::new(2, 1) };
    let (notes, frame) = follow(text, Arithmetic::Shadow, &grid);
    assert_eq!(frame.planes[0].floats(), [0.0, 0.0]);
    assert_eq!(frame.planes[0].doubles(), [0.25, 0.75]);
    // The strict way is taken, and that the other is different is counted.
    assert_eq!(frame.planes[1].floats(), [0.0, 0.0]);
    assert!(notes.flips >= 2, "{}", notes.flips);
    assert_eq!(notes.worst, (0.25, "fadd".to_string()));
}

/// Beside the strict numbers nothing changes them.
#[test]
fn shadows_leave_the_strict_bits_alone() {
    for file in [
        "osl/Cobbled.osl",
        "osl/flakes.osl",
        "osl/strips.osl",
        "crates/oslrun/benches/shaders/derivatives.osl",
    ] {
        let text = std::fs::read_to_string(run::root().join(file)).unwrap();
        let grid = Grid { scale: [3.0, 3.0], ..Grid::new(24, 20) };
        let in_order =
            |frame: Frame| -> Vec<Vec<u32>> { frame.planes.into_iter().map(|p| p.words).collect() };
        let run = |arithmetic| {
            let options = RunOptions { arithmetic, ..RunOptions::default() };
            in_order(run::run(file, &text, &[], &grid, &options).unwrap())
        };
        assert_eq!(run(Arithmetic::Strict), run(Arithmetic::Shadow), "{file}");
    }
}
