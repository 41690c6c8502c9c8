//! Kernels: functions that need more than a lane's arithmetic: noise fields, strings, files, the scene, and
//! whatever has an effect.
//!
//! A kernel says here what a pass must know of it: its effects, the arrays that it touches, whether its result
//! differs between points even for equal arguments, and whether it has a form with tangents.

use super::{Kind, SlotId};
use crate::text::TextFn;
use crate::types::Base;
use osl_syntax::span::Span;
use std::sync::Arc;

/// A function that needs more than a lane's arithmetic.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// A noise field. Arguments: one float for each dimension up to 2; a triple for 3; a triple and a float
    /// for 4; then, if `periodic`, the periods in the same form; then, if `tangents`, the tangents of the coordinates
    /// along x, then along y. Results: float or triple, and its tangents along x and y if asked for.
    Noise {
        /// Which field.
        field: NoiseField,
        /// 1 to 4.
        dims: u8,
        /// Whether three components are wanted.
        triple: bool,
        /// Whether periods follow.
        periodic: bool,
        /// Whether tangents are given and wanted.
        tangents: bool,
    },
    /// `noise(name, …)`: the name, then as for `Noise`, the values of `options` before the tangents. Folding turns a
    /// known name into [`Kernel::Noise`], except for Gabor noise. An unknown name reports an error and gives 0.
    NamedNoise {
        /// 1 to 4.
        dims: u8,
        /// Whether three components are wanted.
        triple: bool,
        /// Whether periods follow.
        periodic: bool,
        /// The options whose values follow.
        options: Vec<GaborOption>,
        /// Whether tangents are given and wanted. Gabor noise is filtered by them.
        tangents: bool,
    },
    /// Matrix that takes points of the first named space to the second. An unknown name reports an error; common
    /// space stands for it.
    SpaceMatrix {
        /// Whether the matrix is the identity unless both are known.
        both: bool,
    },
    /// The same with two results: whether both are known, and the matrix.
    FindSpace,
    /// Color of the first named space in the second. An unknown name reports an error and leaves it as is.
    ColorBetween,
    /// A texture lookup. Arguments: file name, s, t, the values of `options` in order, then if `footprint` the change
    /// of s and t along x, then along y. Results: float or triple, the channel behind it, an error message; then, if
    /// `tangents`, how the first two change along x and y.
    Texture {
        /// Whether three channels are wanted.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether four floats tell the footprint: given by the shader, or added by the `derive` pass.
        footprint: bool,
        /// Whether the error message is wanted, which is then not reported.
        quiet: bool,
        /// Whether tangents are wanted.
        tangents: bool,
    },
    /// A lookup in a picture of all directions: file name, direction, the values of `options`, then if `footprint` the
    /// change of the direction along x and along y. Results as for [`Kernel::Texture`] without tangents.
    Environment {
        /// Whether three channels are wanted.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether two triples tell the footprint: given by the shader, or added by the `derive` pass.
        footprint: bool,
        /// Whether the error message is wanted.
        quiet: bool,
    },
    /// A lookup in a volume, of which none is read: file name and the values of `options`. Results as for
    /// [`Kernel::Texture`] without tangents.
    Volume {
        /// Whether three channels are wanted.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether the error message is wanted.
        quiet: bool,
    },
    /// A query of a texture's header: file name, name of the datum, and s and t if the name may stand for many files of
    /// which one is meant. Results: `count` values of the kind, then whether it was found.
    TextureInfo {
        /// Kind of the values.
        kind: Kind,
        /// How many are wanted.
        count: u8,
    },
    /// A function of strings without effect.
    Text(TextFn),
    /// Text of a format string and the values of `shapes` in order.
    Format(Vec<Shape>),
    /// Prints it. Effect: output.
    Print {
        /// Where to.
        sink: Sink,
        /// The arguments behind the format string.
        shapes: Vec<Shape>,
    },
    /// Splits a string at separators: string, separator, largest number of pieces. Result: number of pieces. Effect:
    /// writes the array.
    Split {
        /// The pieces.
        pieces: SlotId,
    },
    /// Whether a pattern is found in a string, or is the whole of it: string, pattern.
    Regex {
        /// Whether the whole string must match.
        whole: bool,
        /// Begin and end of each group. Effect: writes the array.
        places: Option<SlotId>,
    },
    /// The hash of one to four words, those of floats by their bits.
    Hash,
    /// A named datum of the renderer or of the point: object name, name and element (−1 for the whole). Results: its
    /// `count` values, then whether it was found with exactly this type; then the tangents of the first if asked for.
    Attribute {
        /// Kind of the values.
        kind: Kind,
        /// How many are wanted; 0 for a single one that is no array.
        count: u8,
        /// Whether tangents are wanted.
        tangents: bool,
    },
    /// Whether a ray hits something: its origin and direction.
    Trace,
    /// What is known of the last ray, or of another source of messages: its name and that of the datum. Results: `count`
    /// values of the type, whether they were given, and whether there was an answer.
    SourceMessage {
        /// Type of the values.
        base: Base,
        /// How they are stored.
        kind: Kind,
        /// How many are wanted; 0 for a single one that is no array.
        count: u8,
    },
    /// Whether the run shades rays of a name.
    RayType,
    /// The first node that a path finds in an XML text, or below a node: text or node, path. Result: the node, 0 for
    /// none, −1 for what cannot be read, which is reported.
    DictFind,
    /// The node that the same path found behind a node.
    DictNext,
    /// An attribute of a node: node and name, empty for its text. Results: `count` values of the kind, then whether it
    /// has that many of the kind.
    DictValue {
        /// Kind of the values.
        kind: Kind,
        /// How many are wanted; 0 for a single one that is no array.
        count: u8,
    },
    /// Whether folding knew the value: 1 there, 0 when running.
    IsConstant,
    /// Where a spline reaches a value: basis, value, number of knots.
    SplineInverse {
        /// The knots.
        knots: SlotId,
        /// Whether the value's tangents follow, and the result's are wanted.
        tangents: bool,
    },
    /// A closure component: the values of `shapes`, which are the parameters in order and then keyword arguments.
    Component {
        /// Name of the closure.
        name: Arc<str>,
        /// Its arguments; keyword arguments have their names in [`Shape::key`].
        shapes: Vec<Shape>,
    },
    /// Sum of two closures.
    ClosureSum,
    /// A closure times a color.
    ClosureScale,
    /// Leaves a message whose name is known when running: the name; and the value, unless it is an array. Effect: the
    /// messages of the point; output where it already has one of the name.
    SetMessage(MessageForm),
    /// Asks for a message whose name is known when running: the name. Results: whether there is one of the type; and its
    /// value, unless it is an array. Effects: writes the array where there is one; notes what was asked for in vain;
    /// output where there is one of another type.
    GetMessage(MessageForm),
    /// Reports an error of the program. Effect: output.
    Report {
        /// The text, with `{0}`, `{1}` for the places.
        text: Arc<str>,
        /// Places that it names.
        places: Vec<Span>,
    },
    /// Reports an index that is outside of `0..length`: index, length. Effect: output.
    CheckIndex {
        /// The array, as messages name it.
        name: Arc<str>,
    },
    /// Reports a value that is infinite or no number: the value. Effect: output. Only lowering with checks writes it.
    CheckFinite {
        /// The variable that gets the value.
        name: Arc<str>,
        /// The operation that made it.
        op: Arc<str>,
    },
    /// Reports a variable without a value that is read: the value. Result: the value, zero where it had none. Effect: output.
    /// Only lowering with checks writes it.
    CheckSet {
        /// Type and name of the variable.
        what: Arc<str>,
        /// Who reads it.
        reader: Arc<str>,
    },
    /// Says what the source does here, to who follows a point; a run skips it. Only lowering with notes writes it.
    /// Counts as an effect, so that it stays where it is.
    Note(Note),
}

