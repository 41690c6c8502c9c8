//! The queries of a running shader to the program around it.

use crate::{Column, Files, Value};
use osl_exec::{FindSpace, Ray, Services, Spaces};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// The answers of an embedder. By default, nothing is known. Shaders run on all cores, so the functions are
/// called from any thread; the same query must have the same answer during a run.
///
/// ```
/// use osl::{Files, Group, MemoryFiles, Points, Renderer, RendererServices, RunOptions, Shader, Value};
/// use std::sync::Arc;
///
/// /// A scene in memory: one attribute, and an XML document.
/// struct Scene(Arc<MemoryFiles>);
///
/// impl RendererServices for Scene {
///     fn attribute(&self, object: &str, name: &str, point: usize) -> Option<Value> {
///         (object.is_empty() && name == "index").then(|| Value::Int(point as i32))
///     }
///
///     fn files(&self) -> Option<Arc<dyn Files>> {
///         Some(self.0.clone())
///     }
/// }
///
/// let shader = Shader::compile(
///     "a.osl",
///     "shader a(output int i = -1, output int n = 0) {
///         getattribute(\"index\", i);
///         dict_value(dict_find(\"scene.xml\", \"lamp\"), \"watts\", n);
///     }",
/// )?;
/// let program = Group::new().layer("a", &shader).compile(&[])?;
/// let files = MemoryFiles::new().with("scene.xml", "<lamp watts=\"60\"/>");
/// let renderer = Renderer::new(Scene(Arc::new(files)));
/// let outputs = program.run_with(&Points::new(2), &renderer, &RunOptions::default())?;
/// assert_eq!(outputs.ints("i"), Some(vec![0, 1]));
/// assert_eq!(outputs.ints("n"), Some(vec![60, 60]));
/// # Ok::<(), osl::Error>(())
/// ```
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

    /// An attribute at consecutive points at once: a value for each. `None` means that
    /// [`RendererServices::user_data`] and [`RendererServices::attribute`] are called for each point, as they
    /// are if the shader requests another type. The values must equal theirs.
    fn attributes(&self, object: &str, name: &str, points: Range<usize>) -> Option<Column<'_>> {
        let _ = (object, name, points);
        None
    }

    /// Whether an attribute is the same at all points, or missing at all of them; also as user data, if
    /// `object` is empty. Then one point is asked for all.
    fn is_uniform(&self, object: &str, name: &str) -> bool {
        let _ = (object, name);
        false
    }

    /// Whether a ray from a point hits something: `trace`. Called for programs that were compiled with
    /// [`CompileOptions::traces`](crate::CompileOptions::traces).
    fn trace(&self, ray: &Ray) -> bool {
        let _ = ray;
        false
    }

    /// The same for all rays of a batch at once; `hits` has an element for each.
    fn trace_all(&self, rays: &[Ray], hits: &mut [bool]) {
        hits.iter_mut().zip(rays).for_each(|(hit, ray)| *hit = self.trace(ray));
    }

    /// The value with a name that the last ray of a point found: `getmessage("trace", …)`; in general, that
    /// of a source of messages. It must have exactly the type that the shader requests. Called under the
    /// condition of [`RendererServices::trace`].
    fn message(&self, source: &str, name: &str, point: usize) -> Option<Value> {
        let _ = (source, name, point);
        None
    }

    /// The same for the points of a batch at once, with a value for each. `None` means that
    /// [`RendererServices::message`] is called for each point.
    fn messages(&self, source: &str, name: &str, points: &[usize]) -> Option<Column<'_>> {
        let _ = (source, name, points);
        None
    }

    /// The matrix from a named space to common space, row by row, for row vectors. `common` and `world` are
    /// always known; `shader`, `object` and `camera` equal them unless this function returns a matrix.
    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let _ = space;
        None
    }

    /// Whether [`RendererServices::transform`] knows any space. Called once. If not, programs that are
    /// [compiled for the renderer](crate::CompileOptions::renderer) transform positions in less time.
    fn has_spaces(&self) -> bool {
        true
    }

    /// Folders for textures, searched after the working directory. Files elsewhere are not opened. Called
    /// once.
    fn texture_folders(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// The files from which textures and XML documents are read, in place of the disk. Called once. By
    /// default, the disk, see [`RendererServices::texture_folders`].
    fn files(&self) -> Option<Arc<dyn Files>> {
        None
    }

    /// The ray type for which the points are shaded. Called once.
    fn ray_type(&self) -> String {
        "camera".to_string()
    }
}

/// Services without any answers.
struct Nothing;

impl RendererServices for Nothing {
    fn is_uniform(&self, _: &str, _: &str) -> bool {
        true
    }

    fn has_spaces(&self) -> bool {
        false
    }
}

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
        let textures = match services.files() {
            Some(files) => TextureCache::given(Arc::new(move |name: &str| files.read(name)), limits),
            None => TextureCache::within(services.texture_folders(), limits),
        };
        Renderer::with(Arc::new(services), textures)
    }

    /// A renderer with the textures of this one and other services; their files are not used. So programs
    /// that run at different points need not load textures again.
    #[must_use]
    pub fn answering(&self, services: impl RendererServices + 'static) -> Renderer {
        Renderer::with(Arc::new(services), self.services.textures.clone())
    }

    fn with(answers: Arc<dyn RendererServices>, textures: TextureCache) -> Renderer {
        let mut spaces = Spaces::default();
        if answers.has_spaces() {
            let asked = answers.clone();
            let find: FindSpace = Arc::new(move |space: &str| asked.transform(space));
            spaces.set_lookup(find);
        }
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
