//! Kernels: functions that need more than the arithmetic of one lane, such as noise fields, strings, files,
//! the scene, and everything with an effect.
//!
//! This module states the facts about a kernel that passes need: its effects, the arrays that it reads and
//! writes, whether its result differs between points even for equal arguments, and whether it has a form with
//! derivatives.

use super::TextFn;
use super::{Kind, SlotId};
use crate::types::Base;
use osl_syntax::span::Span;
use std::sync::Arc;

/// A function that needs more than the arithmetic of one lane.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// A noise field. Arguments: one float for each dimension up to 2; a triple for 3; a triple and a float
    /// for 4; then, if `periodic`, the periods in the same form; then, if `has_derivs`, the derivatives of
    /// the coordinates along x, then along y. Results: float or triple, then its derivatives along x and y if
    /// requested and needed.
    Noise {
        /// Which field.
        field: NoiseField,
        /// 1 to 4.
        dims: u8,
        /// Whether the result has three components.
        triple: bool,
        /// Whether periods follow.
        periodic: bool,
        /// Whether derivatives are given and computed.
        has_derivs: bool,
    },
    /// `noise(name, …)`: the name, then as for `Noise`, with the values of `options` before the derivatives.
    /// Folding turns a constant name into [`Kernel::Noise`], except for Gabor noise. An unknown name reports
    /// an error and gives 0.
    NamedNoise {
        /// 1 to 4.
        dims: u8,
        /// Whether the result has three components.
        triple: bool,
        /// Whether periods follow.
        periodic: bool,
        /// The options whose values follow.
        options: Vec<GaborOption>,
        /// Whether derivatives are given and computed. Gabor noise is filtered by them.
        has_derivs: bool,
    },
    /// The matrix from the first named space to the second. An unknown name reports an error and counts as
    /// common space.
    SpaceMatrix {
        /// Whether the matrix is the identity unless both spaces are known.
        both: bool,
    },
    /// The same with two results: whether both are known, and the matrix.
    FindSpace,
    /// Converts a color from the first named space to the second. An unknown name reports an error and leaves
    /// the color unchanged. The pass `primaries` adds the number of the system of RGB primaries as an int;
    /// the spaces of color management are then unknown.
    ColorBetween,
    /// A texture lookup. Arguments: file name, s, t, the values of `options` in order, then, if `footprint`,
    /// the derivatives of s and t along x, then along y. Results: float or triple, the channel after it, an
    /// error message; then, if `has_derivs`, the derivatives of the first two along x and y.
    Texture {
        /// Whether three channels are requested.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether four floats give the footprint: from the shader, or added by the `derive` pass.
        footprint: bool,
        /// Whether the error message is an output, in which case the error is not reported.
        quiet: bool,
        /// Whether derivatives are computed.
        has_derivs: bool,
    },
    /// A lookup in an environment map: file name, direction, the values of `options`, then, if `footprint`,
    /// the derivatives of the direction along x and along y. Results as for [`Kernel::Texture`] without
    /// derivatives.
    Environment {
        /// Whether three channels are requested.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether two triples give the footprint: from the shader, or added by the `derive` pass.
        footprint: bool,
        /// Whether the error message is an output.
        quiet: bool,
    },
    /// A lookup in a volume, which always fails, since no volume format is supported: file name and the
    /// values of `options`. Results as for [`Kernel::Texture`] without derivatives.
    Volume {
        /// Whether three channels are requested.
        triple: bool,
        /// The options whose values follow.
        options: Vec<TextureOption>,
        /// Whether the error message is an output.
        quiet: bool,
    },
    /// A query of a texture's header: file name, name of the datum, and s and t to select a file if the name
    /// is tiled. Results: `count` values of the kind, then whether the datum was found.
    TextureInfo {
        /// Kind of the values.
        kind: Kind,
        /// Number of requested values.
        count: u8,
    },
    /// A function of strings without effect.
    Text(TextFn),
    /// Formats the values of `shapes` in order by a format string.
    Format(Vec<Shape>),
    /// Prints it. Effect: output.
    Print {
        /// The destination.
        sink: Sink,
        /// The arguments after the format string.
        shapes: Vec<Shape>,
    },
    /// Splits a string at separators: string, separator, largest number of pieces. Result: number of pieces.
    /// Effect: writes the array.
    Split {
        /// The pieces.
        pieces: SlotId,
    },
    /// Whether a pattern occurs in a string, or matches the whole string: string, pattern.
    Regex {
        /// Whether the whole string must match.
        whole: bool,
        /// Start and end of each group. Effect: writes the array.
        places: Option<SlotId>,
    },
    /// The hash of one to four words, those of floats by their bits.
    Hash,
    /// A named datum of the renderer or of the point: object name, name and element (−1 for the whole, or
    /// [`USER_DATA`]).
    /// Results: its `count` values, then whether it was found with exactly this type; then the derivatives of
    /// the first value if requested.
    Attribute {
        /// Kind of the values.
        kind: Kind,
        /// Number of requested values; 0 for a single value that is not an array.
        count: u8,
        /// Whether derivatives are computed.
        has_derivs: bool,
    },
    /// Whether a ray hits something: its origin and direction.
    Trace,
    /// A message from another source, such as the last ray: the names of the source and of the datum.
    /// Results: `count` values of the type, whether they were given, and whether there was an answer.
    SourceMessage {
        /// Type of the values.
        base: Base,
        /// How they are stored.
        kind: Kind,
        /// Number of requested values; 0 for a single value that is not an array.
        count: u8,
    },
    /// Whether the run shades rays of the named type.
    RayType,
    /// The first node that a path finds in an XML text, or below a node: text or node, path. Result: the
    /// node, 0 if there is none, −1 if the text cannot be read, which is reported.
    DictFind,
    /// The next node found by the same path.
    DictNext,
    /// An attribute of a node: node and name; an empty name means the node's text. Results: `count` values of
    /// the kind, then whether it has exactly so many of this kind.
    DictValue {
        /// Kind of the values.
        kind: Kind,
        /// Number of requested values; 0 for a single value that is not an array.
        count: u8,
    },
    /// Whether the value is a constant at folding: 1 then, 0 at run time.
    IsConstant,
    /// The position at which a spline reaches a value: basis, value, number of knots.
    SplineInverse {
        /// The knots.
        knots: SlotId,
        /// Whether the value's derivatives follow, and the result's are computed.
        has_derivs: bool,
    },
    /// A closure component: the values of `shapes`, which are the parameters in order and then keyword
    /// arguments.
    Component {
        /// Name of the closure.
        name: Arc<str>,
        /// Its arguments; keyword arguments have their names in [`Shape::key`].
        shapes: Vec<Shape>,
    },
    /// Sum of two closures.
    ClosureSum,
    /// A closure times a number or a color.
    ClosureScale,
    /// Sets a message with a name computed at run time: the name; and the value, unless it is an array.
    /// Effect: the messages of the point; output if the message exists already.
    SetMessage(MessageForm),
    /// Gets a message with a name computed at run time: the name. Results: whether there is a message of the
    /// type; and its value, unless it is an array. Effects: writes the array if there is a message; records a
    /// failed query; output if the message has another type.
    GetMessage(MessageForm),
    /// Reports an error of the program. Effect: output.
    Report {
        /// The text, with `{0}`, `{1}` for the locations.
        text: Arc<str>,
        /// Locations that the text refers to.
        places: Vec<Span>,
    },
    /// Reports an index outside `0..length`: index, length. Effect: output.
    CheckIndex {
        /// The name of the array for messages.
        name: Arc<str>,
    },
    /// Reports an infinite or NaN value: the value. Effect: output. Written only by lowering with checks.
    CheckFinite {
        /// The variable that gets the value.
        name: Arc<str>,
        /// The operation that computed it.
        op: Arc<str>,
    },
    /// Reports a read of an uninitialised variable: the value. Result: the value, or zero if it had none.
    /// Effect: output. Written only by lowering with checks.
    CheckSet {
        /// Type and name of the variable.
        what: Arc<str>,
        /// The reading operation.
        reader: Arc<str>,
    },
    /// Describes the source at this point for the follower of a point; a run skips it. Written only by
    /// lowering with notes. It counts as an effect, so that it stays in place.
    Note {
        /// The number of the note; copies that passes make of it keep the number.
        site: u32,
        /// The description.
        note: Note,
    },
}

