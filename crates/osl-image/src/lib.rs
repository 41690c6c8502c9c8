//! Reads and writes image files, and looks up textures.
//!
//! A shader's `texture()` call arrives here with coordinates and their derivatives. The derivatives select a
//! resolution level and a few samples, and the filtered texels go back to the shader. The crate also reads
//! EXR, TIFF and, through the crate image, the other common formats within memory bounds, keeps textures in a
//! cache that threads share, and writes finished images without ever leaving a half-written file. It must not
//! know shaders: it sees only names, planes of `f32` and coordinates.
//!
//! Pixel row 0 is the first scanline of a file, at `t = 0` in texture space. Nothing here converts colors on
//! reading; writing PNG applies the transfer curve that the caller names.

mod admission;
mod attributes;
mod budget;
mod cache;
mod channels_out;
mod decoded;
mod environment;
mod error;
mod exr_b44;
mod exr_in;
mod exr_meta;
mod exr_out;
mod exr_texture;
mod exr_zip;
mod file;
mod filter;
mod footprint;
mod image;
mod image_in;
mod level;
mod levels;
mod loaded;
mod lookup;
mod png_out;
mod reach;
mod read;
mod search;
mod texels;
mod texture;
mod tiff_in;
mod tiff_meta;
mod tiff_out;
mod transfer;
mod udim;
mod wrap;

pub use self::image::{Header, ImageData, OwnedSubImage, StoredType, SubImage};
pub use attributes::{Attribute, Attributes};
pub use cache::{Missing, TextureCache};
pub use channels_out::{ChannelOptions, ImageFormat, Samples, channel_bytes, write_channels, write_ints};
pub use environment::environment;
pub use error::ImageError;
pub use exr_out::{
    COMMAND, DataWindow, ExrCompression, ExrOptions, Layer, LayerKind, ROWS_TOGETHER, exr_file,
    exr_in_memory, write_exr, write_exr_rows,
};
pub use exr_texture::{TILE_SIDES, exr_command, exr_texture};
pub use exr_zip::SampleType;
pub use filter::{Interp, Sample};
pub use footprint::Footprint;
pub use loaded::{LoadFailure, TextureResult};
pub use lookup::{LookupOptions, lookup, lookup_values};
pub use png_out::{BitDepth, PngOptions, png_bytes, png_samples, write_png};
pub use read::{decode_part, read_image, read_image_within};
pub use search::ReadFile;
pub use texture::{Reach, Texture};
pub use transfer::Transfer;
pub use wrap::Wrap;
