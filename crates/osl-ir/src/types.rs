//! The types of the language and the relations between them: *equivalent* and *assignable*.
//!
//! A [`Type`] is an element type with an array length. Structs are declared in a [`StructTable`] and
//! referenced by id.

use osl_syntax::span::Span;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::{Arc, OnceLock};

/// The longest array. This is a property of types, not a limit to set: `compiling.array_words` bounds the
/// memory of arrays.
pub const MAX_ARRAY_LENGTH: i32 = 1 << 20;

/// Index of a struct in the [`StructTable`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StructId(pub u32);

/// The type of a value or array element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Base {
    /// 32-bit two's-complement integer.
    Int,
    /// binary32 number.
    Float,
    /// RGB triple.
    Color,
    /// Position triple.
    Point,
    /// Direction triple.
    Vector,
    /// Surface-normal triple.
    Normal,
    /// 4×4 matrix, row vectors multiply from the left.
    Matrix,
    /// Character string.
    String,
    /// `closure color`.
    Closure,
    /// No value.
    Void,
    /// A struct.
    Struct(StructId),
    /// The type of an expression that already has an error: it matches everywhere, so that one mistake gives
    /// one message.
    Error,
}

/// The number of elements of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Extent {
    /// Not an array.
    One,
    /// An array of this length, at least 1.
    Array(u32),
    /// An array parameter `[]` with the length of its argument.
    Unsized,
}

/// A type: element type and extent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Type {
    /// Type of the value or of one element.
    pub base: Base,
    /// Whether it is an array, and of what length.
    pub extent: Extent,
}

#[expect(missing_docs, reason = "each constant is the type of its name")]
impl Type {
    /// The type for a word like `float`, `color[2]` or `int[]`.
    pub fn parse(text: &str) -> Option<Type> {
        let (name, extent) = match text.trim().split_once('[') {
            None => (text.trim(), Extent::One),
            Some((name, rest)) => match rest.trim().strip_suffix(']')?.trim() {
                "" => (name.trim(), Extent::Unsized),
                len => (
                    name.trim(),
                    Extent::Array(len.parse().ok().filter(|n| (1..=MAX_ARRAY_LENGTH as u32).contains(n))?),
                ),
            },
        };
        let base = match name {
            "int" => Base::Int,
            "float" => Base::Float,
            "color" => Base::Color,
            "point" => Base::Point,
            "vector" => Base::Vector,
            "normal" => Base::Normal,
            "matrix" => Base::Matrix,
            "string" => Base::String,
            _ => return None,
        };
        Some(Type { base, extent })
    }

    pub const INT: Type = Type::one(Base::Int);
    pub const FLOAT: Type = Type::one(Base::Float);
    pub const COLOR: Type = Type::one(Base::Color);
    pub const POINT: Type = Type::one(Base::Point);
    pub const VECTOR: Type = Type::one(Base::Vector);
    pub const NORMAL: Type = Type::one(Base::Normal);
    pub const MATRIX: Type = Type::one(Base::Matrix);
    pub const STRING: Type = Type::one(Base::String);
    pub const CLOSURE: Type = Type::one(Base::Closure);
    pub const VOID: Type = Type::one(Base::Void);
    pub const ERROR: Type = Type::one(Base::Error);
}

impl Type {
    /// The type that is not an array.
    pub const fn one(base: Base) -> Type {
        Type { base, extent: Extent::One }
    }

    /// The type of one element.
    pub const fn element(self) -> Type {
        Type::one(self.base)
    }

    /// Whether it is an array, sized or not.
    pub fn is_array(self) -> bool {
        self.extent != Extent::One
    }

    /// Whether it is a single color, point, vector or normal.
    pub fn is_triple(self) -> bool {
        !self.is_array() && self.base.is_triple()
    }

    /// Whether it is a single int or float.
    pub fn is_number(self) -> bool {
        self == Type::INT || self == Type::FLOAT
    }

    /// The struct, if it is a single one.
    pub fn as_struct(self) -> Option<StructId> {
        match (self.base, self.extent) {
            (Base::Struct(id), Extent::One) => Some(id),
            _ => None,
        }
    }

    /// Whether an error was already reported about it.
    pub fn is_error(self) -> bool {
        self.base == Base::Error
    }
}

impl Base {
    /// Whether it is color, point, vector or normal.
    pub fn is_triple(self) -> bool {
        matches!(self, Base::Color | Base::Point | Base::Vector | Base::Normal)
    }
}

/// One field of a struct.
#[derive(Clone, Debug)]
pub struct Field {
    /// Its name.
    pub name: Arc<str>,
    /// Its type.
    pub ty: Type,
}

/// A declared struct.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Its name.
    pub name: Arc<str>,
    /// Its fields in order.
    pub fields: Vec<Field>,
    /// Where it was declared.
    pub span: Span,
}

/// All structs of a translation unit.
#[derive(Clone, Debug, Default)]
pub struct StructTable {
    structs: Vec<Struct>,
    by_name: FxHashMap<Arc<str>, StructId>,
    /// The indices of the fields of each struct, computed on first use.
    places: Vec<OnceLock<FxHashMap<Arc<str>, usize>>>,
}

/// Pairs of structs.
type Pairs = FxHashSet<(StructId, StructId)>;