/// The string of an uninitialised variable, if such reads are checked.
pub const UNSET_TEXT: &str = "!!!uninitialized!!!";

/// What the source does at a location.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Note {
    /// A statement begins.
    Reach,
    /// A variable is set: the value, preceded by the index if it is an element of an array, and followed by
    /// its changes to the next pixel along x and y if they are requested.
    Set(Arc<str>),
    /// A built-in was called: its arguments, and then its result if it has one.
    Call {
        /// The chosen overload, as the language would declare it.
        form: Arc<str>,
        /// Why it was chosen.
        why: Arc<str>,
        /// How many arguments there are.
        args: u8,
    },
    /// A condition is evaluated: its truth.
    Branch(Test),
    /// A loop is reached.
    Loop,
    /// A loop iteration begins.
    Round,
    /// A function with a body is entered: the values of its inputs.
    Enter {
        /// The function, as it was declared.
        form: Arc<str>,
        /// Why it was chosen.
        why: Arc<str>,
        /// The names of the values: see [`note_text`].
        names: Arc<str>,
    },
    /// The result of the innermost function that was entered, and the values of its outputs.
    Result {
        /// The names of the values; the name of the result is empty.
        names: Arc<str>,
    },
    /// The innermost function that was entered is left.
    Leave,
}

/// The names of values in one text, for a note: a comma follows each.
pub fn note_text(names: &[Arc<str>]) -> Arc<str> {
    names.iter().fold(String::new(), |text, name| text + name + ",").into()
}

