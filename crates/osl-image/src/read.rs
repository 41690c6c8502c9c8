//! Reads image files of all formats as interleaved `f32`.
//!
//! The first bytes of a file, not its name, determine the format. Sizes are checked against a limit before
//! memory is allocated, and damage becomes an error value. No color conversion happens: an 8-bit value is its
//! byte over 255.

use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use osl_limits::Limits;

use crate::admission::Admission;
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::file;
use crate::image::{EncodedFile, ImageData, Source, SubImage};
use crate::search::ImageSource;
use crate::{exr_in, image_in, tiff_in};

/// A source that fails once the command has to stop. Decoders read through it, so each of them notices.
struct Watched<'a> {
    source: &'a mut dyn Source,
    limits: &'a Limits,
}

impl Watched<'_> {
    fn goes_on(&self) -> std::io::Result<()> {
        self.limits.halted().map_or(Ok(()), |why| Err(std::io::Error::other(why)))
    }
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.goes_on()?;
        self.source.read(buffer)
    }
}

impl BufRead for Watched<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        self.goes_on()?;
        self.source.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.source.consume(amount);
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.source.seek(position)
    }
}

/// Reads the first image of an EXR, PNG, JPEG, TIFF, Radiance HDR, TGA, BMP, GIF, WebP, PNM or DDS file,
/// within the usual limits.
///
/// For EXR this is the first flat part, at its full resolution.
///
/// **Errors**: the system refuses, the format is none of these, the file is damaged, or the image is too
/// large.
pub fn read_image(path: &Path) -> Result<ImageData, ImageError> {
    read_image_within(path, &Limits::default())
}

/// The same, within these limits.
///
/// **Errors**: as for [`read_image`].
pub fn read_image_within(path: &Path, limits: &Limits) -> Result<ImageData, ImageError> {
    let file = file::open_named(path, limits)?;
    read_part(file, SubImage::default(), &Admission::by_limits(limits)).map(Decoded::into_image)
}

/// Reads one image of an opened file. **Errors**: as for [`read_image`]; also if the file has no such image.
pub(crate) fn read_part(
    mut file: ImageSource,
    part: SubImage<'_>,
    admission: &Admission<'_>,
) -> Result<Decoded, ImageError> {
    decode(&file.path, &mut *file.source, file.length, part, admission)
}

/// Decodes one image from the bytes of a file. `path` is used only in error messages.
///
/// **Errors**: as for [`read_image`]; also if the file has no such image.
pub fn decode_part(
    path: &Path,
    bytes: &[u8],
    limits: &Limits,
    part: SubImage<'_>,
) -> Result<ImageData, ImageError> {
    let length = bytes.len() as u64;
    decode(path, &mut Cursor::new(bytes), length, part, &Admission::by_limits(limits))
        .map(Decoded::into_image)
}

/// Decodes one image of a file, if its memory is admitted.
pub(crate) fn decode(
    path: &Path,
    source: &mut dyn Source,
    length: u64,
    part: SubImage<'_>,
    admission: &Admission<'_>,
) -> Result<Decoded, ImageError> {
    let source: &mut dyn Source = &mut Watched { source, limits: admission.limits };
    let unreadable = |error: std::io::Error| ImageError::io(path, "read the file", error);
    let mut head = Vec::new();
    let most = admission.limits.images.header_bytes;
    (&mut *source).take(most).read_to_end(&mut head).map_err(unreadable)?;
    source.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    let file = EncodedFile { path, head, length, source };
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        if exr_in::is_exr(&file.head) {
            exr_in::decode(file, admission, part)
        } else if tiff_in::is_tiff(&file.head) {
            tiff_in::decode(file, admission, part)
        } else if part.among([None].into_iter()) == Some(0) {
            image_in::decode(file, admission)
        } else {
            Err(part.absent(path, 1))
        }
    }));
    // A texture must not be able to end the process, even if a foreign decoder panics. Nothing outside the
    // closure is then half-changed.
    decoded.unwrap_or_else(|_| Err(ImageError::format(path, "the decoder failed on a damaged file")))
}
