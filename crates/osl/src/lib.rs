//! Compiles and runs Open Shading Language inside another program.
//!
//! A shader becomes pixels in four steps. A [`Shader`] is compiled from text. A [`Group`] connects shaders
//! and sets their parameters, and compiles to a [`Program`] specialised for these values. The program runs
//! over [`Points`], the positions at which the shader is evaluated, such as the pixels of an image. The
//! results are [`Outputs`]: one value for each point. If a shader asks the renderer for something, such as an
//! attribute or a named coordinate system, [`RendererServices`] answers.
//!
//! ```
//! use osl::{Group, Points, Shader};
//!
//! let noise = Shader::compile("scale.osl", "shader scale(float by = 1, output float o = 0) { o = by * u; }")?;
//! let paint = Shader::compile(
//!     "paint.osl",
//!     "shader paint(float x = 0, output color c = 0) { c = mix(color(1, 0, 0), color(0, 0, 1), x); }",
//! )?;
//! let program = Group::builder()
//!     .layer("scale", &noise)
//!     .param("by", 0.5)
//!     .layer("paint", &paint)
//!     .connect("scale.o", "paint.x")
//!     .compile(&["c"])?;
//!
//! let points = Points::new(3).u([0.0, 0.5, 1.0]);
//! let outputs = program.run(&points)?;
//! assert_eq!(
//!     outputs.triples("c"),
//!     Some(vec![[1.0, 0.0, 0.0], [0.75, 0.0, 0.25], [0.5, 0.0, 0.5]])
//! );
//! # Ok::<(), osl::Error>(())
//! ```
//!
//! All errors have one type, [`Error`], which shows the diagnostics with excerpts of the source:
//!
//! ```
//! let error = osl::Shader::compile("wrong.osl", "shader wrong() { float x = y; }").unwrap_err();
//! assert_eq!((error.diagnostics()[0].line, error.diagnostics()[0].column), (1, 28));
//! assert!(error.to_string().contains("y"));
//! ```
//!
//! [`Limits`] bound the cost of shaders, groups and textures; `docs/limits.md` lists them. To change the
//! defaults, pass other values to [`Shader::compile_within`], [`GroupBuilder::limits`] and
//! [`Renderer::within`].
//!
//! ```
//! let shader = osl::Shader::compile("a.osl", "shader a(output float o = 0) { while (1) o += u; }")?;
//! let mut limits = osl::Limits::default();
//! limits.running.point_steps = 1000;
//! let program = osl::Group::builder().limits(&limits).layer("a", &shader).compile(&["o"])?;
//! assert!(program.run(&osl::Points::new(1).u([0.5])).is_err());
//! # Ok::<(), osl::Error>(())
//! ```
//!
//! This crate must not know command lines, terminals, or files other than textures. Its interface contains no
//! type of the compiler's crates.

mod closure;
mod error;
mod group;
#[doc(hidden)]
pub mod pipeline;
mod points;
mod program;
mod services;
mod shader;
mod value;

pub use closure::{Argument, Closure};
pub use error::{Diagnostic, Error};
pub use group::{Group, GroupBuilder};
pub use osl_limits::{Halt, Limits};
pub use points::Points;
pub use program::{Message, Outputs, Program};
pub use services::{Renderer, RendererServices};
pub use shader::{Param, Shader};
pub use value::Value;
