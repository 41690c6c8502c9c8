//! Writes a texture: an EXR file in tiles, with all coarser levels, as renderers load it without a
//! conversion.
//!
//! The levels are those that this crate makes itself when it reads a file without any, so that a texture
//! gives the same lookups whether its file has them or not.

use exr::block::chunk::{Chunk, CompressedBlock, CompressedTileBlock};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{AttributeValue, LevelMode, Text, TileDescription};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, TileIndices};
use half::f16;
use osl_files::Unsaved;
use osl_limits::Limits;
use rayon::prelude::*;
use std::io::BufReader;
use std::path::Path;

use crate::error::ImageError;
use crate::exr_out::{COMMAND, ExrOptions, Layer, check_planes, check_size, header};
use crate::exr_zip::{self, SampleType};
use crate::file;
use crate::image::StoredType;
use crate::level::Level;
use crate::levels;
use crate::texels::Texels;

/// The sides of a tile that readers accept, in texels.
pub const TILE_SIDES: std::ops::RangeInclusive<usize> = 8..=4096;

/// Tiles that are compressed before they are written.
const TOGETHER: usize = 64;

/// The file of a texture with these layers, which replaces its target once it is saved. `tile` is the side of
/// its square tiles in texels.
///
/// **Errors**: sizes or names do not form an image, `tile` is not in [`TILE_SIDES`], the work was cancelled,
/// or the system refuses. The file at `path` is then unchanged.
pub fn exr_texture(
    path: &Path,
    (width, height): (usize, usize),
    layers: &[Layer<'_>],
    tile: usize,
    options: ExrOptions<'_>,
    limits: &Limits,
) -> Result<Unsaved, ImageError> {
    check_size(path, width, height)?;
    if !TILE_SIDES.contains(&tile) {
        let why = format!("tiles have {} to {} texels a side", TILE_SIDES.start(), TILE_SIDES.end());
        return Err(ImageError::input(path, why));
    }
    for layer in layers {
        check_planes(path, layer, width * height)?;
    }
    let tiles = BlockDescription::Tiles(TileDescription {
        tile_size: Vec2(tile, tile),
        level_mode: LevelMode::MipMap,
        rounding_mode: RoundingMode::Down,
    });
    let shapes: Vec<_> = layers.iter().map(|layer| (layer.name, layer.kind)).collect();
    let (header, order) = header(path, (width, height), &shapes, tiles, options)?;
    let planes: Vec<&[f32]> = layers.iter().flat_map(|layer| layer.planes.iter().copied()).collect();
    let channels: Vec<Channel> = order
        .par_iter()
        .filter_map(|at| planes.get(*at))
        .map(|plane| Channel::of(plane, (width, height), options.samples, limits))
        .collect();
    let mut file = file::unsaved(path)?;
    let written = exr::block::writer::write_chunks_with(
        file.sink(),
        smallvec::smallvec![header],
        true,
        |meta, chunks| {
            let Some(header) = meta.headers.first() else { return Ok(()) };
            let all: Vec<(usize, TileIndices)> = header.enumerate_ordered_blocks().collect();
            for some in all.chunks(TOGETHER) {
                if limits.halted().is_some() {
                    return Err(exr::error::Error::Aborted);
                }
                let compress = |(at, place): &(usize, TileIndices)| {
                    let rows = rows(&channels, *place, tile)?;
                    Ok((*at, chunk(&rows, *place, tile, (options.samples, channels.len()), &meta.headers)?))
                };
                let done: Vec<exr::error::Result<_>> = some.par_iter().map(compress).collect();
                for chunk in done {
                    let (at, chunk) = chunk?;
                    chunks.write_chunk(at, chunk)?;
                }
            }
            Ok(())
        },
    );
    written.map_err(|error| ImageError::format(path, format!("cannot encode EXR: {error}")))?;
    Ok(file)
}

/// The text of the attribute [`COMMAND`] of an EXR file, of which only the header is read; none if there is
/// no such file or attribute.
pub fn exr_command(path: &Path) -> Option<String> {
    let file = BufReader::new(osl_files::open_named(path).ok()?.into_file());
    let meta = MetaData::read_from_buffered(file, false).ok()?;
    match meta.headers.first()?.own_attributes.other.get(&Text::from(COMMAND))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

/// The levels of one channel, the finest first.
struct Channel(Vec<Level>);

impl Channel {
    fn of(plane: &[f32], (width, height): (usize, usize), samples: SampleType, limits: &Limits) -> Channel {
        let (stored, texels) = match samples {
            SampleType::Float => (StoredType::Float, Texels::Float(plane.to_vec())),
            SampleType::Half => {
                (StoredType::Half, Texels::Half(plane.iter().map(|x| f16::from_f32(*x)).collect()))
            }
        };
        let finest = Level::new(width, height, 1, texels);
        let below = levels::made(&finest, 1, stored, limits);
        Channel(std::iter::once(finest).chain(below).collect())
    }
}

/// Columns and rows of a tile. The size that the library lists is that of a whole tile, also at the border.
fn size(channels: &[Channel], place: TileIndices, tile: usize) -> Option<(usize, usize)> {
    let at = place.location.tile_index;
    let level = channels.first()?.0.get(place.location.level_index.x())?;
    let left = |whole: usize, at: usize| whole.checked_sub(at * tile).map(|left| left.min(tile));
    Some((left(level.width, at.x())?, left(level.height, at.y())?))
}

/// The texels of a tile, row by row with all channels of a row after each other.
fn rows(channels: &[Channel], place: TileIndices, tile: usize) -> exr::error::Result<Vec<Vec<f32>>> {
    let (at, level) = (place.location.tile_index, place.location.level_index);
    let missing = || exr::error::Error::Invalid("level of the texture".into());
    let first = (at.x() * tile, at.y() * tile);
    let (columns, height) = size(channels, place, tile).ok_or_else(missing)?;
    let mut rows = Vec::with_capacity(height * channels.len());
    for row in first.1..first.1 + height {
        for channel in channels {
            let level = channel.0.get(level.x()).ok_or_else(missing)?;
            let texel = |column| level.texel(column, row).map_or(0.0, |at| level.texels.get(at));
            rows.push((first.0..first.0 + columns).map(texel).collect());
        }
    }
    Ok(rows)
}

/// The compressed tile with these rows.
fn chunk(
    rows: &[Vec<f32>],
    place: TileIndices,
    tile: usize,
    (samples, n_channels): (SampleType, usize),
    headers: &[Header],
) -> exr::error::Result<Chunk> {
    let is_zip = |header: &Header| matches!(header.compression, Compression::ZIP1 | Compression::ZIP16);
    if headers.first().is_some_and(is_zip) {
        let rows: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
        let compressed_pixels_le = exr_zip::block(&rows, samples);
        let block = CompressedTileBlock { coordinates: place.location, compressed_pixels_le };
        return Ok(Chunk { layer_index: 0, compressed_block: CompressedBlock::Tile(block) });
    }
    let at = place.location.tile_index;
    let columns = rows.first().map_or(0, Vec::len);
    let mut data = Vec::with_capacity(rows.len() * columns * 4);
    for value in rows.iter().flatten() {
        match samples {
            SampleType::Float => data.extend(value.to_ne_bytes()),
            SampleType::Half => data.extend(f16::from_f32(*value).to_ne_bytes()),
        }
    }
    let index = BlockIndex {
        layer: 0,
        pixel_position: Vec2(at.x() * tile, at.y() * tile),
        pixel_size: Vec2(columns, rows.len() / n_channels.max(1)),
        level: place.location.level_index,
    };
    UncompressedBlock { index, data }.compress_to_chunk(headers)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use crate::{
        ExrCompression, Footprint, LayerKind, LookupOptions, Texture, lookup_values, read_image, write_exr,
    };

    /// A texture of an odd size in both forms: with and without levels.
    #[test]
    fn lookups_are_those_of_a_file_without_levels() {
        let dir = tempfile::tempdir().unwrap();
        let (width, height) = (45, 28);
        let plane = |k: usize| (0..width * height).map(|i| ((i * k) % 17) as f32 / 16.0).collect::<Vec<_>>();
        let planes = [plane(3), plane(5), plane(7)];
        let layer =
            || Layer { name: "", kind: LayerKind::Color, planes: planes.iter().map(Vec::as_slice).collect() };
        for samples in [SampleType::Float, SampleType::Half] {
            for compression in [ExrCompression::Zip16, ExrCompression::None, ExrCompression::Piz] {
                let options = ExrOptions { samples, compression, ..ExrOptions::default() };
                let paths = ["flat.exr", "tiled.exr"].map(|name| dir.path().join(name));
                write_exr(&paths[0], width, height, &[layer()], options).unwrap();
                let limits = Limits::default();
                let file = exr_texture(&paths[1], (width, height), &[layer()], 16, options, &limits).unwrap();
                file.save().unwrap();
                let [flat, tiled] = paths.map(|path| Texture::new(read_image(&path).unwrap()));
                assert_eq!((flat.n_levels(), tiled.n_levels()), (6, 6));
                for i in 0..200 {
                    let (s, t, size) = (i as f32 * 0.013, i as f32 * 0.007, i as f32 * 0.004);
                    let footprint = Footprint { ds_dx: size, dt_dy: size, ..Footprint::default() };
                    let of = |texture| lookup_values(texture, s, t, &footprint, 3, &LookupOptions::default());
                    assert_eq!(of(&flat), of(&tiled), "{samples:?} {compression:?} {i}");
                }
            }
        }
    }
}
