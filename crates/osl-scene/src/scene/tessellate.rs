//! From polygons to triangles: subdivided and displaced, in common space.

use super::describe::Surface;
use super::message::{Messages, say};
use super::network::Network;
use super::polygons::Polygons;
use crate::displace::{Displacement, displace};
use crate::mesh::Triangles;
use crate::subdivide::{self, Detail, Scheme};
use crate::surface_points::SurfacePoints;
use glam::{Mat4, Vec3};
use osl_exec::{Frame, RunError, RunOptions, Services};
use osl_limits::Limits;

/// The triangles of polygons, transformed by a matrix; `None` after an error.
pub(super) fn tessellate(
    surface: &Surface,
    polygons: &Polygons,
    matrix: &Mat4,
    limits: &Limits,
    messages: &mut Messages,
) -> Option<Triangles> {
    let mut mesh = polygons.mesh.clone();
    mesh.transform(matrix);
    let flat = polygons.smooth && polygons.scheme == Scheme::Linear && mesh.normals.is_empty();
    let detail = Detail::Level(polygons.iterations);
    match subdivide::tessellate_within(&mesh, polygons.scheme, &detail, limits) {
        Ok(mut found) => {
            if !found.oddities.is_empty() {
                messages.warning(&surface.place, format!("mesh `{}`: {}", surface.name, found.oddities));
            }
            if flat {
                let smooth = found.triangles.place_normals();
                let Triangles { normals, places, .. } = &mut found.triangles;
                for (n, place) in normals.iter_mut().zip(places) {
                    *n = smooth.get(*place as usize).copied().unwrap_or_default().normalize_or(*n);
                }
            }
            Some(found.triangles)
        }
        Err(why) => {
            messages.error(&surface.place, format!("mesh `{}` cannot be used: {why}", surface.name));
            None
        }
    }
}

/// Displaces triangles by a network.
pub(super) fn move_by(
    network: &Network,
    services: &Services,
    surface: &Surface,
    triangles: &mut Triangles,
    messages: &mut Messages,
) -> Option<()> {
    let options = RunOptions { limits: messages.limits().clone(), ..RunOptions::default() };
    let shade = |points: &SurfacePoints| -> Result<(Displacement, Frame), RunError> {
        let frame = osl_exec::run(&network.program, services, points, &options, &|_| ())?;
        Ok((displacement(network, &frame), frame))
    };
    let mut said = Frame::default();
    let moved = displace(triangles, |points| {
        let (displacement, frame) = shade(points)?;
        said = frame;
        Ok::<_, RunError>(displacement)
    });
    say(&said, &surface.place, messages);
    match moved {
        Err(why) => {
            let text = format!("displacement `{}` of `{}`: {why}", network.name, surface.name);
            messages.error(&surface.place, text);
            None
        }
        Ok(done) => {
            if done.stayed > 0 {
                let text = format!(
                    "displacement `{}` of `{}` is not finite at {} of {} points: they stay where they are",
                    network.name, surface.name, done.stayed, done.points
                );
                messages.warning(&surface.place, text);
            }
            Some(())
        }
    }
}

fn displacement(network: &Network, frame: &Frame) -> Displacement {
    let plane = |component: usize| {
        let mut planes = frame.planes.iter().filter(|p| Some(&p.output) == network.output.as_ref());
        planes.find(|p| p.component == component).map(|p| p.floats()).unwrap_or_default()
    };
    if network.scalar {
        return Displacement::Along(plane(0));
    }
    let (x, y, z) = (plane(0), plane(1), plane(2));
    let list = x.into_iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(x, y, z));
    Displacement::By(list.collect())
}
