//! Globals of the shader that have the same value at all points.

use crate::Failure;
use osl_ir::global::{GLOBALS, Global};
use osl_ir::types::Type;
use osl_syntax::spelling::closest;
use std::collections::BTreeMap;

/// Frames per second, unless the client says otherwise.
pub const FPS: f64 = 24.0;

/// Globals with a value of their own. Globals that differ from point to point belong to the grid or the
/// surface.
#[derive(Clone, Debug, Default)]
pub struct GlobalValues {
    /// The value of `time`, in seconds.
    pub time: Option<f32>,
    /// The frame of a film, if the picture is one.
    pub frame: Option<u32>,
    /// The values of others.
    pub global: Vec<GlobalValue>,
}

/// A global and its value; a scalar is in the first element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalValue {
    global: Global,
    value: [f32; 3],
}

/// Reads a value of `time`.
pub fn seconds(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|t: &f32| t.is_finite());
    number.ok_or_else(|| format!("a time is a number, not `{text}`"))
}

/// The globals that can have a value of their own, with their names and types.
fn settable() -> impl Iterator<Item = (Global, &'static str, Type)> {
    let named = GLOBALS.into_iter().map(|(global, name, ty, _)| (global, name, ty));
    named.filter(|(global, ..)| !matches!(global, Global::P | Global::U | Global::V | Global::Ci))
}

/// Reads `NAME=VALUE`.
pub fn global(text: &str) -> Result<GlobalValue, String> {
    let (name, typed) =
        text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE"))?;
    let name = name.trim();
    let Some((global, _, ty)) = settable().find(|(_, known, _)| *known == name) else {
        let names: Vec<&str> = settable().map(|(_, name, _)| name).collect();
        return Err(match name {
            "P" | "u" | "v" => {
                format!("`{name}` differs from point to point; --uv-scale and --uv-offset move the points")
            }
            _ => {
                let close = closest(name, names.iter().copied());
                let close = close.map_or_else(String::new, |close| format!("; did you mean `{close}`?"));
                format!("there is no global `{name}` that can be set; there are {}{close}", names.join(", "))
            }
        });
    };
    let numbers: Option<Vec<f32>> = typed.split(',').map(|x| x.trim().parse().ok()).collect();
    let value = match (numbers.as_deref(), ty.is_triple()) {
        (Some([x]), false) => Some([*x, 0.0, 0.0]),
        (Some([x, y, z]), true) => Some([*x, *y, *z]),
        _ => None,
    };
    let form = if ty.is_triple() { "three numbers separated by commas" } else { "a number" };
    let value = value.ok_or_else(|| format!("`{name}` is {form}, not `{typed}`"))?;
    Ok(GlobalValue { global, value })
}

impl GlobalValues {
    /// The values by global. `--time` takes precedence.
    pub fn values(&self) -> BTreeMap<Global, [f32; 3]> {
        let time = self.time.map(|time| (Global::Time, [time, 0.0, 0.0]));
        self.global.iter().map(|given| (given.global, given.value)).chain(time).collect()
    }

    /// Fails if one of the values would replace values that differ from point to point.
    pub fn check(&self, varying: &[Global]) -> Result<(), Failure> {
        match self.global.iter().find(|given| varying.contains(&given.global)) {
            None => Ok(()),
            Some(given) => Err(Failure::usage(format!(
                "--global {}: on this surface it differs from point to point",
                given.global.name()
            ))),
        }
    }

    /// The value of `time`, in seconds.
    pub fn seconds(&self) -> f32 {
        self.values().get(&Global::Time).map_or(0.0, |time| time[0])
    }

    /// The frame: that of a film, else the time at [`FPS`].
    pub fn frame(&self) -> f32 {
        self.frame.map_or_else(|| self.seconds() * FPS as f32, |frame| frame as f32)
    }

    /// Whether the time is set.
    pub fn has_time(&self) -> bool {
        self.values().contains_key(&Global::Time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_type_of_the_global() {
        assert_eq!(global("dtime=0.5"), Ok(GlobalValue { global: Global::Dtime, value: [0.5, 0.0, 0.0] }));
        assert_eq!(global("N= 0, 1,-2"), Ok(GlobalValue { global: Global::N, value: [0.0, 1.0, -2.0] }));
        for (text, word) in [
            ("N=1", "three numbers"),
            ("time=1,2,3", "a number"),
            ("P=1,2,3", "--uv-scale"),
            ("tyme=1", "did you mean `time`?"),
            ("Ci=1", "there is no global `Ci` that can be set"),
            ("time", "NAME=VALUE"),
        ] {
            let told = global(text).expect_err(text);
            assert!(told.contains(word), "{told}");
        }
    }
}
