//! The outcome of loading a texture: the texture, or why there is none.
//!
//! A failure is kept like a texture, and it is reported once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::texture::Texture;

/// A texture, or why there is none.
pub type TextureResult = Result<Arc<Texture>, Arc<LoadFailure>>;

/// Why a texture is missing.
#[derive(Debug)]
pub struct LoadFailure {
    message: String,
    /// The name, if there is no such file.
    missing: Option<String>,
    reported: AtomicBool,
}

impl LoadFailure {
    /// A failure with the caller's reason, for a file that exists.
    pub fn new(message: &str) -> Arc<LoadFailure> {
        failure(message.to_owned(), None)
    }

    /// The reason, on one line.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The reason, for the first caller among all threads; `None` for all later callers.
    pub fn take_report(&self) -> Option<&str> {
        let first = !self.reported.swap(true, Ordering::Relaxed);
        first.then_some(self.message.as_str())
    }

    /// Whether there is no file, rather than one that cannot be read.
    pub fn is_missing(&self) -> bool {
        self.missing.is_some()
    }

    /// The reason in the words of the reference's texture library, which scripts may search for. They depend
    /// on the format that the file extension suggests.
    pub fn reference_message(&self) -> String {
        /// Extensions of the formats that the library reads, except TIFF.
        const KNOWN: &str = " bmp bw cin cineon dds dib dpx exr fits gif hdr ico iff int inta j2c j2k jfi jfif jp2 jpe jpeg \
                             jpg pbm pdd pfm pgm pic png pnm ppm psb psd rgb rgba rgbe rla sgi softimage tga tpic webp z \
                             zfile ";
        let Some(name) = &self.missing else { return self.message.clone() };
        if name.is_empty() {
            return "ImageInput::create() called with no filename".to_owned();
        }
        let shown = name.escape_debug();
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
        match &*ending {
            "tif" | "tiff" | "tx" | "env" | "sm" | "vsm" => {
                format!("Could not open file: {shown}: No such file or directory")
            }
            known if !known.is_empty() && KNOWN.contains(&format!(" {known} ")) => {
                format!("Could not open file \"{shown}\"")
            }
            _ => format!(
                "Image \"{shown}\" does not exist. Also, it is not the name of an image format that OpenImageIO recognizes."
            ),
        }
    }
}

/// A failure, with the name if there is no such file.
pub(crate) fn failure(message: String, missing: Option<&str>) -> Arc<LoadFailure> {
    Arc::new(LoadFailure { message, missing: missing.map(str::to_owned), reported: AtomicBool::new(false) })
}
