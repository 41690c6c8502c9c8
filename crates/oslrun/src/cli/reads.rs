//! The files that a run reads or looks for, so that a change of them can be seen. This module must not know
//! who waits for a change.

use super::args::RunArgs;
use super::input;
use osl::stages;
use osl_image::TextureCache;
use osl_syntax::source::SourceMap;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The files that a run reads, or looks for.
#[derive(Debug, Default)]
pub(super) struct Reads(pub(super) BTreeSet<PathBuf>);

impl Reads {
    /// Adds the files of a source.
    pub(super) fn sources(&mut self, sources: &SourceMap) {
        self.0.extend(sources.files().iter().map(|file| PathBuf::from(&*file.name)));
    }

    /// Adds the places of the textures that a run looked for, and of others with these names.
    pub(super) fn textures<'a>(&mut self, textures: &TextureCache, names: impl IntoIterator<Item = &'a str>) {
        self.0.extend(textures.places(names));
    }

    /// Adds the files that the command line names, and those that a single shader includes, even if it has
    /// errors.
    pub(super) fn named(&mut self, args: &RunArgs) {
        self.0.extend(args.file.iter().chain(&args.attributes).cloned());
        self.0.extend(args.on.on.iter().map(PathBuf::from));
        let Some(path) = &args.file else { return };
        if let Ok(input) = input::read(path, &args.read) {
            let files = input.files.or_anywhere(args.allow_files);
            self.sources(&stages::check(&input.name, &input.text, &files, &input.options).sources);
        }
    }
}
