//! Compiles and runs Open Shading Language inside another program: the one way in for all clients, such as a
//! renderer, an editor, a Python module or a web page.
//!
//! # From text to values
//!
//! A [`Shader`] is compiled from text. A [`Group`] connects shaders and sets their parameters, and compiles
//! to a [`Program`]. The program runs over [`Points`], the positions at which the shader is evaluated, such
//! as the pixels of an image. The results are [`Outputs`]: one value for each point.
//!
//! ```
//! use osl::{Group, Points, Shader};
//!
//! let scale = Shader::compile(
//!     "scale.osl",
//!     "shader scale(float by = 1, output float o = 0) { o = by * u; }",
//! )?;
//! let paint = Shader::compile(
//!     "paint.osl",
//!     "shader paint(float x = 0, output color c = 0) { c = mix(color(1, 0, 0), color(0, 0, 1), x); }",
//! )?;
//! let program = Group::new()
//!     .layer("scale", &scale)
//!     .param("by", 0.5)
//!     .layer("paint", &paint)
//!     .connect("scale.o", "paint.x")
//!     .compile(&["c"])?;
//!
//! let outputs = program.run(&Points::new(3).u(&[0.0, 0.5, 1.0]))?;
//! assert_eq!(
//!     outputs.triples("c"),
//!     Some(vec![[1.0, 0.0, 0.0], [0.75, 0.0, 0.25], [0.5, 0.0, 0.5]])
//! );
//! # Ok::<(), osl::Error>(())
//! ```
//!
//! # Where to find what
//!
//! | to | use |
//! | --- | --- |
//! | show mistakes while a user types, with fixes | [`Analysis`], [`Levels`], [`Diagnostic`] |
//! | show what a name means, and where it is used | [`Analysis::symbols`] |
//! | show conversions and overloads | [`Analysis::implied`], [`Symbols::signature_at`] |
//! | format a text | [`format()`] |
//! | show the parameters of a shader | [`Shader::params`]: types, defaults, metadata |
//! | give shaders headers from memory | [`Files`], [`MemoryFiles`], [`Shader::read`] |
//! | read serialized groups | [`Group::read`] |
//! | give shaders textures from memory | [`Files`], [`RendererServices::files`] |
//! | give points data of their own | [`Points::data`], or [`RendererServices::user_data`] |
//! | give attributes of whole batches | [`RendererServices::attributes`] |
//! | trace the rays of whole batches | [`RendererServices::trace_all`], [`RendererServices::messages`] |
//! | take values while they are computed | [`Program::run_tiles`] |
//! | choose outputs and arithmetic | [`CompileOptions`] with [`Group::compile_with`] |
//! | change parameters without compiling again | [`CompileOptions::live`], [`Program::set`] |
//! | choose threads, cancel, show progress | [`RunOptions`] with [`Program::run_with`] |
//! | answer what a shader asks the renderer | [`RendererServices`]: attributes, spaces, textures |
//! | interpret closures | [`Outputs::closures`] |
//! | bound the cost of foreign shaders | [`Limits`]; `docs/limits.md` lists them |
//! | explain diagnostics and built-in functions | [`lessons`], [`reference`](mod@reference) |
//! | look into the compiler | [`stages`], one function for each stage |
//!
//! # Errors
//!
//! All errors have one type, [`Error`]. Its text shows the diagnostics with excerpts of the source, and its
//! data has positions in the units that editors use.
//!
//! ```
//! let error = osl::Shader::compile("wrong.osl", "shader wrong() { float x = y; }").unwrap_err();
//! let first = &error.diagnostics()[0];
//! assert_eq!((first.name, first.line_column()), ("unknown-name", (1, 28)));
//! assert!(error.to_string().contains("y"));
//! ```
//!
//! # Limits
//!
//! [`Limits`] bound the cost of shaders, groups and textures. To change the defaults, pass other values to
//! [`ReadOptions::limits`], [`Group::limits`] and [`Renderer::within`].
//!
//! ```
//! let shader = osl::Shader::compile("a.osl", "shader a(output float o = 0) { while (1) o += u; }")?;
//! let mut limits = osl::Limits::default();
//! limits.running.point_steps = 1000;
//! let program = osl::Group::new().limits(&limits).layer("a", &shader).compile(&["o"])?;
//! let error = program.run(&osl::Points::new(1).u(&[0.5])).unwrap_err();
//! assert_eq!(error.kind(), osl::ErrorKind::Run);
//! # Ok::<(), osl::Error>(())
//! ```
//!
//! # Stability
//!
//! Types of the compiler's crates appear only in [`stages`], which changes with the compiler. The exceptions
//! are re-exported here by name, because they are plain data: [`Limits`], [`Halt`] and [`Cancel`],
//! [`Arithmetic`] and [`Isa`], [`SymbolKind`], [`lessons::Code`].
//!
//! # Web pages
//!
//! The crate also compiles for `wasm32`: give it all texts as strings, textures by
//! [`RendererServices::files`], and run with [`RunOptions::threads`] set to 1, since such a page has neither
//! files nor threads.
//!
//! This crate must not know command lines, terminals, or files other than textures.

mod analysis;
mod assign;
mod closure;
mod column;
mod diagnostic;
mod error;
mod files;
mod group;
mod implied;
pub mod lessons;
mod levels;
mod options;
mod order;
mod param;
mod points;
mod program;
pub mod reference;
mod services;
mod shader;
pub mod stages;
mod symbols;
mod value;

pub use analysis::{Analysis, format};
pub use closure::{Closure, ClosureKind, ClosureParam, Closures};
pub use column::Column;
pub use diagnostic::{Diagnostic, Edit, Fix, Label, Position, Range, Severity};
pub use error::{Error, ErrorKind};
pub use files::{Files, MemoryFiles, NoFiles};
pub use group::Group;
pub use implied::Implied;
pub use levels::{Levels, NoWarning, Verdict, check_warning};
pub use options::{CompileOptions, ReadOptions, RunOptions};
#[doc(inline)]
pub use osl_exec::{Arithmetic, Isa, Ray};
#[doc(inline)]
pub use osl_limits::{Cancel, Halt, Limits};
pub use osl_syntax::Version;
pub use param::{Base, Length, Metadata, Param, Struct, Type};
pub use points::Points;
pub use program::{Message, OutputColumn, Outputs, Program, Tile};
pub use services::{Renderer, RendererServices};
pub use shader::Shader;
pub use symbols::{Symbol, SymbolKind, Symbols};
pub use value::Value;
