//! Places: variables and their parts of a type, at any depth.

use super::{Gen, Ty, Var};

/// The kind of part to find in a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Want {
    /// A part of exactly this type.
    Exactly(Ty),
    /// An array of the letter, of any length.
    Array(char),
    /// An array of the struct, of any length.
    Structs(usize),
}

impl Want {
    fn fits(self, ty: Ty) -> bool {
        match (self, ty) {
            (Want::Exactly(want), ty) => want == ty,
            (Want::Array(want), Ty::Array(have, _) | Ty::Open(have)) => want == have,
            (Want::Structs(want), Ty::Structs(have, _) | Ty::OpenStructs(have)) => want == have,
            _ => false,
        }
    }
}

fn has_components(letter: char) -> bool {
    matches!(letter, 'c' | 'p' | 'v' | 'n' | 'm')
}

impl Gen<'_> {
    /// A place of a type: a variable, an element, a field. `write` means that it must be assignable.
    pub(super) fn place(&mut self, ty: Ty, write: bool) -> Option<String> {
        self.find(Want::Exactly(ty), write)
    }

    /// An array of a letter, of any length.
    pub(super) fn array(&mut self, letter: char, write: bool) -> Option<String> {
        self.find(Want::Array(letter), write)
    }

    /// Any array.
    pub(super) fn any_array(&mut self, write: bool) -> Option<String> {
        if self.bytes.chance(100) && !self.structs.is_empty() {
            let id = self.bytes.below(self.structs.len());
            if let Some(place) = self.find(Want::Structs(id), write) {
                return Some(place);
            }
        }
        let letter = self.value_letter();
        self.array(letter, write)
    }

    /// A place in any variable.
    pub(super) fn find(&mut self, want: Want, write: bool) -> Option<String> {
        let holds = |var: &&Var| (var.write || !write) && self.contains(var.ty, want);
        let fitting: Vec<Var> = self.vars.iter().filter(holds).cloned().collect();
        if fitting.is_empty() {
            return None;
        }
        // Late variables first: they are used most.
        let var = &fitting[fitting.len() - 1 - self.bytes.below(fitting.len().min(256))];
        self.within(var.ty, var.name.clone(), want)
    }

    /// Whether a value of the type has such a part.
    fn contains(&self, ty: Ty, want: Want) -> bool {
        want.fits(ty)
            || match ty {
                Ty::One(have) => want == Want::Exactly(Ty::One('f')) && has_components(have),
                Ty::Array(have, _) | Ty::Open(have) => self.contains(Ty::One(have), want),
                Ty::Struct(id) => self.structs[id].iter().any(|field| self.contains(*field, want)),
                Ty::Structs(id, _) | Ty::OpenStructs(id) => self.contains(Ty::Struct(id), want),
            }
    }

    /// The part in a variable or part of a type.
    pub(super) fn within(&mut self, ty: Ty, path: String, want: Want) -> Option<String> {
        if want.fits(ty) {
            return Some(path);
        }
        match ty {
            Ty::One('m') => {
                let (row, column) = (self.index(4), self.index(4));
                Some(format!("{path}[{row}][{column}]"))
            }
            Ty::One(have) if has_components(have) => {
                if self.bytes.chance(60) {
                    let names = if have == 'c' { ["r", "g", "b"] } else { ["x", "y", "z"] };
                    return Some(format!("{path}.{}", self.bytes.pick(&names)));
                }
                Some(format!("{path}[{}]", self.index(3)))
            }
            Ty::One(_) => None,
            Ty::Array(have, len) => {
                let element = format!("{path}[{}]", self.index(len as usize));
                self.within(Ty::One(have), element, want)
            }
            Ty::Structs(id, len) => {
                let element = format!("{path}[{}]", self.index(len as usize));
                self.within(Ty::Struct(id), element, want)
            }
            Ty::Open(have) => {
                let element = format!("{path}[{}]", self.open_index(&path));
                self.within(Ty::One(have), element, want)
            }
            Ty::OpenStructs(id) => {
                let element = format!("{path}[{}]", self.open_index(&path));
                self.within(Ty::Struct(id), element, want)
            }
            Ty::Struct(id) => {
                let fields = self.structs[id].clone();
                let fitting: Vec<usize> =
                    (0..fields.len()).filter(|n| self.contains(fields[*n], want)).collect();
                let n = *fitting.get(self.bytes.below(fitting.len()))?;
                self.within(fields[n], format!("{path}.m{n}"), want)
            }
        }
    }

    /// An index, sometimes out of range.
    fn index(&mut self, len: usize) -> String {
        let choice = self.bytes.below(8);
        if choice < 4 || self.indices > 2 {
            return self.bytes.below(len).to_string();
        }
        self.indices += 1;
        let index = self.expr('i', 1);
        self.indices -= 1;
        if choice < 7 { format!("abs({index}) % {len}") } else { index }
    }

    /// An index of an array of unknown length.
    fn open_index(&mut self, array: &str) -> String {
        let choice = self.bytes.below(8);
        if choice < 4 || self.indices > 2 {
            return self.bytes.pick(&["0", "0", "1", "2"]).to_string();
        }
        self.indices += 1;
        let index = self.expr('i', 1);
        self.indices -= 1;
        if choice < 7 { format!("abs({index}) % arraylength({array})") } else { index }
    }
}
