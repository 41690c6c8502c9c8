//! Settings of a shader, and the outcome of a run at each.

use super::subject::Swept;
use crate::words::short;
use osl_scene::Grid;
use serde::Serialize;

/// Share of wrong points up to which a setting counts as safe.
pub(super) const SAFE: f64 = 0.001;

/// What a setting changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "setting", rename_all = "snake_case")]
pub enum Setting {
    /// Nothing.
    AsGiven,
    /// The coordinates are multiplied.
    Scale {
        /// The factor.
        by: f64,
    },
    /// A number is added to the coordinates.
    Offset {
        /// The number.
        by: f64,
    },
    /// The change from pixel to pixel is multiplied.
    Footprint {
        /// The factor.
        by: f64,
    },
    /// A parameter has another value.
    Param {
        /// The parameter.
        name: String,
        /// The value, as on the command line.
        value: String,
    },
}

impl Setting {
    /// The points of a grid at this setting.
    pub fn points(&self, grid: &Grid) -> Swept {
        let mut swept = Swept { grid: grid.clone(), footprint: 1.0 };
        match self {
            Setting::Scale { by } => swept.grid.scale = grid.scale.map(|s| s * *by as f32),
            Setting::Offset { by } => swept.grid.offset = grid.offset.map(|o| o + *by as f32),
            Setting::Footprint { by } => swept.footprint = *by as f32,
            Setting::AsGiven | Setting::Param { .. } => {}
        }
        swept
    }

    /// The setting in words.
    pub fn text(&self) -> String {
        match self {
            Setting::AsGiven => "as given".to_string(),
            Setting::Scale { by } => format!("scale {}", short(*by, 3)),
            Setting::Offset { by } => format!("offset {}", short(*by, 3)),
            Setting::Footprint { by } => format!("footprint {}", short(*by, 3)),
            Setting::Param { name, value } => format!("{name} = {value}"),
        }
    }
}

/// The outcome for one component of an output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The output, with the component of a triple or matrix.
    pub output: String,
    /// Share of the points that are NaN.
    pub nan: f64,
    /// Share of the points that are infinite.
    pub infinite: f64,
    /// The smallest and the largest finite value.
    pub range: [f64; 2],
    /// Root mean square error, as a share of the range in double precision.
    pub rms: f64,
    /// The largest error, as a share of that range.
    pub worst: f64,
    /// Share of the points whose error exceeds the tolerance.
    pub wrong: f64,
    /// The share of the points whose error is a hundred times the median error: their values jump in one
    /// arithmetic and not in the other, rather than drift. They are among the wrong points.
    pub flipped: f64,
}

/// A setting with its outcomes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// The setting.
    #[serde(flatten)]
    pub setting: Setting,
    /// The outcomes by output; empty if the run was stopped.
    pub outcomes: Vec<Outcome>,
    /// Why the run was stopped, if it was.
    pub stopped: Option<String>,
}

impl Trial {
    /// The largest share of wrong points among the outputs.
    pub fn wrong(&self) -> f64 {
        self.outcomes.iter().map(|o| o.wrong).fold(0.0, f64::max)
    }

    /// The largest share of NaN or infinite points among the outputs.
    pub fn not_finite(&self) -> f64 {
        self.outcomes.iter().map(|o| o.nan + o.infinite).fold(0.0, f64::max)
    }

    /// Whether the points of the setting are right: nearly all are accurate and finite, and the run ended.
    pub(super) fn is_right(&self) -> bool {
        self.wrong() <= SAFE && self.not_finite() <= SAFE && self.stopped.is_none()
    }
}
