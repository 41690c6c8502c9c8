//! Finds the level at which nothing of the body runs: all outputs are their means, or linear in the
//! coordinate and in the width of a pixel if they have no mean.
//!
//! This module must not know how the text is written.

use super::judge::{FOOTPRINTS, Truth};
use super::known::{FootprintErrors, Sets};
use super::linear::{self, Point};
use super::means::linear as sum;
use super::off::{BLOCKS, Fault, Off};
use super::search::{Failed, Search, is_number};
use super::write::{BEGIN, Far, Form, alone};
use osl_exec::RunError;
use osl_ir::types::Type;

/// What the switch to a level costs without comparisons of parameters, in additions.
const SWITCH: f64 = 6.0;
/// How much larger a coordinate may be than the largest one on which a slope was measured, so that the digits
/// of the slope are still enough.
const FURTHER: f64 = 4.0;

impl Search<'_, '_> {
    /// The level at which nothing of the body runs. A shader that filters by itself may have other means at
    /// larger footprints, so the means are those of the footprints at which they are used.
    pub(super) fn far(&mut self) -> Result<Option<Far>, RunError> {
        let program = self.source.program;
        let mut outputs = program.shader.params.iter().filter(|param| param.output);
        let other = outputs.find_map(|param| {
            let var = program.vars.get(param.var.0 as usize)?;
            (!is_number(var.ty)).then(|| var.name.to_string())
        });
        if let Some(name) = other {
            self.failed.push(Failed::NoMean(name));
            return Ok(None);
        }
        // What the width of a pixel and its comparison with the parameters cost.
        let switch = SWITCH + self.inputs.guards.len() as f64;
        let planes: usize = self.judge.outputs.iter().map(|output| output.planes.len()).sum();
        if self.original.work() <= switch + planes as f64 {
            self.failed.push(Failed::Cheap);
            return Ok(None);
        }
        let mut last = None;
        // At footprint 1 the original always runs.
        for (from, full) in FOOTPRINTS.into_iter().enumerate().skip(1) {
            let Some((planes, forms)) = self.means(from) else { continue };
            let mut errors = |known: &FootprintErrors| Ok(self.constant(&planes, known));
            let verdict = self.known.verdict(&mut errors, ((full, f64::INFINITY), true))?;
            let constant = Far { full, begin: BEGIN, forms, planes: Some(planes) };
            let fault = match verdict {
                Ok(_) => return Ok(Some(constant)),
                Err(fault) => fault,
            };
            match self.with_slopes(constant, (from, fault))? {
                Ok(far) => return Ok(Some(far)),
                Err(failed) => last = Some(failed),
            }
        }
        self.failed.extend(last);
        Ok(None)
    }

    /// Gives slopes to the outputs that fail with their means, one after the other.
    fn with_slopes(
        &mut self,
        mut far: Far,
        (from, mut fault): (usize, Fault),
    ) -> Result<Result<Far, Failed>, RunError> {
        let over = self.known.sets.get(from..).unwrap_or(&[]);
        let columns: Result<Vec<Vec<Vec<f32>>>, RunError> =
            over.iter().map(|sets| self.place.at(self.judge, &sets.fitted.truth)).collect();
        let columns = columns?;
        // An output that has slopes already fails for good.
        while let Some(form) = far.forms.get_mut(fault.output).filter(|form| form.along.is_empty())
            && let Some(sloped) = self.sloped(fault.output, (over, &columns))
        {
            *form = sloped;
            far.planes = None;
            let text = alone(self.source, self.frame, self.inputs, &far);
            let Some(built) = text.and_then(|text| (self.build)(&text)) else { break };
            self.tried += 1;
            let variant = self.judge.variant(built.plain);
            if self.original.work() <= SWITCH + self.inputs.guards.len() as f64 + variant.cost {
                break;
            }
            match self.holds(&variant, (far.full, f64::INFINITY), true)? {
                Ok(_) => return Ok(Ok(far)),
                Err(next) => fault = next,
            }
        }
        let is_sloped = far.planes.is_none();
        Ok(Err(if is_sloped { Failed::Linear(fault) } else { Failed::Outputs(fault) }))
    }

