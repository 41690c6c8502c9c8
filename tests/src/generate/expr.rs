//! Expressions of a type.

use super::{Gen, Ty, VALUES, Var, word};

/// Shader globals that are read.
const GLOBALS: &[(&str, char)] = &[
    ("u", 'f'),
    ("v", 'f'),
    ("P", 'p'),
    ("N", 'n'),
    ("Ng", 'n'),
    ("I", 'v'),
    ("dPdu", 'v'),
    ("dPdv", 'v'),
    ("time", 'f'),
];

/// Numbers that are hard on arithmetic.
const FLOATS: &[&str] = &[
    "0.0",
    "1.0",
    "0.5",
    "2.0",
    "(-1.0)",
    "3.25",
    "(-0.0)",
    "0.1",
    "1e-3",
    "100.0",
    "1e30",
    "1e38",
    "1e-40",
    "(-7.5)",
    "16777216.0",
    "1.5e-45",
];
const INTS: &[&str] =
    &["0", "1", "2", "3", "(-1)", "7", "31", "32", "255", "(-5)", "2147483647", "(-2147483647 - 1)", "65536"];
const STRINGS: &[&str] =
    &["\"\"", "\"a\"", "\"hello\"", "\"12\"", "\"-3.5e1\"", "\"a b,c\"", "\"nan\"", "\"tex64.png\""];

