//! Statements.

use super::{Gen, NOTHING, Scope, Ty, Var};

impl Gen<'_> {
    /// A block of statements in braces; `depth` bounds the nesting in it.
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
        let choice = self.bytes.below(if depth == 0 { 12 } else { 18 });
        match choice {
            0..3 => self.declaration(),
            3..7 => self.assignment(),
            7 => self.void_call(),
            8 => self.jump(),
            9 => self.step(),
            10 | 11 => self.own_statement(),
            12..15 => self.branch(depth),
            15 => self.counted(depth),
            16 => self.conditioned(depth),
            _ => self.block(depth - 1),
        }
    }

    pub(super) fn declaration(&mut self) {
        let ty = self.any_type();
        let value = match ty {
            _ if self.bytes.chance(25) => None,
            Ty::One(_) | Ty::Struct(_) => Some(self.initial(ty)),
            _ if self.bytes.chance(128) => Some(self.initial(ty)),
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
        if self.bytes.chance(60)
            && let Some(line) = self.whole_assignment()
        {
            return self.line(&line);
        }
        let letter = if self.bytes.chance(12) && self.scope == Scope::All { 'K' } else { self.any_value() };
        let Some(place) = self.place(Ty::One(letter), true) else { return self.declaration() };
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

    /// A call of one of the program's functions for its side effects.
    fn own_statement(&mut self) {
        let returns: Vec<Ty> = self.functions.iter().map(|function| function.ret).collect();
        let Some(ret) = returns.get(self.bytes.below(returns.len())) else { return self.assignment() };
        match self.own_call(*ret, 2) {
            Some(call) => self.line(&format!("{call};")),
            None => self.assignment(),
        }
    }

    fn jump(&mut self) {
        let jump = match self.returns {
            _ if self.loops > 0 && self.bytes.chance(160) => {
                self.bytes.pick(&["break", "continue"]).to_string()
            }
            Some(NOTHING) => "return".to_string(),
            Some(_) if self.bytes.chance(30) => "exit()".to_string(),
            Some(ty) => format!("return {}", self.returned(ty)),
            None => self.bytes.pick(&["return", "exit()"]).to_string(),
        };
        let cond = self.expr('i', 2);
        self.line(&format!("if ({cond}) {jump};"));
    }

    fn step(&mut self) {
        let letter = self.bytes.pick(&['i', 'f']);
        if let Some(place) = self.place(Ty::One(letter), true) {
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

    /// A `while` or `do` with another condition in addition to the counter.
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
