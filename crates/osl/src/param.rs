//! Parameters of shaders, as data: types, defaults, metadata.

use crate::Value;
use osl_hir::hir::{self, Expr, ExprKind, Init, MetaValue};
use osl_ir::types::{self, Extent};
use std::fmt;
use std::sync::Arc;

/// Maximum number of ints, floats, triples, matrices and strings in a default that is shown.
const MAX_PARTS: usize = types::MAX_ARRAY_LENGTH as usize;

/// A parameter of a shader.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Param {
    /// Its name.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// Whether it is an output.
    pub output: bool,
    /// Its default; `None` if code computes it, or if it has more than 1,048,576 parts.
    pub default: Option<Value>,
    /// Its metadata, in order.
    pub metadata: Vec<Metadata>,
}

impl Param {
    /// The metadatum with a name, such as `min`, `label` or `widget`.
    pub fn metadatum(&self, name: &str) -> Option<&Value> {
        self.metadata.iter().find(|datum| datum.name == name)?.value.as_ref()
    }
}

/// A constant that is attached to a parameter or a shader: `[[ float max = 10 ]]`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Metadata {
    /// Its name.
    pub name: String,
    /// Its type as written: `float`, `string[2]`.
    pub ty: String,
    /// Its value; `None` if it is not a constant.
    pub value: Option<Value>,
}

/// The type of a parameter. Displays as in a source text: `color[3]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Type {
    /// The type of the value, or of each element of an array.
    pub base: Base,
    /// Whether it is an array.
    pub length: Length,
}

/// Whether a type is an array, and its length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Length {
    /// Not an array.
    One,
    /// An array with this many elements.
    Array(usize),
    /// An array that is as long as its value.
    Open,
}

/// The type of a value that is not an array.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Base {
    /// 32-bit signed integer; also truth values, 0 and 1.
    Int,
    /// Single precision number.
    Float,
    /// Red, green and blue.
    Color,
    /// Position.
    Point,
    /// Direction.
    Vector,
    /// Surface normal.
    Normal,
    /// 4×4 matrix, row by row, for row vectors.
    Matrix,
    /// Text.
    String,
    /// Closure.
    Closure,
    /// Struct.
    Struct(Arc<Struct>),
}

/// A struct type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Struct {
    /// Its name.
    pub name: String,
    /// Its fields in order: name and type.
    pub fields: Vec<(String, Type)>,
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let base = match &self.base {
            Base::Int => "int",
            Base::Float => "float",
            Base::Color => "color",
            Base::Point => "point",
            Base::Vector => "vector",
            Base::Normal => "normal",
            Base::Matrix => "matrix",
            Base::String => "string",
            Base::Closure => "closure color",
            Base::Struct(of) => &of.name,
        };
        match self.length {
            Length::One => f.write_str(base),
            Length::Array(n) => write!(f, "{base}[{n}]"),
            Length::Open => write!(f, "{base}[]"),
        }
    }
}

/// The parameters of a shader, in order.
pub(crate) fn params(program: &hir::Program) -> Vec<Param> {
    let mut types = Types { program, structs: Vec::new() };
    let of = |p: &hir::Param| {
        let var = program.vars.get(p.var.0 as usize)?;
        let mut ty = types.of(var.ty);
        if p.open {
            ty.length = Length::Open;
        }
        let mut reader = Reader { program, left: MAX_PARTS };
        Some(Param {
            name: var.name.to_string(),
            ty,
            output: p.output,
            default: reader.initial(var.ty, Some(&p.init)),
            metadata: metadata(&p.metadata),
        })
    };
    program.shader.params.iter().filter_map(of).collect()
}

/// The default of a parameter, or of a field `s.a` of one; `None` if it is not a constant.
pub(crate) fn default(program: &hir::Program, name: &str) -> Option<Value> {
    let mut parts = name.split('.');
    let param = program.shader.params.get(program.param(parts.next()?)?)?;
    let ty = program.vars.get(param.var.0 as usize)?.ty;
    let whole = Reader { program, left: MAX_PARTS }.initial(ty, Some(&param.init))?;
    parts.try_fold(whole, |value, field| match value {
        Value::Struct(fields) => fields.into_iter().find(|(name, _)| name == field).map(|(_, value)| value),
        _ => None,
    })
}

