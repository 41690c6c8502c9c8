//! A scene with compiled shaders, and how they run over points of shapes.

use super::background::{self, Direction, Table};
use super::camera::{Camera, View};
use super::shapes::{Form, Model, Point, Shape};
use crate::bsdf;
use crate::data::{Data, WithData};
use crate::displace::{Displacement, displace};
use crate::mesh::{SurfacePoint, Triangles};
use crate::surface_points::{Footprint, SurfacePoints};
use glam::Vec3;
use osl_exec::{
    Component, Datum, Frame, Plane, PointSource, Printed, Program, Run, RunError, RunOptions, Said, Services,
    unite,
};
use osl_ir::ir::Const;
use osl_limits::Limits;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

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
    /// A vertex is displaced.
    Displacement,
}

/// Services for shaders, by ray type.
#[derive(Debug)]
pub struct RayServices([Services; 5]);

impl RayServices {
    /// Services that differ by ray type; `make` creates one.
    pub fn new(make: impl Fn() -> Services) -> RayServices {
        // A ray without a type still has a name: the empty name stands for the camera.
        let kinds = ["camera", "diffuse", "shadow", "none", "displacement"];
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

impl World {
    /// Adds a mesh with a shader group. The group `displacement`, if there is one, moves its vertices first.
    ///
    /// # Errors
    /// The displacement exceeds its budget, or the command has to stop.
    pub fn add_mesh(
        &mut self,
        mut triangles: Triangles,
        [group, displacement]: [Option<usize>; 2],
        is_light: bool,
        notes: &mut Notes,
    ) -> Result<(), RunError> {
        if let Some(program) = displacement.and_then(|at| self.groups.get(at)) {
            displace(&mut triangles, |points| {
                let options = RunOptions { limits: self.limits.clone(), ..RunOptions::default() };
                let source = WithData { points: points.clone(), data: attributes(self) };
                let run = Run::new(program, self.services.of(Ray::Displacement), &source, &options);
                let Frame { messages, printed, planes, .. } = run.points(0..source.count(), &|_| ())?;
                notes.add(Notes { messages, printed, ..Notes::default() }, &self.limits);
                let moved: Vec<Vec<f32>> = planes.iter().map(Plane::floats).collect();
                let [x, y, z] = moved.as_slice() else {
                    // The shader leaves P as it is.
                    return Ok(Displacement::By(vec![Vec3::ZERO; points.count()]));
                };
                let moved = x.iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(*x, *y, *z));
                Ok(Displacement::To(moved.collect()))
            })?;
        }
        let form = Form::Mesh(Arc::new(Model::new(triangles)));
        self.shapes.push(Shape { form, group, is_light, resolution: 0 });
        Ok(())
    }
}

/// Messages of shaders.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// Errors and warnings.
    pub messages: Vec<Said>,
    /// Printed texts.
    pub printed: Vec<Printed>,
    /// Closures that are not rendered.
    pub unknown: BTreeSet<Arc<str>>,
}

impl Notes {
    /// Adds the messages of others, as far as the limits permit.
    pub(super) fn add(&mut self, more: Notes, limits: &Limits) {
        unite(&mut self.messages, more.messages, &limits.running);
        let most = usize::try_from(limits.scenes.printed).unwrap_or(usize::MAX);
        let room = most.saturating_sub(self.printed.len());
        self.printed.extend(more.printed.into_iter().take(room));
        self.unknown.extend(more.unknown);
    }
}

/// A world, ready for rendering.
pub(super) struct Stage<'w> {
    pub(super) world: &'w World,
    pub(super) view: View,
    pub(super) table: Option<Table>,
    /// The attributes that shaders can request from the renderer.
    data: Data,
}

/// Points of a table that one task shades.
const PIECE: usize = 1 << 13;

impl<'w> Stage<'w> {
    /// Prepares a world; the background table is computed on all threads.
    pub(super) fn new(world: &'w World, notes: &mut Notes) -> Result<Stage<'w>, RunError> {
        let view = View::new(&world.camera, world.size);
        let mut stage = Stage { world, view, table: None, data: attributes(world) };
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
        directions: &[Direction],
        ray: Ray,
        notes: &mut Notes,
    ) -> Result<Vec<Vec3>, RunError> {
        let Some(group) = self.world.background else { return Ok(Vec::new()) };
        let point = |i: &Direction| {
            let footprint = Footprint { i: i.derivs, ..Footprint::default() };
            Point { on: SurfacePoint::default(), incident: i.value, footprint, area: 0.0 }
        };
        let points: Vec<Point> = directions.iter().map(point).collect();
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
        let mut list = SurfacePoints::of_testrender();
        points.iter().for_each(|p| list.push(p.on, p.incident, p.footprint, p.area));
        let source = WithData { points: list, data: self.data.clone() };
        // One tile, so that it runs on this thread only; the other threads have their own points.
        let limits = self.world.limits.clone();
        let options = RunOptions { tile: points.len(), closures: true, limits, ..RunOptions::default() };
        let run = Run::new(program, self.world.services.of(ray), &source, &options);
        let Frame { messages, printed, closures, .. } = run.points(0..source.count(), &|_| ())?;
        notes.add(Notes { messages, printed, ..Notes::default() }, &self.world.limits);
        let ci = closures.iter().find(|c| &*c.output == "Ci");
        Ok((0..points.len()).map(|at| ci.map_or_else(Vec::new, |c| c.point(at))).collect())
    }
}

/// The attributes of a world, of no object and of the global one.
fn attributes(world: &World) -> Data {
    let float = |x: f32| Datum::one(Const::Float(x));
    let floats = |list: &[f32]| Datum::array(list.iter().map(|x| Const::Float(*x)).collect());
    let [width, height] = world.size;
    let aspect = width as f32 / height.max(1) as f32;
    let list = [
        ("osl:version", Datum::one(Const::Int(11312))),
        ("camera:resolution", Datum::array([width, height].map(|n| Const::Int(n as i32)).to_vec())),
        ("camera:projection", Datum::one(Const::Str("perspective".into()))),
        ("camera:fov", float(world.camera.fov)),
        ("camera:pixelaspect", float(1.0)),
        ("camera:clip", floats(&[0.1, 1000.0])),
        ("camera:clip_near", float(0.1)),
        ("camera:clip_far", float(1000.0)),
        ("camera:shutter", floats(&[0.0, 1.0])),
        ("camera:shutter_open", float(0.0)),
        ("camera:shutter_close", float(1.0)),
        ("camera:screen_window", floats(&[-aspect, -1.0, aspect, 1.0])),
    ];
    let attributes: std::collections::BTreeMap<_, _> =
        list.into_iter().map(|(name, datum)| (name.to_string(), datum)).collect();
    let objects = [("global".to_string(), attributes.clone())].into();
    Data { attributes, objects, ..Data::default() }
}
