//! `--version`: the version, the commit that was built, and the instruction sets that a run may use.

use osl_exec::Isa;
use std::sync::LazyLock;

/// The commit, from the build script; `None` if the sources were built outside of a repository.
const COMMIT: Option<&str> = option_env!("OSLRUN_COMMIT");

static SHORT: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    COMMIT.map_or_else(|| version.to_string(), |commit| format!("{version} ({commit})"))
});

static LONG: LazyLock<String> = LazyLock::new(|| {
    let names: Vec<&str> = Isa::all().into_iter().map(Isa::name).collect();
    let used = Isa::detect().name();
    format!("{}\ninstruction sets of this machine: {}; runs use {used}", *SHORT, names.join(", "))
});

/// The version and the commit.
pub(super) fn short() -> &'static str {
    &SHORT
}

/// The same, and the instruction sets.
pub(super) fn long() -> &'static str {
    &LONG
}
