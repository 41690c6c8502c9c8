//! Built-in shaders that complete the user's: a layer that the outputs of its last layer feed.

use crate::source::load::LoadedShader;
use crate::source::nodes;
use crate::{Failure, Image};
use osl::stages::{self, NoFiles};
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_lower::Requests;
use osl_lower::group::Layer;
use osl_lower::params::{self, ParamValues};
use osl_syntax::source::SourceMap;
use std::sync::Arc;

/// A built-in shader, with its source.
pub(super) fn own(name: &str) -> Result<(Arc<hir::Program>, SourceMap), Failure> {
    let text = nodes::preview(name).unwrap_or_default();
    let file = format!("{name}.osl (built in)");
    let checked = stages::check(&file, text, &NoFiles, &osl_syntax::Options::default());
    let program = checked.program.ok_or_else(|| Failure::new(format!("{file} cannot be read")))?;
    Ok((Arc::new(program), checked.sources))
}

/// The body of the user's shader and of a built-in one that follows, with values of its parameters, and links
/// from outputs of the user's to parameters.
pub(super) fn followed(
    loaded: &mut LoadedShader,
    by: &str,
    values: &[(&str, String)],
    links: &[(&str, &str)],
    image: &Image,
) -> Result<Body, Failure> {
    let limits = image.limits();
    let mut group = loaded.group(limits);
    let last = group.layers().last().map(|layer| layer.name.to_string());
    let Some(last) = last else {
        return Err(Failure::new("the limit reading.layers leaves no room for the shader"));
    };
    let (program, sources) = own(by)?;
    let base =
        loaded.sources.append(&sources).ok_or_else(|| Failure::new("the sources have more than 4 GiB"))?;
    let mut given = ParamValues::default();
    for (name, text) in values {
        params::set(&program, &mut given, name, text).map_err(Failure::new)?;
    }
    // The user's layers may have any name.
    let name =
        (0..).map(|n| format!("preview_{n}")).find(|name| group.find(name).is_none()).unwrap_or_default();
    let layer = Layer { name: name.as_str().into(), program, values: given, base };
    let room = |_| Failure::new(format!("the limit reading.layers leaves no room for {by}"));
    group.add(layer).map_err(room)?;
    for (from, to) in links {
        group.connect((&last, from), (&name, to)).map_err(Failure::new)?;
    }
    let requests = Requests { limits: limits.clone(), ..Requests::default() };
    osl_lower::lower_group_for(&group, &requests).map_err(|list| {
        let why = list.first().map_or_else(String::new, |d| d.message.clone());
        Failure::new(format!("the shader cannot be compiled together with {by}: {why}"))
    })
}
