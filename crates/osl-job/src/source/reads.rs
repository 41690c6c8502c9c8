//! The files that a run reads or looks for, so that a change of them can be seen.

use super::input;
use crate::request::Image;
use osl::stages;
use osl_image::TextureCache;
use osl_syntax::source::SourceMap;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The files that a run reads, or looks for.
#[derive(Debug, Default)]
pub struct Reads(pub BTreeSet<PathBuf>);

impl Reads {
    /// Adds the files of a source.
    pub fn sources(&mut self, sources: &SourceMap) {
        self.0.extend(sources.files().iter().map(|file| PathBuf::from(&*file.name)));
    }

    /// Adds the places of the textures that a run looked for, and of others with these names.
    pub fn textures<'a>(&mut self, textures: &TextureCache, names: impl IntoIterator<Item = &'a str>) {
        self.0.extend(textures.places(names));
    }

    /// Adds the files that the command line names, and those that a single shader includes, even if it has
    /// errors.
    pub fn named(&mut self, image: &Image) {
        self.0.extend(image.shader.file.iter().chain(&image.provided.attributes).cloned());
        self.0.extend(image.points.surface.on.iter().map(PathBuf::from));
        let Some(path) = &image.shader.file else { return };
        if let Ok(input) = input::read(path, &image.shader.read) {
            let files = input.files.or_anywhere(image.shader.allow_files);
            self.sources(&stages::check(&input.name, &input.text, &files, &input.options).sources);
        }
    }
}
