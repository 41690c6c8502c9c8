//! What a running shader may ask of the program around it.

use crate::Value;
use osl_exec::{FindSpace, Services, Spaces};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The answers of an embedder. Each has a default: nothing is known. Shaders run on all cores, so answers come from any
/// thread; the same question has the same answer as long as a run lasts.
pub trait RendererServices: Send + Sync {
    /// An attribute of an object at a point, of none where `object` is empty: `getattribute`. The value is to have exactly
    /// the type that the shader asks for; others count as none.
    fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
        let _ = (object, name, point);
        None
    }

    /// User data of a point: what interpolated parameters take, and what goes before attributes of no object.
    fn user_data(&self, name: &str, point: usize) -> Option<Value> {
        let _ = (name, point);
        None
    }

    /// The matrix from a named space to common space, row by row, for row vectors. `common` and `world` are known;
    /// `shader`, `object` and `camera` are the same space unless this says otherwise.
    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let _ = space;
        None
    }

    /// Folders in which textures lie, after the working directory. Files elsewhere are not opened. Asked once.
    fn texture_folders(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// The kind of ray that the points are shaded for. Asked once.
    fn ray_type(&self) -> String {
        "camera".to_string()
    }
}

/// Services that know nothing.
struct Nothing;

impl RendererServices for Nothing {}

/// Services with what they keep from run to run: the textures that were read. Use one for all programs of a scene.
#[derive(Clone)]
pub struct Renderer {
    pub(crate) answers: Arc<dyn RendererServices>,
    pub(crate) services: Arc<Services>,
}

impl Renderer {
    /// A renderer that answers by these services.
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
    /// A renderer that knows nothing.
    fn default() -> Renderer {
        Renderer::new(Nothing)
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Renderer").finish_non_exhaustive()
    }
}
