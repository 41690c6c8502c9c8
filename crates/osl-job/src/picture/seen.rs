//! `--samples`, `--filter`, `--adaptive` and `--max-error` on a surface that a camera sees.

use super::sampling::{Plan, missed};
use super::sight::{Job, Programs};
use crate::Failure;
use crate::report::samples::{Kept, Samples, spent};
use crate::request::bounds::Resolved;
use osl_measure::sample::{Enough, Pattern, SeenImage, SeenWork, Sight};
use osl_scene::view::Seen;

/// How many standard errors the error bound of a pixel is.
const SURE: f32 = 2.0;

/// The picture of a surface with samples.
pub(super) fn picture(
    job: &mut Job<'_>,
    (displacement, program): Programs<'_>,
    plan: Plan,
) -> Result<(SeenImage, Samples), Failure> {
    let (request, sampling) = (job.image, &job.image.sampling);
    if matches!(plan, Plan::Rate(_) | Plan::Within(..)) || sampling.prefilter {
        return Err(Failure::usage(
            "--shading-rate, --within and --prefilter are for the grid; on a surface, --samples, --filter, --adaptive and \
             --max-error choose the samples",
        ));
    }
    let (view, surface, services) = job.view(displacement)?;
    let sight = Sight {
        view: &view,
        surface: &surface,
        pattern: Pattern::new(plan.samples(), 0),
        filter: plan.filter(),
        limits: &request.limits().running,
    };
    let mut work = SeenWork::new(&sight);
    let mut shade = |seen: &Seen| job.values(program, seen, &services);
    let (mut each, mut words) = (Vec::new(), Vec::new());
    let enough = match (plan, &sampling.max_error) {
        (Plan::MaxError(most, ..), Some(bounds)) => {
            work.first(&mut shade)?;
            let reaches = work.reaches();
            words = bounds.words(&reaches);
            let found = bounds.of(&reaches)?;
            let planes = reaches.iter().map(|reach| reach.planes.end).max().unwrap_or(0);
            let mut errors = vec![f32::INFINITY; planes];
            for (at, own) in found {
                let planes = reaches.get(at).map_or(0..0, |reach| reach.planes.clone());
                if let Some(errors) = errors.get_mut(planes) {
                    errors.fill(own.bound / SURE);
                }
                each.push(own);
            }
            Enough::Errors(errors, most)
        }
        (Plan::Adaptive(wanted, ..), _) => {
            work.first(&mut shade)?;
            let planes = work.reaches().iter().map(|reach| reach.planes.end).max().unwrap_or(0);
            Enough::Errors(vec![wanted.threshold; planes], wanted.most)
        }
        (Plan::Samples(samples, ..), _) => Enough::Samples(samples),
        _ => Enough::Samples(1),
    };
    work.until(&enough, &mut shade)?;
    let bounds = if let Enough::Errors(bounds, _) = &enough { bounds.as_slice() } else { &[] };
    let image = work.image(bounds);
    let said = said(&image, (each, words), matches!(enough, Enough::Errors(..)));
    Ok((image, said))
}

/// The report. With `differ`, pixels have different numbers of samples.
fn said(image: &SeenImage, (bounds, notes): (Vec<Resolved>, Vec<String>), differ: bool) -> Samples {
    let covered = image.coverage.iter().filter(|share| **share > 0.0).count();
    let share = image.tally.unfinished as f64 / covered.max(1) as f64;
    let missed = (!bounds.is_empty()).then(|| missed(&bounds, share)).flatten();
    let max_error = (!bounds.is_empty()).then(|| Kept::of(bounds, missed.is_none()));
    let samples = if differ { image.samples.clone() } else { Vec::new() };
    let (tally, text) = (image.tally.clone(), spent(&image.tally));
    Samples { tally, samples, text, notes, max_error, missed, ..Samples::default() }
}
