//! Results do not depend on batch, tile, thread count, instruction set or passes: the same bits for every
//! seed shader.

use osl_exec::{Datum, Frame, Isa, Native, PointSource, Run, RunOptions};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};
use osl_ir::passes::{self, Pass};
use osl_scene::{Data, Grid, WithData};
use osl_tests::run;
use proptest::prelude::*;
use std::sync::{Mutex, OnceLock};

/// Name, text, and parameter values.
type Case = (&'static str, String, Vec<(String, String)>);

/// Work that is done for many points at once where they share something: tables of any size, remainders,
/// functions of texts, attributes and missing files.
const SHARED_WORK: &str = r#"shader shared_work(
    float table[20] = { 3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5, 8, 9, 7, 9, 3, 2, 3, 8, 4 },
    color few[5] = { color(1, 2, 3), color(4, 5, 6), color(7, 8, 9), color(2, 4, 8), color(3, 9, 27) },
    output float loaded = 0, output color picked = 0, output color rest = 0, output int mixed = 0,
    output float asked = 0, output color pixel = 0, output float place = 0)
{
    int at = (int)(abs(u) * 37) % 20;
    float own[20];
    for (int k = 0; k < 20; k++)
        own[k] = (u * k + v) * (u * k + v);
    loaded = table[at] + own[(at * 7) % 20];
    picked = few[at % 5];
    rest = fmod(color(u, v, u * v) * 100, 0.3) + fmod(v * 1e12, 3) + fmod(u - v, 1e-30) + fmod(u, 1e30);
    string text = format("%d %g", at % 7, v < 0 ? 0.5 : u);
    mixed = hash(u, v) % 1000 + hash(at) % 1000 + regex_search(text, "[2-5]+ 0") * 10000 + strlen(text) * 7;
    float s = -1;
    float gain = 0.25;
    int found = getattribute("s", s) + getattribute("nothing", gain);
    asked = s + gain + found;
    pixel = texture(v < 0.3 ? "none.png" : v < 0.5 ? "gone.png" : "tex64.png", u, v);
    float knots[8] = { 0, 0, 0.1, 0.4, 0.5, 0.9, 1, 1 };
    string basis = at < 8 ? "bspline" : at < 14 ? "bezier" : "constant";
    place = splineinverse(basis, v, knots) + splineinverse("catmull-rom", u, 5 + at % 3, knots)
        + splineinverse("hermite", u - v, 6, own) + splineinverse("linear", v, knots) + Dx(splineinverse("bspline", u, knots));
}"#;

/// Values of cells on which a batch may branch, which change from round to round of a loop, and on which
/// other cells depend: a batch in the cells of the batch before it computes only what differs.
const SHARED_CELLS: &str = r#"shader shared_cells(
    int rounds = 70, float bend = 0.5,
    output float first = 0, output float second = 0, output color third = 0, output float fourth = 0)
{
    point p = floor(P * 0.7);
    color near = cellnoise(p + bend) * 2 - 1;
    first = distance(P, p + near);
    if (v > 0.2) {
        color here = cellnoise(p * 3 + 7 + near[0]);
        first += distance(P, p + here * near);
    } else if (u < 0)
        first -= distance(P, p + cellnoise(p + near * 9));
    for (int k = 0; k < rounds; k++)
        second += length(P - p - (color)cellnoise(p + k * 0.25 + near[1])) * bend;
    for (int k = 0; k < 9 * v; k++)
        third += cellnoise(p + k) * u + near;
    float column = floor(u * 2) + (near[2] > 0 ? 3 : 0);
    fourth = column * v + noise(column + near[0], 3.5) + noise(column * bend, p[1]) * u;
}"#;

/// The seed shaders, with parameters for which they do much work; shaders of the library; and shared work.
fn shaders() -> &'static [Case] {
    static SHADERS: OnceLock<Vec<Case>> = OnceLock::new();
    SHADERS.get_or_init(|| {
        let own = |list: &[(&str, &str)]| list.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
        [
            ("Cobbled", "osl/Cobbled.osl", own(&[])),
            ("flakes", "osl/flakes.osl", own(&[("flake_size_variance", "0.7")])),
            ("chaosmosaic", "osl/chaosmosaic.osl", own(&[("Image", "tex64.png")])),
            (
                "sprinkles",
                "tests/data/seeds/sprinkles.repaired.osl",
                own(&[("Scale", "6"), ("Np", "3"), ("Radius", "0.2")]),
            ),
            ("strips", "osl/strips.osl", own(&[("Var", "0.6")])),
            ("nonlinear_noise", "osl/nonlinear_noise.osl", own(&[("type", "abs_recursive"), ("freq", "7")])),
            ("splines", "crates/oslrun/benches/shaders/splines.osl", own(&[])),
            ("strings", "crates/oslrun/benches/shaders/strings.osl", own(&[])),
        ]
        .into_iter()
        .map(|(name, path, params)| (name, std::fs::read_to_string(run::root().join(path)).unwrap(), params))
        .chain([
            ("shared_work", SHARED_WORK.to_owned(), Vec::new()),
            ("shared_cells", SHARED_CELLS.to_owned(), Vec::new()),
        ])
        .collect()
    })
}