/// The string of a variable without a value, where reads of such are checked.
pub const UNSET_TEXT: &str = "!!!uninitialized!!!";

/// What the source does at a place.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Note {
    /// A variable gets a value: the value, and before it the index where it is an element of an array.
    Set(Arc<str>),
    /// A function was called: its arguments, and then its result if it has one.
    Call {
        /// The form that was chosen, as the language would declare it.
        form: Arc<str>,
        /// Why this one.
        why: Arc<str>,
        /// How many arguments there are.
        args: u8,
    },
    /// An `if` asks: the condition.
    Branch,
    /// A round of a loop begins.
    Round,
}

/// The value of a message.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct MessageForm {
    /// Its type in words: what has to be the same where it is set and where it is asked for.
    pub ty: Arc<str>,
    /// Where it lies, or goes, if it is an array.
    pub array: Option<SlotId>,
    /// Where the call stands.
    pub place: Span,
}

/// What an argument of `printf` and the like is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Shape {
    /// Kind of its values.
    pub kind: Kind,
    /// How many there are: 1, or the length of an array.
    pub count: u32,
    /// The name of a keyword argument of a closure.
    pub key: Option<Arc<str>>,
}

/// Where printed text goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sink {
    /// Standard output.
    Print,
    /// A file, whose name is the first argument, before the format.
    File,
    /// Errors of the shader.
    Error,
    /// Warnings of the shader.
    Warning,
}

