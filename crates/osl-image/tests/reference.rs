//! Lookups compared with results of the reference implementation of OSL for the same textures.
//!
//! Each table in `data/lookup` is one shader over a grid: texture coordinates are its `u` and `v`, and the
//! screen derivatives are one grid step. `mosaic.csv` has scattered coordinates instead.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use osl_image::{Footprint, Interp, LookupOptions, Texture, Wrap, lookup, lookup_values, read_image};

/// Permits another order of float operations. The textures have values up to 3.
const TOLERANCE: f32 = 2e-6;

fn texture(name: &str) -> Texture {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/textures").join(name);
    Texture::new(read_image(&path).unwrap())
}

struct Table {
    columns: HashMap<String, usize>,
    rows: Vec<Vec<String>>,
    /// The change of u and v to the next grid point.
    step: (f32, f32),
}

impl Table {
    fn read(name: &str) -> Self {
        let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests/data/lookup", name].iter().collect();
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let step = grid_step(lines.next().unwrap());
        let header = lines.next().unwrap().split(',');
        let columns = header.enumerate().map(|(i, name)| (name.to_owned(), i)).collect();
        let rows = lines.map(|line| line.split(',').map(str::to_owned).collect()).collect();
        Self { columns, rows, step }
    }

    fn text(&self, row: usize, column: &str) -> &str {
        &self.rows[row][self.columns[column]]
    }

    fn value(&self, row: usize, column: &str) -> f32 {
        self.text(row, column).parse().unwrap()
    }

    fn footprint(&self) -> Footprint {
        Footprint { ds_dx: self.step.0, dt_dy: self.step.1, ..Footprint::default() }
    }

    /// Compares columns with what `looked_up` gives for u, v, within `tolerance`.
    fn check(&self, columns: &[&str], tolerance: f32, looked_up: impl Fn(f32, f32) -> [f32; 4]) {
        for row in 0..self.rows.len() {
            let (u, v) = (self.value(row, "u"), self.value(row, "v"));
            let got = looked_up(u, v);
            for (column, got) in columns.iter().zip(got) {
                let expected = self.value(row, column);
                assert!((got - expected).abs() <= tolerance, "{column} at {u} {v}: {got}, not {expected}");
            }
        }
    }

    /// Compares columns with plain lookups.
    fn check_lookup(&self, columns: &[&str], texture: &Texture, options: LookupOptions) {
        let look = |u, v| lookup_values(texture, u, v, &self.footprint(), columns.len(), &options);
        self.check(columns, TOLERANCE, look);
    }
}

/// The step from a line like `# grid 8 8; scaleuv 3 3; offsetuv -1 -1`. No table here is centered and
/// filtered.
fn grid_step(line: &str) -> (f32, f32) {
    let mut grid = (1.0, 1.0);
    let mut scale = (1.0, 1.0);
    for part in line.trim_start_matches('#').split(';') {
        let words: Vec<&str> = part.split_whitespace().collect();
        let pair = || (words[1].parse::<f32>().unwrap(), words[2].parse::<f32>().unwrap());
        match words.first() {
            Some(&"grid") => grid = pair(),
            Some(&"scaleuv") => scale = pair(),
            _ => {}
        }
    }
    (scale.0 / (grid.0 - 1.0).max(1.0), scale.1 / (grid.1 - 1.0).max(1.0))
}

fn unfiltered(interp: Interp) -> LookupOptions {
    LookupOptions { interp, width: (0.0, 0.0), ..LookupOptions::default() }
}

fn wrapped(interp: Interp, wrap: Wrap) -> LookupOptions {
    LookupOptions { wrap_s: wrap, wrap_t: wrap, ..unfiltered(interp) }
}

const A: [&str; 3] = ["a.r", "a.g", "a.b"];
const B: [&str; 3] = ["b.r", "b.g", "b.b"];
const C: [&str; 3] = ["c.r", "c.g", "c.b"];
const D: [&str; 3] = ["d.r", "d.g", "d.b"];
const E: [&str; 3] = ["e.r", "e.g", "e.b"];

#[test]
fn closest_rounds_halves_down() {
    let table = Table::read("closest.csv");
    table.check_lookup(&A, &texture("tex64f.exr"), unfiltered(Interp::Closest));
    table.check_lookup(&["b"], &texture("tex64f.exr"), unfiltered(Interp::Closest));
    table.check_lookup(&C, &texture("tex64.png"), unfiltered(Interp::Closest));
}

#[test]
fn bytes_are_exact() {
    let table = Table::read("png_bytes_exact.csv");
    let texture = texture("tex64.png");
    let look = |u, v| lookup_values(&texture, u, v, &Footprint::default(), 3, &unfiltered(Interp::Closest));
    table.check(&A, 0.0, look);
}

#[test]
fn linear_and_firstchannel() {
    let table = Table::read("bilinear.csv");
    table.check_lookup(&A, &texture("tex64f.exr"), unfiltered(Interp::Linear));
    // The shader requests "bilinear", which is not a name that the reference knows.
    assert_eq!(Interp::from_name("bilinear"), None);
    let second = LookupOptions { first_channel: 1, ..unfiltered(Interp::default()) };
    table.check_lookup(&["b"], &texture("tex64.png"), second);
}

#[test]
fn cubic_and_smartcubic_agree_in_the_finest_level() {
    let table = Table::read("cubic_smart.csv");
    table.check_lookup(&A, &texture("tex64f.exr"), unfiltered(Interp::Cubic));
    table.check_lookup(&B, &texture("tex64f.exr"), unfiltered(Interp::SmartCubic));
}

