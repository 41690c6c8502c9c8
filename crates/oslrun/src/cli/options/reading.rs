//! How sources are read, and which of their warnings are reported.

use super::heading;
use super::limits::LimitArgs;
use clap::{ArgMatches, Args, ValueEnum};
use osl_job::request::lints::{Lints, denied, warning, warning_or_error};
use osl_job::request::{Reach, Reading};
use osl_limits::{Cancel, Limits};
use osl_syntax::Version;
use std::path::PathBuf;

/// How a source file is read.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct ReadArgs {
    /// Folder to search for #include files; may be repeated.
    #[arg(short = 'I', value_name = "DIR", help_heading = heading::READING)]
    include: Vec<PathBuf>,
    /// Macro to define before reading, NAME or NAME=VALUE; may be repeated.
    #[arg(short = 'D', value_name = "NAME[=VALUE]", help_heading = heading::READING)]
    define: Vec<String>,
    /// Accept exactly what the reference compiler accepts.
    #[arg(long, help_heading = heading::READING)]
    strict_syntax: bool,
    /// Version of the language, 1.13 or 1.15 (default: 1.13): the value of OSL_VERSION, and what linearstep
    /// returns where its first edge is above the second.
    #[arg(long, value_name = "VERSION", value_parser = version, help_heading = heading::READING)]
    osl_version: Option<Version>,
    /// Write the files that the command has read to FILE, as a rule for make: its target is what the command
    /// has written, or FILE itself. A command that fails writes none.
    #[arg(long, value_name = "FILE", help_heading = heading::FILES)]
    deps: Option<PathBuf>,
    /// Renderer whose dialect the files are in, by its name in `oslrun dialects` (default: what each file
    /// shows); `none` reads them as plain OSL.
    #[arg(long, value_name = "NAME", help_heading = heading::READING)]
    dialect: Option<String>,
    /// Folder of a further dialect, with a dialect.toml, or of several; may be repeated.
    #[arg(long, value_name = "DIR", help_heading = heading::READING)]
    dialect_path: Vec<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// The file of `--deps` on a command line, for the end of the command.
pub(in crate::cli) fn deps(line: &ArgMatches) -> Option<PathBuf> {
    let own = line.subcommand().map_or(line, |(_, own)| own);
    own.try_get_one("deps").ok().flatten().cloned()
}

impl ReadArgs {
    /// How sources are read.
    pub(in crate::cli) fn reading(&self) -> Reading {
        Reading {
            include: self.include.clone(),
            define: self.define.clone(),
            strict_syntax: self.strict_syntax,
            version: self.osl_version,
            reach: Reach::default(),
            dialect: self.dialect.clone(),
            dialect_path: self.dialect_path.clone(),
            limits: self.limits.limits().clone(),
            ..Reading::default()
        }
    }

    /// Makes limits for pieces of work that can be cancelled; the time of each begins when they are made.
    pub(in crate::cli) fn limits_until(&self) -> impl Fn(&Cancel) -> Limits + Clone + Send + 'static {
        let own = self.limits.clone();
        move |cancel| own.until(cancel)
    }
}

/// The version with a name.
pub(in crate::cli) fn version(name: &str) -> Result<Version, String> {
    Version::named(name)
        .ok_or_else(|| format!("the versions of the language are 1.13 and 1.15, not `{name}`"))
}

/// How errors and warnings are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum MessageFormat {
    /// With excerpts of the source.
    #[default]
    Human,
    /// One JSON object per line.
    Json,
}

/// How errors and warnings are printed. The console reads the option itself, since it also prints what is
/// wrong with a command line.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct FormatArgs {
    /// How errors and warnings are printed.
    #[arg(long, value_enum, default_value_t, help_heading = heading::MESSAGES)]
    message_format: MessageFormat,
    /// Print errors, warnings and results only: no notes, no progress, and no lines that say which files were
    /// written.
    #[arg(long, help_heading = heading::MESSAGES)]
    quiet: bool,
}

/// Which warnings are reported.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct LintArgs {
    /// Show a warning that is not shown by default; by name or code, or `all`. May be repeated. `-Werror` is
    /// `--deny warnings`.
    #[arg(short = 'W', long = "warn", value_name = "NAME", value_parser = warning_or_error, help_heading = heading::MESSAGES)]
    warn: Vec<String>,
    /// Silence a warning; by name or code, or `all`. May be repeated.
    #[arg(short = 'A', long = "allow", value_name = "NAME", value_parser = warning, help_heading = heading::MESSAGES)]
    allow: Vec<String>,
    /// Turn a warning into an error; by name or code, `warnings` for all that are shown, or `all`. May be
    /// repeated. `errors`: if a shader reports an error while it runs, the run fails and no image is written.
    #[arg(long, value_name = "NAME", value_parser = denied, help_heading = heading::MESSAGES)]
    deny: Vec<String>,
    /// A coordinate or color space that the renderer knows. May be repeated.
    #[arg(long, value_name = "NAME", help_heading = heading::MESSAGES)]
    known_space: Vec<String>,
}

impl LintArgs {
    /// The warnings to report.
    pub(in crate::cli) fn lints(&self) -> Lints {
        Lints {
            warn: self.warn.clone(),
            allow: self.allow.clone(),
            deny: self.deny.clone(),
            known_space: self.known_space.clone(),
        }
    }
}
