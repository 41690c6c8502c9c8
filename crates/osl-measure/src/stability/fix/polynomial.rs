//! Sums as polynomials: what cancels when products are expanded, and powers around their centre.
//!
//! An atom is a term that is no sum, product or number; a monomial is a product of powers of atoms.

use super::term::{Head, Term, binds, product, sum};
use std::collections::BTreeMap;

/// Maximum number of monomials while a sum is expanded.
const MOST: usize = 64;
/// Maximum degree of a monomial.
const DEGREE: i32 = 8;
/// A coefficient below this share of what was added up to it counts as 0: numbers of the source are rounded.
const NOTHING: f64 = 3e-7;

/// The exponent of each atom that a monomial has, by the number of the atom.
type Monomial = BTreeMap<usize, i32>;

/// A polynomial: for each monomial its coefficient, and the sum of the sizes of what was added up to it.
#[derive(Clone, Debug, Default)]
struct Polynomial(BTreeMap<Vec<(usize, i32)>, (f64, f64)>);

/// The atoms of an expansion.
#[derive(Default)]
struct Atoms {
    terms: Vec<Term>,
    /// Whether the parts of a sum that is the value of a variable are atoms.
    keeps_parts: bool,
}

impl Polynomial {
    fn number(x: f64) -> Polynomial {
        Polynomial(BTreeMap::from([(Vec::new(), (x, x.abs()))]))
    }

    fn add(&mut self, other: &Polynomial, factor: f64) {
        for (monomial, (x, size)) in &other.0 {
            let own = self.0.entry(monomial.clone()).or_default();
            own.0 += factor * x;
            own.1 += factor.abs() * size;
        }
    }

    fn times(&self, other: &Polynomial) -> Option<Polynomial> {
        let mut out = Polynomial::default();
        for (a, (x, size_x)) in &self.0 {
            for (b, (y, size_y)) in &other.0 {
                let mut both: Monomial = a.iter().copied().collect();
                b.iter().for_each(|(atom, n)| *both.entry(*atom).or_default() += n);
                let monomial: Vec<(usize, i32)> = both.into_iter().filter(|(_, n)| *n != 0).collect();
                let own = out.0.entry(monomial).or_default();
                own.0 += x * y;
                own.1 += size_x * size_y;
            }
        }
        let fits = out.0.len() <= MOST && out.0.keys().flatten().all(|(_, n)| n.abs() <= DEGREE);
        fits.then_some(out)
    }

    /// The reciprocal of a single monomial.
    fn reciprocal(&self) -> Option<Polynomial> {
        let mut list = self.0.iter();
        let (Some((monomial, (x, size))), None) = (list.next(), list.next()) else { return None };
        let is_one = *x != 0.0 && *size <= x.abs() * (1.0 + NOTHING);
        let monomial = monomial.iter().map(|(atom, n)| (*atom, -n)).collect();
        is_one.then(|| Polynomial(BTreeMap::from([(monomial, (1.0 / x, 1.0 / x.abs()))])))
    }

    /// Removes the monomials that cancel. Returns how many there were.
    fn clean(&mut self) -> usize {
        let before = self.0.len();
        self.0.retain(|_, (x, size)| x.abs() > NOTHING * *size);
        self.0.values_mut().for_each(|(x, size)| *size = x.abs());
        before - self.0.len()
    }
}

impl Atoms {
    fn number_of(&mut self, term: &Term) -> usize {
        let at = self.terms.iter().position(|other| other.same(term));
        at.unwrap_or_else(|| {
            self.terms.push(term.clone());
            self.terms.len() - 1
        })
    }

    fn atom(&mut self, term: &Term) -> Option<Polynomial> {
        if !term.is_pure {
            return None;
        }
        let at = self.number_of(term);
        Some(Polynomial(BTreeMap::from([(vec![(at, 1)], (1.0, 1.0))])))
    }

    fn expand(&mut self, term: &Term) -> Option<Polynomial> {
        match &term.head {
            Head::Number(x) => Some(Polynomial::number(*x)),
            Head::Group => self.expand(term.parts.first()?),
            Head::Sum(flags) => {
                let is_value = self.keeps_parts && term.text.as_ref().is_some_and(|text| is_word(text));
                let mut out = Polynomial::default();
                for (minus, part) in flags.iter().zip(&term.parts) {
                    let is_atom = is_value && !matches!(part.head, Head::Number(_));
                    let own = if is_atom { self.atom(part)? } else { self.expand(part)? };
                    out.add(&own, if *minus { -1.0 } else { 1.0 });
                }
                Some(out)
            }
            Head::Product(flags) => {
                let mut out = Polynomial::number(1.0);
                for (divides, part) in flags.iter().zip(&term.parts) {
                    let mut own = self.expand(part)?;
                    if *divides {
                        own.clean();
                        own = match own.reciprocal() {
                            Some(own) => own,
                            None => self.atom(part)?.reciprocal()?,
                        };
                    }
                    out = out.times(&own)?;
                }
                Some(out)
            }
            _ => self.atom(term),
        }
    }

