//! Reads one part of an EXR file block by block, so that only one block is in memory besides the image.

use std::io::Cursor;
use std::path::Path;

use exr::block::reader::ChunksReader;
use exr::block::{UncompressedBlock, chunk::Chunk, chunk::CompressedBlock};
use exr::compression::Compression;
use exr::error::Error;
use exr::math::Vec2;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, mip_map_levels};
use half::f16;

use crate::admission::{Admission, Claim};
use crate::decoded::Decoded;
use crate::error::ImageError;
use crate::image::{EncodedFile, Header as FileHeader, StoredType, SubImage};
use crate::texels::Texels;
use crate::wrap::Wrap;
use crate::{exr_b44, exr_meta};

/// Whether a file begins as all EXR files do.
pub(crate) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Decodes one of the flat (not deep) parts.
pub(crate) fn decode(
    file: EncodedFile<'_>,
    admission: &Admission<'_>,
    part: SubImage<'_>,
) -> Result<Decoded, ImageError> {
    let EncodedFile { path, head, length, source } = file;
    let damaged = |error: Error| ImageError::format(path, format!("not a readable EXR: {error}"));
    let meta = MetaData::read_from_buffered(Cursor::new(&head), false).map_err(|error| {
        if length > head.len() as u64 && !matches!(error, Error::NotSupported(_)) {
            let most = admission.limits.images.header_bytes;
            let what = format!("EXR whose header is damaged or longer than {most} bytes");
            return ImageError::format(path, format!("{what} (--limit images.header_bytes=BYTES): {error}"));
        }
        damaged(error)
    })?;
    let (index, n_parts) = chosen_header(path, &meta, part)?;
    let header = meta.headers.get(index).ok_or_else(|| part.absent(path, n_parts))?;
    if header.channels.list.iter().any(|c| c.sampling.width() != 1 || c.sampling.height() != 1) {
        return Err(ImageError::format(path, "EXR with channels of different resolutions"));
    }
    let told = file_header(header, exr_meta::attributes(&head, index, &admission.limits.images));
    let mut pixels = Pixels::of(header);
    check_table(path, &meta, length)?;
    let size = (header.layer_size.width(), header.layer_size.height());
    let claim = Claim {
        size,
        full: told.whole_size().unwrap_or(size),
        n_channels: header.channels.list.len(),
        kept: pixels.kept,
        makes_levels: pixels.sizes.len() == 1,
        working: working_bytes(&meta, index).saturating_add(head.len() as u64 * 3),
    };
    admission.admit(path, &claim)?;
    pixels.allocate();
    let reader = exr::block::read(source, false).map_err(damaged)?;
    let with_levels = pixels.levels.len() > 1;
    let wanted = |_: &MetaData, tile: exr::block::chunk::TileCoordinates, block: exr::block::BlockIndex| {
        let Vec2(x, y) = tile.level_index;
        block.layer == index && (x, y) == (0, 0) || block.layer == index && with_levels && x == y
    };
    let mut chunks = reader.filter_chunks(false, wanted).map_err(damaged)?;
    while let Some(chunk) = chunks.read_next_chunk() {
        admission.goes_on(path)?;
        let chunk = chunk.map_err(damaged)?;
        check_chunk(&chunk, index, header).map_err(|why| ImageError::format(path, why))?;
        let block = UncompressedBlock::decompress_chunk(chunk, chunks.meta_data(), false).map_err(damaged)?;
        pixels.take(&block, header).map_err(|why| ImageError::format(path, why))?;
    }
    let wraps = told.attributes.text("wrapmodes").map(Wrap::pair_from_file).unwrap_or_default();
    let mut levels = pixels.levels.into_iter();
    let (width, height, texels) =
        levels.next().ok_or_else(|| ImageError::format(path, "the image has no pixels"))?;
    let coarser = levels.collect();
    let channels = pixels.names;
    Ok(Decoded {
        width,
        height,
        channels,
        stored: pixels.stored,
        wraps,
        n_parts,
        header: told,
        texels,
        coarser,
    })
}