fn grid() -> Grid {
    Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(37, 23) }
}

/// The points of a source, row by row. Each point asks for its attributes itself.
struct Plain<S>(S);

impl<S: PointSource> PointSource for Plain<S> {
    fn count(&self) -> usize {
        self.0.count()
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
    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.0.attribute(object, name, element, point)
    }
}

fn words(frame: &Frame) -> Vec<(String, usize, Vec<u32>)> {
    frame.planes.iter().map(|p| (p.output.to_string(), p.component, p.words.to_vec())).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_way_of_running(
        shader in 0..10_usize,
        batch in 1..700_usize,
        tile in 1..900_usize,
        threads in 1..5_usize,
        isa in 0..3_usize,
        native in 0..3_usize,
    ) {
        let (name, text, params) = &shaders()[shader];
        let plain = RunOptions { batch: Some(64), tile: 10_000, isa: Isa::baseline(), ..RunOptions::default() };
        let native = [Native::Never, Native::Recurring, Native::Always][native];
        let expected = run::run(name, text, params, &grid(), &plain).unwrap();
        let all = Isa::all();
        let options = RunOptions { batch: Some(batch), tile, isa: all[isa % all.len()], native, ..RunOptions::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let got = pool.install(|| run::run(name, text, params, &grid(), &options)).unwrap();
        prop_assert_eq!(words(&got), words(&expected), "{} {:?} {} threads", name, options, threads);
    }
}

/// Any passes may be skipped: they change the computation, but never the results.
#[test]
fn any_passes() {
    let sets: [&[Pass]; 11] = [
        &[Pass::Fold],
        &[Pass::Unroll],
        &[Pass::Algebra],
        &[Pass::Share],
        &[Pass::Fuse],
        &[Pass::Cse],
        &[Pass::Dce],
        &[Pass::Rate],
        &[Pass::Flatten],
        &[Pass::Slice, Pass::Fold, Pass::Cse],
        &osl_tests::laws::SWITCHABLE,
    ];
    let options = RunOptions::default();
    for (name, text, params) in shaders() {
        let expected = run::run(name, text, params, &grid(), &options).unwrap();
        for without in sets {
            let passes = passes::Options { without: without.to_vec(), ..passes::Options::default() };
            let compiled = run::compile(name, text, params, &passes).unwrap();
            let got = osl_exec::run(&compiled.program, &run::services(), &grid(), &options, &|_| ()).unwrap();
            assert_eq!(words(&got), words(&expected), "{name} without {without:?}");
        }
    }
}

/// Batches with one cell of a pattern, with a few or with many share work, without any effect on the results.
#[test]
fn any_size_of_cells() {
    for (name, text, params) in shaders() {
        let without = vec![Pass::Share, Pass::Algebra];
        let plain = passes::Options { without, ..passes::Options::default() };
        let plain = run::compile(name, text, params, &plain).unwrap();
        let shared = run::compile(name, text, params, &passes::Options::default()).unwrap();
        for scale in [0.1, 1.0, 7.0, 60.0] {
            let grid = Grid { scale: [scale; 2], offset: [-0.3 * scale; 2], ..Grid::new(64, 48) };
            let frame = |program| {
                osl_exec::run(program, &run::services(), &grid, &RunOptions::default(), &|_| ()).unwrap()
            };
            assert_eq!(words(&frame(&shared.program)), words(&frame(&plain.program)), "{name} at {scale}");
        }
    }
}

/// Points that share an attribute get what they get if each asks for it.
#[test]
fn shared_attributes_are_those_of_each_point() {
    let text = r#"shader s(output float a = -1, output color b = 0.5, output int c = 0, output float d = 0) {
        c = getattribute("gain", a) + 2 * getattribute("box", "tint", b) + 4 * getattribute("gone", a);
        int list[2] = { 7, 8 };
        if (u > v)
            c += 8 * getattribute("list", list) + 16 * getattribute("list", 1, list[0]);
        string name = "";
        c += 32 * getattribute("name", name) + hash(name) % 1000 + list[0] + list[1];
        float s = 0;
        getattribute("s", s);
        d = s + Dx(s) + filterwidth(a);
    }"#;
    let mut data = Data::default();
    data.user.insert("gain".into(), Datum { derivs: [0.25, 0.5], ..Datum::one(Const::Float(3.5)) });
    data.attributes.insert("list".into(), Datum::array(vec![Const::Int(4), Const::Int(5)]));
    data.attributes.insert("name".into(), Datum::one(Const::Str("a name".into())));
    let tint = Datum::one(Const::Triple([0.1, 0.2, 0.3]));
    data.objects.entry("box".into()).or_default().insert("tint".into(), tint);
    // A single row, so that both have the same order of points.
    let points = WithData { points: Grid { scale: [3.0, 2.5], ..Grid::new(61, 1) }, data };
    let compiled = run::compile("s", text, &[], &passes::Options::default()).unwrap();
    for batch in [1, 16, 64, 1024] {
        let options = RunOptions { batch: Some(batch), ..RunOptions::default() };
        let frame = |points: &dyn PointSource| {
            osl_exec::run(&compiled.program, &run::services(), points, &options, &|_| ()).unwrap()
        };
        let (shared, each) = (frame(&points), frame(&Plain(points.clone())));
        assert_eq!(words(&shared), words(&each), "batches of {batch}");
    }
}

