//! Reading one part of an EXR file.
//!
//! It must not know other formats.

use std::cell::Cell;
use std::io::Cursor;
use std::path::Path;

use exr::error::Error;
use exr::image::{Layer, Levels};
use exr::meta::BlockDescription;
use exr::meta::MetaData;
use exr::meta::attribute::LevelMode;
use exr::meta::header::Header;
use exr::prelude::{AnyChannel, FlatSamples, ReadChannels, ReadLayers};
use smallvec::SmallVec;

use crate::error::ImageError;
use crate::exr_meta;
use crate::read::{Header as FileHeader, ImageData, StoredType, SubImage, check_samples};
use crate::wrap::Wrap;

/// Whether a file begins as all EXR files do.
pub(crate) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Decodes one of the parts of plain pixels.
pub(crate) fn decode(
    path: &Path,
    bytes: &[u8],
    limit: u64,
    part: SubImage<'_>,
) -> Result<ImageData, ImageError> {
    let damaged = |error: Error| ImageError::format(path, format!("not a readable EXR: {error}"));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    let (header_index, n_parts) = chosen_header(path, &meta, part)?;
    if let Some(header) = meta.headers.get(header_index) {
        let size = header.layer_size;
        check_samples(path, size.width(), size.height(), header.channels.list.len(), limit)?;
        if header.channels.list.iter().any(|c| c.sampling.width() != 1 || c.sampling.height() != 1) {
            return Err(ImageError::format(path, "EXR with channels of different resolutions"));
        }
    }
    let mut header = file_header(&meta, header_index, bytes);
    // On this thread: a panic in one of the decoder's own workers would abort the process, barrier or not.
    let (size, levels) = if has_levels(&meta, header_index) {
        let channels = exr::prelude::read().no_deep_data().all_resolution_levels().all_channels();
        let reader = OnePart { channels, wanted: header_index, seen: Cell::new(0) }.first_valid_layer();
        let image =
            reader.all_attributes().non_parallel().from_buffered(Cursor::new(bytes)).map_err(damaged)?;
        let Layer { size, channel_data, .. } = image.layer_data;
        (size, by_level(channel_data.list.into_iter()))
    } else {
        let channels = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
        let reader = OnePart { channels, wanted: header_index, seen: Cell::new(0) }.first_valid_layer();
        let image =
            reader.all_attributes().non_parallel().from_buffered(Cursor::new(bytes)).map_err(damaged)?;
        let Layer { size, channel_data, .. } = image.layer_data;
        (size, vec![channel_data.list.into_iter().collect()])
    };
    let mut levels = levels.into_iter();
    let channels = sorted(levels.next().unwrap_or_default());
    check_samples(path, size.width(), size.height(), channels.len(), limit)?;
    let image = interleaved(path, size.width(), size.height(), &channels)?;
    let mut above = (image.width, image.height);
    header.coarser = levels
        .map_while(|channels| {
            let channels = sorted(channels);
            // Sizes are rounded down or up: the samples tell which.
            let length = channels.first().map_or(0, |channel| channel.sample_data.len());
            let floor = ((above.0 / 2).max(1), (above.1 / 2).max(1));
            let size = [floor, (above.0.div_ceil(2), above.1.div_ceil(2))]
                .into_iter()
                .find(|s| s.0 * s.1 == length)?;
            above = size;
            Some((size.0, size.1, interleaved(path, size.0, size.1, &channels).ok()?.samples))
        })
        .collect();
    let wraps = header.attributes.text("wrapmodes").map(Wrap::pair_from_file).unwrap_or_default();
    Ok(ImageData { wraps, n_parts, header, ..image })
}

type Channels = SmallVec<[AnyChannel<FlatSamples>; 4]>;

