//! `oslrun stability --fix`: compiles changed sources for the search, and shows and writes what it finds.

use crate::cli::print::Console;
use osl::stages;
use osl_job::source::load::{self, Request};
use osl_job::source::{diff, input, repair as brackets};
use osl_job::{Failure, Image, Sink};
use osl_measure::stability::fix::{self, Built, Changed, Repair};
use osl_measure::stability::{Examined, Knob, Subject};
use osl_scene::Grid;
use osl_syntax::escape::shown;
use std::path::Path;

/// Refuses what is not the source of a single shader.
pub(super) fn suits(run: &Image) -> Result<(), Failure> {
    let single = run.shader.file.as_deref().filter(|file| {
        run.shader.network.is_empty()
            && !load::is_group(file)
            && !stages::is_compiled(&file.display().to_string())
    });
    single.map(|_| ()).ok_or_else(|| Failure::usage("--fix is for the source of a single shader"))
}

/// Looks for a repair of the examined shader.
pub(super) fn find(
    run: &Image,
    request: &Request<'_>,
    (subject, grid): (&Subject<'_>, &Grid),
    examined: &Examined,
    knobs: &[Knob],
) -> Result<Repair, Failure> {
    let Some(path) = run.shader.file.as_deref() else { return Err(Failure::usage("--fix needs a file")) };
    let mut input = input::read(path, &run.shader.read)?;
    input.files = input.files.or_anywhere(run.shader.allow_files);
    if run.shader.repair {
        brackets::apply(&mut input, None)?;
    }
    let check = |text: &str| stages::check(&input.name, text, &input.files, &input.options);
    let build = |changed: &Changed<'_>| {
        let checked = check(changed.text);
        let program = checked.program?;
        let mut params = request.params.to_vec();
        params.extend(changed.param.map(|(name, value)| (name.to_string(), value.to_string())));
        let request = Request { params: &params, ..*request };
        let live = changed.param.map(|(name, _)| name);
        let lower = |notes| load::lowered_again(&program, &request, notes, live);
        let plain = lower(false)?;
        let noted = if changed.notes { Some(lower(true)?) } else { None };
        Some(Built { program, sources: checked.sources, plain, noted })
    };
    let program = check(&input.text).program.ok_or_else(Failure::said)?;
    let mut found = fix::repair(subject, grid, examined, knobs, (&input.text, &program), &build);
    if let Some(text) = &found.text {
        found.diff = diff::unified(&input.name, (&input.text, text), "repaired");
    }
    Ok(found)
}

/// The repair as text.
pub(super) fn text(found: &Repair, run: &Image) -> String {
    let name = run.shader.file.as_deref().map(Path::display).map(|name| name.to_string()).unwrap_or_default();
    shown(&fix::text::text(found, &name)).to_string()
}

/// Writes the repaired source, if there is one and a file is named. A repair that fails a test is an error.
pub(super) fn write(found: &Repair, run: &Image, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(path) = &run.shader.write else { return Ok(()) };
    let name = path.display().to_string();
    let failed = match (&found.refused, &found.harmful) {
        (Some(why), _) => Some(why.clone()),
        (None, Some((_, at))) => Some(format!("the repair makes points worse with `{at}`")),
        (None, None) => found.cut_short.then(|| "the time was over (--budget)".to_string()),
    };
    match (&found.text, failed) {
        (Some(text), _) => {
            osl_files::replace(path, text.as_bytes()).map_err(Failure::new)?;
            console.text(&format!("wrote {name}"));
        }
        (None, Some(why)) => return Err(Failure::new(format!("{} is not written: {why}", shown(&name)))),
        (None, None) => {
            console.note(&format!("there is no repair, so {name} is not written"));
        }
    }
    Ok(())
}
