//! What a page shows, as the text of a group: the shader with the present values of its parameters.

use crate::cli::source::group_text;
use osl_job::source::input;
use osl_job::source::load::{self, Request};
use osl_job::{Failure, Image, Sink};
use osl_lower::group::text::{self, Statement};
use std::path::Path;

/// The text of a group, to be saved beside the file: `oslrun` makes the same picture of it.
pub(super) fn group(image: &Image, sink: &mut dyn Sink) -> Result<String, Failure> {
    let path = image.shader.file.as_deref().unwrap_or(Path::new(""));
    if !image.shader.network.is_empty() {
        return Err(Failure::new(
            "the layers are on the command line, so there is no file of a group to write",
        ));
    }
    let limits = image.limits();
    let shaders = if load::is_group(path) {
        let text = input::read_text(path, &image.shader.read).map_err(Failure::new)?;
        let (statements, _) = text::parse(&text, 0, limits);
        let name = |statement: &Statement| match statement {
            Statement::Shader { shader, .. } => Some(shader.text.to_string()),
            Statement::Param { .. } | Statement::Connect { .. } => None,
        };
        statements.iter().filter_map(name).collect()
    } else {
        vec![path.file_stem().unwrap_or_default().to_string_lossy().into_owned()]
    };
    let loaded = load::load(&Request { outputs: None, taps: &[], ..Request::of(image) }, sink)?;
    let group = loaded.group(limits);
    Ok(group_text::serialized(&group, |at, layer| {
        shaders.get(at).cloned().unwrap_or_else(|| layer.program.shader.name.to_string())
    }))
}
