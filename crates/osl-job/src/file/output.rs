//! Writes a frame as image files: one EXR with a layer for each output, or one PNG, TIFF or JPEG for each
//! output.

use super::rows::Rows;
use super::software::{self, SOFTWARE};
use crate::Failure;
use crate::event::{Event, Sink};
use crate::report::closures;
use crate::report::ranges::{InOrder, Ranges, layer_kind};
use crate::request::values::STDOUT;
use crate::request::{Image, Trust};
use osl_exec::{Frame, Plane, Printed, RunError, Words};
use osl_files::{FileError, Roots, Unsaved, save_all};
use osl_image::{
    ExrOptions, ImageError, ImageFormat, Layer, LayerKind, ROWS_TOGETHER, SampleType, channel_bytes,
    exr_file, exr_in_memory, write_exr_rows,
};
use osl_ir::ir::{Body, Kind, Output};
use osl_ir::types::{Base, Type};
use osl_measure::range::{self, Values};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A picture that is complete, but not in its place.
#[derive(Default)]
pub struct Written {
    /// Its files, which are moved into place together.
    pub files: Vec<Unsaved>,
    /// What the picture does not show.
    pub notes: Vec<String>,
}

impl Written {
    /// Moves the files into place. Returns their paths, and the bytes of the only one if it is for the
    /// standard output.
    pub fn save(self, path: &Path, sink: &mut dyn Sink) -> Result<(Vec<PathBuf>, Vec<u8>), Failure> {
        self.notes.iter().for_each(|note| sink.note(note));
        if path.as_os_str() == STDOUT {
            return Ok((Vec::new(), self.files.into_iter().flat_map(Unsaved::into_bytes).collect()));
        }
        let paths = self.files.iter().map(|file| file.path().to_path_buf()).collect();
        save_all(self.files).map_err(Failure::new)?;
        Ok((paths, Vec::new()))
    }
}

/// Writes the frame to files that are not yet in their place. Strings and closures have no pixels and are
/// omitted. `covered` is 0 at pixels that show nothing; it becomes the alpha of the files.
pub fn write(frame: &Frame, covered: Option<&Plane>, path: &Path, image: &Image) -> Result<Written, Failure> {
    let mut planes: Vec<&Plane> =
        frame.planes.iter().filter(|p| !matches!(p.kind, Kind::Str | Kind::Closure)).collect();
    if planes.is_empty() {
        return Err(Failure::new(EMPTY));
    }
    let format = image.output.display.named(path)?;
    match ImageFormat::of(&format) {
        Some(ImageFormat::Exr) => {
            planes.extend(covered);
            exr(&planes, path, image)
        }
        _ => single(&planes, covered, path, image),
    }
}

/// The files that `fprintf` may append to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Appends {
    /// Those below the working directory, unless this is true: the option `--allow-files`.
    ByOption(bool),
    /// Those below the working directory; the command has no option for more.
    Below,
    /// All files.
    Anywhere,
    /// No files: their text is dropped.
    Nowhere,
}

impl Appends {
    /// The files to which a run may append.
    pub fn of(image: &Image) -> Appends {
        match image.trust {
            Trust::All => Appends::ByOption(image.shader.allow_files),
            Trust::Only(_) => Appends::Nowhere,
        }
    }
}

/// Prints the text of `printf`, and appends the text of `fprintf` to its files.
pub fn printed(list: &[Printed], appends: Appends, sink: &mut dyn Sink) -> Result<(), Failure> {
    let anywhere = matches!(appends, Appends::ByOption(true) | Appends::Anywhere);
    let lifts = if appends == Appends::ByOption(false) { "; --allow-files lifts this" } else { "" };
    let roots = Roots::new([""]).or_anywhere(anywhere);
    for printed in list {
        let Some(name) = &printed.file else {
            sink.event(Event::Printed(&printed.text));
            continue;
        };
        if appends == Appends::Nowhere {
            continue;
        }
        roots.append(Path::new(&**name), printed.text.as_bytes()).map_err(|error| {
            let why = match error {
                FileError::Outside => format!("it is not below the working directory{lifts}"),
                FileError::Hidden => format!("{error}{lifts}"),
                error => error.to_string(),
            };
            Failure::new(format!("cannot append to \"{}\": {why}", name.escape_debug()))
        })?;
    }
    Ok(())
}

/// The planes of one output, with their values as floats.
pub struct Group<'a> {
    /// The plane of its first component.
    pub first: &'a Plane,
    /// The values of each component.
    pub values: Vec<Cow<'a, [f32]>>,
}

