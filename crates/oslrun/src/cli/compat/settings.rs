//! The settings that scripts give with `--options KEY=VALUE,…`, as the reference's tools read them.
//!
//! Keys that control a code generator, and unknown keys, have no effect. This module only reads the settings;
//! the code that runs a group applies them.

use super::Console;
use osl_lower::group::{Checks, Rules};
use osl_numeric::color::SYSTEMS;
use std::path::PathBuf;

/// The settings that have an effect here.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::cli) struct Settings {
    /// A layer that writes shader globals runs only if another layer needs it.
    pub(in crate::cli) lazy_globals: bool,
    /// A layer without connections to later layers does not run.
    pub(in crate::cli) lazy_unconnected: bool,
    /// A layer that calls `error` runs only if another layer needs it.
    pub(in crate::cli) lazy_error: bool,
    /// A layer that calls `trace` runs only if another layer needs it.
    pub(in crate::cli) lazy_trace: bool,
    /// Parameters without metadata of their own do not take their values from the point's data.
    pub(in crate::cli) lockgeom: bool,
    /// `isconnected` counts a parameter as connected if it may take its value from the point's data.
    pub(in crate::cli) userdata_isconnected: bool,
    /// An invalid connection is an error; otherwise it is a warning, and the group runs without it.
    pub(in crate::cli) connection_error: bool,
    /// An index out of range is reported.
    pub(in crate::cli) range_checking: bool,
    /// An unknown coordinate system is reported.
    pub(in crate::cli) unknown_coordsys_error: bool,
    /// After a failed `getmessage`, the message cannot be set.
    pub(in crate::cli) strict_messages: bool,
    /// Each error and warning is reported, even if it was reported before.
    pub(in crate::cli) error_repeats: bool,
    /// Maximum number of warnings that one thread reports.
    pub(in crate::cli) max_warnings: usize,
    /// Infinite and NaN values are reported.
    pub(in crate::cli) debug_nan: bool,
    /// Reads of variables without a value are reported.
    pub(in crate::cli) debug_uninit: bool,
    /// The color space, which determines the primaries.
    pub(in crate::cli) color_space: String,
    /// Another name of the common space.
    pub(in crate::cli) common_space: String,
    /// Folders to search for shaders, before the working directory.
    pub(in crate::cli) shader_path: Vec<PathBuf>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            lazy_globals: true,
            lazy_unconnected: true,
            lazy_error: true,
            lazy_trace: true,
            lockgeom: true,
            userdata_isconnected: false,
            connection_error: true,
            range_checking: true,
            unknown_coordsys_error: true,
            strict_messages: true,
            error_repeats: false,
            max_warnings: 100,
            debug_nan: false,
            debug_uninit: false,
            color_space: "Rec709".to_string(),
            common_space: "world".to_string(),
            shader_path: Vec::new(),
        }
    }
}

impl Settings {
    /// Reads a list `KEY=VALUE,…`; commas in quotes belong to the value. Later settings replace earlier ones.
    pub(in crate::cli) fn read(&mut self, list: &str) {
        for (key, value) in pairs(list) {
            self.set(&key, &value);
        }
    }

    /// The rules for the layers of a group.
    pub(in crate::cli) fn rules(&self) -> Rules {
        Rules {
            entries: None,
            eager_globals: !self.lazy_globals,
            eager_unconnected: !self.lazy_unconnected,
            eager_errors: !self.lazy_error,
            eager_traces: !self.lazy_trace,
            lockgeom: self.lockgeom,
            userdata_connected: self.userdata_isconnected,
            checks: Checks { finite: self.debug_nan, set: self.debug_uninit },
        }
    }

    /// Whether the settings silence this message of a run.
    pub(super) fn silences(&self, message: &str) -> bool {
        !self.range_checking && message.starts_with("Index [")
            || !self.unknown_coordsys_error && message.starts_with("Unknown transformation ")
    }

    /// The number of the color space in OSL's list. An unknown one is reported, and Rec709 is used instead.
    pub(super) fn primaries(&self, console: &mut Console<'_>) -> i32 {
        let found = SYSTEMS.iter().position(|name| *name == self.color_space);
        if found.is_none() {
            console.error(&format!("Unknown color space \"{}\"", self.color_space));
        }
        found.unwrap_or(0) as i32
    }

    fn set(&mut self, key: &str, value: &str) {
        let on = value.parse::<f64>().is_ok_and(|x| x != 0.0);
        let flag = match key {
            "lazyglobals" => &mut self.lazy_globals,
            "lazyunconnected" => &mut self.lazy_unconnected,
            "lazyerror" => &mut self.lazy_error,
            "lazytrace" => &mut self.lazy_trace,
            "lockgeom" => &mut self.lockgeom,
            "userdata_isconnected" => &mut self.userdata_isconnected,
            "connection_error" => &mut self.connection_error,
            "range_checking" => &mut self.range_checking,
            "unknown_coordsys_error" => &mut self.unknown_coordsys_error,
            "strict_messages" => &mut self.strict_messages,
            "error_repeats" => &mut self.error_repeats,
            "debug_nan" => &mut self.debug_nan,
            "debug_uninit" => &mut self.debug_uninit,
            "max_warnings_per_thread" => {
                self.max_warnings = value.parse().unwrap_or(self.max_warnings);
                return;
            }
            "colorspace" => {
                self.color_space = value.to_string();
                return;
            }
            "commonspace" => {
                self.common_space = value.to_string();
                return;
            }
            "searchpath:shader" => {
                self.shader_path = folders(value);
                return;
            }
            _ => return,
        };
        *flag = on;
    }
}

/// The folders of a search path, separated by `:` or `;`.
pub(in crate::cli) fn folders(path: &str) -> Vec<PathBuf> {
    path.split([':', ';']).filter(|part| !part.is_empty()).map(PathBuf::from).collect()
}

/// The pairs of a list. Entries that are not pairs are ignored.
pub(in crate::cli) fn pairs(list: &str) -> Vec<(String, String)> {
    let mut quoted = false;
    let parts = list.split(|c| {
        quoted ^= c == '"';
        c == ',' && !quoted
    });
    let pair = |part: &str| {
        let (key, value) = part.split_once('=')?;
        let value = value.trim();
        let bare = value.strip_prefix('"').and_then(|v| v.strip_suffix('"')).unwrap_or(value);
        Some((key.trim().to_string(), bare.to_string()))
    };
    parts.filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_settings_count_and_unknown_ones_do_nothing() {
        let mut settings = Settings::default();
        settings.read("lazyglobals=0, lazyerror=0,lazyerror=1,llvm_debug=2,nosuch,max_warnings_per_thread=3");
        let expected = Settings { lazy_globals: false, max_warnings: 3, ..Settings::default() };
        assert_eq!(settings, expected);
    }

    #[test]
    fn quotes_hold_commas() {
        assert_eq!(
            pairs("a=\"x,y\",b=z"),
            [("a".to_string(), "x,y".to_string()), ("b".to_string(), "z".to_string())]
        );
        let mut settings = Settings::default();
        settings.read("searchpath:shader=\"one:two\",colorspace=ACEScg");
        assert_eq!(settings.shader_path, [PathBuf::from("one"), PathBuf::from("two")]);
        assert_eq!(settings.color_space, "ACEScg");
    }
}