/// Converts the header of a part.
fn file_header(header: &Header, attributes: crate::attributes::Attributes) -> FileHeader {
    let mut told = FileHeader { attributes, ..FileHeader::default() };
    let edges = |origin: (i32, i32), size: (usize, usize)| {
        let last = |first: i32, n: usize| {
            first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX)).saturating_sub(1)
        };
        [origin.0, origin.1, last(origin.0, size.0), last(origin.1, size.1)]
    };
    let position = header.own_attributes.layer_position;
    let data = edges((position.x(), position.y()), (header.layer_size.width(), header.layer_size.height()));
    let window = header.shared_attributes.display_window;
    let display =
        edges((window.position.x(), window.position.y()), (window.size.width(), window.size.height()));
    told.data_origin = (position.x(), position.y());
    told.display_window = (display != data).then_some(display);
    if let BlockDescription::Tiles(tiles) = header.blocks {
        told.tile = Some((tiles.tile_size.width(), tiles.tile_size.height()));
    }
    told
}

/// The index of a part among all headers, and the number of parts to choose from.
fn chosen_header(path: &Path, meta: &MetaData, part: SubImage<'_>) -> Result<(usize, usize), ImageError> {
    let flat: Vec<usize> = (0..meta.headers.len()).filter(|&i| !meta.headers[i].deep).collect();
    let text = |i: &usize| meta.headers[*i].own_attributes.layer_name.as_ref().map(ToString::to_string);
    let names: Vec<Option<String>> = flat.iter().map(text).collect();
    let place = part.among(names.iter().map(Option::as_deref));
    let header = place.and_then(|place| flat.get(place)).ok_or_else(|| part.absent(path, flat.len()))?;
    Ok((*header, flat.len()))
}

/// Refuses a file that is shorter than the table of its blocks.
fn check_table(path: &Path, meta: &MetaData, length: u64) -> Result<(), ImageError> {
    if n_blocks(meta).saturating_mul(8) > length {
        return Err(ImageError::format(path, "EXR that is shorter than the table of its blocks"));
    }
    Ok(())
}

fn n_blocks(meta: &MetaData) -> u64 {
    meta.headers.iter().map(|header| header.chunk_count as u64).fold(0, u64::saturating_add)
}

/// The bytes needed for decoding besides the image: tables of all blocks, and one block in compressed and
/// decompressed form.
fn working_bytes(meta: &MetaData, index: usize) -> u64 {
    let Some(header) = meta.headers.get(index) else { return 0 };
    let pixels = match header.blocks {
        BlockDescription::Tiles(tiles) => {
            (tiles.tile_size.width() as u64).saturating_mul(tiles.tile_size.height() as u64)
        }
        BlockDescription::ScanLines => {
            let rows = header.compression.scan_lines_per_block() as u64;
            (header.layer_size.width() as u64).saturating_mul(rows)
        }
    };
    // Some compressions rearrange a block more than once.
    let block = pixels.saturating_mul(header.channels.bytes_per_pixel as u64).saturating_mul(5);
    block.saturating_add(n_blocks(meta).saturating_mul(16))
}

/// Refuses blocks that are invalid but that the decoder of their compression would accept.
fn check_chunk(chunk: &Chunk, wanted: usize, header: &Header) -> Result<(), String> {
    if chunk.layer_index != wanted {
        return Err("EXR whose table of blocks leads to another part".to_owned());
    }
    if !matches!(header.compression, Compression::B44 | Compression::B44A) {
        return Ok(());
    }
    let bytes = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let place = header.get_block_data_indices(&chunk.compressed_block);
    let place = place.and_then(|tile| header.get_absolute_block_pixel_coordinates(tile));
    let size = place.map_err(|error| format!("not a readable EXR: {error}"))?.size;
    let channels: Vec<exr_b44::Channel> = header
        .channels
        .list
        .iter()
        .map(|c| exr_b44::Channel {
            is_half: c.sample_type == SampleType::F16,
            is_linear: c.quantize_linearly,
        })
        .collect();
    exr_b44::check(bytes, (size.width(), size.height()), &channels).map_err(str::to_owned)
}

/// The pixels of a part, level by level.
struct Pixels {
    /// The names of the channels in the crate's order.
    names: Vec<String>,
    /// For each channel of the file, its index in the crate's order.
    slots: Vec<usize>,
    /// The type of the first channel.
    stored: StoredType,
    /// The type in which all channels are kept.
    kept: StoredType,
    sizes: Vec<(usize, usize)>,
    levels: Vec<(usize, usize, Texels)>,
}