impl StructTable {
    /// Adds a struct.
    pub fn add(&mut self, decl: Struct) -> StructId {
        let id = StructId(self.structs.len() as u32);
        self.by_name.insert(decl.name.clone(), id);
        self.structs.push(decl);
        self.places.push(OnceLock::new());
        id
    }

    /// The names of all structs, in the order of their declarations.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.structs.iter().map(|s| &*s.name)
    }

    /// The struct with an id of this table.
    pub fn get(&self, id: StructId) -> &Struct {
        &self.structs[id.0 as usize]
    }

    /// The field with a name, and its index.
    pub fn field(&self, id: StructId, name: &str) -> Option<(usize, &Field)> {
        let fields = &self.get(id).fields;
        let places = self.places.get(id.0 as usize)?.get_or_init(|| {
            let mut places = FxHashMap::default();
            for (at, field) in fields.iter().enumerate() {
                places.entry(field.name.clone()).or_insert(at);
            }
            places
        });
        let at = *places.get(name)?;
        Some((at, fields.get(at)?))
    }

    /// The id for a name; the newest declaration counts.
    pub fn find(&self, name: &str) -> Option<StructId> {
        self.by_name.get(name).copied()
    }

    /// The type as written in the language: `float`, `closure color`, `vector[3]`, `struct slot`.
    pub fn show(&self, ty: Type) -> String {
        let base = match ty.base {
            Base::Int => "int",
            Base::Float => "float",
            Base::Color => "color",
            Base::Point => "point",
            Base::Vector => "vector",
            Base::Normal => "normal",
            Base::Matrix => "matrix",
            Base::String => "string",
            Base::Closure => "closure color",
            Base::Void => "void",
            Base::Struct(id) => &self.get(id).name,
            Base::Error => "<error>",
        };
        match ty.extent {
            Extent::One => base.to_string(),
            Extent::Array(n) => format!("{base}[{n}]"),
            Extent::Unsized => format!("{base}[]"),
        }
    }

    /// Equal types; any two kinds of triples; arrays of equivalent elements if their lengths agree or one is
    /// open.
    pub fn equivalent(&self, a: Type, b: Type) -> bool {
        self.equivalent_known(a, b, &mut Pairs::default())
    }

    /// The same. `known` holds the pairs of structs that were compared before, so that each pair is compared
    /// once: without it, the time would double with each level of structs that hold the level below twice.
    fn equivalent_known(&self, a: Type, b: Type, known: &mut Pairs) -> bool {
        if a.is_error() || b.is_error() {
            return true;
        }
        let extents = match (a.extent, b.extent) {
            (Extent::One, Extent::One) => true,
            (Extent::One, _) | (_, Extent::One) => false,
            (Extent::Array(n), Extent::Array(m)) => n == m,
            _ => true,
        };
        extents && self.equivalent_base(a.base, b.base, known)
    }

    fn equivalent_base(&self, a: Base, b: Base, known: &mut Pairs) -> bool {
        match (a, b) {
            (Base::Struct(a), Base::Struct(b)) if a != b => {
                // The first pair that differs ends the whole comparison, so a known pair has not differed.
                if !known.insert((a, b)) {
                    return true;
                }
                let (a, b) = (self.get(a), self.get(b));
                a.name == b.name
                    && a.fields.len() == b.fields.len()
                    && a.fields.iter().zip(&b.fields).all(|(x, y)| self.equivalent_known(x.ty, y.ty, known))
            }
            _ => a == b || (a.is_triple() && b.is_triple()),
        }
    }

    /// Whether a value of `src` may be assigned to `dst`. Float to int is assignable here (with a warning
    /// elsewhere). An array must have equivalent elements and no more of them than the destination. The
    /// caller decides about number to closure, which is permitted only for a literal zero.
    pub fn assignable(&self, dst: Type, src: Type) -> bool {
        if dst.is_error() || src.is_error() || self.equivalent(dst, src) {
            return true;
        }
        if let (Extent::Array(n), Extent::Array(m)) = (dst.extent, src.extent) {
            return m <= n && self.equivalent_base(dst.base, src.base, &mut Pairs::default());
        }
        if dst.is_array() || !src.is_number() {
            return false;
        }
        matches!(dst.base, Base::Int | Base::Float | Base::Matrix) || dst.base.is_triple()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Adds a chain of structs, each with two fields of the one before; the last.
    fn chain(table: &mut StructTable, depth: usize, end: Type) -> Type {
        let mut inner = end;
        for level in 0..depth {
            let field = |name: &str| Field { name: name.into(), ty: inner };
            let fields = vec![field("a"), field("b")];
            let id = table.add(Struct { name: format!("s{level}").into(), fields, span: Span::default() });
            inner = Type { base: Base::Struct(id), extent: Extent::One };
        }
        inner
    }

    #[test]
    fn structs_are_compared_in_time() {
        let mut table = StructTable::default();
        let [a, b] = [Type::COLOR, Type::POINT].map(|end| chain(&mut table, 100, end));
        let other = chain(&mut table, 100, Type::INT);
        assert!(table.equivalent(a, b) && table.assignable(b, a));
        assert!(!table.equivalent(a, other) && !table.assignable(other, b));
    }
}
