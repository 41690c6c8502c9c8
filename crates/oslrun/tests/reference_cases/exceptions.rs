//! Cases that differ from the recordings, each with the reason. `docs/conformance.md` lists the permanent
//! ones.

/// Case and reason.
const EXCEPTIONS: &[(&str, &str)] = &[
    (
        "debug_checks",
        "the numbers of operations are those of the reference's optimised shader; file, line, type and variable agree",
    ),
    (
        "fused_arithmetic/hash_of_cos_host",
        "recorded where the reference fuses products and sums; here each is rounded",
    ),
    ("gettextureinfo", "the shader prints what a failed query left in variables that nobody set"),
    (
        "testrender_errors",
        "where a shader is missing the reference aborts by a signal; here the run ends with exit code 1",
    ),
    ("undefined_reads/knots_past_end", "the shader reads what nobody set: the reference shows memory"),
    ("undefined_reads/maybe_unset", "the shader reads what nobody set: the reference shows memory"),
];

/// Why a case may differ.
pub(crate) fn reason(case: &str) -> Option<&'static str> {
    EXCEPTIONS.iter().find(|(name, _)| *name == case).map(|(_, reason)| *reason)
}
