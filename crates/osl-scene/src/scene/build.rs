//! Builds a world for rendering from a description: triangles, programs, lights.

use super::describe::{Description, Form, SkyNode, Surface};
use super::message::{Messages, say};
use super::network::{Network, Networks, Use};
use super::tessellate::{move_by, tessellate};
use crate::answers::Place;
use crate::camera::View;
use crate::data::Data;
use crate::light::Sky;
use crate::mesh::{Bounds, SurfacePoint, Triangles};
use crate::render::{Body, Ground, Material, Object, World};
use crate::shape::{Placed, Shape, Solid};
use crate::subdivide::Detail;
use crate::surface_points::{Footprint, SurfacePoints};
use glam::{Mat4, Quat, Vec2, Vec3};
use osl_exec::{Frame, Program, RunOptions, Services};
use osl_limits::Limits;
use std::sync::Arc;

/// External inputs of a scene.
pub struct Surroundings<'a> {
    /// Width and height of the picture; `None` means those of the file.
    pub size: Option<[usize; 2]>,
    /// Services for shaders: textures, and spaces, which are adapted for each object.
    pub services: &'a dyn Fn() -> Services,
}

/// Pixels of the image for which a sky's shader runs: width and height.
const SKY: [usize; 2] = [1024, 512];
/// Maximum edge length of displaced shapes, in pixels.
const EDGE: f64 = 1.5;

/// Builds the world of a scene; `None` after an error.
pub fn build(
    scene: &Description,
    networks: &mut Networks<'_>,
    around: &Surroundings<'_>,
    messages: &mut Messages,
) -> Option<World> {
    let Some(mut camera) = scene.camera else {
        messages.error(&scene.place, "there is no camera: a node of kind `persp_camera`");
        return None;
    };
    let (width, height) = scene.settings.size;
    camera.resolution = around.size.unwrap_or([width as usize, height as usize]);
    let most = messages.limits().scenes.pixels;
    if (camera.resolution[0] as u64).saturating_mul(camera.resolution[1] as u64) > most {
        let [width, height] = camera.resolution;
        let text = format!("{width} x {height} pixels are more than {most} (--limit scenes.pixels=N)");
        messages.error(&scene.place, text);
        return None;
    }
    let view = match camera.view() {
        Ok(view) => view,
        Err(why) => {
            messages.error(&scene.place, why.to_string());
            return None;
        }
    };
    let mut world = World {
        view,
        lens: None,
        objects: Vec::new(),
        grounds: Vec::new(),
        materials: Vec::new(),
        lights: scene.lights.clone(),
        sky: None,
        background: false,
        diffuse_depth: scene.settings.diffuse_depth,
        glossy_depth: scene.settings.glossy_depth,
        limits: messages.limits().clone(),
    };
    if scene.surfaces.is_empty() {
        messages.warning(&scene.place, "there is no surface to be seen");
    }
    for surface in &scene.surfaces {
        if let Some(why) = messages.limits().halted() {
            messages.error(&surface.place, why.to_string());
            return None;
        }
        add_surface(surface, &mut world, networks, around, messages);
    }
    add_sky(scene, &mut world, networks, around, messages);
    (!messages.failed()).then_some(world)
}

fn add_surface(
    surface: &Surface,
    world: &mut World,
    networks: &mut Networks<'_>,
    around: &Surroundings<'_>,
    messages: &mut Messages,
) -> Option<()> {
    let Some(shader) = &surface.shader else {
        let text = format!("surface `{}` has no shader: it is left out", surface.name);
        messages.warning(&surface.place, text);
        return None;
    };
    let network = networks.compile(shader, Use::Surface, &surface.place, messages)?;
    let services = || with_spaces((around.services)(), &surface.matrix, &world.view);
    let number = world.materials.len();
    let material = Material {
        color: network.output.clone().filter(|_| !network.closure),
        program: network.program,
        lean: network.lean,
        services: services(),
        stretch: None,
        through: None,
        data: Data { place: placed(surface, number, &services()), ..Data::default() },
    };
    let form = form(surface, world, networks, &services, messages)?;
    match form {
        BuiltShape::Ground(point, normal) => world.grounds.push(Ground { point, normal, material: number }),
        BuiltShape::Object(body) => world.objects.push(Object { body: *body, material: number }),
    }
    world.materials.push(material);
    Some(())
}

