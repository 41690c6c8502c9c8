//! Groups of options that several commands share.
//!
//! A command flattens the groups that have an effect in it, and only those. Each group turns itself into a
//! part of a request; its fields are private, so that nothing below the command line reads an option.

pub(super) mod limits;
pub(super) mod picture;
pub(super) mod points;
pub(super) mod reading;
pub(super) mod running;
pub(super) mod samples;
pub(super) mod shader;

/// The headings under which `--help` lists the options.
pub(super) mod heading {
    pub(in crate::cli) const PICTURE: &str = "Picture";
    pub(in crate::cli) const DISPLAY: &str = "From values to colors (PNG and JPEG)";
    pub(in crate::cli) const VALUES: &str = "Values for the shader";
    pub(in crate::cli) const POINTS: &str = "Points";
    pub(in crate::cli) const SAMPLES: &str = "Samples and accuracy";
    pub(in crate::cli) const SURFACE: &str = "Surface";
    pub(in crate::cli) const PREVIEW: &str = "Preview with light";
    pub(in crate::cli) const GROUP: &str = "Group of shaders";
    pub(in crate::cli) const READING: &str = "Reading the source";
    pub(in crate::cli) const FILES: &str = "Files";
    pub(in crate::cli) const MESSAGES: &str = "Errors and warnings";
    pub(in crate::cli) const MEASURING: &str = "Statistics";
    pub(in crate::cli) const RUNNING: &str = "Running";
    pub(in crate::cli) const LIMITS: &str = "Limits";
}
