//! The queries of a running shader to its surroundings: named spaces and textures.

use osl_image::TextureCache;
use osl_numeric::Scalar;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Finds the matrix from a named space to common space, row by row, for row vectors.
pub type FindSpace = Arc<dyn Fn(&str) -> Option<[f32; 16]> + Send + Sync>;

/// Named coordinate systems. Matrices are row by row, for row vectors, from the space to common space.
#[derive(Clone)]
pub struct Spaces {
    to_common: FxHashMap<String, [f32; 16]>,
    /// The matrices from common space to spaces for which they are given. Without a matrix to common space,
    /// such a space can only be a destination.
    from_common: FxHashMap<String, [f32; 16]>,
    /// A function that is called first.
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

/// The identity matrix.
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

    /// Makes a space a destination only, with the matrix from common space to it.
    pub fn set_destination(&mut self, name: &str, from_common: [f32; 16]) {
        self.to_common.remove(name);
        self.from_common.insert(name.to_string(), from_common);
    }

    /// Sets the matrices from a space to common space and back.
    pub fn set_pair(&mut self, name: &str, to_common: [f32; 16], from_common: [f32; 16]) {
        self.to_common.insert(name.to_string(), to_common);
        self.from_common.insert(name.to_string(), from_common);
    }

    /// Sets a function that is called for each named space before those that were set are searched.
    pub fn set_lookup(&mut self, find: FindSpace) {
        self.find = Some(find);
    }

    /// The spaces whose matrices to and from common space are affine, with finite elements. There are none
    /// if a function finds spaces, since it may answer otherwise the next time.
    pub fn affine(&self) -> Vec<Arc<str>> {
        let names = self.to_common.keys().filter(|name| self.is_affine(name));
        let mut names: Vec<Arc<str>> = names.map(|name| name.as_str().into()).collect();
        names.sort();
        names
    }

    /// Whether the matrices of a space are affine.
    pub(crate) fn is_affine(&self, name: &str) -> bool {
        let is_affine = |m: &[f32; 16]| {
            let [x, y, z, w] = [m[3], m[7], m[11], m[15]];
            [x, y, z, w] == [0.0, 0.0, 0.0, 1.0] && m.iter().all(|x| x.is_finite())
        };
        // Then the products with other such matrices are affine too.
        let is_space = |m: &[f32; 16]| is_affine(m) && is_affine(&osl_numeric::matrix::inverse(*m));
        self.find.is_none()
            && !self.from_common.contains_key(name)
            && self.to_common.get(name).is_some_and(is_space)
    }

    fn to_common(&self, name: &str) -> Option<[f32; 16]> {
        let found = self.find.as_ref().and_then(|find| find(name));
        found.or_else(|| self.to_common.get(name).copied())
    }

    /// The matrix from one space to another in an arithmetic.
    ///
    /// # Errors
    /// The unknown names, and the matrix with common space in their place.
    pub fn matrix<'n, R: Scalar>(&self, from: &'n str, to: &'n str) -> Result<[R; 16], Unknown<'n, R>> {
        let mut names = [None; 2];
        let from_matrix = self.to_common(from);
        names[0] = from_matrix.is_none().then_some(from);
        let from_matrix = from_matrix.map(|m| m.map(R::lit));
        let common = |name: &str| name == "common" || name == "world";
        let identity = IDENTITY.map(R::lit);
        let multiply = osl_numeric::matrix::multiply;
        let unlike = from != to || from_matrix.is_none();
        let matrix = if let Some(to_matrix) = self.from_common.get(to).filter(|_| unlike) {
            let to_matrix = to_matrix.map(R::lit);
            multiply(from_matrix.unwrap_or(identity), to_matrix)
        } else {
            let to_matrix = self.to_common(to);
            names[1] = to_matrix.is_none().then_some(to);
            // The product with an unknown space is computed like any other, so that no zero of it is
            // negative.
            let inverse = to_matrix.map_or(identity, |m| osl_numeric::matrix::inverse(m.map(R::lit)));
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

/// The result for unknown spaces.
#[derive(Clone, Copy, Debug)]
pub struct Unknown<'n, R> {
    /// The unknown names: of the source space and of the destination space.
    pub names: [Option<&'n str>; 2],
    /// The matrix with common space in place of the unknown spaces.
    pub matrix: [R; 16],
}

/// Everything that a running shader can query.
#[derive(Debug, Default)]
pub struct Services {
    /// The ray type of the run; empty means `camera`.
    pub ray: String,
    /// Named spaces.
    pub spaces: Spaces,
    /// Textures.
    pub textures: TextureCache,
    /// Whether texture lookups fail with the messages of the reference's tools: "errormessage" has the reason
    /// at the first lookup of a file, and "unknown" from then on. The first lookup depends on the order of
    /// execution, so such runs have one thread.
    pub reference_texts: bool,
}