/// Planes by output, in their order.
pub fn groups<'a>(planes: &[&'a Plane]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for plane in planes {
        match groups.last_mut() {
            Some(group) if plane.component > 0 => group.values.push(plane.as_floats()),
            _ => groups.push(Group { first: plane, values: vec![plane.as_floats()] }),
        }
    }
    groups
}

/// What is counted of the values of an image.
#[derive(Default)]
pub struct Tallied {
    /// The number of ints of each output that a float layer cannot hold exactly.
    rounded: BTreeMap<Arc<str>, u64>,
    /// The range of each plane, if somebody is told.
    pub ranges: Ranges,
    /// The closures, if somebody is told.
    pub closures: closures::Summary,
    /// Whether a value is not 0, except ints.
    pub shows: bool,
}

/// What is wanted of a run besides its image.
#[derive(Clone, Copy, Debug)]
pub struct RunRequest {
    /// The text of the closures.
    pub closures: bool,
    /// The range of each output.
    pub ranges: bool,
    /// The values, for more than a file and the ranges.
    pub values: bool,
}

impl Tallied {
    /// Adds the values of these planes.
    pub fn count(&mut self, planes: &[Plane], wanted: RunRequest, image: &Image) {
        if wanted.ranges {
            self.ranges.add(planes);
        }
        let mut numbers = planes.iter().filter(|plane| plane.kind != Kind::Int);
        self.shows = self.shows || numbers.any(|plane| plane.words.iter().any(|word| word << 1 != 0));
        let exr = streams(image);
        for plane in planes.iter().filter(|plane| exr && plane.kind == Kind::Int) {
            // The maximum number of significant bits, and the maximum value.
            let (digits, most) = if image.output.half { (11, 65504) } else { (24, u32::MAX) };
            let held = |word: &u32| {
                let size = (*word as i32).unsigned_abs();
                size == 0 || (size <= most && size.ilog2() + 1 - size.trailing_zeros() <= digits)
            };
            let n = plane.words.iter().filter(|word| !held(word)).count() as u64;
            if n > 0 {
                *self.rounded.entry(plane.output.clone()).or_default() += n;
            }
        }
    }

    /// Warns about rounded ints.
    pub fn warn(&self, image: &Image, sink: &mut dyn Sink) {
        let limit = if image.output.half { 2048 } else { 1 << 24 };
        for (output, n) in &self.rounded {
            sink.warn(&format!(
                "{n} ints of `{output}` are rounded in the image, whose floats hold all up to {limit}"
            ));
        }
    }
}

/// Names and kinds of the layers of an EXR file with these planes.
fn layers(planes: &[Plane]) -> Vec<(&str, LayerKind)> {
    planes
        .iter()
        .filter(|plane| plane.component == 0)
        .map(|plane| (&*plane.output, layer_kind(plane)))
        .collect()
}

fn exr_options(image: &Image) -> ExrOptions<'_> {
    let samples = if image.output.half { SampleType::Half } else { SampleType::Float };
    ExrOptions {
        samples,
        compression: image.output.compression,
        part: image.part(),
        software: Some(SOFTWARE),
        command: image.output.command.as_deref(),
    }
}

fn exr(planes: &[&Plane], path: &Path, image: &Image) -> Result<Written, Failure> {
    let groups = groups(planes);
    let layers: Vec<Layer<'_>> = groups
        .iter()
        .map(|group| Layer {
            name: &group.first.output,
            kind: layer_kind(group.first),
            planes: group.values.iter().map(AsRef::as_ref).collect(),
        })
        .collect();
    let (width, height) = image.size();
    let file = match path.as_os_str() == STDOUT {
        true => exr_in_memory(width, height, &layers, exr_options(image)),
        false => exr_file(path, width, height, &layers, exr_options(image)),
    };
    Ok(Written { files: vec![file.map_err(Failure::new)?], notes: Vec::new() })
}

/// Size in words of the pieces of a frame that is written while the next piece is computed.
const PIECE_WORDS: usize = 1 << 23;

/// The reason why a frame was not written.
pub enum Broken {
    /// The file.
    Image(ImageError),
    /// The run.
    Run(RunError),
    /// There are no pixels to write.
    Empty,
}

/// The message for a frame without planes.
pub const EMPTY: &str = "the shader has no output that an image can hold";

/// The message for an image of closure weights, written because the shader has no other output.
pub const CLOSURES_ALONE: &str = "the shader yields closures alone: the layers are their weights, `--closures` also \
    shows their parameters, and `oslrun render` makes a picture of a scene";

/// The message for such an image without any weights.
pub const CLOSURES_NULL: &str = "the shader yields closures alone, and they are null at every point: the layers \
    are black";

/// Whether all outputs of a body that could be shown are closures.
pub fn only_closures(body: &Body) -> bool {
    let mut outputs = body.outputs.iter().filter(|output| output.ty.element() != Type::STRING).peekable();
    outputs.peek().is_some() && outputs.all(|output| output.ty.element().base == Base::Closure)
}

