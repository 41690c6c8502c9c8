//! Points on surfaces, from ray hits or vertices, for the batch interpreter.

use crate::camera::Ray;
use crate::camera_facts::CameraFacts;
use crate::mesh::SurfacePoint;
use glam::{Vec2, Vec3};
use osl_exec::{Datum, PointSource, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};

/// The footprint of a point: the changes to its neighbours along x and along y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Change of the position.
    pub p: [Vec3; 2],
    /// Change of the surface coordinates.
    pub uv: [Vec2; 2],
    /// Change of the ray's direction.
    pub i: [Vec3; 2],
}

impl Footprint {
    /// The footprint of a ray at a hit: where its neighbours meet the tangent plane, to first order. H.
    /// Igehy, "Tracing Ray Differentials", 1999.
    pub fn of(point: &SurfacePoint, ray: &Ray) -> Footprint {
        let t = (point.p - ray.origin).dot(ray.direction);
        let facing = ray.direction.dot(point.ng);
        let p = [0, 1].map(|axis| {
            let moved = ray.origin_derivs[axis] + ray.direction_derivs[axis] * t;
            let p = moved - ray.direction * (moved.dot(point.ng) / facing);
            if p.is_finite() { p } else { moved }
        });
        Footprint { p, uv: p.map(|p| uv_change(point, p)), i: ray.direction_derivs }
    }

    /// A square on the surface with a given side, along `dpdu` if there is one.
    pub fn square(point: &SurfacePoint, side: f32) -> Footprint {
        let flat = |t: Vec3| (t - point.n * point.n.dot(t)).try_normalize();
        let along = flat(point.dpdu).unwrap_or_else(|| point.n.any_orthonormal_vector());
        let p = [along * side, point.n.cross(along) * side];
        Footprint { p, uv: p.map(|p| uv_change(point, p)), i: [Vec3::ZERO; 2] }
    }
}

/// The change of the surface coordinates for a displacement along the surface: the least squares solution of
/// `dpdu * du + dpdv * dv = way`; 0 where the tangents do not span a plane.
pub fn uv_change(point: &SurfacePoint, way: Vec3) -> Vec2 {
    let (u, v) = (point.dpdu.as_dvec3(), point.dpdv.as_dvec3());
    let way = way.as_dvec3();
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (wu, wv) = (way.dot(u), way.dot(v));
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-12 * uu * vv {
        return Vec2::ZERO;
    }
    let found = glam::DVec2::new((vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant);
    if found.is_finite() { found.as_vec2() } else { Vec2::ZERO }
}

/// Points on surfaces with all globals of a shader.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePoints {
    points: Vec<SurfacePoint>,
    /// Directions of the rays that hit them.
    incident: Vec<Vec3>,
    footprints: Vec<Footprint>,
    /// Areas of the surfaces.
    areas: Vec<f32>,
    /// Whether shaders see them as in testrender.
    testrender: bool,
    /// What shaders can ask about the camera.
    camera: Option<CameraFacts>,
}

impl SurfacePoints {
    /// An empty list whose points shaders see as in testrender: normals are turned to the viewer, and the
    /// surface coordinates are also attributes with the names s and t.
    pub fn of_testrender() -> SurfacePoints {
        SurfacePoints { testrender: true, ..SurfacePoints::default() }
    }

    /// An empty list with room for some points.
    pub fn with_capacity(count: usize) -> SurfacePoints {
        SurfacePoints {
            points: Vec::with_capacity(count),
            incident: Vec::with_capacity(count),
            footprints: Vec::with_capacity(count),
            areas: Vec::with_capacity(count),
            testrender: false,
            camera: None,
        }
    }

    /// The same list for a camera about which shaders can ask.
    #[must_use]
    pub fn seen_by(self, camera: CameraFacts) -> SurfacePoints {
        SurfacePoints { camera: Some(camera), ..self }
    }

    /// Adds a point, the direction of the ray that hit it, its footprint, and the area of its surface.
    pub fn push(&mut self, point: SurfacePoint, incident: Vec3, footprint: Footprint, area: f32) {
        self.points.push(point);
        self.incident.push(incident);
        self.footprints.push(footprint);
        self.areas.push(area);
    }

