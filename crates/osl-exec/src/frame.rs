//! The result of a run: planes, closures, messages.

mod spare;
mod words;

use crate::closures::Closures;
use crate::message::{Event, Printed, Said, Severity, unite};
use crate::profile::ProfileEntry;
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use osl_limits::Running;
use std::borrow::Cow;
use std::sync::Arc;
pub use words::Words;

/// One component of an output over all points.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Name of the output, `a[2]` for an element of an array.
    pub output: Arc<str>,
    /// Type of the output (of one element).
    pub ty: Type,
    /// Which component: 0 for scalars, 0 to 2 for triples, 0 to 15 for matrices.
    pub component: usize,
    /// The kind of the words.
    pub kind: Kind,
    /// A word for each point, in order; floats in single precision.
    pub words: Words,
    /// The values in double precision, point by point, if the run used it; empty otherwise.
    pub wide: Vec<f64>,
}

impl Plane {
    /// The values as floats; ints are converted.
    pub fn floats(&self) -> Vec<f32> {
        self.as_floats().into_owned()
    }

    /// The values as floats, in place if they are floats; ints are converted.
    pub fn as_floats(&self) -> Cow<'_, [f32]> {
        match self.kind {
            Kind::Int => self.words.iter().map(|word| *word as i32 as f32).collect(),
            _ => Cow::Borrowed(self.words.as_floats()),
        }
    }

    /// The values as the words of floats; ints are converted in their place.
    pub fn into_float_words(mut self) -> Words {
        if self.kind == Kind::Int {
            self.words.iter_mut().for_each(|word| *word = (*word as i32 as f32).to_bits());
        }
        self.words
    }

    /// The values as doubles, as accurate as they are stored; ints are converted.
    pub fn doubles(&self) -> Vec<f64> {
        if !self.wide.is_empty() {
            return self.wide.clone();
        }
        let convert =
            |w: &u32| if self.kind == Kind::Int { f64::from(*w as i32) } else { f32::from_bits(*w).into() };
        self.words.iter().map(convert).collect()
    }
}

/// The result of a run.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// The planes, output by output.
    pub planes: Vec<Plane>,
    /// The messages of the run, each once.
    pub messages: Vec<Said>,
    /// The printed text of the shader, point by point.
    pub printed: Vec<Printed>,
    /// The text and messages of points in their order, if every occurrence is kept: then `messages` and
    /// `printed` are empty.
    pub events: Vec<Event>,
    /// The closures, if requested.
    pub closures: Vec<Closures>,
    /// The time of each instruction, if requested: the sum over all threads.
    pub profile: Vec<ProfileEntry>,
}

impl Frame {
    /// Appends the results of the points after its own: the next piece of a [`Run`](crate::Run). `limits`
    /// bound the messages.
    pub fn add(&mut self, next: Frame, limits: &Running) {
        let Frame { planes, messages, printed, events, closures, profile } = next;
        unite(&mut self.messages, messages, limits);
        self.events.extend(events);
        self.printed.extend(printed);
        if self.planes.is_empty() {
            self.planes = planes;
        } else {
            for (all, more) in self.planes.iter_mut().zip(planes) {
                all.words.append(&more.words);
                all.wide.extend(more.wide);
            }
        }
        if self.closures.is_empty() {
            self.closures = closures;
        } else {
            self.closures.iter_mut().zip(closures).for_each(|(all, more)| all.append(more));
        }
        self.profile.iter_mut().zip(&profile).for_each(|(all, more)| all.add(more));
        if self.profile.is_empty() {
            self.profile = profile;
        }
    }

    /// Makes room for the results of so many points in all.
    pub fn reserve(&mut self, points: usize) {
        for plane in &mut self.planes {
            plane.words.reserve(points);
        }
    }

    /// The errors and warnings as text, each once, with a flag for errors; `place` names a source location.
    pub fn said(&self, place: impl Fn(osl_ir::Span) -> String) -> Vec<(bool, String)> {
        let mut seen = rustc_hash::FxHashSet::default();
        let all = self.messages.iter().map(|said| &said.message).filter(|m| m.severity != Severity::Note);
        let all = all.map(|message| (message.severity == Severity::Error, message.show(&place)));
        all.filter(|said| seen.insert(said.clone())).collect()
    }
}