/// A run in pieces has the results of a single run.
#[test]
fn any_pieces() {
    for (name, text, params) in shaders() {
        let compiled = run::compile(name, text, params, &passes::Options::default()).unwrap();
        let (services, grid, options) = (run::services(), Grid::new(50, 90), RunOptions::default());
        let whole = osl_exec::run(&compiled.program, &services, &grid, &options, &|_| ()).unwrap();
        let pieces = Run::new(&compiled.program, &services, &grid, &options);
        let mut frame = Frame::default();
        for rows in [0..32, 32..64, 64..90] {
            let piece = pieces.points(rows.start * 50..rows.end * 50, &|_| ()).unwrap();
            frame.add(piece, &options.limits.running);
        }
        assert_eq!(words(&frame), words(&whole), "{name}");
        assert_eq!(frame.messages, whole.messages, "{name}");
    }
}

/// Runs of any size have the results of a single run. They share machine code, which the first of them do not
/// have yet.
#[test]
fn any_short_runs() {
    // Without blocks, so that any points can be a piece.
    let grid = Plain(Grid { scale: [3.0, 2.5], ..Grid::new(3000, 1) });
    for (name, text, params) in shaders() {
        let compiled = run::compile(name, text, params, &passes::Options::default()).unwrap();
        let services = run::services();
        let plain = RunOptions { native: Native::Never, isa: Isa::baseline(), ..RunOptions::default() };
        let whole = osl_exec::run(&compiled.program, &services, &grid, &plain, &|_| ()).unwrap();
        for isa in Isa::all() {
            let options = RunOptions { isa, ..RunOptions::default() };
            let pieces = Run::new(&compiled.program, &services, &grid, &options);
            let sizes = [
                (0, 1),
                (5, 17),
                (100, 33),
                (0, 64),
                (700, 300),
                (100, 1000),
                (40, 1025),
                (0, 2500),
                (9, 40),
            ];
            for (start, count) in [sizes; 3].concat() {
                let piece = pieces.points(start..start + count, &|_| ()).unwrap();
                for (got, all) in piece.planes.iter().zip(&whole.planes) {
                    let expected = &all.words[start..start + count];
                    let isa = isa.name();
                    assert_eq!(
                        got.words[..],
                        *expected,
                        "{name} {}: {isa}, {count} from {start}",
                        got.output
                    );
                }
            }
        }
    }
}