    /// Removes all points.
    pub fn clear(&mut self) {
        self.points.clear();
        self.incident.clear();
        self.footprints.clear();
        self.areas.clear();
    }

    /// The points.
    pub fn points(&self) -> &[SurfacePoint] {
        &self.points
    }

    /// Transforms the surface coordinates: `uv * scale + offset`. Tangents and footprints follow. Factors
    /// must not be 0.
    pub fn stretch(&mut self, scale: Vec2, offset: Vec2) {
        for point in &mut self.points {
            point.uv = point.uv * scale + offset;
            point.dpdu /= scale.x;
            point.dpdv /= scale.y;
        }
        self.footprints.iter_mut().flat_map(|f| &mut f.uv).for_each(|uv| *uv *= scale);
    }

    /// The brightness of each point under a light at the eye: the cosine between its normal and the direction
    /// to the eye, for either side.
    pub fn lit_from_eye(&self) -> Vec<f32> {
        self.points
            .iter()
            .zip(&self.incident)
            .map(|(point, i)| point.n.dot(i.normalize_or_zero()).abs())
            .collect()
    }

    fn value(&self, global: Global, at: usize) -> [f32; 3] {
        let Some(point) = self.points.get(at) else { return [0.0; 3] };
        let incident = self.incident.get(at).copied().unwrap_or_default();
        let behind = incident.dot(point.ng) > 0.0;
        let n = if behind && self.testrender { -point.n } else { point.n };
        match global {
            Global::P => point.p.to_array(),
            Global::I => incident.to_array(),
            Global::N => n.to_array(),
            Global::Ng if self.testrender => n.to_array(),
            Global::Ng => point.ng.to_array(),
            Global::U => [point.uv.x, 0.0, 0.0],
            Global::V => [point.uv.y, 0.0, 0.0],
            Global::DPdu => point.dpdu.to_array(),
            Global::DPdv => point.dpdv.to_array(),
            Global::Backfacing => [f32::from(u8::from(behind)), 0.0, 0.0],
            Global::SurfaceArea => [self.areas.get(at).copied().unwrap_or_default(), 0.0, 0.0],
            Global::LeftHanded => {
                let [dx, dy] = self.footprints.get(at).copied().unwrap_or_default().p;
                [left_handed(dx.to_array(), dy.to_array(), n.to_array()), 0.0, 0.0]
            }
            _ => [0.0; 3],
        }
    }

    fn change(&self, global: Global, axis: Axis, at: usize) -> [f32; 3] {
        let Some(footprint) = self.footprints.get(at) else { return [0.0; 3] };
        let axis = axis as usize;
        match global {
            Global::P => footprint.p[axis].to_array(),
            Global::I => footprint.i[axis].to_array(),
            Global::U => [footprint.uv[axis].x, 0.0, 0.0],
            Global::V => [footprint.uv[axis].y, 0.0, 0.0],
            _ => [0.0; 3],
        }
    }

    fn write(&self, first: usize, width: usize, lanes: &mut [f32], value: impl Fn(usize) -> [f32; 3]) {
        let width = width.max(1);
        let last = self.points.len().saturating_sub(1);
        for lane in 0..width.min(lanes.len()) {
            let value = value((first + lane).min(last));
            for (lanes, x) in lanes.chunks_mut(width).zip(value) {
                lanes[lane] = x;
            }
        }
    }
}

impl PointSource for SurfacePoints {
    fn count(&self) -> usize {
        self.points.len()
    }

    fn varying(&self) -> &[Global] {
        &[
            Global::P,
            Global::I,
            Global::N,
            Global::Ng,
            Global::U,
            Global::V,
            Global::DPdu,
            Global::DPdv,
            Global::Backfacing,
            Global::SurfaceArea,
            Global::LeftHanded,
        ]
    }

    fn uniform(&self, _: Global) -> [f32; 3] {
        [0.0; 3]
    }

