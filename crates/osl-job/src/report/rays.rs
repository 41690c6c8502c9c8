//! `--rays`: a drawing of a camera's rays, seen from above and from the right.
//!
//! Both views show camera space, with the line of sight to the right, in one scale. A few places of the image
//! have a few rays each, through different places of the aperture.

use crate::Failure;
use osl_exec::RunError;
use osl_files::Unsaved;
use osl_scene::camera::View;
use osl_scene::glam::{DVec3, Vec3};
use osl_scene::lens::{self, Aim, Lens};
use std::fmt::Write as _;
use std::path::Path;

/// Places along the width of the image, and along its height.
const PLACES: usize = 7;
/// The random numbers of the rays of a place. They are spread evenly, since a shader may use them for any
/// form of aperture: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
const APERTURE: [[f32; 2]; 7] = [
    [0.755, 0.570],
    [0.510, 0.140],
    [0.265, 0.710],
    [0.019, 0.279],
    [0.774, 0.849],
    [0.529, 0.419],
    [0.284, 0.989],
];
/// Length of the rays, in distances of what the camera looks at.
const LENGTH: f64 = 1.6;
/// Side of a view, its margin, and the height of the text above and below, in pixels.
const SIDE: f64 = 440.0;
const MARGIN: f64 = 46.0;
const HEAD: f64 = 64.0;
/// The sensor's part of a view.
const SENSOR: f64 = 70.0;

/// A ray of the drawing, in camera space: x to the right, y up, z ahead.
struct Drawn {
    /// Its place on the image, from 0 at the left or below to 1.
    place: f64,
    /// Start and end; none for a sample without a ray.
    line: Option<[DVec3; 2]>,
    throughput: Vec3,
}

/// One of the two views: its title, the name of its upright axis, 1 if this points upwards and -1 if it
/// points downwards, and its rays with the upward direction of the view in y.
struct Side<'a> {
    title: &'a str,
    axis: &'a str,
    sign: f64,
    rays: Vec<Drawn>,
}

/// The file of the drawing, which is not there yet.
///
/// # Errors
/// The shader exceeds its budget, or the file cannot be written.
pub fn file(view: &View, lens: &Lens, name: &str, path: &Path) -> Result<Unsaved, Failure> {
    let text = draw(view, lens, name).map_err(Failure::new)?;
    Unsaved::new(path).and_then(|file| file.with(text.as_bytes())).map_err(Failure::new)
}

/// The drawing of the rays of a camera shader with this name.
///
/// # Errors
/// The shader exceeds its budget.
pub fn draw(view: &View, lens: &Lens, name: &str) -> Result<String, RunError> {
    // From above, with the line of sight to the right, the right of the camera is below.
    let plan = Side { title: "From above", axis: "x", sign: -1.0, rays: drawn(view, lens, (0, -1.0))? };
    let side = Side { title: "From the right", axis: "y", sign: 1.0, rays: drawn(view, lens, (1, 1.0))? };
    let all = || plan.rays.iter().chain(&side.rays).filter_map(|ray| ray.line).flatten();
    let (mut low, mut high) = ([0.0_f64; 2], [0.0_f64; 2]);
    for point in all() {
        for (axis, x) in [point.z, point.y].into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
        }
    }
    let reach = high[1].max(-low[1]).max(1e-6);
    let room = (SIDE - SENSOR) / (high[0] - low[0]).max(1e-6);
    let scale = room.min((SIDE - 2.0 * MARGIN) / (2.0 * reach));
    let frame = Frame { scale, zero: SENSOR - low[0] * scale, height: 2.0 * (reach * scale + MARGIN) };
    let (width, height) = (2.0 * (SIDE + MARGIN), frame.height + HEAD + 84.0);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} \
         {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{MARGIN}\" y=\"22\" font-size=\"15\">Rays of {}</text>\n",
        escaped(name)
    );
    for (at, side) in [plan, side].iter().enumerate() {
        let _ = writeln!(
            out,
            "<g stroke-width=\"0.7\" transform=\"translate({:.0} {HEAD})\">",
            at as f64 * (SIDE + MARGIN)
        );
        frame.side(&mut out, side);
        out += "</g>\n";
    }
    legend(&mut out, MARGIN, frame.height + HEAD + 24.0);
    out += "</svg>\n";
    Ok(out)
}

