//! Expressions of a type.

use super::{Gen, Scope, Ty, VALUES, word};

/// Shader globals that programs read.
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

/// Numbers that are difficult for arithmetic.
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
        self.place(Ty::One(letter), false).unwrap_or_else(|| self.literal(letter))
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
        if self.bytes.chance(12)
            && let Some(effect) = self.effect(letter, d)
        {
            return effect;
        }
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
                4 if self.scope == Scope::All => {
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

    /// An operation on a variable that one of its operands changes: all variables are read after all
    /// operands.
    fn effect(&mut self, letter: char, d: usize) -> Option<String> {
        if !matches!(letter, 'i' | 'f' | 'c' | 'v' | 'm') {
            return None;
        }
        let place = self.place(Ty::One(letter), true)?;
        let effect = match self.bytes.below(5) {
            0 => format!("({place}++)"),
            1 => format!("(--{place})"),
            2 => format!("(++{place})"),
            _ => format!("({place} = {})", self.expr(letter, d)),
        };
        let other = if self.bytes.chance(128) { place } else { self.expr(letter, d) };
        let op = if letter == 'm' { "*" } else { self.bytes.pick(&["+", "-", "*"]) };
        Some(if self.bytes.chance(128) {
            format!("({effect} {op} {other})")
        } else {
            format!("({other} {op} {effect})")
        })
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
            5 if self.scope == Scope::All => {
                let space = if letter == 'c' { self.color_space() } else { self.space() };
                format!("{of}({space}, {}, {}, {})", self.expr('f', d), self.expr('f', d), self.expr('f', d))
            }
            6 => format!("{of}({})", self.expr('f', d)),
            _ => format!("({of})({} {op} {})", self.expr(letter, d), self.expr(letter, d)),
        }
    }

    fn int(&mut self, d: usize) -> String {
        match self.bytes.below(9) {
            8 => match self.any_array(false) {
                Some(array) => format!("arraylength({array})"),
                None => self.leaf('i'),
            },
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