    fn deriv(&self, _: Global, _: Axis) -> [f32; 3] {
        [0.0; 3]
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.write(first, width, lanes, |at| self.value(global, at));
    }

    fn varying_derivs(&self) -> &[Global] {
        &[Global::P, Global::I, Global::U, Global::V]
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.write(first, width, lanes, |at| self.change(global, axis, at));
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let Some(global) = self.attribute_global(object, name, element) else {
            return self.camera?.attribute(name);
        };
        let derivs = Axis::BOTH.map(|axis| self.change(global, axis, point)[0]);
        Some(Datum { derivs, ..Datum::one(Const::Float(self.value(global, point)[0])) })
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        let is_of_surface = self.testrender && matches!(object, "" | "global") && element.is_none();
        match name {
            "s" if is_of_surface => Some(Global::U),
            "t" if is_of_surface => Some(Global::V),
            _ => None,
        }
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.attribute_global(object, name, element).is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> SurfacePoints {
        let mut points = SurfacePoints::default();
        for (at, side) in [(0.0, -1.0), (1.0, 1.0)] {
            let point = SurfacePoint {
                p: Vec3::new(at, 2.0, 3.0),
                n: Vec3::Z,
                ng: Vec3::Z,
                uv: Vec2::new(at, 0.5),
                dpdu: Vec3::X,
                dpdv: Vec3::new(0.5, 2.0, 0.0),
            };
            points.push(point, Vec3::Z * side, Footprint::square(&point, 0.1), 5.0);
        }
        points
    }

    #[test]
    fn batches_have_an_array_for_each_component_and_repeat_the_last_point() {
        let mut lanes = vec![9.0; 12];
        points().fill(Global::P, 1, 4, &mut lanes);
        assert_eq!(lanes, [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0]);
        points().fill(Global::Backfacing, 0, 4, &mut lanes[..4]);
        assert_eq!(lanes[..4], [0.0, 1.0, 1.0, 1.0]);
        points().fill(Global::SurfaceArea, 0, 4, &mut lanes[..4]);
        assert_eq!(lanes[..4], [5.0; 4]);
        SurfacePoints::default().fill(Global::U, 0, 4, &mut lanes[..4]);
        assert_eq!(lanes[..4], [0.0; 4], "no points");
    }

    #[test]
    fn the_image_is_left_handed_where_its_changes_turn_away_from_the_normal() {
        let mut seen = SurfacePoints::default();
        let point = points().points()[0];
        for p in [[Vec3::X, Vec3::Y], [Vec3::Y, Vec3::X], [Vec3::X, Vec3::X]] {
            seen.push(point, Vec3::NEG_Z, Footprint { p, ..Footprint::default() }, 1.0);
        }
        let mut lanes = [9.0; 4];
        seen.fill(Global::LeftHanded, 0, 4, &mut lanes);
        assert_eq!(lanes, [0.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn coordinates_change_as_the_tangents_say() {
        // dP = dpdu du + dpdv dv.
        let point = points().points()[0];
        let duv = uv_change(&point, Vec3::new(1.5, 2.0, 0.0));
        assert!(duv.distance(Vec2::ONE) < 1e-6, "{duv}");
        assert_eq!(uv_change(&SurfacePoint { dpdu: Vec3::ZERO, ..point }, Vec3::X), Vec2::ZERO);
        assert_eq!(uv_change(&SurfacePoint { dpdv: point.dpdu * 2.0, ..point }, Vec3::X), Vec2::ZERO);
    }

    #[test]
    fn stretched_coordinates_take_tangents_along() {
        let mut stretched = points();
        stretched.stretch(Vec2::new(2.0, -4.0), Vec2::new(0.0, 1.0));
        let (before, after) = (points(), stretched.points()[1]);
        assert_eq!(after.uv, Vec2::new(2.0, -1.0));
        assert_eq!((after.dpdu, after.dpdv), (Vec3::X * 0.5, Vec3::new(-0.125, -0.5, 0.0)));
        let way = before.footprints[1].p[1];
        assert!(uv_change(&after, way).distance(stretched.footprints[1].uv[1]) < 1e-6);
    }
}