/// Removes closures from the outputs of a body if they are not shown, so that they are not computed. They
/// stay if no other output was requested.
pub fn drop_closures(body: &mut Body, asked: Option<&[Arc<str>]>) {
    let is_asked = |name: &str| {
        asked.is_none_or(|list| list.iter().any(|asked| name.split('.').next() == asked.split('.').next()))
    };
    let is_closure = |output: &Output| output.ty.base == Base::Closure;
    if body
        .outputs
        .iter()
        .any(|output| !is_closure(output) && output.ty.element() != Type::STRING && is_asked(&output.name))
    {
        body.outputs.retain(|output| !is_closure(output));
    }
}

/// Whether one of these outputs is a closure.
pub fn has_closure(body: &Body, names: &[Arc<str>]) -> bool {
    body.outputs.iter().any(|output| output.ty.base == Base::Closure && names.contains(&output.name))
}

impl From<ImageError> for Broken {
    fn from(error: ImageError) -> Broken {
        Broken::Image(error)
    }
}

/// Whether a frame is written to its file piece by piece.
pub fn streams(image: &Image) -> bool {
    image.output.path.as_deref().and_then(ImageFormat::of) == Some(ImageFormat::Exr)
}

/// The number of rows that are computed at a time; the fewest if closures are kept with them.
fn together(source: &dyn Rows, width: usize, planes: usize, closures: bool) -> usize {
    if closures {
        return ROWS_TOGETHER;
    }
    let words = (width * planes * source.weight()).max(1);
    (PIECE_WORDS / words).next_multiple_of(ROWS_TOGETHER).max(ROWS_TOGETHER)
}

/// Computes a whole image. Its closures are only tallied.
pub fn whole(
    source: &mut dyn Rows,
    wanted: RunRequest,
    image: &Image,
    tallied: &mut Tallied,
) -> Result<Frame, Broken> {
    let ((width, height), limits) = (image.size(), image.limits());
    let planes = source.planes().map_err(Broken::Run)?.len();
    source.fits(width * height).map_err(Broken::Run)?;
    let step = match source.is_plain() && !wanted.closures {
        true => height.max(1),
        false => together(source, width, planes, wanted.closures),
    };
    let mut frame = Frame::default();
    for row in (0..height).step_by(step) {
        let mut piece = source.rows(row..height.min(row + step)).map_err(Broken::Run)?;
        tallied.closures.add(&std::mem::take(&mut piece.closures));
        frame.add(piece, &limits.running);
        if row == 0 && step < height {
            frame.reserve(width * height);
        }
    }
    Ok(frame)
}

/// Computes an image whose values are not wanted, only their ranges. `None` if this needs memory for the
/// whole image.
pub fn only_ranges(
    source: &mut dyn Rows,
    wanted: RunRequest,
    image: &Image,
) -> Result<Option<(Frame, Tallied)>, Broken> {
    let kinds: Vec<bool> =
        source.planes().map_err(Broken::Run)?.iter().map(|plane| plane.kind == Kind::Int).collect();
    let joined = Mutex::new(InOrder::default());
    let look = |tile: usize, planes: &[&[u32]]| {
        if wanted.ranges {
            let values = planes.iter().zip(&kinds).map(|(words, ints)| Values { words, ints: *ints });
            let found: Vec<range::Range> = values.map(range::Range::of).collect();
            joined.lock().unwrap_or_else(PoisonError::into_inner).add(tile, found);
        }
    };
    let Some(frame) = source.look(0..image.size().1, &look) else { return Ok(None) };
    let frame = frame.map_err(Broken::Run)?;
    let mut tallied = Tallied::default();
    if wanted.ranges {
        tallied.ranges.join(&frame.planes, joined.into_inner().unwrap_or_else(PoisonError::into_inner));
    }
    Ok(Some((frame, tallied)))
}

/// Computes an image and writes it to an EXR file piece by piece, so that memory does not grow with its size.
/// Returns the frame without its planes, the time of the computation alone, and the file.
pub fn stream(
    source: &mut (dyn Rows + Send),
    path: &Path,
    wanted: RunRequest,
    image: &Image,
) -> Result<(Frame, Duration, Unsaved, Tallied), Broken> {
    let (width, height) = image.size();
    let planes = source.planes().map_err(Broken::Run)?;
    if planes.is_empty() {
        return Err(Broken::Empty);
    }
    let rows = together(source, width, planes.len(), wanted.closures);
    let (mut frame, mut time, mut row) = (Frame::default(), Duration::ZERO, 0);
    let mut tallied = Tallied::default();
    let file = write_exr_rows(path, (width, height), &layers(&planes), exr_options(image), || {
        if row >= height {
            return Ok::<_, Broken>(None);
        }
        let started = Instant::now();
        let here = row..height.min(row + rows);
        row += rows;
        let piece = source.rows(here).map_err(Broken::Run)?;
        tallied.count(&piece.planes, wanted, image);
        tallied.closures.add(&piece.closures);
        let Frame { planes, .. } = piece;
        frame.add(Frame { planes: Vec::new(), closures: Vec::new(), ..piece }, &image.limits().running);
        let values: Vec<Words> = planes.into_iter().map(Plane::into_float_words).collect();
        time += started.elapsed();
        Ok(Some(values))
    })?;
    Ok((frame, time, file, tallied))
}