/// Where a surface is.
fn placed(surface: &Surface, number: usize, services: &Services) -> Place {
    let bounds = match &surface.form {
        Form::Plane { point, .. } => Bounds { min: *point, max: *point },
        Form::Sphere { center, radius } => Bounds { min: *center - *radius, max: *center + *radius },
        Form::Cylinder { bottom, top, radius } => {
            let axis = (*top - *bottom).normalize_or(Vec3::Y);
            let across = (Vec3::ONE - axis * axis).max(Vec3::ZERO).map(f32::sqrt) * *radius;
            Bounds { min: bottom.min(*top) - across, max: bottom.max(*top) + across }
        }
        Form::Mesh(polygons) => Bounds::of(polygons.mesh.positions.iter().copied()),
    };
    let to_window = services.spaces.matrix("common", "NDC").ok().map(|m| Mat4::from_cols_array(&m));
    // The radical inverse in base 2: close numbers give values far apart.
    let random = (number as u32 + 1).reverse_bits() as f32 / 4_294_967_296.0;
    Place { bounds, to_common: surface.matrix, to_window, random }
}

/// The result for a shape.
enum BuiltShape {
    Ground(Vec3, Vec3),
    Object(Box<Body>),
}

/// A shape, displaced, in common space.
fn form(
    surface: &Surface,
    world: &World,
    networks: &mut Networks<'_>,
    services: &dyn Fn() -> Services,
    messages: &mut Messages,
) -> Option<BuiltShape> {
    let matrix = surface.matrix;
    // All surfaces share the permitted number of triangles.
    let mut limits = messages.limits().clone();
    let used: usize = world.objects.iter().map(|object| object.body.triangles()).sum();
    limits.scenes.triangles = limits.scenes.triangles.saturating_sub(used as u64);
    let (shape, own) = match &surface.form {
        Form::Plane { point, normal } => {
            let for_normals = matrix.inverse().transpose();
            let normal = for_normals.transform_vector3(*normal).normalize_or(Vec3::Y);
            return Some(BuiltShape::Ground(matrix.transform_point3(*point), normal));
        }
        Form::Sphere { center, radius } => {
            (Shape::Sphere { radius: *radius }, matrix * Mat4::from_translation(*center))
        }
        Form::Cylinder { bottom, top, radius } => {
            let axis = *top - *bottom;
            let turn = Quat::from_rotation_arc(Vec3::Y, axis.normalize_or(Vec3::Y));
            let height = axis.length().max(1e-6);
            let place = Mat4::from_rotation_translation(turn, (*bottom + *top) * 0.5);
            (Shape::Cylinder { radius: *radius, height }, matrix * place)
        }
        Form::Mesh(polygons) => {
            let mut triangles = tessellate(surface, polygons, &matrix, &limits, messages)?;
            displaced(surface, &mut triangles, networks, services, messages)?;
            return Some(BuiltShape::Object(Box::new(Body::Solid(Solid::new(triangles)))));
        }
    };
    if surface.displacement.is_none() {
        return Some(BuiltShape::Object(Box::new(Body::Shape(Placed::new(shape, own)?))));
    }
    let detail = Detail::Pixels { view: &world.view, edge: EDGE };
    let (mut triangles, _, _) = shape
        .triangles_within(&own, &detail, &limits)
        .map_err(|why| messages.error(&surface.place, why.to_string()))
        .ok()?;
    displaced(surface, &mut triangles, networks, services, messages)?;
    Some(BuiltShape::Object(Box::new(Body::Solid(Solid::new(triangles)))))
}

/// Displaces triangles, if the surface has a displacement.
fn displaced(
    surface: &Surface,
    triangles: &mut Triangles,
    networks: &mut Networks<'_>,
    services: &dyn Fn() -> Services,
    messages: &mut Messages,
) -> Option<()> {
    let Some(name) = &surface.displacement else { return Some(()) };
    let network = networks.compile(name, Use::Displacement, &surface.place, messages)?;
    move_by(&network, &services(), surface, triangles, messages)
}

/// The spaces of an object: `object` and `shader` are its own, `camera` and the later ones belong to the
/// view.
fn with_spaces(mut services: Services, matrix: &Mat4, view: &View) -> Services {
    let rows = matrix.to_cols_array();
    services.spaces.set("object", rows);
    services.spaces.set("shader", rows);
    view.set_spaces(&mut services.spaces, view.sight() * 0.01, view.sight() * 100.0);
    services
}