impl Kernel {
    /// Whether it does more than yield results.
    pub fn has_effect(&self) -> bool {
        matches!(
            self,
            Kernel::Print { .. }
                | Kernel::Report { .. }
                | Kernel::CheckIndex { .. }
                | Kernel::CheckFinite { .. }
                | Kernel::CheckSet { .. }
                | Kernel::SetMessage(_)
                | Kernel::GetMessage(_)
                | Kernel::Note(_)
        )
    }

    /// The array that it writes.
    pub fn writes(&self) -> Option<SlotId> {
        match self {
            Kernel::Split { pieces } => Some(*pieces),
            Kernel::Regex { places, .. } => *places,
            Kernel::GetMessage(form) => form.array,
            _ => None,
        }
    }

    /// The array that it reads.
    pub fn reads(&self) -> Option<SlotId> {
        match self {
            Kernel::SplineInverse { knots, .. } => Some(*knots),
            Kernel::SetMessage(form) => form.array,
            _ => None,
        }
    }

    /// Whether equal arguments may give different results at different points.
    pub fn is_varying(&self) -> bool {
        matches!(
            self,
            Kernel::Attribute { .. } | Kernel::GetMessage(_) | Kernel::Trace | Kernel::SourceMessage { .. }
        )
    }

    /// Whether the result changes smoothly with the arguments.
    pub fn is_smooth(&self) -> bool {
        match self {
            Kernel::Noise { field, .. } => !matches!(field, NoiseField::Cell | NoiseField::Hash),
            Kernel::NamedNoise { .. } | Kernel::SplineInverse { .. } => true,
            Kernel::Attribute { kind, count, .. } => *kind == Kind::Float && *count == 0,
            _ => false,
        }
    }

    /// Whether tangents of its arguments change its value, so that it always asks for them.
    pub fn is_filtered(&self) -> bool {
        matches!(self, Kernel::NamedNoise { .. })
    }

    /// The form that takes and yields tangents.
    #[must_use]
    pub fn with_tangents(mut self) -> Kernel {
        if let Kernel::Noise { tangents, .. }
        | Kernel::NamedNoise { tangents, .. }
        | Kernel::Texture { tangents, .. }
        | Kernel::SplineInverse { tangents, .. }
        | Kernel::Attribute { tangents, .. } = &mut self
        {
            *tangents = true;
        }
        self
    }