#[test]
fn texel_centers_hit_texels() {
    let table = Table::read("texel_centers.csv");
    for (columns, interp) in [(A, Interp::Closest), (B, Interp::Linear), (C, Interp::Cubic)] {
        table.check_lookup(&columns, &texture("tex4rgba.exr"), unfiltered(interp));
    }
}

#[test]
fn wrap_modes() {
    let texture = texture("tex4rgba.exr");
    let wraps = [(A, Wrap::Periodic), (B, Wrap::Clamp), (C, Wrap::Mirror), (D, Wrap::Black)];
    for (file, interp) in [("wrap_modes.csv", Interp::Closest), ("wrap_bilinear.csv", Interp::Linear)] {
        let table = Table::read(file);
        for (columns, wrap) in wraps {
            table.check_lookup(&columns, &texture, wrapped(interp, wrap));
        }
    }
    Table::read("wrap_modes.csv").check_lookup(&E, &texture, unfiltered(Interp::Closest));
}

#[test]
fn each_axis_has_its_wrap() {
    let options =
        LookupOptions { wrap_s: Wrap::Periodic, wrap_t: Wrap::Clamp, ..unfiltered(Interp::Closest) };
    Table::read("swrap_twrap.csv").check_lookup(&A, &texture("tex4rgba.exr"), options);
}

#[test]
fn alpha_and_fill() {
    let table = Table::read("alpha_fill.csv");
    let closest = unfiltered(Interp::Closest);
    table.check_lookup(&["a.r", "a.g", "a.b", "al"], &texture("tex4rgba.exr"), closest);
    let grey = texture("tex3x2gray.png");
    table.check_lookup(&["g.r", "g.g", "g.b", "al2"], &grey, closest);
    table.check_lookup(&["f.r", "f.g", "f.b"], &grey, LookupOptions { fill: 0.25, ..closest });
}

#[test]
fn firstchannel_selects() {
    let table = Table::read("firstchannel.csv");
    let texture = texture("tex4rgba.exr");
    let from = |first_channel, fill| LookupOptions { first_channel, fill, ..unfiltered(Interp::Closest) };
    table.check_lookup(&["a"], &texture, from(1, 0.0));
    table.check_lookup(&["b"], &texture, from(3, 0.0));
    table.check_lookup(&["c"], &texture, from(0, 0.7));
    table.check_lookup(&D, &texture, from(1, 0.6));
}

#[test]
fn default_filter_blends_two_levels() {
    let table = Table::read("default_filter.csv");
    table.check_lookup(&A, &texture("tex64f.exr"), LookupOptions::default());
    table.check_lookup(&["b"], &texture("tex64.png"), LookupOptions::default());
}

#[test]
fn explicit_derivatives_replace_the_grid_step() {
    let table = Table::read("explicit_derivs0.csv");
    let texture = texture("tex64f.exr");
    for (columns, step) in [(A, 0.0), (B, 0.01)] {
        let footprint = Footprint { ds_dx: step, dt_dy: step, ..Footprint::default() };
        let look = |u, v| lookup_values(&texture, u, v, &footprint, 3, &LookupOptions::default());
        table.check(&columns, TOLERANCE, look);
    }
}

#[test]
fn blur_grows_the_footprint() {
    let table = Table::read("blur.csv");
    let texture = texture("tex64f.exr");
    table.check_lookup(&A, &texture, LookupOptions { blur: (0.05, 0.05), ..LookupOptions::default() });
    // The footprint becomes longer than wide: two probes.
    table.check_lookup(&B, &texture, LookupOptions { blur: (0.1, 0.0), ..LookupOptions::default() });
}

#[test]
fn results_have_derivatives() {
    let table = Table::read("derivs_of_result.csv");
    let texture = texture("tex64f.exr");
    let options = LookupOptions { interp: Interp::Linear, ..LookupOptions::default() };
    let (step_x, step_y) = table.step;
    let look = |u, v| lookup(&texture, u, v, &table.footprint(), 3, &options);
    table.check(&A, TOLERANCE, |u, v| look(u, v).d_ds.map(|d| d * step_x));
    table.check(&["b"], TOLERANCE, |u, v| look(u, v).d_dt.map(|d| d * step_y));
}

#[test]
fn averages() {
    let table = Table::read("gettextureinfo.csv");
    let texture = texture("tex4rgba.exr");
    for channel in 0..4 {
        assert_eq!(texture.average().unwrap()[channel], table.value(0, &format!("avg[{channel}]")));
    }
}

/// Scattered lookups of chaosmosaic with default options, at one to three texels per pixel.
#[test]
fn chaosmosaic_lookups() {
    let table = Table::read("mosaic.csv");
    let textures = ["tex64f.exr", "tex64.png"].map(|name| (name, texture(name)));
    let mut worst = 0.0_f32;
    for row in 0..table.rows.len() {
        let name = table.text(row, "texture");
        let texture = &textures.iter().find(|(known, _)| *known == name).unwrap().1;
        let step = table.value(row, "step");
        let footprint = Footprint { ds_dx: step, dt_dy: step, ..Footprint::default() };
        let (s, t) = (table.value(row, "s"), table.value(row, "t"));
        let got = lookup_values(texture, s, t, &footprint, 3, &LookupOptions::default());
        for (column, got) in ["r", "g", "b"].iter().zip(got) {
            worst = worst.max((got - table.value(row, column)).abs());
        }
    }
    assert!(worst <= 1e-5, "off by up to {worst}");
}
