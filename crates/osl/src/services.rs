//! The queries of a running shader to the program around it.

use crate::Value;
use osl_exec::{FindSpace, Services, Spaces};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The answers of an embedder. By default, nothing is known. Shaders run on all cores, so the functions are
/// called from any thread; the same query must have the same answer during a run.
pub trait RendererServices: Send + Sync {
    /// An attribute of an object at a point, or of no object if `object` is empty: `getattribute`. The value
    /// must have exactly the type that the shader requests; other values are ignored.
    fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
        let _ = (object, name, point);
        None
    }

    /// User data of a point: the values of interpolated parameters. They also take precedence over attributes
    /// of no object.
    fn user_data(&self, name: &str, point: usize) -> Option<Value> {
        let _ = (name, point);
        None
    }

    /// The matrix from a named space to common space, row by row, for row vectors. `common` and `world` are
    /// always known; `shader`, `object` and `camera` equal them unless this function returns a matrix.
    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let _ = space;
        None
    }

    /// Folders for textures, searched after the working directory. Files elsewhere are not opened. Called
    /// once.
    fn texture_folders(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// The ray type for which the points are shaded. Called once.
    fn ray_type(&self) -> String {
        "camera".to_string()
    }
}

/// Services without any answers.
struct Nothing;

impl RendererServices for Nothing {}

/// Services with the data that they keep between runs, such as loaded textures. Use one for all programs of a
/// scene.
#[derive(Clone)]
pub struct Renderer {
    pub(crate) answers: Arc<dyn RendererServices>,
    pub(crate) services: Arc<Services>,
}

impl Renderer {
    /// A renderer with these services.
    pub fn new(services: impl RendererServices + 'static) -> Renderer {
        Renderer::within(services, &Limits::default())
    }

    /// The same, with limits for the textures that it reads.
    pub fn within(services: impl RendererServices + 'static, limits: &Limits) -> Renderer {
        let answers: Arc<dyn RendererServices> = Arc::new(services);
        let mut spaces = Spaces::default();
        let asked = answers.clone();
        let find: FindSpace = Arc::new(move |space: &str| asked.transform(space));
        spaces.set_lookup(find);
        let textures = TextureCache::within(answers.texture_folders(), limits);
        let services =
            Arc::new(Services { ray: answers.ray_type(), spaces, textures, ..Services::default() });
        Renderer { answers, services }
    }
}

impl Default for Renderer {
    /// A renderer without answers.
    fn default() -> Renderer {
        Renderer::new(Nothing)
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Renderer").finish_non_exhaustive()
    }
}
