//! A scene with compiled shaders, and how they run over points of shapes.

use super::background::{self, Table};
use super::camera::{Camera, View};
use super::dual::Dual3;
use super::points::{Attributes, Points};
use super::shapes::{Point, Shape};
use crate::bsdf;
use osl_exec::{
    Component, Frame, PointSource, Printed, Program, Run, RunError, RunOptions, Said, Services, unite,
};
use osl_limits::Limits;
use rayon::prelude::*;

/// The purpose of a shader run, as reported by `raytype`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ray {
    /// The camera sees the point.
    Camera,
    /// A path reaches the point.
    Bounce,
    /// The point sends light to another one.
    Light,
    /// The background table is computed.
    Table,
}

/// Services for shaders, by ray type.
#[derive(Debug)]
pub struct RayServices([Services; 4]);

impl RayServices {
    /// Services that differ by ray type; `make` creates one.
    pub fn new(make: impl Fn() -> Services) -> RayServices {
        // A ray without a type still has a name: the empty name stands for the camera.
        let kinds = ["camera", "diffuse", "shadow", "none"];
        RayServices(kinds.map(|kind| Services { ray: kind.to_string(), ..make() }))
    }

    fn of(&self, ray: Ray) -> &Services {
        &self.0[ray as usize]
    }
}

/// Everything needed to render a picture.
pub struct World {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// The shapes.
    pub shapes: Vec<Shape>,
    /// The shader groups; each computes `Ci`.
    pub groups: Vec<Program>,
    /// Their services.
    pub services: RayServices,
    /// The shader group of the background.
    pub background: Option<usize>,
    /// Side of its table; 0 for none.
    pub resolution: usize,
    /// What its shaders and the picture may cost.
    pub limits: Limits,
}

/// Messages of shaders.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// Errors and warnings.
    pub messages: Vec<Said>,
    /// Printed texts.
    pub printed: Vec<Printed>,
}

impl Notes {
    /// Adds the messages of others, as far as the limits permit.
    pub(super) fn add(&mut self, more: Notes, limits: &Limits) {
        unite(&mut self.messages, more.messages, &limits.running);
        let most = usize::try_from(limits.scenes.printed).unwrap_or(usize::MAX);
        let room = most.saturating_sub(self.printed.len());
        self.printed.extend(more.printed.into_iter().take(room));
    }
}

/// A world, ready for rendering.
pub(super) struct Stage<'w> {
    pub(super) world: &'w World,
    pub(super) view: View,
    pub(super) table: Option<Table>,
    attributes: Attributes,
}

/// Points of a table that one task shades.
const PIECE: usize = 1 << 13;

impl<'w> Stage<'w> {
    /// Prepares a world; the background table is computed on all threads.
    pub(super) fn new(world: &'w World, notes: &mut Notes) -> Result<Stage<'w>, RunError> {
        let attributes = Attributes { resolution: world.size, fov: world.camera.fov };
        let view = View::new(&world.camera, world.size);
        let mut stage = Stage { world, view, table: None, attributes };
        if world.background.is_some() && world.resolution > 0 {
            let centers = background::centers(world.resolution);
            let pieces: Vec<_> = centers
                .par_chunks(PIECE)
                .map(|directions| {
                    let mut notes = Notes::default();
                    let light = stage.background(directions, Ray::Table, &mut notes)?;
                    Ok((light, notes))
                })
                .collect::<Result<_, RunError>>()?;
            let mut light = Vec::with_capacity(centers.len());
            for (part, more) in pieces {
                light.extend(part);
                notes.add(more, &world.limits);
            }
            stage.table = Some(Table::new(world.resolution, light));
        }
        Ok(stage)
    }

    /// Fails once the command has to stop.
    pub(super) fn goes_on(&self) -> Result<(), RunError> {
        self.world.limits.halted().map_or(Ok(()), |why| Err(RunError::Halted(why)))
    }

    /// Whether there is a background.
    pub(super) fn has_background(&self) -> bool {
        self.world.background.is_some()
    }

    /// The light of the background from directions.
    pub(super) fn background(
        &self,
        directions: &[Dual3],
        ray: Ray,
        notes: &mut Notes,
    ) -> Result<Vec<glam::Vec3>, RunError> {
        let Some(group) = self.world.background else { return Ok(Vec::new()) };
        let points: Vec<Point> = directions.iter().map(|i| Point { i: *i, ..Point::default() }).collect();
        let found = self.shade(group, &points, ray, notes)?;
        Ok(found.iter().map(|components| bsdf::background(components)).collect())
    }

    /// The closures of points of a shader group.
    pub(super) fn shade(
        &self,
        group: usize,
        points: &[Point],
        ray: Ray,
        notes: &mut Notes,
    ) -> Result<Vec<Vec<Component>>, RunError> {
        let Some(program) = self.world.groups.get(group).filter(|_| !points.is_empty()) else {
            return Ok(vec![Vec::new(); points.len()]);
        };
        let source = Points { list: points, attributes: &self.attributes };
        // One tile, so that it runs on this thread only; the other threads have their own points.
        let limits = self.world.limits.clone();
        let options = RunOptions { tile: points.len(), closures: true, limits, ..RunOptions::default() };
        let run = Run::new(program, self.world.services.of(ray), &source, &options);
        let Frame { messages, printed, closures, .. } = run.points(0..source.count(), &|_| ())?;
        notes.add(Notes { messages, printed }, &self.world.limits);
        let ci = closures.iter().find(|c| &*c.output == "Ci");
        Ok((0..points.len()).map(|at| ci.map_or_else(Vec::new, |c| c.point(at))).collect())
    }
}