/// A file for each output with one or three components: PNG, TIFF or JPEG. A JPEG has no alpha.
fn single(
    planes: &[&Plane],
    covered: Option<&Plane>,
    path: &Path,
    image: &Image,
) -> Result<Written, Failure> {
    let mut groups = groups(planes);
    groups.retain(|group| matches!(group.values.len(), 1 | 3));
    if groups.is_empty() {
        return Err(Failure::new(EMPTY));
    }
    let named = image.output.display.named(path)?;
    let format = ImageFormat::of(&named);
    let names: Vec<&str> = groups.iter().map(|group| &*group.first.output).collect();
    if path.as_os_str() == STDOUT && names.len() > 1 {
        return Err(Failure::new(format!(
            "such a picture holds one output, and there are {}: --outputs NAME chooses, `--format exr` holds all",
            names.join(", ")
        )));
    }
    let covered = covered.map(Plane::as_floats);
    let mut set = ImageSet::new(path, groups.len() > 1);
    let mut notes = Vec::new();
    for group in groups {
        let (name, ty) = (&*group.first.output, group.first.ty);
        let shown = image.output.display.shown(format, (name, ty), group.values, covered.as_deref());
        let mut planes: Vec<&[f32]> = shown.planes.iter().map(AsRef::as_ref).collect();
        if format != Some(ImageFormat::Jpeg) {
            planes.extend(covered.as_deref());
        }
        let bytes = channel_bytes(&named, image.size(), &planes, software::named(shown.transfer))
            .map_err(Failure::new)?;
        set.add(name, &bytes)?;
        notes.extend(shown.note);
    }
    Ok(Written { files: set.files, notes })
}

/// The part of a file's name that stands for the output.
pub const OUTPUT: &str = "{output}";

/// Whether the picture of a path is there: the file itself, or a file of one of its outputs. The files of one
/// picture are moved into place together.
pub fn is_there(path: &Path) -> bool {
    let folder = path.parent().unwrap_or(Path::new(""));
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let stem = |ending: &str| name.strip_suffix(ending).map(|stem| (format!("{stem}."), ending.to_string()));
    let parts = match name.split_once(OUTPUT) {
        Some((before, after)) => Some((before.to_string(), after.to_string())),
        None => path.extension().and_then(|ending| stem(&format!(".{}", ending.to_str()?))),
    };
    path.is_file() || parts.is_some_and(|(before, after)| osl_files::has_file(folder, &before, &after))
}

/// Files, one for each output.
pub struct ImageSet<'a> {
    path: &'a Path,
    several: bool,
    /// The files, under temporary names.
    pub files: Vec<Unsaved>,
}

impl ImageSet<'_> {
    /// An empty set. With `several`, each file has the name of its output: `out.png` for the output `mask` is
    /// `out.mask.png`. `{output}` in the file's name stands for the output, also if there is only one.
    pub fn new(path: &Path, several: bool) -> ImageSet<'_> {
        ImageSet { path, several, files: Vec::new() }
    }

    /// Writes the file of an output under a temporary name in its folder.
    pub fn add(&mut self, output: &str, bytes: &[u8]) -> Result<(), Failure> {
        let file = self.path.file_name().unwrap_or_default();
        // The user chose the folder, and the shader a part of the file name.
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let unsaved = match file.to_str().filter(|name| name.contains(OUTPUT)) {
            _ if self.path.as_os_str() == STDOUT => Ok(Unsaved::in_memory()),
            Some(name) => Unsaved::derived(folder, name.replace(OUTPUT, output)),
            None if self.several => {
                let mut name = self.path.file_stem().unwrap_or_default().to_owned();
                name.push(format!(".{output}."));
                name.push(self.path.extension().unwrap_or_default());
                Unsaved::derived(folder, name)
            }
            None => Unsaved::new(self.path),
        };
        let file = unsaved.and_then(|file| file.with(bytes)).map_err(Failure::new)?;
        self.files.push(file);
        Ok(())
    }
}
