//! Whole structs and arrays: their values and copies.

use super::place::Want;
use super::{Gen, Ty, Var};

impl Gen<'_> {
    /// A constant of a type, as an initialiser.
    pub(super) fn literal_of(&mut self, ty: Ty) -> String {
        let list = match ty {
            Ty::One(letter) => return self.literal(letter),
            Ty::Open(letter) => vec![Ty::One(letter)],
            Ty::OpenStructs(id) => vec![Ty::Struct(id)],
            Ty::Array(letter, len) => vec![Ty::One(letter); len as usize],
            Ty::Structs(id, len) => vec![Ty::Struct(id); len as usize],
            Ty::Struct(id) => self.structs[id].clone(),
        };
        let list: Vec<String> = list.into_iter().map(|part| self.literal_of(part)).collect();
        format!("{{ {} }}", list.join(", "))
    }

    /// A list of values for a type that has parts.
    fn list_of(&mut self, parts: Vec<Ty>, depth: usize) -> String {
        let values: Vec<String> = parts.into_iter().map(|part| self.part_of(part, depth)).collect();
        format!("{{ {} }}", values.join(", "))
    }

    /// A value of a type as a part of a list or of a constructor.
    fn part_of(&mut self, ty: Ty, depth: usize) -> String {
        let d = depth.saturating_sub(1);
        match ty {
            Ty::One(letter) => self.expr(letter, d),
            Ty::Struct(id) => self.struct_value(id, d, true),
            ty => {
                if self.bytes.chance(100)
                    && let Some(place) = self.place(ty, false)
                {
                    return place;
                }
                self.list(ty, d)
            }
        }
    }

    /// A list of all parts of a struct or array.
    pub(super) fn list(&mut self, ty: Ty, depth: usize) -> String {
        if depth == 0 || self.bytes.ended() {
            return self.literal_of(ty);
        }
        let parts = match ty {
            Ty::One(_) => vec![ty],
            Ty::Array(letter, len) => vec![Ty::One(letter); len as usize],
            Ty::Open(letter) => vec![Ty::One(letter); 1 + self.bytes.below(3)],
            Ty::Struct(id) => self.structs[id].clone(),
            Ty::Structs(id, len) => vec![Ty::Struct(id); len as usize],
            Ty::OpenStructs(id) => vec![Ty::Struct(id); 1 + self.bytes.below(2)],
        };
        self.list_of(parts, depth)
    }

    /// A struct: a variable or part of one, a call, a constructor, or a list if `list` permits it.
    pub(super) fn struct_value(&mut self, id: usize, depth: usize, list: bool) -> String {
        if depth > 0 && !self.bytes.ended() {
            let found = match self.bytes.below(8) {
                0..3 => self.place(Ty::Struct(id), false),
                3..6 => self.own_call(Ty::Struct(id), depth),
                _ => None,
            };
            if let Some(found) = found {
                return found;
            }
        }
        if list && self.bytes.chance(128) {
            return self.list(Ty::Struct(id), depth);
        }
        let fields = self.structs[id].clone();
        let values: Vec<String> = fields.into_iter().map(|field| self.part_of(field, depth)).collect();
        format!("S{id}({})", values.join(", "))
    }

    /// The value of a `return`.
    pub(super) fn returned(&mut self, ty: Ty) -> String {
        match ty {
            Ty::Struct(id) => self.struct_value(id, 2, true),
            Ty::One(letter) => self.expr(letter, 2),
            _ => String::new(),
        }
    }

    /// The initial value of a local variable.
    pub(super) fn initial(&mut self, ty: Ty) -> String {
        match ty {
            Ty::One(letter) => self.expr(letter, 3),
            Ty::Struct(id) => self.struct_value(id, 2, true),
            ty => self.list(ty, 2),
        }
    }

    /// An assignment of a whole struct or array, or `None` if there is no variable for it.
    pub(super) fn whole_assignment(&mut self) -> Option<String> {
        let whole: Vec<Var> =
            self.vars.iter().filter(|v| v.write && !matches!(v.ty, Ty::One(_))).cloned().collect();
        let to = whole.get(self.bytes.below(whole.len()))?;
        let mut types = Vec::new();
        self.wholes(to.ty, &mut types);
        let ty = *types.get(self.bytes.below(types.len()))?;
        let target = self.within(to.ty, to.name.clone(), Want::Exactly(ty))?;
        let value = match ty {
            Ty::Struct(id) => self.struct_value(id, 2, false),
            // A shorter array fills the first elements.
            Ty::Array(letter, len) if self.bytes.chance(60) => {
                let shorter = 1 + self.bytes.below(len as usize) as u32;
                self.place(Ty::Array(letter, shorter), false)?
            }
            ty => self.place(ty, false)?,
        };
        Some(format!("{target} = {value};"))
    }

    /// The types of the structs and arrays of known length in a type, itself among them.
    fn wholes(&self, ty: Ty, types: &mut Vec<Ty>) {
        match ty {
            Ty::One(_) | Ty::Open(_) => {}
            Ty::Array(..) => types.push(ty),
            Ty::Struct(id) => {
                types.push(ty);
                self.structs[id].iter().for_each(|field| self.wholes(*field, types));
            }
            Ty::Structs(id, _) => {
                types.push(ty);
                self.wholes(Ty::Struct(id), types);
            }
            Ty::OpenStructs(id) => self.wholes(Ty::Struct(id), types),
        }
    }
}
