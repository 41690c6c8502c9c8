//! A grid of points on the unit patch, on which reference results are recorded.

use crate::camera_facts::CameraFacts;
use glam::{Mat4, Vec3, Vec4};
use osl_exec::{Blocks, Datum, PointSource, Spaces, left_handed};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};

/// `width * height` points, row by row. `u = scale * x/(width-1) + offset`, or at pixel centres; an axis with
/// one point gets half the scale. `P = (u, v, 1)`, `N = Ng = (0, 0, 1)`, `dPdu = (1, 0, 0)`,
/// `dPdv = (0, 1, 0)`, and `I = (0, 0, -1)`: a parallel view from above.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Points per row.
    pub width: usize,
    /// Rows; the first has the smallest v.
    pub height: usize,
    /// Factors of u and v.
    pub scale: [f32; 2],
    /// Added to u and v.
    pub offset: [f32; 2],
    /// Whether points are at pixel centres rather than spread from border to border.
    pub center: bool,
}

/// Some columns and rows of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridArea {
    /// Its first column and row.
    pub(crate) first: [usize; 2],
    /// Columns and rows.
    pub(crate) size: [usize; 2],
}

impl Grid {
    /// The unit patch.
    pub fn new(width: usize, height: usize) -> Grid {
        Grid { width, height, scale: [1.0; 2], offset: [0.0; 2], center: false }
    }

    /// The order of the points: [`Blocks`].
    pub fn order(&self) -> Blocks {
        Blocks::new(self.width, self.height)
    }

    /// Coordinate of the `i`th of `n` points along an axis: 0 for u, 1 for v.
    #[inline]
    pub fn coordinate(&self, axis: usize, i: usize, n: usize) -> f32 {
        let (scale, offset) = (self.scale[axis], self.offset[axis]);
        if self.center {
            return scale * (i as f32 + 0.5) / n as f32 + offset;
        }
        let unit = if n == 1 { 0.5 } else { i as f32 / (n - 1) as f32 };
        scale * unit + offset
    }
}

impl Grid {
    /// The axis of a texture coordinate: the patch has the data `s`, which is u, and `t`, which is v.
    pub fn texture_axis(object: &str, name: &str, element: Option<usize>) -> Option<usize> {
        match (object, name, element) {
            ("", "s", None) => Some(0),
            ("", "t", None) => Some(1),
            _ => None,
        }
    }

    /// A texture coordinate with its derivatives.
    pub fn texture_coordinate(&self, axis: usize, value: f32) -> Datum {
        let global = if axis == 0 { Global::U } else { Global::V };
        let derivs = Axis::BOTH.map(|along| self.deriv(global, along)[0]);
        Datum { derivs, ..Datum::one(Const::Float(value)) }
    }

    /// A global at the points from `first` on of a part; lanes after the last point get its value.
    pub(crate) fn fill_part(
        &self,
        part: GridArea,
        global: Global,
        (first, width): (usize, usize),
        lanes: &mut [f32],
    ) {
        for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
            match (global, component) {
                (Global::U, _) | (Global::P, 0) => self.fill_coordinate(part, 0, first, lanes),
                (Global::V, _) | (Global::P, 1) => self.fill_coordinate(part, 1, first, lanes),
                (Global::P, _) => lanes.fill(1.0),
                _ => lanes.fill(0.0),
            }
        }
    }

    fn fill_coordinate(&self, part: GridArea, axis: usize, first: usize, lanes: &mut [f32]) {
        let (from, n) = (part.first[axis], [self.width, self.height][axis]);
        let [width, height] = part.size;
        let count = lanes.len().min((width * height).saturating_sub(first));
        let (here, after) = lanes.split_at_mut(count);
        Blocks::new(width, height).along(axis, first, here, |i| self.coordinate(axis, from + i, n));
        if let Some(last) = here.last() {
            after.fill(*last);
        }
    }

    /// A texture coordinate of a point of a part, or a fact about the camera.
    pub(crate) fn attribute_in(
        &self,
        part: GridArea,
        (object, name, element): (&str, &str, Option<usize>),
        point: usize,
    ) -> Option<Datum> {
        let Some(axis) = Grid::texture_axis(object, name, element) else {
            return CameraFacts::of_patch([self.width, self.height]).attribute(name);
        };
        let (column, row) = Blocks::new(part.size[0], part.size[1]).pixel(point);
        let at = part.first[axis] + [column, row][axis];
        Some(self.texture_coordinate(axis, self.coordinate(axis, at, [self.width, self.height][axis])))
    }

    fn whole(&self) -> GridArea {
        GridArea { first: [0; 2], size: [self.width, self.height] }
    }
}

impl PointSource for Grid {
    fn count(&self) -> usize {
        self.width * self.height
    }

    fn blocks(&self) -> Option<Blocks> {
        Some(self.order())
    }