/// The rays of places along an axis of the image: 0 for its width, 1 for its height. That axis, with a sign,
/// is y of the result.
fn drawn(view: &View, lens: &Lens, (axis, sign): (usize, f64)) -> Result<Vec<Drawn>, RunError> {
    let size = view.resolution().map(|n| n as f32);
    let mut aims = Vec::new();
    for place in 0..PLACES {
        // Row 0 of the image is its uppermost.
        let share = [place, PLACES - 1 - place][axis] as f32 / (PLACES - 1) as f32;
        let mut at = size.map(|n| 0.5 * n);
        at[axis] = share * size[axis];
        aims.extend(APERTURE.map(|sample| Aim { place: at, sample }));
    }
    let rays = lens::rays(view, Some(lens), &aims)?.rays;
    let axes = view.axes();
    let own = |v: DVec3| DVec3::new(0.0, sign * axes[axis].dot(v), axes[2].dot(v));
    let length = f64::from(view.sight()) * LENGTH;
    let line = |(at, ray): (usize, Option<lens::LensRay>)| Drawn {
        place: (at / APERTURE.len()) as f64 / (PLACES - 1) as f64,
        throughput: ray.map_or(Vec3::ZERO, |ray| ray.throughput),
        line: ray.map(|ray| {
            let start = own((ray.ray.origin - view.position()).as_dvec3());
            let length = length.min(f64::from(ray.range[1]));
            [start, start + own(ray.ray.direction.as_dvec3()) * length]
        }),
    };
    Ok(rays.into_iter().enumerate().map(line).collect())
}

/// Where camera space is in a view: pixels per unit, the place of z = 0, and the height of the view.
struct Frame {
    scale: f64,
    zero: f64,
    height: f64,
}

impl Frame {
    fn x(&self, z: f64) -> f64 {
        self.zero + z * self.scale
    }

    fn y(&self, up: f64) -> f64 {
        0.5 * self.height - up * self.scale
    }

    fn side(&self, out: &mut String, side: &Side<'_>) {
        let (middle, sensor) = (0.5 * self.height, 24.0);
        let _ = writeln!(out, "<text x=\"{MARGIN}\" y=\"-14\" font-size=\"13\">{}</text>", side.title);
        self.axes(out, side.axis, side.sign);
        // Half the height of the sensor: it is drawn in no scale, since the shader does not say where it is.
        let half = 0.3 * self.height.min(SIDE);
        for ray in &side.rays {
            // The image on a sensor is upside down: its lower border sees what is above.
            let from = middle + side.sign * (ray.place - 0.5) * 2.0 * half;
            let Some([start, end]) = ray.line else {
                let _ = writeln!(out, "<path d=\"M{sensor} {from:.1}h16\" {}/>", stroke(Vec3::ZERO));
                continue;
            };
            let [x, y] = [self.x(start.z), self.y(start.y)];
            let _ = writeln!(
                out,
                "<path d=\"M{sensor} {from:.1}L{x:.1} {y:.1}\" stroke=\"#bbb\" stroke-dasharray=\"2 3\"/>\
                 <path d=\"M{x:.1} {y:.1}L{:.1} {:.1}\" {}/>",
                self.x(end.z),
                self.y(end.y),
                stroke(ray.throughput)
            );
        }
        let _ = writeln!(
            out,
            "<path d=\"M{sensor} {:.1}V{:.1}\" stroke=\"black\" stroke-width=\"3\"/><text x=\"{sensor}\" y=\"{:.1}\" \
             text-anchor=\"middle\">image</text>",
            middle - half,
            middle + half,
            middle + half + 16.0
        );
        self.ticks(out, side.sign);
    }

