//! `--prefilter`: which steps and noises of a shader are filtered, before the picture is computed.
//!
//! This module must not know how that is decided.

use super::Failure;
use super::args::RunArgs;
use super::session::{grid, on_threads, options, stopped};
use osl::stages;
use osl_exec::{RunOptions, Services};
use osl_ir::ir::Body;
use osl_ir::passes::{self, FilterSite, Prefilter};
use osl_measure::sample::{Filter, Filtered, Pattern, Shading, Surface, filtered};
use osl_scene::WithData;
use osl_syntax::source::SourceMap;

/// What a decision is made for.
pub(super) struct DecisionInput<'a> {
    pub(super) services: &'a Services,
    /// The points of the whole picture, because a part of it must have the same values.
    pub(super) surface: &'a dyn Surface,
    pub(super) options: &'a RunOptions,
    pub(super) filter: Filter,
    pub(super) samples: u32,
    /// Whether each pixel may be decided on its own: the picture has one sample in each, and numbers only.
    pub(super) may_guard: bool,
}

impl DecisionInput<'_> {
    /// Decides what is filtered of a lowered program with these passes. Without any place there is nothing to
    /// filter.
    pub(super) fn chosen(
        &self,
        body: &Body,
        passes: &passes::Options,
    ) -> Result<(Option<Prefilter>, Filtered), osl_exec::RunError> {
        let scale = 1.0 / (self.samples as f32).sqrt();
        let compile = |left: &[FilterSite]| {
            let prefilter = Some(Prefilter { scale, left: left.to_vec() });
            stages::finish(body.clone(), &passes::Options { prefilter, ..passes.clone() }).program
        };
        let places = passes::prefilter_places(body.clone(), passes);
        let plain = stages::finish(body.clone(), passes).program;
        let shading = Shading {
            program: &plain,
            services: self.services,
            surface: self.surface,
            options: self.options,
            cheaper: None,
            guard: None,
            pattern: Pattern::new(self.samples, 0),
            filter: self.filter.clone(),
        };
        let found = filtered(&shading, (&places, self.may_guard), &compile)?;
        let wanted = (found.kept() > 0).then(|| Prefilter { scale, left: found.left.clone() });
        Ok((wanted, found))
    }
}

/// The same for a run of the command line.
pub(super) fn of_run(
    args: &RunArgs,
    (samples, filter, may_guard): (u32, Filter, bool),
    (body, passes): (&Body, &passes::Options),
    (services, data): (&Services, &WithData<osl_scene::Crop>),
    sources: &SourceMap,
) -> Result<(Option<Prefilter>, Filtered), Failure> {
    let surface = WithData { data: data.data.clone(), points: grid(args) };
    let options = options(args);
    let wanted = DecisionInput { services, surface: &surface, options: &options, filter, samples, may_guard };
    let found = on_threads(args.threads, || wanted.chosen(body, passes))?;
    found.map_err(|stop| stopped(&stop, sources))
}