    /// The term of a polynomial, with the atoms that most monomials share in front.
    fn write(&self, p: &Polynomial) -> Option<Term> {
        let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
        for (atom, _) in p.0.keys().flatten().filter(|(_, n)| *n > 0) {
            *uses.entry(*atom).or_default() += 1;
        }
        let shared = uses.iter().max_by_key(|(atom, count)| (**count, std::cmp::Reverse(**atom)));
        match shared {
            Some((atom, count)) if *count > 1 => {
                let (mut within, mut rest) = (Polynomial::default(), Polynomial::default());
                for (monomial, x) in &p.0 {
                    if monomial.iter().any(|(own, n)| own == atom && *n > 0) {
                        let less = monomial.iter().map(|(own, n)| (*own, n - i32::from(own == atom)));
                        within.0.insert(less.filter(|(_, n)| *n != 0).collect(), *x);
                    } else {
                        rest.0.insert(monomial.clone(), *x);
                    }
                }
                let inner = self.write(&within)?;
                let front = self.terms.get(*atom)?.clone();
                let term = product(vec![(false, front), (false, grouped(inner))]);
                if rest.0.is_empty() { Some(term) } else { Some(added(self.write(&rest)?, term)) }
            }
            _ => {
                let parts = p.0.iter().map(|(monomial, (x, _))| self.monomial(monomial, *x));
                let mut parts = parts.collect::<Option<Vec<(bool, Term)>>>()?;
                parts.sort_by_key(|(minus, _)| *minus);
                if parts.is_empty() { Some(Term::number(0.0)) } else { Some(sum(parts)) }
            }
        }
    }

    fn monomial(&self, monomial: &[(usize, i32)], x: f64) -> Option<(bool, Term)> {
        let mut factors = Vec::new();
        let size = x.abs();
        // A number and its reciprocal are the same; the one that is written shorter stands there.
        let inverse = 1.0 / size;
        let divides =
            (inverse - inverse.round()).abs() < 1e-12 && size.fract() != 0.0 && !monomial.is_empty();
        if size != 1.0 && !divides || monomial.iter().all(|(_, n)| *n < 0) {
            factors.push((false, Term::number(size)));
        }
        for (atom, n) in monomial {
            let term = self.terms.get(*atom)?;
            factors.extend((0..n.abs()).map(|_| (*n < 0, term.clone())));
        }
        if divides {
            factors.push((true, Term::number(inverse)));
        }
        Some((x < 0.0, product(factors)))
    }
}

