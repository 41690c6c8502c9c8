//! Valid programs from the generator, with the bytes as its choices.

use super::{broken, hash, tight};
use crate::generate as generator;
use crate::laws::{self, Shown, Way};
use osl::stages;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_limits::Limits;
use osl_lower::params::ParamValues;
use osl_measure::explain::{self, text as words};
use osl_measure::sanitize;
use osl_measure::stability::{self, Base, Knob, Subject, fix};
use osl_measure::trace::{self, OnePoint};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::sync::OnceLock;

/// A rough kind of program: the numbers of its different operations, values and blocks.
fn kind(body: &Body) -> u64 {
    let insts = body.blocks.iter().flat_map(|block| &block.insts);
    let ops: std::collections::HashSet<_> = insts.map(|inst| std::mem::discriminant(&inst.op)).collect();
    let roughly = |n: usize| u64::from(n.max(1).ilog2());
    (ops.len() as u64) << 16 | roughly(body.values.len()) << 8 | roughly(body.blocks.len())
}

/// All ways to compile and run give the same bits.
pub fn generate(bytes: &[u8]) -> u64 {
    static WAYS: OnceLock<Vec<Way>> = OnceLock::new();
    let ways = WAYS.get_or_init(laws::ways);
    let text = generator::program(bytes);
    // The few invalid programs of the generator must still not cause a panic.
    let Ok(body) = laws::lower(&text) else { return 0 };
    // One other way per execution, because compiling takes most of the time.
    let at = hash(bytes) as usize % ways.len();
    if let Err(law) = laws::hold_body(&body, &ways[at..=at]) {
        broken(&text, &format!("breaks {law}"));
    }
    kind(&body)
}

/// A program, the compiled shader written from it, and that text read again: both run with the same bits.
pub fn compiled(bytes: &[u8]) -> u64 {
    let text = generator::program(bytes);
    let checked = stages::check("generated.osl", &text, &NoFiles, &Options::default());
    let Some(program) = &checked.program else { return 0 };
    let Ok(body) = osl_lower::lower(program, &ParamValues::default()) else { return 1 };
    let written = match osl_hir::oso::write(program, &checked.sources, &Limits::default()) {
        Ok(written) => written,
        Err(why) => broken(&text, &format!("it cannot be written: {why:?}")),
    };
    let loaded = stages::check("generated.oso", &written, &NoFiles, &Options::default());
    let Some(loaded) = &loaded.program else {
        broken(&text, &format!("{written}\nwhat is written cannot be read: {:?}", loaded.diagnostics))
    };
    let again = match osl_lower::lower(loaded, &ParamValues::default()) {
        Ok(again) => again,
        Err(why) => broken(&text, &format!("{written}\nwhat is read cannot be compiled: {why:?}")),
    };
    let [first, second] = [&body, &again].map(|body| match laws::shown(body, &laws::plain()) {
        Ok(shown) => comparable(&shown),
        Err(why) => broken(&text, &why),
    });
    if first != second {
        let line = first.iter().zip(&second).find(|(a, b)| a != b);
        broken(&text, &format!("{written}\ndiffers: {line:#?}"));
    }
    kind(&body)
}

/// The results that must be the same through a compiled shader: values and text. A compiled shader knows no
/// columns and, in closures that only a renderer knows, not where keywords begin.
fn comparable(shown: &Shown) -> Vec<String> {
    if shown.values.starts_with("stopped") {
        return vec!["stopped".to_string()];
    }
    let values =
        shown.values.lines().filter(|line| !line.contains("Component {") && !line.contains("Printed {"));
    values.map(str::to_string).collect()
}

/// The number of values below which a program's lines to blame are repaired too.
const REPAIRED: usize = 2000;

/// `explain` at one point, `sanitize` and `stability` at a few points, with pages, and repairs of small
/// programs: within their limits, without a panic.
pub fn told(bytes: &[u8]) -> u64 {
    let text = generator::program(bytes);
    let checked = stages::check("generated.osl", &text, &NoFiles, &Options::default());
    let Some(program) = &checked.program else { return 0 };
    let (Ok(body), Ok(noted)) = (stages::lower(program, &[]), stages::lower_noted(program, &[])) else {
        return 1;
    };
    // A sweep runs a program some fifty times with the limits of the command: a slow program would take
    // minutes.
    let compiled = stages::finish(body.clone(), &passes::Options::default());
    let once = osl_exec::run(&compiled.program, laws::services(), &Grid::new(2, 2), &tight(), &|_| ());
    let points = Grid::new(4, 4);
    let options = passes::Options {
        varying: osl_exec::PointSource::varying(&points).to_vec(),
        derivs: osl_exec::PointSource::varying_derivs(&points).to_vec(),
        ..passes::Options::default()
    };
    explain::table(&explain::cost(&body, &options));
    let subject = explain::Subject::new(noted.clone(), &options, &checked.sources);
    let Some(point) = OnePoint::at_pixel(&points, 4, 4, 1, 2) else { return 2 };
    let one = OnePoint { source: &points, point };
    let mut limits = Limits::default();
    limits.running.trace = 20_000;
    let traced = trace::follow(&subject.body, laws::services(), one, &limits);
    let explanation = explain::explain(&traced, &subject, &checked.sources);
    words::text(&explanation, "a point", words::Style { exact: true, all: false });
    if once.is_err() || !hash(bytes).is_multiple_of(4) {
        return kind(&body);
    }
    let shorter = passes::Options { limits: limits.clone(), ..options.clone() };
    let subject = sanitize::Subject::new(body.clone(), &shorter);
    let places = sanitize::Points { source: &points, size: (4, 4), pixels: None };
    let mut examined =
        sanitize::sanitize(&subject, laws::services(), &places, &checked.sources, "<svg onload=x>");
    examined.report.rounding =
        Some(sanitize::rounding(&subject, laws::services(), &places, &checked.sources));
    sanitize::text::text(&examined.report);
    let base = Base::new(body.clone(), noted.clone(), None, &options.limits);
    let subject = Subject::new(laws::services(), base, &limits);
    let values = vec!["nan".to_string()];
    let knobs = [Knob { name: "none".to_string(), values, near: vec!["2".to_string()] }];
    let variant = |_: &str, _: &str| Some(Base::new(body.clone(), noted.clone(), None, &options.limits));
    let examined = stability::examine(
        &subject,
        &Grid::new(2, 2),
        0.01,
        &knobs,
        &variant,
        &checked.sources,
        "<svg onload=x>\u{1b}[31m",
    );
    stability::text::text(&examined.report, true);
    let page = stability::html::html(&examined, (2, 2), None);
    assert!(!page.contains("<svg onload"), "the page holds the name of the shader as it is");
    // The search compiles up to a few hundred programs.
    if body.values.len() < REPAIRED && hash(bytes).is_multiple_of(16) {
        let build = |changed: &fix::Changed<'_>| {
            let checked = stages::check("generated.osl", changed.text, &NoFiles, &Options::default());
            let program = checked.program?;
            let plain = stages::lower(&program, &[]).ok()?;
            let noted = if changed.notes { Some(stages::lower_noted(&program, &[]).ok()?) } else { None };
            Some(fix::Built { program, sources: checked.sources, plain, noted })
        };
        let found = fix::repair(&subject, &Grid::new(2, 2), &examined, &knobs, (&text, program), &build);
        fix::text::text(&found, "<svg onload=x>\u{1b}[31m");
        if let Some(repaired) = found.text.filter(|repaired| build(&fix::Changed::plain(repaired)).is_none())
        {
            broken(&text, &format!("{repaired}\nis no repair: it does not compile"));
        }
    }
    kind(&body)
}