    /// The axes through the camera.
    fn axes(&self, out: &mut String, name: &str, sign: f64) {
        let (left, right, middle) = (self.zero, SIDE, 0.5 * self.height);
        let (top, bottom) = (12.0, self.height - 12.0);
        let _ = writeln!(
            out,
            "<path d=\"M{SENSOR} {middle:.1}H{right}M{left:.1} {top}V{bottom:.1}\" stroke=\"#888\"/>\
             <text x=\"{right}\" y=\"{:.1}\">z</text><text x=\"{left:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            middle - 6.0,
            if sign > 0.0 { top - 3.0 } else { bottom + 12.0 }
        );
    }

    /// The marks of both axes.
    fn ticks(&self, out: &mut String, sign: f64) {
        let (left, right, middle) = (self.zero, SIDE, 0.5 * self.height);
        let (top, bottom) = (12.0, self.height - 12.0);
        let step = tick(70.0 / self.scale);
        let digits = [1.0, 10.0, 100.0, 1e3, 1e4].iter().position(|n| step * n > 0.99).unwrap_or(5);
        let mut mark = |x: f64, y: f64, value: f64, across: bool| {
            let (tick, dx, dy, anchor) =
                if across { ("v5", 0.0, 17.0, "middle") } else { ("h-5", -8.0, 4.0, "end") };
            let _ = writeln!(
                out,
                "<path d=\"M{x:.1} {y:.1}{tick}\" stroke=\"#888\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" \
                 fill=\"#333\" font-size=\"10\" stroke=\"white\" stroke-width=\"3\" paint-order=\"stroke\">{value:.digits$}</text>",
                x + dx,
                y + dy
            );
        };
        for n in (-20..=20).filter(|n| *n != 0) {
            let value = f64::from(n) * step;
            let (x, y) = (self.x(value), self.y(value));
            if x > SENSOR && x < right - 8.0 {
                mark(x, middle, value, true);
            }
            if y > top && y < bottom {
                mark(left, y, sign * value, false);
            }
        }
    }
}

/// The step of an axis: 1, 2 or 5 times a power of ten, and at least this.
fn tick(least: f64) -> f64 {
    let mut step = 1e-6;
    while step < least && step < 1e12 {
        let next = [2.0, 5.0, 10.0].into_iter().map(|n| n * step);
        step = next.into_iter().find(|n| *n >= least).unwrap_or(10.0 * step);
    }
    step
}

/// The line of a ray with this share of light: the more, the darker and bluer.
fn stroke(throughput: Vec3) -> String {
    let share = throughput.max_element().clamp(0.0, 1.0);
    let (few, all) = (Vec3::new(245.0, 190.0, 90.0), Vec3::new(20.0, 60.0, 170.0));
    let [r, g, b] = few.lerp(all, share).to_array().map(|x| x.round() as u8);
    match share {
        0.0 => "stroke=\"#d33\" stroke-dasharray=\"4 3\"".to_string(),
        _ => format!("stroke=\"rgb({r},{g},{b})\""),
    }
}

fn legend(out: &mut String, left: f64, y: f64) {
    let _ = write!(out, "<text x=\"{left}\" y=\"{:.1}\">throughput</text>", y + 4.0);
    for (at, share) in [0.0, 0.25, 0.5, 0.75, 1.0_f32].into_iter().enumerate() {
        let x = left + 90.0 + 70.0 * at as f64;
        let word = if share == 0.0 { "0: no ray".to_string() } else { share.to_string() };
        let line = stroke(Vec3::splat(share));
        let _ = write!(
            out,
            "<path d=\"M{x} {y:.1}h24\" {line} stroke-width=\"3\"/><text x=\"{x}\" y=\"{:.1}\">{word}</text>",
            y + 18.0
        );
    }
    let text = "Axes: camera space, in units of the scene. Dashed: from the image to the start of each ray, not to scale.";
    let _ = writeln!(
        out,
        "<text x=\"{}\" y=\"{:.1}\" fill=\"#666\" font-size=\"11\">{text}</text>",
        left,
        y + 42.0
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