impl Pixels {
    fn of(header: &Header) -> Self {
        let list = &header.channels.list;
        let mut order: Vec<usize> = (0..list.len()).collect();
        let name = |at: usize| list.get(at).map(|c| c.name.to_string()).unwrap_or_default();
        order.sort_by_cached_key(|at| channel_order(&name(*at)));
        let mut slots = vec![0; list.len()];
        for (slot, at) in order.iter().enumerate() {
            slots[*at] = slot;
        }
        let stored = match order.first().and_then(|at| list.get(*at)).map(|c| c.sample_type) {
            Some(SampleType::F16) => StoredType::Half,
            Some(SampleType::U32) => StoredType::U32,
            _ => StoredType::Float,
        };
        let all_half = list.iter().all(|c| c.sample_type == SampleType::F16);
        let whole = (header.layer_size.width(), header.layer_size.height());
        let sizes = match header.blocks {
            BlockDescription::Tiles(tiles) if tiles.level_mode == LevelMode::MipMap => {
                let levels = mip_map_levels(tiles.rounding_mode, header.layer_size);
                levels.map(|(_, size)| (size.width(), size.height())).collect()
            }
            _ => vec![whole],
        };
        Self {
            names: order.iter().map(|at| name(*at)).collect(),
            slots,
            stored,
            kept: if all_half { StoredType::Half } else { StoredType::Float },
            sizes,
            levels: Vec::new(),
        }
    }

    /// Allocates the memory for all levels.
    fn allocate(&mut self) {
        let empty = |(width, height): &(usize, usize)| {
            let count = width * height * self.slots.len();
            let texels = match self.kept {
                StoredType::Half => Texels::Half(vec![f16::ZERO; count]),
                _ => Texels::Float(vec![0.0; count]),
            };
            (*width, *height, texels)
        };
        self.levels = self.sizes.iter().map(empty).collect();
    }

    /// Copies a block into the levels.
    fn take(&mut self, block: &UncompressedBlock, header: &Header) -> Result<(), &'static str> {
        let n_channels = self.slots.len();
        let level = self.levels.get_mut(block.index.level.x());
        let (width, height, texels) = level.ok_or("EXR with a block of a level that it does not have")?;
        for line in block.lines(&header.channels) {
            let at = line.location;
            let end = at.position.x().saturating_add(at.sample_count);
            if end > *width || at.position.y() >= *height {
                return Err("EXR with a block that is not within the image");
            }
            let Some(slot) = self.slots.get(at.channel) else { continue };
            let first = (at.position.y() * *width + at.position.x()) * n_channels + slot;
            let kind = header.channels.list.get(at.channel).map(|c| c.sample_type);
            match (&mut *texels, kind) {
                (Texels::Half(list), _) => {
                    let values = line.value.as_chunks::<2>().0.iter().map(|b| f16::from_ne_bytes(*b));
                    fill(list, first, n_channels, values);
                }
                (Texels::Float(list), Some(SampleType::F16)) => {
                    let values =
                        line.value.as_chunks::<2>().0.iter().map(|b| f16::from_ne_bytes(*b).to_f32());
                    fill(list, first, n_channels, values);
                }
                (Texels::Float(list), Some(SampleType::U32)) => {
                    let values = line.value.as_chunks::<4>().0.iter().map(|b| u32::from_ne_bytes(*b) as f32);
                    fill(list, first, n_channels, values);
                }
                (Texels::Float(list), _) => {
                    let values = line.value.as_chunks::<4>().0.iter().map(|b| f32::from_ne_bytes(*b));
                    fill(list, first, n_channels, values);
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn fill<T>(list: &mut [T], first: usize, step: usize, values: impl Iterator<Item = T>) {
    let slots = list.get_mut(first..).unwrap_or_default().iter_mut().step_by(step.max(1));
    for (slot, value) in slots.zip(values) {
        *slot = value;
    }
}

/// A sort key that puts plain names before those of layers, and within a layer R, G, B, A before the rest.
fn channel_order(name: &str) -> (String, usize, String) {
    let (layer, base) = name.rsplit_once('.').unwrap_or(("", name));
    let rank = ["R", "G", "B", "A"].iter().position(|known| *known == base).unwrap_or(4);
    (layer.to_owned(), rank, base.to_owned())
}