/// The names in the text of a note.
pub fn note_names(text: &str) -> impl Iterator<Item = &str> {
    text.split_terminator(',')
}

/// What a condition decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Test {
    /// Which side of an `if` runs.
    If,
    /// Which side of `?:` is taken.
    Choice,
    /// An operand of `&&` or `||`.
    Operand,
}

impl Test {
    /// All conditions.
    pub const ALL: [Test; 3] = [Test::If, Test::Choice, Test::Operand];

    /// The word for it in the text of the IR.
    pub fn text(self) -> &'static str {
        match self {
            Test::If => "if",
            Test::Choice => "choice",
            Test::Operand => "operand",
        }
    }
}

/// The value of a message.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct MessageForm {
    /// Its type in words, which must be the same where it is set and where it is read.
    pub ty: Arc<str>,
    /// The array that holds it, or receives it, if it is an array.
    pub array: Option<SlotId>,
    /// The location of the call.
    pub place: Span,
}

/// In place of the element of an attribute: the whole of it, as the user data of a parameter, which has a
/// value without it.
pub const USER_DATA: i32 = -2;

/// The form of an argument of `printf` and the like.
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
    /// Whether it has effects besides its results.
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
                | Kernel::Note { .. }
        )
    }

    /// The forms of its arguments, after a file name if it prints to one.
    pub fn shapes(&self) -> Option<&[Shape]> {
        match self {
            Kernel::Format(shapes) | Kernel::Print { shapes, .. } | Kernel::Component { shapes, .. } => {
                Some(shapes)
            }
            _ => None,
        }
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

    /// Whether the derivatives of its arguments change its value, so that it always needs them.
    pub fn is_filtered(&self) -> bool {
        matches!(self, Kernel::NamedNoise { .. })
    }

    /// The form that takes and returns derivatives.
    #[must_use]
    pub fn with_derivs(mut self) -> Kernel {
        if let Kernel::Noise { has_derivs, .. }
        | Kernel::NamedNoise { has_derivs, .. }
        | Kernel::Texture { has_derivs, .. }
        | Kernel::SplineInverse { has_derivs, .. }
        | Kernel::Attribute { has_derivs, .. } = &mut self
        {
            *has_derivs = true;
        }
        self
    }

    /// Whether it is the form with derivatives.
    pub fn has_derivs(&self) -> bool {
        matches!(
            self,
            Kernel::Noise { has_derivs: true, .. }
                | Kernel::NamedNoise { has_derivs: true, .. }
                | Kernel::Texture { has_derivs: true, .. }
                | Kernel::SplineInverse { has_derivs: true, .. }
                | Kernel::Attribute { has_derivs: true, .. }
        )
    }

    /// The arguments whose derivatives determine the footprint of a lookup; `None` if the footprint is given.
    pub fn unseen(&self) -> Option<std::ops::Range<usize>> {
        match self {
            Kernel::Texture { footprint: false, .. } => Some(1..3),
            Kernel::Environment { footprint: false, .. } => Some(1..2),
            _ => None,
        }
    }

    /// The form of a lookup with a given footprint.
    #[must_use]
    pub fn with_footprint(mut self) -> Kernel {
        if let Kernel::Texture { footprint, .. } | Kernel::Environment { footprint, .. } = &mut self {
            *footprint = true;
        }
        self
    }

    /// The arguments whose derivatives it takes.
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
    /// The option with a name, and the kind of its value.
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

/// The noise fields that can be selected by name.
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
    /// The field for a noise name of the language, or `None`. Simplex noise has no periodic form.
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
