//! `--time` and `--global NAME=VALUE`: globals of the shader that are the same at all points.
//!
//! Globals that differ from point to point belong to the grid or the surface. This module must not know how
//! points are made.

use super::heading;
use crate::cli::Failure;
use clap::Args;
use osl_ir::global::{GLOBALS, Global};
use osl_ir::types::Type;
use osl_syntax::spelling::closest;
use std::collections::BTreeMap;

/// The globals on the command line.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct GlobalArgs {
    /// Value of the global `time` (default: 0).
    #[arg(long, value_name = "T", value_parser = seconds, allow_hyphen_values = true, help_heading = heading::VALUES)]
    pub(in crate::cli) time: Option<f32>,
    /// Value of a global: dtime=0.04, N=0,0.6,0.8, I=0,0,-1. It is the same at all points, so on the grid it
    /// may be any global except P, u and v. May be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = global, help_heading = heading::VALUES)]
    pub(in crate::cli) global: Vec<GlobalValue>,
}

/// A global and its value; a scalar is in the first element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) struct GlobalValue {
    global: Global,
    value: [f32; 3],
}

fn seconds(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|t: &f32| t.is_finite());
    number.ok_or_else(|| format!("a time is a number, not `{text}`"))
}

/// The globals that can have a value of their own, with their names and types.
fn settable() -> impl Iterator<Item = (Global, &'static str, Type)> {
    let named = GLOBALS.into_iter().map(|(global, name, ty, _)| (global, name, ty));
    named.filter(|(global, ..)| !matches!(global, Global::P | Global::U | Global::V | Global::Ci))
}

fn global(text: &str) -> Result<GlobalValue, String> {
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

impl GlobalArgs {
    /// The values by global. `--time` takes precedence.
    pub(in crate::cli) fn values(&self) -> BTreeMap<Global, [f32; 3]> {
        let time = self.time.map(|time| (Global::Time, [time, 0.0, 0.0]));
        self.global.iter().map(|given| (given.global, given.value)).chain(time).collect()
    }

    /// Fails if one of the values would replace values that differ from point to point.
    pub(in crate::cli) fn check(&self, varying: &[Global]) -> Result<(), Failure> {
        match self.global.iter().find(|given| varying.contains(&given.global)) {
            None => Ok(()),
            Some(given) => Err(Failure::usage(format!(
                "--global {}: on this surface it differs from point to point",
                given.global.name()
            ))),
        }
    }

    /// Whether the time is set.
    pub(in crate::cli) fn has_time(&self) -> bool {
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