    fn varying(&self) -> &[Global] {
        &[Global::P, Global::U, Global::V]
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        match global {
            Global::N | Global::Ng => Vec3::Z.to_array(),
            Global::I => Vec3::NEG_Z.to_array(),
            Global::SurfaceArea => [1.0, 0.0, 0.0],
            Global::LeftHanded => {
                let [dx, dy] = Axis::BOTH.map(|axis| self.deriv(Global::P, axis));
                [left_handed(dx, dy, Vec3::Z.to_array()), 0.0, 0.0]
            }
            Global::DPdu => Vec3::X.to_array(),
            Global::DPdv => Vec3::Y.to_array(),
            _ => [0.0; 3],
        }
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        let at = axis as usize;
        let n = [self.width, self.height][at];
        let border = self.scale[at] / n.saturating_sub(1).max(1) as f32;
        // At pixel centres, u and v step by pixels while P keeps the step from border to border, as in the
        // reference.
        let own = if self.center { self.scale[at] / n.max(1) as f32 } else { border };
        match (global, axis) {
            (Global::U, Axis::X) | (Global::V, Axis::Y) => [own, 0.0, 0.0],
            (Global::P, Axis::X) => [border, 0.0, 0.0],
            (Global::P, Axis::Y) => [0.0, border, 0.0],
            _ => [0.0; 3],
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.attribute_in(self.whole(), (object, name, element), point)
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        Grid::texture_axis(object, name, element).map(|axis| [Global::U, Global::V][axis])
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        Grid::texture_axis(object, name, element).is_none()
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.fill_part(self.whole(), global, (first, width), lanes);
    }
}

/// The spaces of a grid of `width` by `height` points on which reference results are recorded: shader space
/// is rotated by 45° about z and moved by 1 in x, object space is rotated by 90° and moved by 1 in y,
/// `myspace` is scaled by (1, 2, 1). `camera` and the spaces of [`set_screen_spaces`] are destinations only.
pub fn reference_spaces(width: usize, height: usize) -> Spaces {
    let mut spaces = Spaces::default();
    // Rows for row vectors: the transpose of the form for column vectors.
    let rows = |m: Mat4| m.to_cols_array();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let shader = Mat4::from_cols(
        Vec4::new(half, half, 0.0, 0.0),
        Vec4::new(-half, half, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(1.0, 0.0, 0.0, 1.0),
    );
    let tiny = -4.371_14e-8_f32;
    let object = Mat4::from_cols(
        Vec4::new(tiny, 1.0, 0.0, 0.0),
        Vec4::new(-1.0, tiny, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(0.0, 1.0, 0.0, 1.0),
    );
    spaces.set("shader", rows(shader));
    spaces.set("object", rows(object));
    spaces.set("myspace", rows(Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0))));
    spaces.set_destination("camera", rows(Mat4::IDENTITY));
    for (name, from_common) in screen_spaces(width, height) {
        spaces.set_destination(name, rows(from_common));
    }
    spaces
}

/// Adds the spaces of the image to those of a grid of `width` by `height` points: `screen`, `NDC` and
/// `raster`. The camera is the identity, with a field of view of 90°, a near plane at 0.1 and a far one at
/// 1000.
pub fn set_screen_spaces(spaces: &mut Spaces, width: usize, height: usize) {
    set_projections(spaces, screen_spaces(width, height));
}

/// Adds spaces, given by the matrices from common space for column vectors, with the ways back.
pub(crate) fn set_projections<const N: usize>(spaces: &mut Spaces, projections: [(&str, Mat4); N]) {
    for (name, from_common) in projections {
        // In double precision, because depths behind a projection differ little.
        let to_common = from_common.as_dmat4().inverse().as_mat4();
        // Rows for row vectors: the transpose of the form for column vectors.
        spaces.set_pair(name, to_common.to_cols_array(), from_common.to_cols_array());
    }
}

fn screen_spaces(width: usize, height: usize) -> [(&'static str, Mat4); 3] {
    let (near, far) = (0.1_f32, 1000.0_f32);
    let (a, b) = (far / (far - near), -near * far / (far - near));
    let screen = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, a, 1.0), Vec4::new(0.0, 0.0, b, 0.0));
    let half = Mat4::from_translation(Vec3::new(0.5, 0.5, 0.0)) * Mat4::from_scale(Vec3::new(0.5, 0.5, 1.0));
    let raster = Mat4::from_scale(Vec3::new(width as f32, height as f32, 1.0));
    [("screen", screen), ("NDC", half * screen), ("raster", raster * half * screen)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_of_the_image_go_both_ways_except_in_the_reference() {
        let mut spaces = Spaces::default();
        set_screen_spaces(&mut spaces, 20, 10);
        let reference = reference_spaces(20, 10);
        let p = Vec3::new(0.25, 0.75, 1.0);
        for space in ["screen", "NDC", "raster"] {
            let [there, back] = [("common", space), (space, "common")]
                .map(|(from, to)| Mat4::from_cols_array(&spaces.matrix(from, to).unwrap()));
            let near = back.project_point3(there.project_point3(p)).distance(p);
            assert!(near < 2e-6, "{space}: {near}");
            assert!(reference.matrix::<f32>("common", space).is_ok());
            assert!(reference.matrix::<f32>(space, "common").is_err());
        }
        let across = Mat4::from_cols_array(&spaces.matrix("raster", "NDC").unwrap());
        assert!(across.project_point3(Vec3::new(10.0, 5.0, 0.9)).distance(Vec3::new(0.5, 0.5, 0.9)) < 2e-6);
    }

    #[test]
    fn points_run_from_border_to_border() {
        let grid = Grid::new(5, 3);
        let mut p = vec![0.0; 16 * 3];
        grid.fill(Global::P, 5, 16, &mut p);
        assert_eq!((p[0], p[16], p[32]), (0.0, 0.5, 1.0));
        assert_eq!((p[4], p[16 + 4]), (1.0, 0.5));
        assert_eq!((p[15], p[16 + 15]), (1.0, 1.0), "past the end the last point repeats");
        let center = Grid { center: true, ..Grid::new(4, 4) };
        assert_eq!(center.coordinate(0, 0, 4), 0.125);
        assert_eq!(Grid::new(1, 1).coordinate(0, 0, 1), 0.5);
    }
}
