//! The facts about an operation that its line in the list gives.

/// The approximate cost of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Takes a triple apart or composes one; computes nothing.
    Part,
    /// One addition, or a few.
    Cheap,
    /// A division or a square root.
    Root,
    /// About ten operations.
    Medium,
    /// A polynomial with a simple argument reduction: exponential, logarithm, arc tangent, exact remainder.
    Exponential,
    /// A polynomial with a longer argument reduction: sine.
    Trigonometric,
    /// A logarithm, an exponential, and many special cases: a power.
    Power,
    /// A product, inverse or determinant of matrices.
    Matrix,
    /// A change of RGB system that is known only at run time.
    System,
    /// A sum over wavelengths.
    Spectrum,
}

impl Cost {
    /// The cost in additions: about the ratio of times of many such operations.
    pub fn additions(self) -> usize {
        match self {
            Cost::Part => 0,
            Cost::Cheap => 1,
            Cost::Root => 4,
            Cost::Medium => 8,
            Cost::Exponential => 10,
            Cost::Trigonometric => 16,
            Cost::Power => 40,
            Cost::Matrix | Cost::System | Cost::Spectrum => 100,
        }
    }
}

/// How a result responds to small changes of the arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// It changes little, except at isolated places such as the corner of `abs`.
    Smooth,
    /// It changes little, but jumps at some places: `mod`, `select`.
    Jump,
    /// It is constant between jumps: `floor`, `step`, the conversion to int.
    Step,
    /// It is the truth of a comparison of floats.
    Compare,
    /// Its arguments are ints, strings or closures, which have no small changes.
    Discrete,
}

/// How the fast arithmetic treats an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// The bits of the strict arithmetic.
    Strict,
    /// The formula of the strict arithmetic, except that products and sums may be fused and a reciprocal root
    /// is the fast one.
    Fused,
    /// By a cheaper formula from `numeric::fast`.
    Approximated,
}

/// The arguments for which the mathematical function has a value. Outside, the language defines the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// All finite numbers.
    Everywhere,
    /// Numbers that are not negative.
    Roots,
    /// Positive numbers.
    Logs,
    /// Numbers from -1 to 1.
    Arcs,
    /// A base and an exponent: the base is not negative, or the exponent is whole.
    Powers,
    /// The second argument is not 0.
    Divisors,
    /// Vectors other than zero.
    Directions,
}

impl Domain {
    /// Whether arguments are outside. Each is given by its components; a single number beside a triple stands
    /// for all three.
    pub fn excludes(self, args: &[Vec<f64>]) -> bool {
        let arg = |i: usize| args.get(i).map_or(&[][..], Vec::as_slice);
        let any = |i: usize, test: fn(f64) -> bool| arg(i).iter().any(|x| test(*x));
        match self {
            Domain::Everywhere => false,
            Domain::Roots => any(0, |x| x < 0.0),
            Domain::Logs => any(0, |x| x <= 0.0),
            Domain::Arcs => any(0, |x| x.abs() > 1.0),
            Domain::Powers => {
                let (bases, powers) = (arg(0), arg(1));
                let at = |list: &[f64], i: usize| list.get(i).or(list.first()).copied().unwrap_or(1.0);
                (0..bases.len().max(powers.len())).any(|i| at(bases, i) < 0.0 && at(powers, i).fract() != 0.0)
            }
            Domain::Divisors => any(1, |x| x == 0.0),
            Domain::Directions => !arg(0).is_empty() && arg(0).iter().all(|x| *x == 0.0),
        }
    }
}

/// The derivative of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivative {
    /// There is none: the result is not a float or triple, or is constant between jumps. The derivatives of
    /// the arguments are not requested.
    None,
    /// Always zero. The derivatives of the arguments are requested nevertheless, as in the reference, because
    /// this affects the last bits of the code that computes the arguments.
    Zero,
    /// None is needed: only passes after `derive` write the operation.
    Late,
    /// Written by a function of `passes::derive::rules`.
    Rule,
}