fn is_word(text: &str) -> bool {
    text.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// A sum that keeps its parentheses.
fn grouped(term: Term) -> Term {
    match term.head {
        Head::Sum(ref flags) if flags.len() > 1 => Term::new(Head::Group, vec![term]),
        _ => term,
    }
}

/// `a + b`, or `a - c` if `b` is `-c`.
fn added(a: Term, b: Term) -> Term {
    match &b.head {
        Head::Sum(flags) if flags == &[true] && b.parts.len() == 1 => {
            sum(vec![(false, a), (true, b.parts[0].clone())])
        }
        _ => sum(vec![(false, a), (false, b)]),
    }
}

/// The expansions of a sum: with all products multiplied out, and with the parts of what variables stand for
/// as atoms.
fn expansions(term: &Term) -> Vec<(Atoms, Polynomial)> {
    let expanded = |keeps_parts| {
        let mut atoms = Atoms { keeps_parts, ..Atoms::default() };
        let p = atoms.expand(term)?;
        Some((atoms, p))
    };
    [false, true].into_iter().filter_map(expanded).collect()
}

/// The term without what cancels when its products are expanded, in each way in which something does.
pub(super) fn expanded(term: &Term) -> Vec<Term> {
    let cancels = |(atoms, mut p): (Atoms, Polynomial)| {
        if p.clean() == 0 {
            return None;
        }
        atoms.write(&p)
    };
    if matches!(term.head, Head::Sum(_)) {
        expansions(term).into_iter().filter_map(cancels).collect()
    } else {
        Vec::new()
    }
}

/// The term around the centre of its powers: a polynomial of one atom whose roots nearly coincide is a power
/// of the distance from their mean. Returns the term, in which the distance has this text, and the distance.
pub(super) fn around_centre(term: &Term, name: &str) -> Option<(Term, Term)> {
    let (atoms, mut p) = expansions(term).into_iter().next()?;
    p.clean();
    let mut powers = Vec::new();
    for (monomial, (x, _)) in &p.0 {
        let power = match monomial[..] {
            [] => 0,
            [(0, n)] if n > 0 => n as usize,
            _ => return None,
        };
        if powers.len() <= power {
            powers.resize(power + 1, 0.0);
        }
        powers[power] += x;
    }
    let degree = powers.len().checked_sub(1).filter(|degree| *degree >= 2)?;
    let centre = f64::from((-powers[degree - 1] / (degree as f64 * powers[degree])) as f32);
    if centre == 0.0 || !centre.is_finite() {
        return None;
    }
    // Horner's scheme, once for each power of the distance.
    let mut sizes: Vec<f64> = powers.iter().map(|x| x.abs()).collect();
    for first in 0..degree {
        for at in (first..degree).rev() {
            powers[at] += centre * powers[at + 1];
            sizes[at] += centre.abs() * sizes[at + 1];
        }
    }
    let mut around = Polynomial::default();
    for (power, (x, size)) in powers.iter().zip(&sizes).enumerate() {
        let monomial = if power == 0 { Vec::new() } else { vec![(0, power as i32)] };
        around.0.insert(monomial, (*x, *size));
    }
    // The next lower power is gone in any case.
    if around.clean() < 2 {
        return None;
    }
    let x = atoms.terms.first()?.clone();
    let ty = x.ty;
    let shift = (centre > 0.0, Term::number(centre.abs()));
    let distance = Term { ty, ..sum(vec![(false, x), shift]) };
    let local = Term {
        text: Some(name.into()),
        binds: binds::WHOLE,
        ty,
        ..Term::new(Head::Leaf(name.into()), Vec::new())
    };
    let term = Atoms { terms: vec![local], keeps_parts: false }.write(&around)?;
    Some((term, distance))
}

/// The factors that all parts of a sum share, and the sum of what is left of them.
pub(super) fn common_factor(term: &Term) -> Option<(Vec<(bool, Term)>, Term)> {
    let Head::Sum(flags) = &term.head else { return None };
    let mut lists: Vec<Vec<(bool, Term)>> = term.parts.iter().map(|part| part.items(false)).collect();
    let mut common = Vec::new();
    for item in lists.first()?.clone() {
        let at = |list: &Vec<(bool, Term)>| list.iter().position(|(d, t)| *d == item.0 && t.same(&item.1));
        if let Some(places) = lists.iter().map(at).collect::<Option<Vec<usize>>>() {
            lists.iter_mut().zip(places).for_each(|(list, at)| drop(list.remove(at)));
            common.push(item);
        }
    }
    if common.is_empty() || flags.len() < 2 {
        return None;
    }
    let left = |list: Vec<(bool, Term)>| match list.iter().all(|(divides, _)| *divides) {
        true => product(std::iter::once((false, Term::number(1.0))).chain(list).collect()),
        false => product(list),
    };
    let parts: Vec<Term> = lists.into_iter().map(left).collect();
    let mut inner = sum(flags.iter().copied().zip(parts).collect());
    inner.covers.extend(term.covers.iter().copied());
    inner.ty = inner.ty.or(term.ty);
    Some((common, inner))
}

#[cfg(test)]
mod tests {
    use super::super::term::parse;
    use super::super::writing::show;
    use super::*;

    /// A text of the table's language, whose letters are variables.
    fn named(text: &str) -> Term {
        fn leaves(mut term: Term) -> Term {
            term.parts = term.parts.into_iter().map(leaves).collect();
            if let Head::Any(letter) = term.head {
                let name = letter.to_string();
                let leaf = Term::new(Head::Leaf(name.as_str().into()), Vec::new());
                return Term { text: Some(name.as_str().into()), ..leaf };
            }
            term
        }
        leaves(parse(text).unwrap())
    }

    fn shown(term: Option<Term>) -> String {
        term.map(|term| show(&term).0).unwrap_or_default()
    }

    #[test]
    fn products_that_cancel_are_expanded() {
        let expanded = |text: &str| shown(expanded(&named(text)).into_iter().next());
        assert_eq!(expanded("1 - (1 - e) * (1 - e)"), "e * (2 - e)");
        assert_eq!(expanded("a * (b + c) - a * b"), "a * c");
        assert_eq!(expanded("4 - (1 - (1 - e) * (1 - e)) / e"), "2 + e");
        assert_eq!(expanded("a * b - c"), "");
    }

    #[test]
    fn powers_are_taken_around_their_centre() {
        let around = |text: &str| {
            let found = around_centre(&named(text), "d");
            found.map(|(term, d)| format!("{} | {}", show(&term).0, show(&d).0)).unwrap_or_default()
        };
        assert_eq!(around("x * x - 2 * x + 1"), "d * d | x - 1");
        assert_eq!(around("x * x * x * x - 4 * x * x * x + 6 * x * x - 4 * x + 1"), "d * d * d * d | x - 1");
        assert_eq!(around("x * x - 2 * x + 3"), "");
        assert_eq!(around("x * x - y"), "");
    }

    #[test]
    fn factors_of_all_parts_are_taken_out() {
        let (factors, inner) = common_factor(&named("k * a * x - k * b * x")).unwrap();
        assert_eq!((factors.len(), show(&inner).0.as_str()), (2, "a - b"));
        assert!(common_factor(&named("a - b")).is_none());
    }
}
