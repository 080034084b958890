//! Limits and breakpoints must increase, whether given by numbers, constants or parameters.

use super::*;

fn text(value: &str) -> String {
    format!(
        "states = {{ x = '1' }}\nparameters = {{ p = '1' }}\nconstants = {{ two = 2, one = 1 }}\nder = {{ x = '1' }}\n\
         outputs = {{ y = \"{value}\" }}"
    )
}

#[test]
fn numbers_and_expressions_of_constants_out_of_order_are_an_error() {
    for value in [
        "deadzone(x, 2, 1)",
        "clip(x, 2, 1)",
        "clip(x, two, one)",
        "deadzone(x, two + 1, one)",
        "clip(x, -one, -two)",
        "table(x, two, 0, one, 1)",
        "table(x, 0, 0, one, 1, 2*one - 1, 3)",
        "clip(2*x, two, 1)",
    ] {
        let mistake = read(&text(value)).err().unwrap_or_else(|| panic!("{value} is accepted"));
        assert!(mistake.to_string().contains("must increase"), "{value}: {mistake}");
    }
    for value in ["clip(x, 1, 1)", "deadzone(x, -1, 1)", "clip(x, one, two)", "table(x, one, 0, two, 1)"] {
        assert!(read(&text(value)).is_ok(), "{value}");
    }
}

#[test]
fn a_parameter_that_makes_the_order_wrong_is_a_failure() {
    for (value, right, wrong) in [
        ("clip(x, p, 1)", 0.5, 1.5),
        ("deadzone(x, -1, p)", 1.0, -2.0),
        ("clip(x, -p, p)", 1.0, -1.0),
        ("table(x, 0, 0, p, 1)", 0.1, 0.0),
        ("table(x, 0, 0, p, 1, 2, 3)", 1.0, 2.0),
    ] {
        let model = read(&text(value)).unwrap();
        assert!(attempt(&model, &[], &[("p", right)], 1.0).is_ok(), "{value}");
        let failure = attempt(&model, &[], &[("p", wrong)], 1.0).unwrap_err();
        assert!(failure.to_string().contains("must increase"), "{value}: {failure}");
    }
}