/// The visible sky also lights the scene. If no sky is visible, a single sky lights the scene invisibly.
fn add_sky(
    scene: &Description,
    world: &mut World,
    networks: &mut Networks<'_>,
    around: &Surroundings<'_>,
    messages: &mut Messages,
) -> Option<()> {
    let named = scene.settings.background.as_deref();
    let node = match named {
        Some(name) => {
            let found = scene.skies.iter().find(|s| s.name == name);
            if found.is_none() {
                messages.warning(&scene.place, format!("there is no sky `{name}` for a background"));
            }
            found
        }
        None => None,
    };
    world.background = node.is_some();
    let node = node.or(scene.skies.last())?;
    for other in scene.skies.iter().filter(|s| s.name != node.name) {
        messages.warning(&other.place, format!("a scene has one sky: `{}` has no effect", other.name));
    }
    world.sky = Some(match &node.shader {
        None => Sky::constant(node.color * node.intensity),
        Some(name) => {
            let network = networks.compile(name, Use::Sky, &node.place, messages)?;
            shaded_sky(node, &network, &(around.services)(), messages)?
        }
    });
    Some(())
}

/// Runs the shader of a sky for all directions: `I` and `P` are the direction, `N` is its opposite, `u` and
/// `v` are the position on the image from the left and from the top.
fn shaded_sky(
    node: &SkyNode,
    network: &Network,
    services: &Services,
    messages: &mut Messages,
) -> Option<Sky> {
    let [width, height] = SKY;
    let mut points = SurfacePoints::with_capacity(width * height);
    let step = [1.0 / width as f32, 1.0 / height as f32];
    for index in 0..width * height {
        let uv =
            Vec2::new((index % width) as f32 + 0.5, (index / width) as f32 + 0.5) * Vec2::from_array(step);
        let at = |uv: Vec2| Sky::direction(uv.to_array());
        let (dx, dy) = (Vec2::new(step[0], 0.0), Vec2::new(0.0, step[1]));
        let p = at(uv);
        let derivs = [at(uv + dx) - p, at(uv + dy) - p];
        let [dpdu, dpdv] = [derivs[0] / step[0], derivs[1] / step[1]];
        let footprint = Footprint { p: derivs, uv: [dx, dy], i: derivs };
        points.push(SurfacePoint { p, n: -p, ng: -p, uv, dpdu, dpdv }, p, footprint, 0.0);
    }
    let frame = run(&network.program, services, &points, network.closure, messages.limits());
    let frame = frame
        .map_err(|why| messages.error(&node.place, format!("shader of sky `{}`: {why}", node.name)))
        .ok()?;
    say(&frame, &node.place, messages);
    let color = |at: usize| match &network.output {
        Some(name) if !network.closure => plane_color(&frame, name, at),
        _ => background_color(&frame, at),
    };
    let pixels = (0..width * height).map(|at| color(at) * node.intensity).collect();
    Some(Sky::image(SKY, pixels))
}

fn run(
    program: &Program,
    services: &Services,
    points: &SurfacePoints,
    closures: bool,
    limits: &Limits,
) -> Result<Frame, osl_exec::RunError> {
    let options = RunOptions { closures, limits: limits.clone(), ..RunOptions::default() };
    osl_exec::run(program, services, points, &options, &|_| ())
}

fn plane_color(frame: &Frame, name: &Arc<str>, at: usize) -> Vec3 {
    let value = |component: usize| {
        let plane = frame.planes.iter().find(|p| p.output == *name && p.component == component);
        plane.and_then(|p| p.words.get(at)).map(|w| f32::from_bits(*w))
    };
    let first = value(0).unwrap_or(0.0);
    Vec3::new(first, value(1).unwrap_or(first), value(2).unwrap_or(first))
}

/// The light of the closures `background` and `emission`.
fn background_color(frame: &Frame, at: usize) -> Vec3 {
    let ci = frame.closures.iter().find(|c| &*c.output == "Ci");
    let shines = |name: &str| matches!(name, "background" | "emission");
    let components = ci.into_iter().flat_map(|c| c.weights(at)).filter(|(name, _)| shines(name));
    components.map(|(_, weight)| Vec3::from_array(weight)).sum()
}
