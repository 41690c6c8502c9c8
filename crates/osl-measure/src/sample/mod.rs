//! Images from samples: where the samples of a pixel lie and what they weigh; the same number for each pixel,
//! one for several pixels, as many as an error bound requires, or as many as fit into a time.
//!
//! A pixel shows the filtered image of the shader over its area. The shader's derivatives are those of the
//! pixel's footprint, regardless of the number of samples. The reference follows the same convention: its
//! derivatives are differentials of the pixel. Because all samples then have the same integrand, more samples
//! only come closer to the result, several rounds can be averaged, and an error estimate means the same in
//! each round. A renderer that divides the differentials by the root of the sample count gets sharper
//! textures, but a different image for each count.

mod adapt;
mod bounds;
mod error;
mod filter;
mod image;
pub mod likely;
mod max_error;
mod oracle;
mod pattern;
mod points;
mod rate;
mod round;
mod seen;
mod surface;
mod within;

pub use adapt::{Adaptive, adaptive};
pub use bounds::{Reach, outputs, reaches};
pub use filter::{Filter, FilterKind};
pub use image::{Cheaper, Image, PixelSamples, Shading, Tally};
pub use max_error::{MaxError, PROMISED, max_error, max_error_each};
pub(crate) use oracle::some_pixels;
pub use oracle::{Check, Oracle, Watch, check, oracle};
pub use pattern::{MAX_SAMPLES, Pattern};
pub use points::SamplePoints;
pub use rate::{Rate, at_rate};
pub use seen::{Enough, SeenImage, SeenWork, Sight};
pub use surface::{Line, PixelPosition, Positions, Surface};
pub use within::{Timed, within};
