//! The native part of the Python package `oslrun`: shaders, groups and programs of the crate `osl`, run at
//! arrays of points, and the command `oslrun` inside the process.
//!
//! It checks and converts what Python passes, releases the interpreter's lock while it works, and raises the
//! exceptions of `oslrun._errors`. Names, broadcasting and presentation are in `python/oslrun`. It must not
//! know how shaders are compiled or run.

mod command;
mod encode;
mod error;
mod group;
mod image;
mod program;
mod services;
mod shader;
mod values;
mod work;

use pyo3::prelude::*;

/// The native part of the package `oslrun`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::command::{command, command_line};
    #[pymodule_export]
    use super::encode::{png, texture};
    #[pymodule_export]
    use super::group::Group;
    #[pymodule_export]
    use super::image::image;
    #[pymodule_export]
    use super::program::{Program, Renderer};
    #[pymodule_export]
    use super::shader::Shader;
}