    /// An output as linear forms. `None` if none of its components has a significant slope.
    fn sloped(&self, output: usize, (over, columns): (&[Sets], &[Vec<Vec<f32>>])) -> Option<Form> {
        let own = self.judge.outputs.get(output)?;
        // The places of points belong together in every scene only if nothing else says where a point is.
        let used: Vec<usize> = match self.inputs.is_only_place {
            true => (0..self.place.columns.len()).collect(),
            false => vec![self.place.columns.len().checked_sub(1)?],
        };
        let names: Vec<&str> =
            used.iter().filter_map(|at| self.place.columns.get(*at).map(String::as_str)).collect();
        let ignored = self.known.tolerance * own.range;
        let mut terms = Vec::new();
        let mut along = vec![false; names.len()];
        let truths: Vec<&Truth> = over.iter().map(|sets| &sets.fitted.truth).collect();
        let means = self.judge.means(&truths);
        for plane in own.planes.clone() {
            let points = points((output, plane), (over, columns), (&used, self.known.tolerance));
            let form = linear::fit(&points, ignored).unwrap_or(linear::Form {
                constant: means.get(plane).copied()?,
                slopes: vec![0.0; names.len()],
            });
            along.iter_mut().zip(&form.slopes).for_each(|(any, slope)| *any |= *slope != 0.0);
            let largest = |at: usize| {
                points.iter().filter_map(|point| point.columns.get(at)).fold(0.0_f64, |a, x| a.max(x.abs()))
            };
            let reach = (0..names.len()).map(|at| FURTHER * largest(at));
            let slopes: Vec<(f64, &str, f64)> = form
                .slopes
                .iter()
                .zip(&names)
                .zip(reach)
                .map(|((slope, name), reach)| (*slope, *name, reach))
                .collect();
            terms.push((form.constant, slopes));
        }
        let text = sum(own.ty, &terms, own.range)?;
        let along: Vec<usize> = used.iter().zip(along).filter(|(_, any)| *any).map(|(at, _)| *at).collect();
        (!along.is_empty()).then(|| Form { name: own.name.clone(), text, is_int: own.ty == Type::INT, along })
    }

    /// The errors of planes that have the same value everywhere.
    pub(super) fn constant(&self, planes: &[f64], known: &FootprintErrors) -> Off {
        let count = known.original.squares.first().map_or(0, Vec::len);
        let values: Vec<Vec<f32>> = planes.iter().map(|x| vec![*x as f32; count]).collect();
        self.judge.compare(&values, &known.truth)
    }
}

/// The points of a plane. The squared errors of a footprint count as shares of what the original errs there,
/// so that none dominates because its values are larger.
fn points(
    (output, plane): (usize, usize),
    (over, columns): (&[Sets], &[Vec<Vec<f32>>]),
    (used, tolerance): (&[usize], f64),
) -> Vec<Point> {
    let mut points = Vec::new();
    for (index, (sets, columns)) in over.iter().zip(columns).enumerate() {
        let may = sets.fitted.original.output(output).mean.max(0.0) + tolerance * tolerance;
        let truth = &sets.fitted.truth;
        for (at, (wanted, block)) in truth.wanted(plane).iter().zip(truth.blocks()).enumerate() {
            let value = |column: &usize| columns.get(*column)?.get(at).copied().map(f64::from);
            let own: Option<Vec<f64>> = used.iter().map(value).collect();
            let Some(own) = own.filter(|own| wanted.is_finite() && own.iter().all(|x| x.is_finite())) else {
                continue;
            };
            let group = index * BLOCKS * BLOCKS + block;
            points.push(Point {
                columns: own,
                wanted: f64::from(*wanted),
                weight: 1.0 / may.max(1e-12),
                group,
            });
        }
    }
    points
}
