use mops_math as math;
use proptest::prelude::*;

use super::*;
use crate::Dual;
use crate::expression::functions;

/// Cubic in the distance from the centre of an interval of half-length `radius`.
#[derive(Debug, Clone, Copy)]
struct Cubic {
    coefficients: [f64; 4],
    radius: f64,
}

impl Cubic {
    fn enclosure(&self) -> Enclosure {
        Enclosure::of_polynomial(&self.coefficients, self.radius)
    }

    /// Returns value and derivative at the fraction `share` from the centre to the end, -1 to 1.
    fn at(&self, share: f64) -> Dual<1> {
        let d = Dual::<1>::variable(share * self.radius, 0);
        let [a, b, c, e] = self.coefficients;
        ((d * e + c) * d + b) * d + a
    }
}

fn cubic(radius: f64) -> impl Strategy<Value = Cubic> {
    [-3.0..3.0, -3.0..3.0, -3.0..3.0, -3.0..3.0].prop_map(move |coefficients| Cubic { coefficients, radius })
}

/// Returns true if the value and the derivative of `x` lie within the bounds, up to rounding.
fn holds(bounds: Enclosure, x: Dual<1>) -> bool {
    let within = |bounds: Interval, x: f64| {
        let slop = 1e-12 * (1.0 + x.abs());
        x.is_nan() || bounds.low - slop <= x && x <= bounds.high + slop
    };
    // Outside of the domain of a function there is nothing to enclose.
    x.value.is_nan() || within(bounds.value, x.value) && within(bounds.rate, x.tangent[0])
}

type OfOne = (fn(Enclosure) -> Enclosure, fn(Dual<1>) -> Dual<1>);
type OfTwo = (fn(Enclosure, Enclosure) -> Enclosure, fn(Dual<1>, Dual<1>) -> Dual<1>);

const OF_TWO: [OfTwo; 8] = [
    (|a, b| a + b, |a, b| a + b),
    (|a, b| a - b, |a, b| a - b),
    (|a, b| a * b, |a, b| a * b),
    (|a, b| a / b, |a, b| a / b),
    (Enclosure::power, functions::power),
    (Enclosure::atan2, functions::atan2),
    (|a, b| a.holds(Comparison::Greater, b).choose(a, b), functions::max),
    (|a, b| a.holds(Comparison::AtMost, b).choose(a, b), functions::min),
];

const OF_ONE: [OfOne; 5] = [
    (|a| -a, |a| -a),
    (|a| a.power(Enclosure::from(2.0)), |a| functions::power(a, Dual::from(2.0))),
    (|a| a.power(Enclosure::from(3.0)), |a| functions::power(a, Dual::from(3.0))),
    (|a| a.power(Enclosure::from(-2.0)), |a| functions::power(a, Dual::from(-2.0))),
    (|a| a.power(Enclosure::from(0.5)), |a| functions::power(a, Dual::from(0.5))),
];

const SMOOTH: [Function; 13] = [
    Function::Sin,
    Function::Cos,
    Function::Tan,
    Function::Asin,
    Function::Acos,
    Function::Atan,
    Function::Sinh,
    Function::Cosh,
    Function::Tanh,
    Function::Exp,
    Function::Ln,
    Function::Log10,
    Function::Sqrt,
];

proptest! {
    #![proptest_config(mops_tiers::property(2_000))]

    #[test]
    fn every_value_and_slope_lies_within_the_bounds(
        a in prop_oneof![cubic(0.3), cubic(1e-3), cubic(2.0)],
        b in cubic(0.3),
        shares in prop::collection::vec(-1.0..1.0, 8),
    ) {
        let b = Cubic { radius: a.radius, ..b };
        for share in shares {
            let (x, y) = (a.at(share), b.at(share));
            for (k, (bounds, value)) in OF_TWO.iter().enumerate() {
                let (bounds, value) = (bounds(a.enclosure(), b.enclosure()), value(x, y));
                prop_assert!(holds(bounds, value), "operation {k}: {bounds:?} {value:?}");
            }
            for (k, (bounds, value)) in OF_ONE.iter().enumerate() {
                let (bounds, value) = (bounds(a.enclosure()), value(x));
                prop_assert!(holds(bounds, value), "operation {k}: {bounds:?} {value:?}");
            }
            // The derivative of a square root at 0 is infinite; by convention it is given as 0.
            for function in SMOOTH.into_iter().filter(|f| *f != Function::Sqrt || x.value != 0.0) {
                let bounds = a.enclosure().function(function);
                let value = function.smooth(x).expect("it is smooth");
                prop_assert!(holds(bounds, value), "{}: {bounds:?} {value:?}", function.name());
            }
        }
    }
}

#[test]
fn bounds_are_tight_where_a_function_is_monotone() {
    let t = Enclosure::of_time(1.0, 2.0);
    assert_eq!(t.function(Function::Exp).value, Interval::between(math::exp(1.0), math::exp(2.0)));
    assert_eq!(t.power(Enclosure::from(2.0)).value, Interval::between(1.0, 4.0));
    assert_eq!(Enclosure::of_time(0.0, 1.0).sin().value, Interval::between(0.0, math::sin(1.0)));
}

#[test]
fn a_sine_over_more_than_a_period_has_no_bounds_but_its_amplitude() {
    assert_eq!(Enclosure::of_time(-3.0, 900.0).sin().value, Interval::between(-1.0, 1.0));
    assert_eq!(Enclosure::of_time(0.5, 2.0).sin().value.high, 1.0);
    assert_eq!(Enclosure::of_time(2.0, 4.0).cos().value.low, -1.0);
}

#[test]
fn a_quotient_by_what_may_be_zero_is_unknown() {
    let quotient = Enclosure::from(1.0) / Enclosure::of_time(-1.0, 1.0);
    assert_eq!(quotient.value, Interval::ALL);
}