/// Several threads get tiles beside each other. Who only looks at values sees those of the frame, in tiles
/// that do not depend on the number of threads.
#[test]
fn any_threads_and_looks() {
    let grid = Grid::new(300, 70);
    let blocks = grid.blocks().unwrap();
    for (name, text, params) in shaders() {
        let compiled = run::compile(name, text, params, &passes::Options::default()).unwrap();
        let services = run::services();
        let options = RunOptions { steps: true, ..RunOptions::default() };
        let whole = Run::new(&compiled.program, &services, &grid, &options);
        let frame = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| whole.points(0..grid.count(), &|_| ())).unwrap()
        };
        let expected = frame(1);
        let mut sizes = Vec::new();
        for threads in [1, 2, 5] {
            assert_eq!(words(&frame(threads)), words(&expected), "{name}, {threads} threads");
            let tiles = Mutex::new(Vec::new());
            let look = |tile: usize, planes: &[&[u32]]| {
                let planes: Vec<Vec<u32>> = planes.iter().map(|words| words.to_vec()).collect();
                tiles.lock().unwrap().push((tile, planes));
            };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let looked = pool.install(|| whole.look(0..grid.count(), &|_| (), &look)).unwrap();
            assert!(looked.planes.iter().all(|plane| plane.words.is_empty()));
            assert_eq!(looked.messages, expected.messages, "{name}");
            let mut tiles = tiles.into_inner().unwrap();
            tiles.sort();
            sizes.push(tiles.iter().map(|(_, planes)| planes[0].len()).collect::<Vec<_>>());
            for (at, plane) in expected.planes.iter().enumerate() {
                let seen: Vec<u32> = tiles.iter().flat_map(|(_, planes)| planes[at].clone()).collect();
                let ordered: Vec<u32> = (0..grid.count()).map(|p| plane.words[blocks.position(p)]).collect();
                assert_eq!(seen, ordered, "{name} {}", plane.output);
            }
        }
        assert!(sizes[0].len() > 1 && sizes.iter().all(|list| *list == sizes[0]), "{sizes:?}");
    }
}

/// NaN is always the same word in outputs.
#[test]
fn one_nan() {
    let text =
        "shader s(float zero = 0, output float a = 0, output color b = 0, output float c[2] = {0, 0}) {
        float inf = 1e38 * 1e38; a = inf * zero; b = color(-(inf - inf), sqrt(u) * a, 1); c[0] = -a; }";
    for isa in Isa::all() {
        let options = RunOptions { isa, ..RunOptions::default() };
        let frame = run::run("s", text, &[], &grid(), &options).unwrap();
        let nans: Vec<u32> = frame
            .planes
            .iter()
            .flat_map(|p| p.words.to_vec())
            .filter(|w| f32::from_bits(*w).is_nan())
            .collect();
        assert_eq!(nans.len(), 4 * 37 * 23, "{isa:?}");
        assert!(nans.iter().all(|w| *w == f32::NAN.to_bits()), "{isa:?}");
    }
}

/// An output that is computed alone equals the output that is computed with all others.
#[test]
fn any_slice() {
    for (name, text, params) in shaders() {
        let all = run::run(name, text, params, &grid(), &RunOptions::default()).unwrap();
        for plane in &all.planes {
            let outputs = Some(vec![plane.output.clone()]);
            let compiled =
                run::compile(name, text, params, &passes::Options { outputs, ..passes::Options::default() })
                    .unwrap();
            let one =
                osl_exec::run(&compiled.program, &run::services(), &grid(), &RunOptions::default(), &|_| ())
                    .unwrap();
            let got = one
                .planes
                .iter()
                .find(|p| p.output == plane.output && p.component == plane.component)
                .unwrap();
            assert_eq!(got.words, plane.words, "{name} {}", plane.output);
        }
    }
}

/// An element is set by copies if its index is uniform, and lane by lane if it is not.
#[test]
fn elements_of_matrices_are_set_alike_in_either_way() {
    let text = "shader s(output int off = 0) {
        int none = (int)(u * 1e-30);
        for (int r = 0; r < 4; r++) for (int c = 0; c < 4; c++) {
            matrix a = matrix(u, v, 3, 4, 5, u * v, 7, 8, 9, 10, v - u, 12, 13, 14, 15, u + v);
            matrix b = a;
            a[r][c] = v + 100;
            b[r + none][c + none] = v + 100;
            matrix d = 2;
            matrix e = d;
            d[r][c] = u;
            e[r + none][c + none] = u;
            off += a != b || d != e || a[r][c] != v + 100;
        }
    }";
    for batch in [7, 256, 1024] {
        for isa in Isa::all() {
            for without in [Vec::new(), vec![Pass::Fold, Pass::Unroll, Pass::Algebra]] {
                let varying = grid().varying().to_vec();
                let passes = passes::Options { varying, without, ..passes::Options::default() };
                let compiled = run::compile("elements", text, &[], &passes).unwrap();
                let options = RunOptions { batch: Some(batch), isa, ..RunOptions::default() };
                let frame =
                    osl_exec::run(&compiled.program, &run::services(), &grid(), &options, &|_| ()).unwrap();
                assert!(frame.planes[0].words.iter().all(|off| *off == 0), "{batch} {isa:?}");
            }
        }
    }
}
