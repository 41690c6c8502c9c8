//! Images from samples: where a pixel's samples lie and what they weigh, fixed numbers of them, one for several pixels,
//! and as many as an error asks for.
//!
//! What a pixel is to show is the filtered image of the shader over it, with the shader's derivatives those of the pixel's
//! footprint however many samples there are. This is the reference's convention, where derivatives are differentials of
//! the pixel, and it is what makes samples comparable: all have one integrand, so that more of them can only come
//! closer, those of several rounds may be averaged, and an error estimate means the same in each. A renderer that
//! divides differentials by the root of the number of samples gets sharper textures, but another image for
//! each number.

mod adapt;
mod error;
mod filter;
mod image;
mod max_error;
mod oracle;
mod pattern;
mod points;
mod rate;
mod surface;

pub use adapt::{Adaptive, adaptive};
pub use filter::{Filter, FilterKind};
pub use image::{Cheaper, Image, Shading, Tally};
pub use max_error::{MaxError, max_error};
pub use oracle::{Check, Oracle, Watch, check, oracle};
pub use pattern::{MAX_SAMPLES, Pattern};
pub use points::SamplePoints;
pub use rate::{Rate, at_rate};
pub use surface::{Place, Surface};