/// What the header of a part says.
fn file_header(meta: &MetaData, index: usize, bytes: &[u8]) -> FileHeader {
    let mut told = FileHeader { attributes: exr_meta::attributes(bytes, index), ..FileHeader::default() };
    let Some(header) = meta.headers.get(index) else { return told };
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

fn has_levels(meta: &MetaData, index: usize) -> bool {
    let blocks = meta.headers.get(index).map(|header| header.blocks);
    matches!(blocks, Some(BlockDescription::Tiles(tiles)) if tiles.level_mode == LevelMode::MipMap)
}

/// The channels of each level, from the finest on.
fn by_level(channels: impl Iterator<Item = AnyChannel<Levels<FlatSamples>>>) -> Vec<Channels> {
    let mut levels: Vec<Channels> = Vec::new();
    for AnyChannel { name, sample_data, quantize_linearly, sampling } in channels {
        let list = match sample_data {
            Levels::Singular(samples) => vec![samples],
            Levels::Mip { level_data, .. } => level_data,
            Levels::Rip { level_data, .. } => level_data.map_data.into_iter().take(1).collect(),
        };
        for (index, sample_data) in list.into_iter().enumerate() {
            if levels.len() <= index {
                levels.push(Channels::new());
            }
            levels[index].push(AnyChannel { name: name.clone(), sample_data, quantize_linearly, sampling });
        }
    }
    levels
}

fn sorted(mut channels: Channels) -> Channels {
    channels.sort_by_cached_key(|channel| channel_order(&channel.name.to_string()));
    channels
}

/// The place of a part among all headers, and how many parts there are to choose from.
fn chosen_header(path: &Path, meta: &MetaData, part: SubImage<'_>) -> Result<(usize, usize), ImageError> {
    let flat: Vec<usize> = (0..meta.headers.len()).filter(|&i| !meta.headers[i].deep).collect();
    let text = |i: &usize| meta.headers[*i].own_attributes.layer_name.as_ref().map(ToString::to_string);
    let names: Vec<Option<String>> = flat.iter().map(text).collect();
    let place = part.among(names.iter().map(Option::as_deref));
    let header = place.and_then(|place| flat.get(place)).ok_or_else(|| part.absent(path, flat.len()))?;
    Ok((*header, flat.len()))
}

/// Lets the decoder read one part only, where it would take the first that it can.
struct OnePart<C> {
    channels: C,
    wanted: usize,
    /// How many headers were offered so far; they come in the order of the file.
    seen: Cell<usize>,
}

impl<'s, C: ReadChannels<'s>> ReadChannels<'s> for OnePart<C> {
    type Reader = C::Reader;

    fn create_channels_reader(&'s self, header: &Header) -> exr::error::Result<Self::Reader> {
        let index = self.seen.replace(self.seen.get() + 1);
        if index == self.wanted {
            self.channels.create_channels_reader(header)
        } else {
            Err(Error::NotSupported("another part was asked for".into()))
        }
    }
}

fn interleaved(
    path: &Path,
    width: usize,
    height: usize,
    channels: &[AnyChannel<FlatSamples>],
) -> Result<ImageData, ImageError> {
    let n_channels = channels.len();
    let mut samples = vec![0.0; width * height * n_channels];
    for (i, channel) in channels.iter().enumerate() {
        if channel.sample_data.len() != width * height {
            return Err(ImageError::format(path, "EXR with a channel that is not of the image's size"));
        }
        let slots = samples.iter_mut().skip(i).step_by(n_channels);
        for (slot, value) in slots.zip(channel.sample_data.values_as_f32()) {
            *slot = value;
        }
    }
    let stored = match channels.first().map(|c| &c.sample_data) {
        Some(FlatSamples::F16(_)) => StoredType::Half,
        Some(FlatSamples::U32(_)) => StoredType::U32,
        _ => StoredType::Float,
    };
    let channels = channels.iter().map(|c| c.name.to_string()).collect();
    Ok(ImageData {
        width,
        height,
        channels,
        stored,
        wraps: Default::default(),
        n_parts: 1,
        header: Default::default(),
        samples,
    })
}

/// A key that puts bare names before those of layers, and within a layer R, G, B, A before the rest.
fn channel_order(name: &str) -> (String, usize, String) {
    let (layer, base) = name.rsplit_once('.').unwrap_or(("", name));
    let rank = ["R", "G", "B", "A"].iter().position(|known| *known == base).unwrap_or(4);
    (layer.to_owned(), rank, base.to_owned())
}
