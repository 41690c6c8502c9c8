//! The renderer with which reference values were recorded, configured from the conditions of a recorded run.

use crate::golden::Golden;
use osl_exec::{Datum, Services};
use osl_hir::hir::Global;
use osl_image::TextureCache;
use osl_ir::ir::Const;
use osl_scene::{Grid, ReferenceRenderer};

/// The renderer of a recorded run.
pub fn renderer(golden: &Golden) -> ReferenceRenderer {
    let grid = Grid {
        width: golden.size.0,
        height: golden.size.1,
        scale: golden.scale,
        offset: golden.offset,
        center: golden.center,
    };
    let mut host = ReferenceRenderer::new(grid);
    for key in &golden.other {
        let words: Vec<&str> = key.split_whitespace().collect();
        match words[..] {
            ["vary", "pdxdy"] => host.vary.push(Global::P),
            ["vary", "udxdy"] => host.vary.push(Global::U),
            ["vary", "vdxdy"] => host.vary.push(Global::V),
            ["userdata", "float", name, value] => {
                let value = Const::Float(value.parse().unwrap_or(0.0));
                host.data.push((name.to_string(), Datum::one(value)));
            }
            ["userdata", _, name, value] => {
                let mut parts = value.split(',').map(|x| x.parse().unwrap_or(0.0));
                let triple = std::array::from_fn(|_| parts.next().unwrap_or(0.0));
                host.data.push((name.to_string(), Datum::one(Const::Triple(triple))));
            }
            _ => {}
        }
    }
    host
}

/// Its named spaces, its textures, and the kind of ray.
pub fn services(golden: &Golden, host: &ReferenceRenderer) -> Services {
    let ray = golden.other.iter().find_map(|key| key.strip_prefix("raytype ")).unwrap_or("");
    Services {
        ray: ray.trim().to_string(),
        spaces: host.spaces(),
        textures: TextureCache::new(vec![crate::run::root().join("tests/data/textures")]),
        ..Services::default()
    }
}