/// The names of the parts of a parameter that are not structs, without strings and closures.
pub(crate) fn leaves(program: &hir::Program, name: &str, ty: types::Type) -> Vec<String> {
    let mut names = Vec::new();
    let mut open = vec![(name.to_string(), ty)];
    while let Some((name, ty)) = open.pop() {
        match ty.base {
            types::Base::Struct(id) if names.len() < MAX_PARTS => {
                let fields = &program.structs.get(id).fields;
                open.extend(fields.iter().rev().map(|field| (format!("{name}.{}", field.name), field.ty)));
            }
            types::Base::Struct(_) | types::Base::String | types::Base::Closure => {}
            _ => names.push(name),
        }
    }
    names
}

/// Metadata as written.
pub(crate) fn metadata(list: &[(String, Arc<str>, MetaValue)]) -> Vec<Metadata> {
    let one = |(ty, name, value): &(String, Arc<str>, MetaValue)| Metadata {
        name: name.to_string(),
        ty: ty.clone(),
        value: metadatum(ty, value),
    };
    list.iter().map(one).collect()
}

fn metadatum(ty: &str, value: &MetaValue) -> Option<Value> {
    let numbers = match value {
        MetaValue::Text(text) => return Some(Value::String(text.to_string())),
        MetaValue::Texts(texts) => {
            return Some(Value::Strings(texts.iter().map(ToString::to_string).collect()));
        }
        MetaValue::Unknown => return None,
        MetaValue::Numbers(numbers) => numbers,
    };
    let floats = || numbers.iter().map(|x| *x as f32);
    let array = ty.ends_with(']');
    let is = |base: &str| ty == base || ty.strip_prefix(base).is_some_and(|rest| rest.starts_with('['));
    let triples = ["color", "point", "vector", "normal"].into_iter().any(is);
    Some(match &numbers[..] {
        [x] if is("int") && !array => Value::Int(*x as i32),
        _ if is("int") => Value::Ints(numbers.iter().map(|x| *x as i32).collect()),
        [x] if triples && !array => Value::Triple([*x as f32; 3]),
        [x, y, z] if triples && !array => Value::Triple([*x, *y, *z].map(|x| x as f32)),
        [x] if is("matrix") && !array => Value::Matrix(osl_numeric::matrix::diagonal(*x as f32)),
        [x] if !array => Value::Float(*x as f32),
        _ => Value::Floats(floats().collect()),
    })
}

/// Converts types. Each struct is converted once, since structs may nest deeply.
struct Types<'a> {
    program: &'a hir::Program,
    structs: Vec<(types::StructId, Arc<Struct>)>,
}

impl Types<'_> {
    fn of(&mut self, ty: types::Type) -> Type {
        let base = match ty.base {
            types::Base::Int | types::Base::Void | types::Base::Error => Base::Int,
            types::Base::Float => Base::Float,
            types::Base::Color => Base::Color,
            types::Base::Point => Base::Point,
            types::Base::Vector => Base::Vector,
            types::Base::Normal => Base::Normal,
            types::Base::Matrix => Base::Matrix,
            types::Base::String => Base::String,
            types::Base::Closure => Base::Closure,
            types::Base::Struct(id) => Base::Struct(self.structure(id)),
        };
        let length = match ty.extent {
            Extent::One => Length::One,
            Extent::Array(n) => Length::Array(n as usize),
            Extent::Unsized => Length::Open,
        };
        Type { base, length }
    }

    fn structure(&mut self, id: types::StructId) -> Arc<Struct> {
        if let Some((_, known)) = self.structs.iter().find(|(known, _)| *known == id) {
            return known.clone();
        }
        let declared = self.program.structs.get(id);
        let fields = declared.fields.iter().map(|f| (f.name.to_string(), self.of(f.ty))).collect();
        let structure = Arc::new(Struct { name: declared.name.to_string(), fields });
        self.structs.push((id, structure.clone()));
        structure
    }
}

