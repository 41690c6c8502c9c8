//! The command `oslrun` inside this process.

use crate::work::detached;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::ffi::OsString;

/// Runs the command with these arguments, after its name. Returns its exit code, and the bytes of its
/// standard output and the text of its standard error.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, args: Vec<OsString>) -> PyResult<(u8, Bound<'_, PyBytes>, String)> {
    let (code, out, err) = detached(py, |_| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let args = [OsString::from("oslrun")].into_iter().chain(args);
        (oslrun::cli::main(args, &mut out, &mut err), out, err)
    })?;
    Ok((code, PyBytes::new(py, &out), oslrun::cli::plain(&String::from_utf8_lossy(&err))))
}

/// Runs the command with these arguments as the whole work of this process, and returns its exit code.
#[pyfunction]
pub(crate) fn command_line(py: Python<'_>, args: Vec<OsString>) -> u8 {
    let args = [OsString::from("oslrun")].into_iter().chain(args).collect();
    py.detach(|| oslrun::run(args))
}
