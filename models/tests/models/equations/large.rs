//! Long and deeply nested expressions.

use mops_math as math;

use super::{model, read, respond};

/// Returns the model `x' = text`, from `x = 1` over 1 s, with a parameter `k`.
fn of_one_state(text: &str) -> String {
    let tables = "states = { x = \"1\" }\nparameters = { k = \"1\" }\nstart = { x = 1.0 }\nhorizon = \"1 s\"";
    format!("{tables}\nder = {{ x = \"{text}\" }}")
}

#[test]
fn sums_products_and_conditions_may_have_any_number_of_operands() {
    let n = 30_000;
    // All of them reduce to x' = k x, with k = -1.
    let growth = [
        ("k*x", " + x - x", ""),
        ("k*x", "+0.5*k*x-0.5*x*k", ""),
        ("k*x", "*k*k", ""),
        ("k*x", "*2/2", ""),
        ("k*x", "/k/k", ""),
        ("k*x", "*x/x", ""),
        ("x", "*(1 + x)/(x + 1)", "*k"),
        ("k*x", "+sin(0*x)", ""),
        ("if(x > 2", " or x < -2", ", 0, k*x)"),
        ("if(x > -2", " and x > -3", ", k*x, 0)"),
        ("k*x + max(-5, -6", ", -7", ") + 5"),
    ];
    for (first, more, last) in growth {
        let text = of_one_state(&format!("{first}{}{last}", more.repeat(n)));
        let end = respond(&model(&text), &[], &[("k", -1.0)], 1.0).trace("x").unwrap().last();
        assert!((end - math::exp(-1.0)).abs() < 1e-6, "{end}: {first}{more}{last}");
    }
}

#[test]
fn nesting_within_definitions_is_an_error_before_the_stack_overflows() {
    let nested = |lets: usize, functions: usize| {
        let level = |i: usize| {
            let below = if i + 1 < lets { format!("a{}", i + 1) } else { "x".to_owned() };
            format!("a{i} = \"{}{below}{}\"\n", "sin(".repeat(functions), ")".repeat(functions))
        };
        let lets: String = (0..lets).map(level).collect();
        format!("{}\n[let]\n{lets}", of_one_state("a0"))
    };
    for (lets, functions) in [(1, 1), (190, 1), (100, 4), (2, 200)] {
        assert!(read(&nested(lets, functions)).is_ok());
    }
    for (lets, functions) in [(1, 201), (201, 0), (190, 190), (5, 200), (100, 10), (200, 5), (3, 199)] {
        let mistake = read(&nested(lets, functions)).err().unwrap();
        assert!(mistake.message.contains("nested more than"), "{}", mistake.message);
    }
}

#[test]
fn definitions_that_use_the_one_before_several_times_cost_no_more_than_their_texts() {
    // All of them leave 1 unchanged.
    let kinds = [
        "A*A",
        "A^2",
        "A^4",
        "A*A/A",
        "1/(A*A)",
        "(A + A)/2",
        "2*A - A*A",
        "sqrt(A*A*A)",
        "max(A, 2 - A)",
        "if(A > 0, A, -A*A)",
        "table(A, 0, 0, 2, A + A)",
        "sin(A)^2 + cos(A)^2",
    ];
    for kind in kinds {
        let level = |i: usize| format!("a{} = \"{}\"\n", i + 1, kind.replace('A', &format!("a{i}")));
        let lets: String = (0..120).map(level).collect();
        let tables = "states = { x = \"1\", y = \"1\" }\nstart = { x = 1.0, y = 1.0 }\nhorizon = \"1 s\"";
        let text = format!("{tables}\nder = {{ x = \"-x*a120\", y = \"0\" }}\n[let]\na0 = \"y\"\n{lets}");
        let end = respond(&model(&text), &[], &[], 1.0).trace("x").unwrap().last();
        assert!((end - math::exp(-1.0)).abs() < 1e-6, "{end}: {kind}");
    }
}
