//! The facts in the lines of the lane operations are consistent with each other and with facts stored
//! elsewhere.

#![allow(missing_docs, reason = "a test says what must hold")]

use osl_numeric::fast::BOUNDS;
use osl_numeric::{Continuity, Derivative, Kind, LaneOp};
use std::collections::BTreeSet;

fn is_number(kind: Kind) -> bool {
    matches!(kind, Kind::Float | Kind::Triple)
}

/// An operation with a derivative returns a float or triple, computed from one, and is not constant between
/// jumps.
#[test]
fn only_what_changes_has_a_derivative() {
    for op in LaneOp::ALL.iter().filter(|op| op.derivative() == Derivative::Rule) {
        let shape = op.shape();
        assert!(is_number(shape.result), "{op:?}");
        assert!(shape.args.iter().any(|kind| is_number(*kind)), "{op:?}");
        assert!(matches!(op.continuity(), Continuity::Smooth | Continuity::Jump), "{op:?}");
    }
}

/// A smooth operation has a derivative, if it returns a float or triple computed from such: matrices have
/// none.
#[test]
fn what_is_smooth_says_what_its_derivative_is() {
    for op in LaneOp::ALL.iter().filter(|op| op.continuity() == Continuity::Smooth) {
        let shape = op.shape();
        if is_number(shape.result) && shape.args.iter().any(|kind| is_number(*kind)) {
            assert_ne!(op.derivative(), Derivative::None, "{op:?}");
        }
    }
}

#[test]
fn continuity_suits_the_kinds() {
    for op in LaneOp::ALL {
        let shape = op.shape();
        let of_floats =
            shape.args.iter().any(|kind| matches!(kind, Kind::Float | Kind::Triple | Kind::Matrix));
        assert_eq!(op.continuity() == Continuity::Discrete, !of_floats, "{op:?}");
        if op.continuity() == Continuity::Compare {
            assert_eq!(shape.result, Kind::Int, "{op:?}");
        }
    }
}

/// Each approximated function of one argument has an error bound in a separate list, and no other function
/// has.
#[test]
fn every_approximated_function_of_one_argument_has_a_bound() {
    let one = |op: &&LaneOp| op.is_approximated() && op.shape().args.len() == 1;
    let approximated: BTreeSet<&str> = LaneOp::ALL.iter().filter(one).map(|op| op.text()).collect();
    let bounded: BTreeSet<&str> = BOUNDS.iter().map(|bound| bound.name).collect();
    assert_eq!(approximated, bounded);
    assert_eq!(BOUNDS.len(), bounded.len());
}

#[test]
fn no_operation_takes_more_arguments_than_there_is_room_for() {
    let most = LaneOp::ALL.iter().map(|op| op.shape().args.len()).max();
    assert_eq!(most, Some(osl_numeric::MAX_ARGS));
}

type One = fn(f64) -> f64;
type Two = fn(f64, f64) -> f64;

/// Arguments that a domain excludes give no finite number in C's arithmetic, and those that it holds do.
#[test]
fn domains_hold_what_has_a_value() {
    let excludes = |op: LaneOp, args: &[f64]| {
        let args: Vec<Vec<f64>> = args.iter().map(|x| vec![*x]).collect();
        op.domain().excludes(&args)
    };
    let one: [(LaneOp, One); 7] = [
        (LaneOp::Sqrt, f64::sqrt),
        (LaneOp::InverseSqrt, |x| 1.0 / x.sqrt()),
        (LaneOp::Log, f64::ln),
        (LaneOp::Log2, f64::log2),
        (LaneOp::Log10, f64::log10),
        (LaneOp::Asin, f64::asin),
        (LaneOp::Acos, f64::acos),
    ];
    let numbers = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5];
    for (op, function) in one {
        for x in numbers {
            assert_eq!(excludes(op, &[x]), !function(x).is_finite(), "{op:?} of {x}");
        }
    }
    let two: [(LaneOp, Two); 4] = [
        (LaneOp::FDiv, |a, b| a / b),
        (LaneOp::Fmod, |a, b| a % b),
        (LaneOp::Mod, |a, b| a - b * (a / b).floor()),
        (LaneOp::Pow, |a, b| if a == 0.0 { 0.0 } else { a.powf(b) }),
    ];
    for (op, function) in two {
        for (x, y) in numbers.into_iter().flat_map(|x| numbers.map(|y| (x, y))) {
            assert_eq!(excludes(op, &[x, y]), !function(x, y).is_finite(), "{op:?} of {x} and {y}");
        }
    }
    assert!(LaneOp::Normalize.domain().excludes(&[vec![0.0; 3]]));
    assert!(!LaneOp::Normalize.domain().excludes(&[vec![0.0, 0.0, 1.0]]));
}
