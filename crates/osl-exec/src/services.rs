//! What a running shader can ask of its surroundings: named spaces and textures.

use osl_image::TextureCache;
use osl_ir::numeric::Real;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Finds the matrix from a space to common space by the name of the space, row by row, for row vectors.
pub type FindSpace = Arc<dyn Fn(&str) -> Option<[f32; 16]> + Send + Sync>;

/// Named coordinate systems. Matrices are row by row, for row vectors, from the space to common space.
#[derive(Clone)]
pub struct Spaces {
    to_common: FxHashMap<String, [f32; 16]>,
    /// Spaces that are only a destination, such as the raster.
    from_common: FxHashMap<String, [f32; 16]>,
    /// Who is asked first.
    find: Option<FindSpace>,
}

impl std::fmt::Debug for Spaces {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Spaces { to_common, from_common, find } = self;
        let mut fields = f.debug_struct("Spaces");
        fields.field("to_common", to_common).field("from_common", from_common);
        fields.field("find", &find.is_some()).finish()
    }
}

/// The matrix that changes nothing.
pub(crate) const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

impl Default for Spaces {
    /// `common`, `world`, `shader` and `object`, all the same.
    fn default() -> Self {
        let names = ["common", "world", "shader", "object", "camera"];
        let to_common = names.into_iter().map(|n| (n.to_string(), IDENTITY)).collect();
        Spaces { to_common, from_common: FxHashMap::default(), find: None }
    }
}

impl Spaces {
    /// Sets the matrix from a space to common space.
    pub fn set(&mut self, name: &str, to_common: [f32; 16]) {
        self.to_common.insert(name.to_string(), to_common);
    }

    /// Makes a space one that can only be a destination, by the matrix from common space to it.
    pub fn set_destination(&mut self, name: &str, from_common: [f32; 16]) {
        self.to_common.remove(name);
        self.from_common.insert(name.to_string(), from_common);
    }

    /// Has spaces looked up by a function before those that were set, each time that a shader names one.
    pub fn set_lookup(&mut self, find: FindSpace) {
        self.find = Some(find);
    }

    fn to_common(&self, name: &str) -> Option<[f32; 16]> {
        let found = self.find.as_ref().and_then(|find| find(name));
        found.or_else(|| self.to_common.get(name).copied())
    }

    /// The matrix from one space to another in some arithmetic.
    ///
    /// # Errors
    /// The unknown names, and the matrix with common space in their place.
    pub fn matrix<'n, R: Real>(&self, from: &'n str, to: &'n str) -> Result<[R; 16], Unknown<'n, R>> {
        let mut names = [None; 2];
        let from_matrix = self.to_common(from);
        names[0] = from_matrix.is_none().then_some(from);
        let from_matrix = from_matrix.map(|m| m.map(R::lit));
        let common = |name: &str| name == "common" || name == "world";
        let identity = IDENTITY.map(R::lit);
        let multiply = osl_ir::numeric::matrix::multiply;
        let matrix = if let Some(to_matrix) = self.from_common.get(to) {
            let to_matrix = to_matrix.map(R::lit);
            multiply(from_matrix.unwrap_or(identity), to_matrix)
        } else {
            let to_matrix = self.to_common(to);
            names[1] = to_matrix.is_none().then_some(to);
            // An unknown space is multiplied by as any other: no zero of the product is negative then.
            let inverse = to_matrix.map_or(identity, |m| osl_ir::numeric::matrix::inverse(m.map(R::lit)));
            let known = names == [None; 2];
            match (from_matrix, inverse) {
                _ if known && from == to => identity,
                (Some(from), _) if known && common(to) => from,
                (_, to) if known && common(from) => to,
                (from, to) => multiply(from.unwrap_or(identity), to),
            }
        };
        if names == [None; 2] { Ok(matrix) } else { Err(Unknown { names, matrix }) }
    }
}

/// What is left where spaces are unknown.
#[derive(Clone, Copy, Debug)]
pub struct Unknown<'n, R> {
    /// The unknown names: of the space that points come from, of the one that they go to.
    pub names: [Option<&'n str>; 2],
    /// The matrix with common space in place of the unknown ones.
    pub matrix: [R; 16],
}

/// All that a running shader can ask for.
#[derive(Debug, Default)]
pub struct Services {
    /// The kind of ray that the run shades, `camera` if empty.
    pub ray: String,
    /// Named spaces.
    pub spaces: Spaces,
    /// Textures.
    pub textures: TextureCache,
    /// Whether texture lookups fail in the words of the reference's tools: "errormessage" has the reason at the first
    /// lookup of a file, and "unknown" from then on. Which lookup is the first depends on who comes first, so that such
    /// runs have one thread.
    pub reference_texts: bool,
}
