//! A test case: a piece of a shader, a model of it in f64, and the domains of its arguments.

/// The number of inputs of a case, in the order of the globals that carry them: `a`, `b`, `c` are P, I, Ps,
/// and `s`, `t` are u, v.
pub(crate) const INPUTS: usize = 11;

/// The values of the inputs in f64.
#[derive(Clone, Copy)]
pub(crate) struct In(pub(crate) [f64; INPUTS]);

impl In {
    pub(crate) fn a(&self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }
    pub(crate) fn b(&self) -> [f64; 3] {
        [self.0[3], self.0[4], self.0[5]]
    }
    pub(crate) fn c(&self) -> [f64; 3] {
        [self.0[6], self.0[7], self.0[8]]
    }
    pub(crate) fn s(&self) -> f64 {
        self.0[9]
    }
    pub(crate) fn t(&self) -> f64 {
        self.0[10]
    }
}

/// Identifies the piece of a piecewise function that a model computes: the model records each decision.
/// Across pieces there is no central difference.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Piece {
    decisions: u64,
    /// Whether the point is next to an internal edge, so that arithmetic in f32 may be on the other side.
    pub(crate) blurred: bool,
}

impl Piece {
    pub(crate) fn note(&mut self, decision: i64) {
        let word = (decision as u64).wrapping_add(0x2545_f491_4f6c_dd1d);
        self.decisions = (self.decisions.rotate_left(7) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    /// Records a condition.
    pub(crate) fn is(&mut self, condition: bool) -> bool {
        self.note(i64::from(condition));
        condition
    }

    /// Records the sign of a number, computed from terms of this size.
    pub(crate) fn positive(&mut self, x: f64, terms: f64) -> bool {
        self.blurred |= x.abs() < 1e-5 * terms;
        self.is(x > 0.0)
    }

    /// Records a floor.
    pub(crate) fn floor(&mut self, x: f64) -> f64 {
        self.note(x.floor() as i64);
        x.floor()
    }
}

/// A model; a float result is the first of the three.
pub(crate) type Model = Box<dyn Fn(&In, &mut Piece) -> [f64; 3] + Sync + Send>;

/// A function of some numbers.
pub(crate) type Scalar = fn(&[f64], &mut Piece) -> f64;

/// The range of an argument's values.
#[derive(Clone, Copy)]
pub(crate) struct Domain {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Whether all magnitudes are equally likely, rather than all values; `low` is then a magnitude too.
    pub(crate) sizes: bool,
    /// Whether magnitudes come with both signs.
    pub(crate) signed: bool,
    /// The range of the extreme values,
    pub(crate) edges: (f64, f64),
    /// and their smallest magnitude, except zero.
    pub(crate) least: f64,
}

/// All values equally likely; all extreme values up to 1e10.
pub(crate) const fn even(low: f64, high: f64) -> Domain {
    Domain { low, high, sizes: false, signed: false, edges: (-1e10, 1e10), least: 0.0 }
}

/// All magnitudes equally likely, with both signs.
pub(crate) const fn sizes(low: f64, high: f64) -> Domain {
    Domain { sizes: true, signed: true, ..even(low, high) }
}

/// All positive magnitudes equally likely.
pub(crate) const fn positive(low: f64, high: f64) -> Domain {
    Domain { sizes: true, ..even(low, high) }
}

impl Domain {
    /// Only these extreme values.
    pub(crate) const fn edges(self, low: f64, high: f64) -> Domain {
        Domain { edges: (low, high), ..self }
    }

    /// Whether an extreme value belongs to the domain.
    pub(crate) fn takes(&self, edge: f64) -> bool {
        self.edges.0 <= edge && edge <= self.edges.1 && (edge == 0.0 || edge.abs() >= self.least)
    }

    /// No extreme values between zero and this magnitude.
    pub(crate) const fn least(self, least: f64) -> Domain {
        Domain { least, ..self }
    }
}

/// The permitted error of a derivative, as a fraction of the sum of all contributions. The approximations in
/// the slopes (sine, exponential, power) have errors up to about 2e-6 in their intended range, powers some
/// 1e-5 at their largest exponents; a rule has up to some 40 roundings of 6e-8 each.
pub(crate) const TOLERANCE: f64 = 3e-5;

/// A case.
pub(crate) struct Case {
    /// The row of the table of built-ins; expressions other than calls have names of their own.
    pub(crate) row: &'static str,
    /// Statements that set `f`.
    pub(crate) code: String,
    pub(crate) triple: bool,
    /// Of `a`, `b`, `c`, `s`, `t`.
    pub(crate) domains: [Domain; 5],
    /// `None`: the derivatives are exactly zero.
    pub(crate) model: Option<Model>,
    /// Inputs whose derivatives do not contribute, by the rule of the function.
    pub(crate) still: Vec<usize>,
    /// Internal roundings with the effect of moving an input by this many units in the last place of the
    /// largest input, or of 1; with their cause.
    pub(crate) inside: (f64, &'static str),
    /// The number of points with random arguments, and with some extreme arguments.
    pub(crate) points: [usize; 2],
    /// A tolerance other than [`TOLERANCE`], with its cause.
    pub(crate) tolerance: Option<(f64, &'static str)>,
}

impl Case {
    pub(crate) fn new(row: &'static str, code: &str, triple: bool, model: Model) -> Case {
        let code = if code.contains(';') { code.to_string() } else { format!("f = {code};") };
        Case {
            row,
            code,
            triple,
            domains: [even(-3.0, 3.0); 5],
            model: Some(model),
            still: Vec::new(),
            inside: (0.0, ""),
            points: [300, 200],
            tolerance: None,
        }
    }

    /// A case with zero derivatives.
    pub(crate) fn zero(row: &'static str, code: &str, triple: bool) -> Case {
        Case { model: None, ..Case::new(row, code, triple, Box::new(|_, _| [0.0; 3])) }
    }

    /// Domains of `a`, `b`, `c`, `s`, `t`; the last one is used for the remaining inputs.
    pub(crate) fn on(mut self, domains: &[Domain]) -> Case {
        for (at, domain) in self.domains.iter_mut().enumerate() {
            *domain = domains[at.min(domains.len() - 1)];
        }
        self
    }

    pub(crate) fn still(mut self, inputs: &[usize]) -> Case {
        self.still = inputs.to_vec();
        self
    }

    pub(crate) fn within(mut self, tolerance: f64, cause: &'static str) -> Case {
        self.tolerance = Some((tolerance, cause));
        self
    }

    /// The inputs that the code uses.
    pub(crate) fn used(&self) -> Vec<usize> {
        let has = |name: &str| self.code.split(|c: char| !c.is_alphanumeric() && c != '_').any(|w| w == name);
        let mut used = Vec::new();
        for (name, inputs) in [("a", 0..3), ("b", 3..6), ("c", 6..9), ("s", 9..10), ("t", 10..11)] {
            if has(name) {
                used.extend(inputs);
            }
        }
        used
    }

    /// The domain of an input.
    pub(crate) fn domain(&self, input: usize) -> Domain {
        self.domains[if input < 9 { input / 3 } else { input - 6 }]
    }

    /// Its name in messages.
    pub(crate) fn name(&self) -> String {
        format!("{}: {}", self.row, self.code)
    }
}

/// The two forms of a function that works on each component: for floats and for triples. `$0` … in `call` are
/// the arguments, with these domains.
pub(crate) fn each(row: &'static str, call: &str, domains: &[Domain], scalar: Scalar) -> Vec<Case> {
    vec![of_floats(row, call, domains, scalar), of_triples(row, call, domains, scalar)]
}

/// The form of floats of [`each`].
pub(crate) fn of_floats(row: &'static str, call: &str, domains: &[Domain], scalar: Scalar) -> Case {
    let n = domains.len();
    let mut code = call.to_string();
    for (at, name) in ["s", "t", "a[0]", "b[0]"].into_iter().enumerate() {
        code = code.replace(&format!("${at}"), name);
    }
    let model: Model = Box::new(move |x, piece| {
        let args = [x.s(), x.t(), x.0[0], x.0[3]];
        [scalar(&args[..n], piece), 0.0, 0.0]
    });
    let at = |i: usize| domains[i.min(n - 1)];
    Case::new(row, &code, false, model).on(&[at(2), at(3), at(0), at(0), at(1)])
}

/// The form of triples of [`each`].
pub(crate) fn of_triples(row: &'static str, call: &str, domains: &[Domain], scalar: Scalar) -> Case {
    let n = domains.len();
    let mut code = call.to_string();
    for (at, name) in ["a", "b", "c", "vector(s)"].into_iter().enumerate() {
        code = code.replace(&format!("${at}"), name);
    }
    let model: Model = Box::new(move |x, piece| {
        [0, 1, 2].map(|i| {
            let args = [x.0[i], x.0[3 + i], x.0[6 + i], x.s()];
            scalar(&args[..n], piece)
        })
    });
    let at = |i: usize| domains[i.min(n - 1)];
    Case::new(row, &code, true, model).on(&[at(0), at(1), at(2), at(3), at(3)])
}
