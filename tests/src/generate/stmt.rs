//! Statements.

use super::{Gen, Ty, Var};

impl Gen<'_> {
    /// A block of statements in braces; `depth` bounds what is nested in it.
    pub(super) fn block(&mut self, depth: usize) {
        let mark = self.vars.len();
        self.line("{");
        self.indent += 1;
        let most = self.left;
        for _ in 0..most {
            if self.left == 0 || self.bytes.ended() || (depth < 3 && self.bytes.chance(50)) {
                break;
            }
            self.left -= 1;
            self.statement(depth);
        }
        self.indent -= 1;
        self.line("}");
        self.vars.truncate(mark);
    }

    fn statement(&mut self, depth: usize) {
        let choice = self.bytes.below(if depth == 0 { 10 } else { 16 });
        match choice {
            0..3 => self.declaration(),
            3..7 => self.assignment(),
            7 => self.void_call(),
            8 => self.jump(),
            9 => self.step(),
            10..13 => self.branch(depth),
            13 => self.counted(depth),
            14 => self.conditioned(depth),
            _ => self.block(depth - 1),
        }
    }

    fn declaration(&mut self) {
        let ty = self.any_type();
        let value = match ty {
            _ if self.bytes.chance(25) => None,
            Ty::One(letter) => Some(self.expr(letter, 3)),
            _ => Some(self.literal_of(ty)),
        };
        let name = self.name("x");
        let head = Self::declarator(ty, &name);
        match value {
            Some(value) => self.line(&format!("{head} = {value};")),
            None => self.line(&format!("{head};")),
        }
        self.vars.push(Var { name, ty, write: true });
    }

    fn assignment(&mut self) {
        let whole: Vec<Var> =
            self.vars.iter().filter(|v| v.write && !matches!(v.ty, Ty::One(_))).cloned().collect();
        if self.bytes.chance(30) && !whole.is_empty() {
            let to = &whole[self.bytes.below(whole.len())];
            if let Some(from) = self.variable(to.ty, false) {
                return self.line(&format!("{} = {from};", to.name));
            }
        }
        let letter = if self.bytes.chance(12) { 'K' } else { self.any_value() };
        let Some(place) = self.place(letter, true) else { return self.declaration() };
        let op = match letter {
            'i' => self.bytes.pick(&["=", "=", "+=", "-=", "*=", "/=", "&=", "|=", "^=", "<<=", ">>="]),
            'f' | 'c' | 'p' | 'v' | 'n' => self.bytes.pick(&["=", "=", "=", "+=", "-=", "*=", "/="]),
            'm' => self.bytes.pick(&["=", "=", "*=", "/="]),
            'K' => self.bytes.pick(&["=", "+="]),
            _ => "=",
        };
        let value = self.expr(letter, 4);
        self.line(&format!("{place} {op} {value};"));
    }

    fn void_call(&mut self) {
        if let Some(call) = self.call_of('x', 2) {
            self.line(&format!("{call};"));
        }
    }

    fn jump(&mut self) {
        let jump = match self.returns {
            _ if self.loops > 0 && self.bytes.chance(160) => {
                self.bytes.pick(&["break", "continue"]).to_string()
            }
            Some('x') => "return".to_string(),
            Some(letter) => format!("return {}", self.expr(letter, 2)),
            None => self.bytes.pick(&["return", "exit()"]).to_string(),
        };
        let cond = self.expr('i', 2);
        self.line(&format!("if ({cond}) {jump};"));
    }

    fn step(&mut self) {
        let letter = self.bytes.pick(&['i', 'f']);
        if let Some(place) = self.place(letter, true) {
            let text = match self.bytes.below(4) {
                0 => format!("{place}++;"),
                1 => format!("{place}--;"),
                2 => format!("++{place};"),
                _ => format!("--{place};"),
            };
            self.line(&text);
        }
    }

    fn branch(&mut self, depth: usize) {
        let letter = self.bytes.pick(&['i', 'i', 'f']);
        let cond = self.expr(letter, 3);
        self.line(&format!("if ({cond})"));
        self.block(depth - 1);
        if self.bytes.chance(120) {
            self.line("else");
            self.block(depth - 1);
        }
    }

    /// A loop over a counter that its body cannot write.
    fn counted(&mut self, depth: usize) {
        let name = self.name("i");
        let rounds = if self.bytes.chance(90) {
            format!("abs({}) % 4", self.expr('i', 1))
        } else {
            (1 + self.bytes.below(4)).to_string()
        };
        self.line(&format!("for (int {name} = 0; {name} < {rounds}; {name}++)"));
        self.body(name, depth);
    }

    fn body(&mut self, counter: String, depth: usize) {
        let mark = self.vars.len();
        self.vars.push(Var { name: counter, ty: Ty::One('i'), write: false });
        self.loops += 1;
        self.block(depth - 1);
        self.loops -= 1;
        self.vars.truncate(mark);
    }

    /// A `while` or `do` with a condition of its own besides the counter.
    fn conditioned(&mut self, depth: usize) {
        let name = self.name("w");
        let most = 1 + self.bytes.below(4);
        let cond = self.expr('i', 2);
        self.line(&format!("int {name} = 0;"));
        if self.bytes.chance(128) {
            self.line(&format!("while ({name}++ < {most} && {cond})"));
            self.body(name, depth);
        } else {
            self.line("do");
            self.body(name.clone(), depth);
            self.line(&format!("while (++{name} < {most} && {cond});"));
        }
    }
}
