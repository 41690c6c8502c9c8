//! Levels of detail: the written shader has the bits of the original where the original runs, keeps the
//! stated error at points that were used for nothing, and means the same as a compiled file.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_possible_truncation,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages::{self, Compiled};
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::passes;
use osl_limits::Cancel;
use osl_measure::lod::{self, GivenParam, Report, Request, Stop};
use osl_measure::sample::{Check, Filter, Pattern, Shading, check, oracle, reaches};
use osl_measure::stability::fix::Built;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

/// Stones: a mask with cells, and a grain that is finer.
const STONES: &str = "\
// Stones with grain.
float cell_distance(point p)
{
    float nearest = 9;
    for (int i = -1; i <= 1; i++)
        for (int j = -1; j <= 1; j++) {
            point corner = floor(p) + vector(i, j, 0);
            point center = corner + noise(\"cell\", corner);
            nearest = min(nearest, distance(p, center));
        }
    return nearest;
}

shader stones
[[ string help = \"Stones with grain\" ]]
(
    float frequency = 9 [[ float min = 0 ]],
    float radius = 0.4,
    color tint = color(0.6, 0.5, 0.4),
    output float mask = 0,
    output color result = 0
)
{
    point p = point(u, v, 0) * frequency;
    mask = smoothstep(radius, radius + 0.1, cell_distance(p));
    float grain = noise(\"uperlin\", p * 12);
    result = tint * mix(1, grain, 0.5 * mask);
}
";

fn grid() -> Grid {
    Grid::new(128, 128)
}

fn find_in(
    text: &str,
    given: &[GivenParam],
    params: &[(String, String)],
    samples: u32,
) -> Result<Report, Stop> {
    let check = |text: &str| stages::check("s.osl", text, &NoFiles, &Options::default());
    let build = |text: &str| {
        let checked = check(text);
        let program = checked.program?;
        let plain = stages::lower(&program, params).ok()?;
        Some(Built { program, sources: checked.sources, plain, noted: None })
    };
    let checked = check(text);
    let program = checked.program.unwrap_or_else(|| panic!("{:?}", checked.diagnostics));
    lod::lod(&Request {
        text,
        program: &program,
        body: stages::lower(&program, params).unwrap(),
        given,
        build: &build,
        grid: &grid(),
        services: &Services::default(),
        options: &RunOptions::default(),
        samples,
        tolerance: 0.002,
        error: 0.2,
        seed: 1,
        pictures: false,
    })
}

fn find(text: &str) -> Report {
    find_in(text, &[], &[], 1).unwrap_or_else(|stop| panic!("{stop:?}"))
}

fn compiled(text: &str, params: &[(String, String)]) -> Compiled {
    let checked = stages::check("s.osl", text, &NoFiles, &Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{text}\n{:?}", checked.diagnostics));
    assert!(checked.diagnostics.is_empty(), "{text}\n{:?}", checked.diagnostics);
    let grid = grid();
    let options = passes::Options {
        varying: grid.varying().to_vec(),
        derivs: grid.varying_derivs().to_vec(),
        ..passes::Options::default()
    };
    stages::finish(stages::lower(&program, params).unwrap(), &options)
}

/// The mean of an output over an image: of the pixels, each with so many samples.
fn mean(program: &Compiled, grid: &Grid, output: usize, samples: u32) -> f64 {
    let (services, options) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &program.program,
        services: &services,
        surface: grid,
        options: &options,
        cheaper: None,
        pattern: Pattern::new(samples, 5),
        filter: Filter::default(),
    };
    let image = shading.rows(0..grid.height, samples).unwrap();
    let values = image.frame.planes[output].floats();
    values.iter().map(|x| f64::from(*x)).sum::<f64>() / values.len() as f64
}

fn at(footprint: f32, offset: f32) -> Grid {
    Grid { scale: [footprint; 2], offset: [offset; 2], ..grid() }
}

fn planes(program: &Compiled, grid: &Grid) -> Vec<(String, Vec<u32>)> {
    let frame =
        osl_exec::run(&program.program, &Services::default(), grid, &RunOptions::default(), &|_| ()).unwrap();
    frame.planes.into_iter().map(|plane| (plane.output.to_string(), plane.words.to_vec())).collect()
}

/// The errors of the outputs of a program with one sample, at pixels of a grid, as shares of their ranges,
/// with the reference's own error subtracted.
fn errors(original: &Compiled, program: &Compiled, grid: &Grid) -> Vec<f64> {
    let services = Services::default();
    let options = RunOptions::default();
    let shading = |compiled, surface| Shading {
        program: compiled,
        services: &services,
        surface,
        options: &options,
        cheaper: None,
        pattern: Pattern::new(1, 77),
        filter: Filter::default(),
    };
    let pixels: Vec<u32> = (0..16384).step_by(7).collect();
    let truth = oracle(&shading(&original.program, grid), &pixels, 256).unwrap();
    let values = shading(&program.program, grid).chosen(&pixels, 1).unwrap();
    let near = at(16.0, 0.0);
    let ranges = reaches(&shading(&original.program, &near)).unwrap();
    let one = |reach: &osl_measure::sample::Reach| {
        let pick = |list: &[Vec<f32>]| list[reach.planes.clone()].to_vec();
        let own = osl_measure::sample::Oracle {
            pixels: (0..pixels.len() as u32).collect(),
            values: pick(&truth.values),
            errors: pick(&truth.errors),
            ..truth.clone()
        };
        let Check { rmse, .. } = check(&pick(&values), &own, &[], |pixel| pixel as usize);
        rmse / f64::from(reach.size())
    };
    ranges.iter().map(one).collect()
}

#[test]
fn the_written_shader_reads_like_this() {
    insta::assert_snapshot!(find(STONES).text.unwrap());
}

#[test]
fn where_the_original_runs_its_bits_are_the_same() {
    let report = find(STONES);
    let text = report.text.unwrap();
    let (original, written) = (compiled(STONES, &[]), compiled(&text, &[]));
    for footprint in [1.0, 0.25] {
        assert_eq!(planes(&original, &at(footprint, 0.3)), planes(&written, &at(footprint, 0.3)));
    }
    // With another value of a parameter, the means do not hold, and the original runs at every footprint.
    // Only the fine noise fades, since that does not depend on parameters; the mask has none.
    let other = [("radius".to_string(), "0.3".to_string())];
    let (original, other) = (compiled(STONES, &other), compiled(&text, &other));
    let mask = |program: &Compiled| planes(program, &at(64.0, 0.0)).swap_remove(0);
    assert_eq!(mask(&original), mask(&other));
    assert_ne!(mask(&other), mask(&written));
}

#[test]
fn the_stated_error_holds_at_points_that_were_used_for_nothing() {
    let report = find(STONES);
    let far = report.level.as_ref().unwrap();
    assert!(far.footprint <= 64.0 && far.cost < 0.05 * report.cost);
    let (original, written) = (compiled(STONES, &[]), compiled(report.text.as_deref().unwrap(), &[]));
    for (footprint, offset) in [(64.0, -517.0), (64.0, 912.3), (256.0, 3001.0)] {
        let grid = at(footprint, offset);
        let own = errors(&original, &written, &grid).into_iter().fold(0.0, f64::max);
        assert!(own <= far.error, "{footprint}: {own} above {}", far.error);
        let plain = errors(&original, &original, &grid).into_iter().fold(0.0, f64::max);
        assert!(own < plain, "{footprint}: {own}, the original {plain}");
    }
    // In the middle of the fade it is not worse than the original either.
    let grid = at(0.75 * far.footprint as f32, 55.0);
    let (own, plain) = (errors(&original, &written, &grid), errors(&original, &original, &grid));
    for (own, plain) in own.iter().zip(plain) {
        assert!(*own <= plain + 0.01, "{own} above {plain}");
    }
}

/// Checks that a source and its compiled file give the same values at these footprints.
fn same_as_compiled(text: &str, footprints: &[f32]) {
    let checked = stages::check("s.osl", text, &NoFiles, &Options::default());
    let limits = osl_limits::Limits::default();
    let oso = osl_hir::oso::write(&checked.program.unwrap(), &checked.sources, &limits).unwrap();
    let loaded = stages::check("s.oso", &oso, &NoFiles, &Options::default());
    let program = loaded.program.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let grid = grid();
    let options = passes::Options {
        varying: grid.varying().to_vec(),
        derivs: grid.varying_derivs().to_vec(),
        ..passes::Options::default()
    };
    let loaded = stages::finish(stages::lower(&program, &[]).unwrap(), &options);
    let written = compiled(text, &[]);
    for footprint in footprints {
        assert_eq!(planes(&loaded, &at(*footprint, 0.7)), planes(&written, &at(*footprint, 0.7)));
    }
}

#[test]
fn the_compiled_file_gives_the_same_values() {
    same_as_compiled(&find(STONES).text.unwrap(), &[1.0, 8.0, 12.0, 16.0, 24.0, 64.0]);
}

#[test]
fn two_searches_find_the_same() {
    let numbers = |report: &Report| {
        let rows = report.rows.iter().map(|row| (row.footprint, row.written.clone(), row.equal_samples));
        (report.text.clone(), rows.collect::<Vec<_>>())
    };
    assert_eq!(numbers(&find(STONES)), numbers(&find(STONES)));
}

#[test]
fn given_values_are_compared_instead_of_the_defaults() {
    use osl_ir::ir::Const;
    let given = [
        ("radius".to_string(), vec![Const::Float(0.3)]),
        ("tint".to_string(), vec![Const::Triple([1.0; 3])]),
    ];
    let params = [("radius".to_string(), "0.3".to_string()), ("tint".to_string(), "1".to_string())];
    let text = find_in(STONES, &given, &params, 1).unwrap().text.unwrap();
    assert!(text.contains("frequency == 9 && radius == 0.3 && tint == color(1, 1, 1)"), "{text}");
    assert!(text.contains("float radius = 0.4,"), "the defaults stay: {text}");
}

#[test]
fn more_samples_of_the_original_are_harder_to_match() {
    let from = |samples| {
        let report = find_in(STONES, &[], &[], samples).unwrap();
        report.level.as_ref().map(|level| level.footprint)
    };
    let (one, many) = (from(1).unwrap(), from(8).unwrap());
    assert!(one < many, "{one} {many}");
}

#[test]
fn what_no_mean_can_stand_for_is_refused_or_has_no_level() {
    let refused = |text: &str| match find_in(text, &[], &[], 1) {
        Err(Stop::Refused(why)) => why,
        other => panic!("{other:?}"),
    };
    let why = refused("shader s(output float r = 0) { getattribute(\"x\", r); r += noise(P * 50); }");
    assert!(why.contains("`getattribute`"), "{why}");
    let why = refused("surface s(output float r = 0) { Ci = noise(P * 50) * diffuse(N); }");
    assert!(why.contains("`Ci`"), "{why}");
    let why = refused("shader s(float x = 1, output float r = 0) { r = x; }");
    assert!(why.contains("neither P nor u nor v"), "{why}");
    let ramp = find("shader s(output float r = 0) { r = u; }");
    assert!(ramp.level.is_none() && ramp.text.is_none());
    // The body is not skipped if an output has no mean, here a string.
    let named =
        "shader s(output float r = 0, output string name = \"\") { r = noise(P * 50); name = \"x\"; }";
    let found = find(named);
    assert!(found.text.is_none_or(|text| !text.contains("far")));
    // A mean over directions is found with random ones.
    let facing =
        find("shader s(output float r = 0) { r = 0.001 * noise(P * 90) + abs(dot(normalize(I), N)); }");
    assert!(facing.level.is_none(), "{:?}", facing.level);
}

#[test]
fn a_mean_over_directions_must_be_right_for_the_direction_of_a_run() {
    // Seen from the front, the pattern is 1 in half of the places; seen from the side, it is darker.
    let text = "\
shader s(output float rim = 0, output float r = 0)
{
    rim = pow(1 - abs(dot(normalize(I), N)), 2);
    r = rim * (sin(50 * P[0]) * sin(50 * P[1]) > 0 ? 1 : 0);
}
";
    let report = find(text);
    assert!(report.level.is_none(), "{:?}", report.level);
}

#[test]
fn a_shader_that_returns_gets_a_switch() {
    let text = "\
shader dots(float size = 0.3, output float r = 0)
{
    point p = point(mod(u * 20, 1) - 0.5, mod(v * 20, 1) - 0.5, 0);
    if (length(p) > size)
        return;
    r = 1;
}
";
    let found = find(text).text.unwrap();
    insta::assert_snapshot!(found);
    let (original, written) = (compiled(text, &[]), compiled(&found, &[]));
    assert_eq!(planes(&original, &at(1.0, 0.3)), planes(&written, &at(1.0, 0.3)));
}

/// A mask by a threshold of noise. The mean of the noise is on one side of the threshold everywhere, so that
/// noise that is replaced by its mean makes the mask constant.
const THRESHOLD: &str = "\
shader threshold(output float mask = 0, output float id = 0)
{
    float n = noise(P * 60);
    if (n > 0.6) mask = 1; else mask = 0;
    id = floor(u * 60);
}
";

#[test]
fn no_level_shifts_the_mean_of_the_picture() {
    let alone = THRESHOLD.replace(", output float id = 0", "").replace("id = floor(u * 60);", "");
    for text in [THRESHOLD, &alone] {
        let report = find(text);
        let Some(written) = report.text else {
            assert!(report.why.iter().any(|why| why.contains("`id` has a larger error")), "{:?}", report.why);
            continue;
        };
        let (original, written) = (compiled(text, &[]), compiled(&written, &[]));
        for footprint in [4.0, 16.0, 64.0, 256.0] {
            let grid = at(footprint, 40.0);
            let (wanted, got) = (mean(&original, &grid, 0, 16), mean(&written, &grid, 0, 1));
            assert!((wanted - got).abs() < 0.02, "{footprint}: {got} instead of {wanted}");
        }
    }
    // Without the number of a cell, which has no mean, the mask itself becomes its mean.
    assert!(find(&alone).level.is_some());
}

#[test]
fn one_sample_lies_at_the_centre_as_in_a_run() {
    // The centre of a pixel has the mean of a ramp, a random place in it has not.
    let report =
        find("shader s(output float ramp = 0, output float r = 0) { ramp = u; r = noise(P * 100); }");
    assert!(!report.rows.is_empty());
    for row in &report.rows {
        assert!(row.original.outputs[0] < 1e-3, "{row:?}");
        assert_eq!(row.original.worst, row.original.outputs[1]);
    }
}

#[test]
fn a_pattern_that_is_right_up_to_the_largest_footprint_is_measured_where_it_is_right() {
    // From 2^24 / 4096 on, no float lies within a cell.
    let report = find(
        "shader s(output float r = 0) { r = mod(u * 4096, 1) < 0.5 && mod(v * 4096, 1) < 0.5 ? 1 : 0; }",
    );
    assert!(report.level.is_some(), "{:?}", report.why);
}

#[test]
fn a_single_object_is_not_erased() {
    let object = "\
shader s(output float r = 0, output color c = 0)
{
    float d = hypot(u - 0.5, v - 0.5);
    r = d < 0.3 ? 1 : 0;
    if (d < 0.3) c = noise(P * 200);
}
";
    let report = find(object);
    assert!(report.level.is_none() && report.text.is_none(), "{:?}", report.level);
    assert!(
        report.why.iter().any(|why| why.contains("does not look the same everywhere")),
        "{:?}",
        report.why
    );
}

#[test]
fn the_report_says_why_there_is_no_level() {
    let why = |text: &str| find(text).why.join("\n");
    let named = "shader s(output float r = 0, output matrix m = 1) { r = u; m = matrix(u); }";
    assert!(why(named).contains("`m` is no number and no triple"), "{}", why(named));
    let cheap = why("shader s(output float r = 0) { r = u; }");
    assert!(cheap.contains("costs no more than the test of how large a pixel is"), "{cheap}");
    let ramp = why("shader s(output float r = 0) { r = u; r += 0.1 * sin(u) * cos(v) * exp(-v); }");
    assert!(ramp.contains("by their means: `r` has a larger error at footprint 256"), "{ramp}");
}

#[test]
fn with_other_parameters_only_faded_noise_remains_and_the_comment_says_so() {
    let text = find(STONES).text.unwrap();
    let words = text.replace("    // ", "").replace('\n', " ");
    assert_eq!(words.contains("with others, only noise fades"), text.contains("faded_noise("), "{text}");
}

#[test]
fn elongated_pixels_are_nearer_to_the_truth_than_one_sample() {
    let text = "shader s(output float r = 0) { r = mod(u * 20, 1) < 0.5 && mod(v * 20, 1) < 0.3 ? 1 : 0; }";
    let report = find(text);
    let (original, written) = (compiled(text, &[]), compiled(report.text.as_deref().unwrap(), &[]));
    for scale in [[64.0, 4.0], [4.0, 64.0], [128.0, 8.0], [8.0, 128.0], [100.0, 25.0]] {
        let grid = Grid { scale, offset: [-300.0, 77.0], ..grid() };
        let [own, plain] = [&written, &original].map(|program| errors(&original, program, &grid)[0]);
        assert!(own < 0.8 * plain, "{scale:?}: {own}, the original {plain}");
    }
    // Lines along one axis are sharp in pixels that are long along them.
    let lines = "shader s(output float r = 0) { r = mod(u * 20, 1) < 0.5 ? 1 : 0; r *= mod(v, 0.01) < 2; }";
    let report = find(lines);
    let (original, written) = (compiled(lines, &[]), compiled(report.text.as_deref().unwrap_or(lines), &[]));
    let grid = Grid { scale: [1.0, 16.0], offset: [-300.0, 77.0], ..grid() };
    assert_eq!(planes(&original, &grid), planes(&written, &grid));
}

#[test]
fn line_breaks_are_those_of_the_source() {
    let text = STONES.replace('\n', "\r\n");
    let written = find(&text).text.unwrap();
    assert_eq!(written.matches('\n').count(), written.matches("\r\n").count());
    assert_eq!(find(STONES).text.unwrap(), written.replace("\r\n", "\n"));
}

#[test]
fn when_the_time_is_over_nothing_is_claimed() {
    let cancel = Cancel::new();
    cancel.cancel();
    let checked = stages::check("s.osl", STONES, &NoFiles, &Options::default());
    let program = checked.program.unwrap();
    let body = stages::lower(&program, &[]).unwrap();
    let mut options = RunOptions::default();
    options.limits = options.limits.until(&cancel);
    let stop = lod::lod(&Request {
        text: STONES,
        program: &program,
        body,
        given: &[],
        build: &|_| None,
        grid: &grid(),
        services: &Services::default(),
        options: &options,
        samples: 1,
        tolerance: 0.002,
        error: 0.2,
        seed: 1,
        pictures: false,
    });
    assert!(matches!(stop, Err(Stop::Run(_))));
}
