//! Compiled expressions: constants folded, common subexpressions computed once, products in any order.

use mops_core::model::OperatingPoint;

use super::*;

/// Model with the states `x` and `y`, the parameters `a` and `b`, and these derivatives.
fn compiled(x: &str, y: &str) -> Equations {
    model(&format!(
        "states = {{ x = '1', y = '1' }}\nparameters = {{ a = '1', b = '1' }}\nder = {{ x = '{x}', y = '{y}' }}"
    ))
}

/// Returns the number of instructions of the derivatives.
fn instructions(x: &str, y: &str) -> usize {
    compiled(x, y).plant_model().instructions()
}

/// Returns the derivative of `x` for `a = 2`, `b = 3`, `x = 0.7` and `y = -1.3`.
fn derivative(x: &str) -> f64 {
    let parameters = [2.0, 3.0, 0.7, -1.3];
    let at =
        OperatingPoint { parameters: &parameters, states: &parameters[2..], inputs: &[], past: &[], at_rest: false };
    compiled(x, "x").local(&at).expect("it has derivatives").expect("they are finite").rates[0]
}

#[test]
fn repeated_subexpressions_share_a_node_in_any_order() {
    let [one, other] = ["2*a*y*sin(x)", "sin(x)*2*y*a"];
    assert!(instructions(one, "x") > 0);
    assert_eq!(instructions(one, other), instructions(one, "x"));
    assert_eq!(derivative(one), derivative(other));
    // The product of the number and the parameter is computed once per simulation.
    assert_eq!(instructions(one, "x"), instructions("b*y*sin(x)", "x"));
}

#[test]
fn numbers_are_folded_and_neutral_operands_are_removed() {
    for same in ["x + 0", "1*x", "x/1", "x^1", "-(-x)"] {
        assert_eq!((instructions(same, "y"), derivative(same)), (instructions("x", "y"), 0.7), "{same}");
    }
    for zero in ["x*0", "x - x", "x + (-x)"] {
        assert_eq!((instructions(zero, "y"), derivative(zero)), (instructions("0", "y"), 0.0), "{zero}");
    }
    assert_eq!((instructions("3*3", "y"), derivative("3*3")), (instructions("9", "y"), 9.0));
    assert_eq!((instructions("3*3*x", "y"), derivative("3*3*x")), (instructions("9*x", "y"), derivative("9*x")));
}