impl Gen<'_> {
    /// A constant of a type, as an initialiser.
    pub(super) fn literal_of(&mut self, ty: Ty) -> String {
        match ty {
            Ty::One(letter) => self.literal(letter),
            Ty::Array(letter, len) => {
                let list: Vec<String> = (0..len).map(|_| self.literal(letter)).collect();
                format!("{{ {} }}", list.join(", "))
            }
            Ty::Struct(id) => {
                let fields = self.structs[id].clone();
                let list: Vec<String> = fields.into_iter().map(|field| self.literal_of(field)).collect();
                format!("{{ {} }}", list.join(", "))
            }
        }
    }

    pub(super) fn literal(&mut self, letter: char) -> String {
        match letter {
            'i' => self.bytes.pick(INTS).to_string(),
            'f' => self.bytes.pick(FLOATS).to_string(),
            's' => self.bytes.pick(STRINGS).to_string(),
            'm' if self.bytes.chance(60) => {
                let list: Vec<&str> = (0..16).map(|_| self.bytes.pick(FLOATS)).collect();
                format!("matrix({})", list.join(", "))
            }
            'm' => format!("matrix({})", self.bytes.pick(FLOATS)),
            'K' => "emission()".to_string(),
            _ => {
                let [a, b, c] = std::array::from_fn(|_| self.bytes.pick(FLOATS));
                format!("{}({a}, {b}, {c})", word(letter))
            }
        }
    }

    /// A place of a type: a variable, an element, a field. `write` asks for one that can be assigned to.
    pub(super) fn place(&mut self, letter: char, write: bool) -> Option<String> {
        let holds = |var: &&Var| (var.write || !write) && self.contains(var.ty, letter);
        let fitting: Vec<Var> = self.vars.iter().filter(holds).cloned().collect();
        if fitting.is_empty() {
            return None;
        }
        // Late variables first: they are the busy ones.
        let var = &fitting[fitting.len() - 1 - self.bytes.below(fitting.len().min(256))];
        self.within(var.ty, var.name.clone(), letter)
    }

    /// Whether a value of the type has a part of the letter.
    fn contains(&self, ty: Ty, letter: char) -> bool {
        match ty {
            Ty::One(have) => have == letter || (letter == 'f' && matches!(have, 'c' | 'p' | 'v' | 'n' | 'm')),
            Ty::Array(have, _) => have == letter,
            Ty::Struct(id) => self.structs[id].iter().any(|field| self.contains(*field, letter)),
        }
    }

    fn within(&mut self, ty: Ty, path: String, letter: char) -> Option<String> {
        match ty {
            Ty::One(have) if have == letter => Some(path),
            Ty::One('m') if letter == 'f' => {
                let (row, column) = (self.index(4), self.index(4));
                Some(format!("{path}[{row}][{column}]"))
            }
            Ty::One(_) if letter == 'f' => Some(format!("{path}[{}]", self.index(3))),
            Ty::Array(_, len) => Some(format!("{path}[{}]", self.index(len as usize))),
            Ty::Struct(id) => {
                let fields = self.structs[id].clone();
                let fitting: Vec<usize> =
                    (0..fields.len()).filter(|n| self.contains(fields[*n], letter)).collect();
                let n = *fitting.get(self.bytes.below(fitting.len()))?;
                self.within(fields[n], format!("{path}.m{n}"), letter)
            }
            Ty::One(_) => None,
        }
    }

    /// An index, now and then out of range.
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

    /// An array of a letter, whatever its length.
    pub(super) fn array(&mut self, letter: char, write: bool) -> Option<String> {
        let holds =
            |var: &&Var| (var.write || !write) && matches!(var.ty, Ty::Array(have, _) if have == letter);
        let fitting: Vec<String> = self.vars.iter().filter(holds).map(|var| var.name.clone()).collect();
        fitting.get(self.bytes.below(fitting.len())).cloned()
    }

    /// A whole variable of exactly this type.
    pub(super) fn variable(&mut self, ty: Ty, write: bool) -> Option<String> {
        let fitting: Vec<String> = self
            .vars
            .iter()
            .filter(|var| var.ty == ty && (var.write || !write))
            .map(|var| var.name.clone())
            .collect();
        fitting.get(self.bytes.below(fitting.len())).cloned()
    }

    fn leaf(&mut self, letter: char) -> String {
        let choice = self.bytes.below(8);
        if choice == 7 {
            return self.literal(letter);
        }
        if choice >= 4 {
            let fitting: Vec<&str> = GLOBALS.iter().filter(|(_, l)| *l == letter).map(|(n, _)| *n).collect();
            if !fitting.is_empty() {
                return self.bytes.pick(&fitting).to_string();
            }
        }
        if self.bytes.ended() {
            return self.literal(letter);
        }
        self.place(letter, false).unwrap_or_else(|| self.literal(letter))
    }

    /// An expression of exactly this type.
    pub(super) fn expr(&mut self, letter: char, depth: usize) -> String {
        if depth == 0 || self.bytes.ended() {
            return self.leaf(letter);
        }
        match self.bytes.below(8) {
            0 | 1 => self.leaf(letter),
            2 => self.conditional(letter, depth),
            3 | 4 => self.call_of(letter, depth).unwrap_or_else(|| self.leaf(letter)),
            _ => self.operation(letter, depth),
        }
    }

    fn conditional(&mut self, letter: char, depth: usize) -> String {
        let cond = self.expr('i', depth - 1);
        if letter == 'K' {
            return self.leaf('K');
        }
        let (a, b) = (self.expr(letter, depth - 1), self.expr(letter, depth - 1));
        format!("({cond} ? {a} : {b})")
    }

    fn operation(&mut self, letter: char, depth: usize) -> String {
        let d = depth - 1;
        match letter {
            'i' => self.int(d),
            'f' => match self.bytes.below(8) {
                0 => format!("(-{})", self.expr('f', d)),
                1 => format!("float({})", self.expr('i', d)),
                2 => {
                    let from = self.bytes.pick(&['i', 'f']);
                    let op = self.bytes.pick(&["+", "-", "*", "/"]);
                    format!("({} {op} {})", self.expr('f', d), self.expr(from, d))
                }
                _ => {
                    let op = self.bytes.pick(&["+", "-", "*", "/"]);
                    format!("({} {op} {})", self.expr('f', d), self.expr('f', d))
                }
            },
            'm' => match self.bytes.below(6) {
                0 => format!("(-{})", self.expr('m', d)),
                1 => format!("({} * {})", self.expr('f', d), self.expr('m', d)),
                2 => format!("({} / {})", self.expr('m', d), self.expr('f', d)),
                3 => format!("({} / {})", self.expr('m', d), self.expr('m', d)),
                4 => {
                    let names = [self.space(), self.space()];
                    format!("matrix({}, {})", names[0], names[1])
                }
                _ => format!("({} * {})", self.expr('m', d), self.expr('m', d)),
            },
            's' => self.leaf('s'),
            'K' => match self.bytes.below(3) {
                0 => format!("({} + {})", self.expr('K', d), self.expr('K', d)),
                1 => format!("({} * {})", self.expr('K', d), self.expr('f', d)),
                _ => format!("({} * {})", self.expr('c', d), self.expr('K', d)),
            },
            _ => self.triple(letter, d),
        }
    }

    fn triple(&mut self, letter: char, d: usize) -> String {
        let op = self.bytes.pick(&["+", "-", "*", "/"]);
        let of = word(letter);
        match self.bytes.below(8) {
            0 => format!("(-{})", self.expr(letter, d)),
            1 => format!("({of})({} {op} {})", self.expr(letter, d), self.expr('f', d)),
            2 => format!("({of})({} {op} {})", self.expr('f', d), self.expr(letter, d)),
            3 => format!("{of}({}, {}, {})", self.expr('f', d), self.expr('f', d), self.expr('f', d)),
            4 => {
                let other = self.bytes.pick(&['c', 'p', 'v', 'n']);
                format!("({of})({} {op} {})", self.expr(letter, d), self.expr(other, d))
            }
            5 => {
                let space = if letter == 'c' { self.color_space() } else { self.space() };
                format!("{of}({space}, {}, {}, {})", self.expr('f', d), self.expr('f', d), self.expr('f', d))
            }
            6 => format!("{of}({})", self.expr('f', d)),
            _ => format!("({of})({} {op} {})", self.expr(letter, d), self.expr(letter, d)),
        }
    }

    fn int(&mut self, d: usize) -> String {
        match self.bytes.below(8) {
            0 => format!("({}{})", self.bytes.pick(&["-", "~", "!"]), self.expr('i', d)),
            1 => format!("int({})", self.expr('f', d)),
            2 => {
                let op = self.bytes.pick(&["<", "<=", ">", ">=", "==", "!="]);
                format!("({} {op} {})", self.expr('f', d), self.expr('f', d))
            }
            3 => {
                let letter = self.bytes.pick(VALUES);
                let op = self.bytes.pick(&["==", "!="]);
                format!("({} {op} {})", self.expr(letter, d), self.expr(letter, d))
            }
            4 => {
                let op = self.bytes.pick(&["&&", "||"]);
                let (a, b) = (self.bytes.pick(&['i', 'f']), self.bytes.pick(&['i', 'f', 'c']));
                format!("({} {op} {})", self.expr(a, d), self.expr(b, d))
            }
            _ => {
                let op = self
                    .bytes
                    .pick(&["+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>", "<", "<=", ">", ">="]);
                format!("({} {op} {})", self.expr('i', d), self.expr('i', d))
            }
        }
    }
}
