//! Closures for embedders: what a shader says about light, for the embedder's renderer to interpret.
//!
//! A closure is data, whatever its name: the renderer decides which closures exist. The components of all
//! points lie in columns, and nothing is copied: a renderer finds its own function for each kind once, and
//! then walks over the points.

use crate::Value;
use crate::param::{Base, Length, Type};
use osl_exec::Row;
use osl_ir::ir::{Kind, Shape};

/// The closures of an output at all points.
///
/// ```
/// use osl::{Group, Points, Shader};
///
/// let text = "surface s() { Ci = u * diffuse(N) + emission(); }";
/// let program = Group::new().layer("s", &Shader::compile("s.osl", text)?).compile(&["Ci"])?;
/// let outputs = program.run(&Points::new(2).u(&[0.25, 0.5]))?;
/// let closures = outputs.closures("Ci").unwrap();
/// // Once for all points: what the kinds mean.
/// let kinds = closures.kinds();
/// let is_light: Vec<bool> = kinds.iter().map(|kind| kind.name == "emission").collect();
/// let mut reflected = Vec::new();
/// for point in 0..closures.len() {
///     let components = closures.at(point).filter(|component| !is_light[component.kind()]);
///     reflected.push(components.map(|component| component.weight()[0]).sum::<f32>());
/// }
/// assert_eq!(reflected, [0.25, 0.5]);
/// # Ok::<(), osl::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Closures<'a>(pub(crate) &'a osl_exec::Closures);

/// A kind of closure: a name with certain parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClosureKind {
    /// Its name.
    pub name: String,
    /// Its parameters in order; keyword parameters come last.
    pub params: Vec<ClosureParam>,
}

/// A parameter of a kind of closure.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClosureParam {
    /// The keyword, if it has one.
    pub key: Option<String>,
    /// Its type. A color, point, vector and normal are all a vector here.
    pub ty: Type,
}

impl<'a> Closures<'a> {
    /// The number of points.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The kinds of components that the program makes. Those of the components are indices in this list.
    pub fn kinds(&self) -> Vec<ClosureKind> {
        let param = |shape: &Shape| ClosureParam {
            key: shape.key.as_ref().map(ToString::to_string),
            ty: Type {
                base: match shape.kind {
                    Kind::Int => Base::Int,
                    Kind::Float => Base::Float,
                    Kind::Triple => Base::Vector,
                    Kind::Matrix => Base::Matrix,
                    Kind::Str => Base::String,
                    Kind::Closure => Base::Closure,
                },
                length: if shape.count == 1 { Length::One } else { Length::Array(shape.count as usize) },
            },
        };
        let kind = |kind: &osl_exec::ClosureKind| ClosureKind {
            name: kind.name.to_string(),
            params: kind.shapes.iter().map(param).collect(),
        };
        self.0.kinds().iter().map(kind).collect()
    }

    /// The components of a point; their sum is the closure.
    pub fn at(&self, point: usize) -> impl Iterator<Item = Closure<'a>> + use<'a> {
        self.0.rows(point).map(Closure)
    }
}

/// A component of a closure at a point.
#[derive(Clone, Copy, Debug)]
pub struct Closure<'a>(Row<'a>);

impl<'a> Closure<'a> {
    /// The index of its kind in [`Closures::kinds`].
    pub fn kind(&self) -> usize {
        self.0.kind as usize
    }

    /// Its name.
    pub fn name(&self) -> &'a str {
        self.0.name()
    }

    /// Red, green and blue factors.
    pub fn weight(&self) -> [f32; 3] {
        self.0.weight
    }

    /// A parameter that is one float, or one int as a float.
    pub fn float(&self, param: usize) -> Option<f32> {
        match self.0.words(param)? {
            (shape, [word]) if shape.kind == Kind::Float => Some(f32::from_bits(*word)),
            (shape, [word]) if shape.kind == Kind::Int => Some(*word as i32 as f32),
            _ => None,
        }
    }

    /// A parameter that is one color, point, vector or normal.
    pub fn triple(&self, param: usize) -> Option<[f32; 3]> {
        match self.0.words(param)? {
            (shape, [x, y, z]) if shape.kind == Kind::Triple => Some([*x, *y, *z].map(f32::from_bits)),
            _ => None,
        }
    }

    /// A parameter of any type, except a closure.
    pub fn value(&self, param: usize) -> Option<Value> {
        let (shape, _) = self.0.words(param)?;
        Value::of_constants(&self.0.values(param)?, shape.count != 1)
    }

    /// The components of a parameter that is a closure, such as the base of a layer.
    pub fn closure(&self, param: usize) -> impl Iterator<Item = Closure<'a>> + use<'a> {
        self.0.inner(param).map(Closure)
    }
}