/// Reads the values of initialisers, up to a number of parts.
struct Reader<'a> {
    program: &'a hir::Program,
    left: usize,
}

impl Reader<'_> {
    /// The value of an initialiser; missing elements of a list are zero. `None` if it is not a constant, or
    /// too long.
    fn initial(&mut self, ty: types::Type, init: Option<&Init>) -> Option<Value> {
        let items = match init {
            Some(Init::Value(e)) => return self.constant(e),
            Some(Init::List(items)) => items.as_slice(),
            None => &[],
        };
        if let Extent::Array(n) = ty.extent {
            let n = n as usize;
            if n > self.left {
                return None;
            }
            let element = |at| self.initial(ty.element(), items.get(at));
            return Some(gathered((0..n).map(element).collect::<Option<Vec<Value>>>()?));
        }
        if let Some(id) = ty.as_struct() {
            let fields = self.program.structs.get(id).fields.iter().enumerate();
            let field = |(at, f): (usize, &types::Field)| {
                Some((f.name.to_string(), self.initial(f.ty, items.get(at))?))
            };
            return fields.map(field).collect::<Option<Vec<_>>>().map(Value::Struct);
        }
        self.left = self.left.checked_sub(1)?;
        Some(match ty {
            types::Type::INT => Value::Int(0),
            types::Type::STRING => Value::String(String::new()),
            types::Type::MATRIX => Value::Matrix([0.0; 16]),
            types::Type::CLOSURE => Value::NullClosure,
            ty if ty.is_triple() => Value::Triple([0.0; 3]),
            _ => Value::Float(0.0),
        })
    }

    fn constant(&mut self, e: &Expr) -> Option<Value> {
        self.left = self.left.checked_sub(1)?;
        Some(match &e.kind {
            ExprKind::Int(n) => Value::Int(*n),
            ExprKind::Float(x) => Value::Float(*x),
            ExprKind::Str(text) => Value::String(text.to_string()),
            ExprKind::NullClosure => Value::NullClosure,
            ExprKind::Triple(parts) => {
                let [x, y, z] = &**parts;
                Value::Triple([self.number(x)?, self.number(y)?, self.number(z)?])
            }
            ExprKind::Matrix(cells) => {
                let cells = cells.iter().map(|cell| self.number(cell)).collect::<Option<Vec<f32>>>()?;
                Value::Matrix(cells.try_into().ok()?)
            }
            ExprKind::Convert(inner) => converted(e.ty, self.constant(inner)?)?,
            _ => return None,
        })
    }

    fn number(&mut self, e: &Expr) -> Option<f32> {
        match self.constant(e)? {
            Value::Int(n) => Some(n as f32),
            Value::Float(x) => Some(x),
            _ => None,
        }
    }
}

fn converted(to: types::Type, value: Value) -> Option<Value> {
    let number = match value {
        Value::Int(n) => n as f32,
        Value::Float(x) => x,
        Value::Triple(_) if to.is_triple() => return Some(value),
        _ => return None,
    };
    Some(match to {
        types::Type::INT => Value::Int(number as i32),
        types::Type::FLOAT => Value::Float(number),
        types::Type::MATRIX => Value::Matrix(osl_numeric::matrix::diagonal(number)),
        ty if ty.is_triple() => Value::Triple([number; 3]),
        _ => return None,
    })
}

/// The array of elements that have the same type.
fn gathered(list: Vec<Value>) -> Value {
    macro_rules! all {
        ($one:ident, $many:ident) => {
            Value::$many(
                list.into_iter()
                    .filter_map(|v| if let Value::$one(x) = v { Some(x) } else { None })
                    .collect(),
            )
        };
    }
    match list.first() {
        Some(Value::Int(_)) => all!(Int, Ints),
        Some(Value::Float(_)) => all!(Float, Floats),
        Some(Value::Triple(_)) => all!(Triple, Triples),
        Some(Value::Matrix(_)) => all!(Matrix, Matrices),
        Some(Value::String(_)) => all!(String, Strings),
        _ => Value::List(list),
    }
}
