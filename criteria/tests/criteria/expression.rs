//! Tests of the value of a formula.

use mops_core::{Case, CriterionSpec, Interface, Parameter, Variable};
use mops_criteria::expression::Expression;
use mops_language::Unit;
use mops_math as math;

use crate::testing::{assert_near, simulated};

fn model() -> Interface {
    Interface {
        signals: vec![Variable::new("y", "mm", ""), Variable::new("u", "V", "")],
        parameters: vec![Parameter::new("m", "g", "mass")],
        ..Interface::default()
    }
}

fn formula(value: &str) -> Expression {
    Expression { value: value.into(), unit: None }
}

fn value(text: &str) -> (f64, String) {
    // y = 1000 sin t mm and u = 1000 sin t V over [0, 10] s; m = 500 g.
    let analysis = simulated(10.0, |t| 1e3 * math::sin(t));
    let bound = formula(text).bind(&model()).unwrap();
    (bound.value_with(&Case::default(), &analysis, &[500.0]).unwrap().number, bound.unit().to_string())
}

fn mistake(text: &str) -> String {
    formula(text).bind(&model()).err().unwrap().to_string()
}

#[test]
fn reductions_have_their_closed_forms_in_coherent_units() {
    let (sin, cos) = math::sin_cos(10.0);
    let squares = 5.0 - 0.5 * sin * cos;
    for (text, expected, unit) in [
        ("maximum(y)", 1.0, "m"),
        ("minimum(y)", -1.0, "m"),
        ("initial(y)", 0.0, "m"),
        ("final(y)", sin, "m"),
        ("integral(y)", 1.0 - cos, "m s"),
        ("mean(y)", (1.0 - cos) / 10.0, "m"),
        ("rms(y)", (squares / 10.0).sqrt(), "m"),
        ("integral(y^2)", squares, "m2 s"),
        ("2*m*maximum(y)", 1.0, "kg m"),
        ("maximum(m*y) + 0.5 [kg m]", 1.0, "kg m"),
        ("sqrt(integral(abs(y)*abs(y))/1 [s])", squares.sqrt(), "m"),
        // Kinks and jumps of the formula.
        ("maximum(sign(y))", 1.0, "1"),
        ("minimum(abs(y))", 0.0, "m"),
        ("integral(abs(y))", 7.0 + cos, "m s"),
        ("integral(sign(y))", 4.0 * std::f64::consts::PI - 10.0, "s"),
        ("maximum(if(y > 0.5 [m], 1, 0))", 1.0, "1"),
    ] {
        let (found, of) = value(text);
        assert_near(found, expected, 1e-7);
        assert!(Unit::known(&of).is_compatible(&Unit::known(unit)), "{text}: {of}");
    }
    let in_mm = Expression { unit: Some("mm".into()), ..formula("maximum(y)") }.bind(&model()).unwrap();
    let analysis = simulated(10.0, |t| 1e3 * math::sin(t));
    assert_near(in_mm.value_with(&Case::default(), &analysis, &[1.0]).unwrap().number, 1e3, 1e-6);
}

#[test]
fn what_is_no_number_and_what_does_not_fit_is_refused() {
    for (text, fact) in [
        ("y", "`y` is a signal"),
        ("maximum(z)", "no signal and no parameter `z`"),
        ("q + 1", "neither another criterion"),
        ("maximum(y) + maximum(u)", "same dimension"),
        ("maximum(2*m)", "contains no signal"),
        ("maximum(y", "expected"),
        ("maximum(y, u)", "takes one argument"),
        ("maximum(maximum(y))", "is no time response"),
    ] {
        assert!(mistake(text).contains(fact), "{text}: {}", mistake(text));
    }
    let wrong = Expression { unit: Some("V".into()), ..formula("maximum(y)") };
    assert!(wrong.bind(&model()).err().unwrap().to_string().contains("not in `V`"));
}
