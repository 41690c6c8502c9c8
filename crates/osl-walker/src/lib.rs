//! The meaning of Open Shading Language as a tree-walking interpreter: what a shader computes at one point.
//!
//! [`walk`] executes the resolved tree of a shader ([`osl_hir::hir`]) statement by statement, as the text
//! says, at one shading point. There is no lowering, no optimiser, no batch and no machine code. The crate
//! can thus be read from its first line to its last as a definition of the language; a program like this is
//! called a definitional interpreter (J. Reynolds, *Definitional interpreters for higher-order programming
//! languages*, 1972). It is small and slow.
//!
//! ```
//! use osl_hir::{hir::Global, resolve::resolve_parsed};
//! use osl_walker::{Value, walk};
//!
//! let text = "shader stripe(float width = 0.25, output float r = 0) {
//!     for (float x = width; x < u; x += 2 * width)
//!         if (u < x + width) r = 1;
//! }";
//! let options = osl_syntax::Options::default();
//! let parsed = osl_syntax::parse("stripe.osl", text, &osl_syntax::NoFiles, &options);
//! let program = resolve_parsed(&parsed, options.reports, &options.limits).program.map_err(|_| "errors")?;
//! let at = |u: f32| walk(&program, &|global| Value::Float(if global == Global::U { u } else { 0.0 }));
//! assert_eq!(at(0.2)?.outputs[0].1, Value::Float(0.0));
//! assert_eq!(at(0.3)?.outputs[0].1, Value::Float(1.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # In the order of reading
//!
//! **`value`**: numbers, triples, matrices, strings, and the trees that arrays and structs are. The rules for
//! converting one into another.
//!
//! **`state`**: what changes while a shader runs. Variables have locations, and locations have values; two
//! names of one location are aliases. An index outside its array is clamped and reported.
//!
//! **`expressions`**: the order of evaluation, side effects, and when a variable is read.
//!
//! **`operators`**: the arithmetic of `+`, `/`, `==`, `&&` and the others on values of each type.
//!
//! **`statements`**: declarations, branches, loops, and the four ways in which a statement completes.
//!
//! **`functions`**: how formals are bound to arguments: by reference, by value, or by value and result.
//!
//! **`shader`**: parameters with their defaults, the globals of a point, and [`walk`] itself.
//!
//! **`builtins`**, **`math`**, **`strings`**: the library, as one table of names and definitions.
//!
//! # What this crate does not define
//!
//! It starts from the resolved tree, so scopes, overloads and implicit conversions are those that osl-hir
//! chose. Where the language leaves a value undefined, a walk ends with [`Reason::Undefined`] instead of
//! choosing one. Closures, textures, coordinate systems, messages between shaders, derivatives and connected
//! layers are unknown to it: [`Reason::Unsupported`].
//!
//! # What it shares with the engine, and what not
//!
//! The tests of the project run thousands of generated programs here and in the engine, and demand the same
//! bits, the same printed text and the same messages (`tests/src/agree.rs`). Control flow, variables, calls,
//! conversions, operators and the functions in `math` are written here a second time, so that an error in
//! lowering, in a pass or in a loop over lanes shows as a difference. The two implementations share the
//! parser and the resolver, the elementary functions (sine, exponential and their kin), inverses and
//! determinants of osl-numeric, the noise of osl-noise, and from osl-ir the reading and printing of numbers
//! as text. An error in these shows only against values that were recorded from the reference implementation
//! (`tests/data`).
//!
//! This crate must not know lowering, passes, lanes or the engine.

mod value;

mod state;

mod expressions;
mod operators;

mod statements;

mod functions;

mod shader;

mod builtins;
mod math;
mod strings;

mod examples;

pub use builtins::knows;
pub use examples::printed;
pub use shader::{Outcome, walk};
pub use state::{Error, Reason};
pub use value::Value;