    /// Whether it is the form with tangents.
    pub fn tangents(&self) -> bool {
        matches!(
            self,
            Kernel::Noise { tangents: true, .. }
                | Kernel::NamedNoise { tangents: true, .. }
                | Kernel::Texture { tangents: true, .. }
                | Kernel::SplineInverse { tangents: true, .. }
                | Kernel::Attribute { tangents: true, .. }
        )
    }

    /// Which arguments tell, by their tangents, what a lookup sees; none if it has been told.
    pub fn unseen(&self) -> Option<std::ops::Range<usize>> {
        match self {
            Kernel::Texture { footprint: false, .. } => Some(1..3),
            Kernel::Environment { footprint: false, .. } => Some(1..2),
            _ => None,
        }
    }

    /// The form of a lookup that has been told what it sees.
    #[must_use]
    pub fn with_footprint(mut self) -> Kernel {
        if let Kernel::Texture { footprint, .. } | Kernel::Environment { footprint, .. } = &mut self {
            *footprint = true;
        }
        self
    }

    /// Which arguments have tangents that it takes.
    pub fn coordinates(&self) -> std::ops::Range<usize> {
        let words = |dims: u8| if dims == 3 { 1 } else { usize::from(dims).min(2) };
        match self {
            Kernel::Noise { dims, .. } => 0..words(*dims),
            Kernel::NamedNoise { dims, .. } => 1..1 + words(*dims),
            Kernel::SplineInverse { .. } => 1..2,
            _ => 0..0,
        }
    }
}

/// Options of a texture lookup.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each variant is the option of its name; S and T are directions")]
pub enum TextureOption {
    Blur,
    SBlur,
    TBlur,
    Width,
    SWidth,
    TWidth,
    Wrap,
    SWrap,
    TWrap,
    FirstChannel,
    Fill,
    Interp,
    MissingColor,
    MissingAlpha,
    SubImage,
    SubImageName,
}

/// Options of Gabor noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each variant is the option of its name")]
pub enum GaborOption {
    Anisotropic,
    Direction,
    Bandwidth,
    Impulses,
    DoFilter,
}

impl GaborOption {
    /// The option of a name, and the kind of its value.
    pub fn from_name(name: &str) -> Option<(GaborOption, Kind)> {
        Some(match name {
            "anisotropic" => (GaborOption::Anisotropic, Kind::Int),
            "direction" => (GaborOption::Direction, Kind::Triple),
            "bandwidth" => (GaborOption::Bandwidth, Kind::Float),
            "impulses" => (GaborOption::Impulses, Kind::Float),
            "do_filter" => (GaborOption::DoFilter, Kind::Int),
            _ => return None,
        })
    }
}

/// The noise fields that a name can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NoiseField {
    /// Constant within each unit cell, 0 to 1.
    Cell,
    /// A different value at each point, 0 to 1.
    Hash,
    /// Gradient noise, −1 to 1.
    Perlin,
    /// Gradient noise, 0 to 1.
    UPerlin,
    /// Simplex noise, −1 to 1.
    Simplex,
    /// Simplex noise, 0 to 1.
    USimplex,
}

impl NoiseField {
    /// The field of a noise name of the language, or `None`. Simplex noise has no periodic form.
    pub fn from_name(name: &str, periodic: bool) -> Option<NoiseField> {
        Some(match name {
            "cell" | "cellnoise" => NoiseField::Cell,
            "hash" | "hashnoise" => NoiseField::Hash,
            "perlin" | "snoise" | "psnoise" => NoiseField::Perlin,
            "uperlin" | "noise" | "pnoise" => NoiseField::UPerlin,
            "simplex" | "simplexnoise" if !periodic => NoiseField::Simplex,
            "usimplex" | "usimplexnoise" if !periodic => NoiseField::USimplex,
            _ => return None,
        })
    }
}
