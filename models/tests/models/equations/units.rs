//! Units in equations: computations use coherent units, and all dimensions are checked.

use std::f64::consts::TAU;

use mops_language::Unit;
use mops_math as math;

use super::*;

fn read_ok(text: &str) -> Equations {
    read(text).unwrap_or_else(|mistake| panic!("{mistake}\n{text}"))
}

/// Returns the mistake, with the part of the expression it refers to.
fn wrong(text: &str) -> (String, String) {
    let mistake = read(text).err().unwrap_or_else(|| panic!("it was read: {text}"));
    (mistake.to_string(), mistake.help.unwrap_or_default())
}

#[test]
fn quantities_in_any_units_move_as_those_in_si_units() {
    // A motor with a gear: once with each table in its own units, and once in SI units.
    let si = "states = { i = 'A', w = 'rad/s', x = 'm' }\ninputs = { u = 'V' }\n\
              constants = { R = '0.6 ohm', L = '0.8e-3 H', Kt = '0.06 N m/A', J = '8e-5 kg m2', b = '1e-5 N m s', r = '5e-3 m' }\n\
              outputs = { q = { value = 'x', unit = 'm' } }\nstart = { w = '10 rad/s' }\n\
              der = { i = \"L*i' = u - R*i - Kt*w\", w = \"J*w' = Kt*i - b*w\", x = 'r*w' }";
    let own = "states = { i = 'mA', w = 'rpm', x = 'mm' }\ninputs = { u = 'mV' }\n\
               constants = { R = '600 mOhm', L = '0.8 mH', Kt = '6 N cm/A', J = '0.8 kg cm2', b = '10 uN m s/rad', r = '0.5 cm' }\n\
               outputs = { q = { value = 'x', unit = 'um' } }\nstart = { w = '95.49296585513721 rpm' }\n\
               der = { i = \"L*i' = u - R*i - Kt*w\", w = \"J*w' = Kt*i - b*w\", x = 'r*w' }";
    let a = respond(&read_ok(si), &[("u", Input::Constant(3.0))], &[], 0.3);
    let b = respond(&read_ok(own), &[("u", Input::Constant(3000.0))], &[], 0.3);
    for (signal, factor) in [("i", 1e3), ("w", 60.0 / TAU), ("x", 1e3), ("q", 1e6), ("u", 1e3)] {
        for t in [0.01, 0.1, 0.3] {
            let (a, b) = (factor * at(&a, signal, t), at(&b, signal, t));
            assert!((a - b).abs() < 1e-6 * b.abs().max(1e-3), "{signal} at {t}: {a} {b}");
        }
    }
}

#[test]
fn the_integral_of_a_speed_in_other_units_is_right_for_ten_pairs() {
    for (rate, state, per_second) in [
        ("rpm", "deg", 6.0),
        ("rpm", "rad", TAU / 60.0),
        ("rev/s", "deg", 360.0),
        ("deg/s", "rad", TAU / 360.0),
        ("rad/s", "rev", 1.0 / TAU),
        ("km/h", "m", 1.0 / 3.6),
        ("m/s", "km", 1e-3),
        ("mm/min", "um", 1e3 / 60.0),
        ("L/min", "cm3", 1e3 / 60.0),
        ("mA", "C", 1e-3),
        ("kW", "J", 1e3),
        ("K/min", "degC", 1.0 / 60.0),
        ("1/min", "%", 100.0 / 60.0),
    ] {
        let text = format!("states = {{ x = '{state}' }}\nparameters = {{ v = '{rate}' }}\nder = {{ x = 'v' }}");
        let response = respond(&read_ok(&text), &[], &[("v", 3.0)], 2.0);
        let found = at(&response, "x", 2.0);
        assert!((found - 6.0 * per_second).abs() < 1e-9 * found.abs(), "{rate} {state}: {found}");
    }
}

#[test]
fn temperatures_are_computed_in_kelvin_whatever_their_scale() {
    let room = |unit: &str, outside: &str, start: &str| {
        let text = format!(
            "states = {{ T = '{unit}' }}\nparameters = {{ k = '1/s' }}\nconstants = {{ To = '{outside}' }}\n\
             start = {{ T = '{start}' }}\nder = {{ T = 'k*(To - T)' }}"
        );
        let response = respond(&read_ok(&text), &[], &[("k", 0.1)], 5.0);
        at(&response, "T", 5.0)
    };
    let celsius = 10.0 + 10.0 * math::exp(-0.5);
    assert!((room("K", "10 degC", "20 degC") - (celsius + 273.15)).abs() < 1e-6);
    assert!((room("degC", "283.15 K", "20 degC") - celsius).abs() < 1e-6);
    assert!((room("degC", "50 degF", "293.15 K") - celsius).abs() < 1e-6);
    assert!((room("degF", "10 degC", "68 degF") - (celsius * 1.8 + 32.0)).abs() < 1e-6);
    // Radiation depends on absolute temperatures.
    let text =
        "states = { T = 'degC' }\nconstants = { e = '1e-12 1/K3/s' }\nder = { T = '-e*T^4' }\nstart = { T = 27 }";
    let exact = math::powf(3e-12 * 100.0 + math::powi(300.15, -3), -1.0 / 3.0) - 273.15;
    assert!((at(&respond(&read_ok(text), &[], &[], 100.0), "T", 100.0) - exact).abs() < 1e-5);
}

#[test]
fn hertz_count_cycles_in_equations() {
    let text = |unit: &str, phase: &str| {
        format!(
            "states = {{ x = '1' }}\nparameters = {{ f = '{unit}' }}\nder = {{ x = '0' }}\noutputs = {{ y = 'sin({phase})' }}"
        )
    };
    for (unit, phase, value) in [
        ("Hz", "2*pi*f*time", 1.25),
        ("kHz", "2*pi*f*time", 1.25e-3),
        ("rad/s", "f*time", 1.25 * TAU),
        ("rpm", "f*time", 75.0),
    ] {
        let response = respond(&read_ok(&text(unit, phase)), &[], &[("f", value)], 1.0);
        for t in [0.1, 0.35, 1.0] {
            assert!((at(&response, "y", t) - math::sin(TAU * 1.25 * t)).abs() < 1e-7, "{unit} {t}");
        }
    }
}

#[test]
fn a_wrong_dimension_is_an_error_at_its_term_in_any_position() {
    let base = "states = { x = 'm', v = 'm/s' }\ninputs = { F = 'N' }\nparameters = { k = 'N/m', m = 'kg', T = 's' }\n";
    for (rest, place, fact) in [
        ("der = { x = 'v', v = 'F/m - k*x' }", "der.v", "expected a quantity in m/s2, found one in N"),
        ("der = { x = 'x', v = 'F/m' }", "der.x", "expected a quantity in m/s, found one in m"),
        ("der = { x = 'v', v = \"m*v' = F - k*v\" }", "der.v", "expected a quantity in N, found one in N/s"),
        ("let = { a = 'x + v' }\nder = { x = 'v', v = 'a' }", "let.a", "expected a quantity in m, found one in m/s"),
        (
            "der = { x = 'v', v = 'F/m' }\noutputs = { E = { value = 'k*x', unit = 'J' } }",
            "outputs.E",
            "expected a quantity in N m, found one in N",
        ),
        ("der = { x = 'v', v = 'F/m*sin(x)' }", "der.v", "`sin` takes a pure number, found a quantity in m"),
        ("der = { x = 'v', v = 'F/m*exp(-time)' }", "der.v", "`exp` takes a pure number, found a quantity in s"),
        ("der = { x = 'v', v = 'F/m*2^x' }", "der.v", "expected a pure number, found a quantity in m"),
        ("der = { x = 'v', v = 'F/m*x^F' }", "der.v", "expected a pure number, found a quantity in N"),
        ("der = { x = 'v', v = 'if(x > v, F, 0)/m' }", "der.v", "expected a quantity in m, found one in m/s"),
        ("der = { x = 'v', v = 'if(x > 1, F, k)/m' }", "der.v", "expected a quantity in N, found one in N/m"),
        ("der = { x = 'v', v = 'clip(F, -1, x)/m' }", "der.v", "expected a quantity in N, found one in m"),
        ("der = { x = 'v', v = 'table(x, 0, F, T, F)/m' }", "der.v", "expected a quantity in m, found one in s"),
        ("der = { x = 'v', v = 'table(x, 0, F, 1, T)/m' }", "der.v", "expected a quantity in N, found one in s"),
        (
            "der = { x = 'v', v = 'F/m' }\nstart = { v = 'k/m' }",
            "start.v",
            "expected a quantity in m/s, found one in 1/s2",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nwhen.hit = { guard = 'x - v' }",
            "when.hit.guard",
            "expected a quantity in m, found one in m/s",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nwhen.hit = { guard = 'x', reset = { v = 'x' } }",
            "when.hit.reset.v",
            "found one in m",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nwhen.hit = { guard = 'x', at-rest = { v = 'x' } }",
            "when.hit.at-rest.v",
            "found one in m",
        ),
        (
            "der = { x = 'v', v = 'F' }\nmass = { \"v,v\" = 'k' }",
            "mass.v,v",
            "expected a quantity in kg, found one in N/m",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nfriction.x = { coulomb = 'F' }",
            "friction.x.coulomb",
            "expected a quantity in m/s2, found one in N",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nfriction.x = { viscous = 'k' }",
            "friction.x.viscous",
            "expected a quantity in 1/s, found one in N/m",
        ),
        (
            "der = { x = 'v', v = 'F/m' }\nfriction.x = { coulomb = 'F/m', peak = 'm' }",
            "friction.x.peak",
            "a pure number",
        ),
        (
            "constants = { c = '3 V' }\nder = { x = 'v', v = 'F/m + c' }",
            "der.v",
            "expected a quantity in m/s2, found one in V",
        ),
        ("constants = { c = '3 V' }\nder = { x = 'v', v = '(F + c [N])/m' }", "der.v", "expected `)`, found"),
    ] {
        let (mistake, _) = wrong(&format!("{base}{rest}"));
        assert!(mistake.starts_with(place) && mistake.contains(fact), "{rest}\n{mistake}");
    }
}

#[test]
fn powers_and_roots_have_rational_dimensions() {
    for rest in [
        "parameters = { k = 'm^0.5/s' }\nder = { x = '-k*sqrt(x)' }",
        "parameters = { k = 'm^(1/2)/s' }\nder = { x = '-k*x^0.5' }",
        "parameters = { k = 'm^(2/3)/s' }\nder = { x = '-k*x^(1/3)' }",
        "parameters = { k = 'm3.s-1', A = 'm^-1.5 m3.5 m-2' }\nder = { x = '-k/x^2/A^0' }",
        "constants = { n = 2 }\nparameters = { k = '1/(m s)' }\nder = { x = '-k*x^n' }",
        "parameters = { k = '1/s', y = 'm2' }\nder = { x = '-k*sqrt(x^2 + y)' }",
        "parameters = { n = '1', X = 'm', k = 'm/s' }\nder = { x = '-k*(x/X)^n' }",
    ] {
        read_ok(&format!("states = {{ x = 'm' }}\n{rest}"));
    }
    let (mistake, _) = wrong("states = { x = 'm' }\nparameters = { n = '1', k = 'm/s' }\nder = { x = '-k*x^n' }");
    assert!(mistake.contains("as the exponent varies, found a quantity in m"), "{mistake}");
}

#[test]
fn quantities_without_a_unit_get_the_one_that_the_equations_require() {
    let tanks = read_ok(
        "states = { h1 = 'V', h2 = 'V' }\ninputs = { u = 'V' }\nparameters = { k1 = '', k2 = '', k4 = '1/s', s = '' }\n\
         outputs = { sum = 'h1 + h2' }\n\
         der = { h1 = 'k4*u*s - k1*sqrt(max(h1, 0))', h2 = 'k2*sqrt(max(h1, 0)) - k1*sqrt(max(h2, 0))' }",
    );
    let unit = |name: &str| {
        let parameters = &tanks.interface().parameters;
        parameters.iter().find(|p| p.variable.name == name).unwrap().variable.unit.clone()
    };
    assert_eq!(unit("k1"), Unit::known("V^0.5/s"));
    assert_eq!(unit("k2"), Unit::known("V^0.5/s"));
    assert_eq!(unit("s").to_string(), "1");
    let sum = tanks.interface().signals.iter().find(|s| s.name == "sum").unwrap();
    assert_eq!(sum.unit.to_string(), "V");
    assert_eq!(tanks.notes().len(), 1);
    assert!(tanks.notes()[0].contains("`k1` in"), "{:?}", tanks.notes());
    // A contradiction between two equations, and a wrong declaration.
    let two = |unit: &str| {
        format!(
            "states = {{ x = 'm', y = 'kg' }}\nparameters = {{ k = '{unit}' }}\nder = {{ x = 'k', y = 'k' }}\noutputs = {{ z = 'k*x' }}"
        )
    };
    for unit in ["", "1", "m/s", "kg/s"] {
        assert!(wrong(&two(unit)).0.starts_with("der."), "{unit}");
    }
    read_ok("states = { x = 'm' }\nparameters = { k = '1' }\nder = { x = 'k*1 [m/s]' }");
}

#[test]
fn a_model_of_pure_numbers_has_a_pure_time() {
    read_ok(
        "states = { x = '1', v = '1' }\nparameters = { a = '1' }\nder = { x = 'v', v = 'sin(time) - a*x - v + 2' }",
    );
    read_ok("states = { x = '1' }\nparameters = { a = '' }\nconstants = { c = 2 }\nder = { x = 'exp(-time) - a*x^c' }");
    let (mistake, _) = wrong("states = { x = '1' }\nparameters = { a = '1', T = 's' }\nder = { x = '-a*x' }");
    assert!(mistake.contains("expected a quantity in 1/s, found a pure number"), "{mistake}");
}

#[test]
fn a_bare_number_is_read_in_si_units_or_is_an_error_next_to_others() {
    let fine = read_ok(
        "states = { h = 'm', v = 'm/s' }\nder = { h = 'v', v = '-9.81' }\nwhen.b = { guard = 'h - 0.5', reset = { v = 3 } }",
    );
    let notes = fine.notes();
    assert_eq!(notes.len(), 1, "{notes:?}");
    for part in ["-9.81 in m/s2 (der.v)", "0.5 in m (when.b.guard)", "3 in m/s (when.b.reset.v)"] {
        assert!(notes[0].contains(part), "{part}: {notes:?}");
    }
    for (unit, rate, rest, name, write) in [
        ("cm", "cm/s", "der = { x = '1 [cm/s]' }\nwhen.e = { guard = 'x - 5' }", "`x`, which is in cm", "5 [cm]"),
        ("deg", "deg/s", "der = { x = 'clip(r, -3, 0)' }", "`r`, which is in deg/s", "-3 [deg/s]"),
        (
            "degC",
            "K/s",
            "constants = { k = '1 1/s' }\nder = { x = 'k*(20 - x)' }",
            "`x`, which is in degC",
            "20 [degC]",
        ),
        (
            "degC",
            "K/s",
            "constants = { k = '1 1/s' }\nder = { x = 'k*(20 [degC] - max(x, 0))' }",
            "`x`, which is in degC",
            "0 [degC]",
        ),
        ("rad", "rpm", "der = { x = 'if(r > 100, r, 0)' }", "`r`, which is in rpm", "100 [rpm]"),
        ("m", "m/min", "der = { x = 'r + 1' }", "`r`, which is in m/min", "1 [m/min]"),
        ("cm", "m/s", "der = { x = '5' }", "`x`, which is in cm", "5 [m/s]"),
        ("%", "1/s", "der = { x = 'r' }\nwhen.e = { guard = 'x - 1', reset = { x = 5 } }", "`x`, which is in %", "%"),
        ("deg", "deg/s", "der = { x = 'table(x, -10, r, 10, -r)' }", "`x`, which is in deg", "-10 [deg]"),
        (
            "degC",
            "K/s",
            "der = { x = 'r' }\nwhen.e = { guard = 'x - 1 [degC]', reset = { x = 5 } }",
            "`x`, which is in degC",
            "5 [degC]",
        ),
        (
            "cm",
            "cm/s",
            "constants = { c = 5 }\nder = { x = 'if(x > c, r, 0)' }",
            "`x`, which is in cm",
            "declare its unit",
        ),
        (
            "cm",
            "cm/s",
            "parameters = { c = '', r = 'cm/s' }\nder = { x = 'if(x > c, r, 0)' }",
            "`x`, which is in cm",
            "declare its unit",
        ),
    ] {
        let parameters =
            if rest.contains("parameters") { String::new() } else { format!("parameters = {{ r = '{rate}' }}\n") };
        let (mistake, help) = wrong(&format!("states = {{ x = '{unit}' }}\n{parameters}{rest}"));
        assert!(mistake.contains(&format!("next to {name}")) && help.contains(write), "{rest}\n{mistake}\n{help}");
    }
    // 0 is the same in all units except temperatures; numbers in products are pure numbers.
    read_ok(
        "states = { x = 'cm' }\nparameters = { r = 'cm/s' }\nder = { x = 'max(r, 0)*0.5' }\nwhen.e = { guard = 'x', reset = { x = 0 } }",
    );
    // If units cancel, nothing is ambiguous.
    read_ok("states = { x = 'cm' }\nparameters = { k = 'V/cm', s = 'cm/s/V' }\nder = { x = 's*clip(k*x, 0, 10)' }");
}

#[test]
fn numbers_take_units_in_brackets() {
    let response = respond(
        &read_ok(
            "states = { x = 'm' }\nder = { x = '36 [km/h] + 0 [m/s]' }\noutputs = { T = { value = '-5 [degC]', unit = 'degC' } }",
        ),
        &[],
        &[],
        2.0,
    );
    assert!((at(&response, "x", 2.0) - 20.0).abs() < 1e-9);
    assert!((at(&response, "T", 2.0) + 5.0).abs() < 1e-9);
    let (mistake, _) = wrong("states = { x = 'm' }\nder = { x = '3 m/s + 1' }");
    assert!(mistake.contains("expected a unit in brackets, as in 20 [m]"), "{mistake}");
    assert!(wrong("states = { x = 'm' }\nder = { x = '3 [mars]' }").0.contains("`mars` is not a known unit"));
    // A text may be a quantity, as anywhere in a study.
    let text =
        "states = { x = 'cm' }\nder = { x = '6 m/min' }\nwhen.e = { guard = 'x - 1 [m]', reset = { x = '20 mm' } }";
    assert!((at(&respond(&read_ok(text), &[], &[], 3.0), "x", 3.0) - 30.0).abs() < 1e-9);
}

#[test]
fn a_joint_in_degrees_and_rpm_has_friction_as_one_in_si_units() {
    let joint = |position: &str, speed: &str| {
        format!(
            "states = {{ q = '{position}', w = '{speed}' }}\nparameters = {{ J = 'kg m2', c = 'N m', b = 'N m s' }}\n\
             der = {{ q = 'w', w = \"J*w' = 0\" }}\nfriction.q = {{ coulomb = 'c', viscous = 'b' }}"
        )
    };
    let given = |w: f64| [("J", 2.0), ("c", 0.7), ("b", 0.1), ("w0", w)];
    let si = respond(&read_ok(&joint("rad", "rad/s")), &[], &given(TAU), 30.0);
    let own = respond(&read_ok(&joint("deg", "rpm")), &[], &given(60.0), 30.0);
    for t in [1.0, 10.0, 30.0] {
        let (a, b) = (at(&si, "q", t).to_degrees(), at(&own, "q", t));
        assert!((a - b).abs() < 1e-5 * a.abs(), "{t}: {a} {b}");
    }
    assert_eq!(at(&own, "w", 30.0), 0.0);
}

#[test]
fn differences_ratios_and_angles_combine_with_numbers() {
    for rest in [
        // A difference of temperatures is in K, and 0 is not a value in degC.
        "states = { T = 'degC' }\nparameters = { k = '1/s', To = 'degC' }\nder = { T = 'k*max(To - T, 0)' }",
        "states = { T = 'degC' }\nparameters = { k = '1/s' }\nder = { T = 'if(T - 20 [degC] > 1, -k*(T - 20 [degC]), 0)' }",
        "states = { T = 'degC' }\nparameters = { k = 's', To = 'K' }\nder = { T = \"0 = To - T - k*T'\" }",
        "states = { T = 'degC' }\nparameters = { k = 's', To = 'K' }\nder = { T = '(0.5*(T + To) - T)/k' }",
        // Ratios are pure numbers, in any units.
        "states = { x = 'cm' }\nparameters = { v = 'm/s', L = 'm' }\nder = { x = 'v*(1 - x/L)' }",
        "states = { x = 'cm' }\nparameters = { v = 'm/s', tau = 'min' }\nder = { x = 'v*(1 - time/tau)' }",
        "states = { x = 'cm' }\nparameters = { v = 'm/s' }\nder = { x = 'v*ln(1 + x/1 [cm])' }",
        "states = { th = 'deg' }\nparameters = { w = 'rpm' }\nder = { th = 'w*sin(th - pi/2)' }",
        "states = { x = '%' }\nparameters = { k = '1/s' }\nder = { x = 'k*(1 [1] - x)' }",
        // Literals with units show that time has a unit.
        "states = { x = '1' }\nparameters = { k = '1/s' }\nder = { x = '-k*x + 1 [1/s]' }",
        "states = { x = '' }\nparameters = { k = '' }\nder = { x = '-k*x + 1 [m/s]' }",
        // Branches, tables, members and definitions consisting of numbers.
        "states = { 'x[1..3]' = '1' }\nparameters = { k = '1' }\nder = { 'x[i]' = 'if(x[i] > 0, 1, 2) - k*x[i]' }",
        "states = { 'x[1..2]' = 'm' }\nder = { 'x[i]' = 'table(x[i], 0, 1, 1, 2)' }",
        "states = { 'v[1..2]' = 'm/s' }\nlet = { 'g[1..2]' = '9.81' }\nder = { 'v[i]' = '-g[i]' }",
        "states = { v = 'm/s' }\nlet = { n = '2' }\nparameters = { k = '1/m' }\nder = { v = '-k*v^n' }",
        "states = { v = 'm/s' }\nparameters = { k = { unit = '', default = '2 1/s' } }\nder = { v = '-k*v' }",
    ] {
        read_ok(rest);
    }
    for (rest, fact, help) in [
        (
            "states = { T = 'degC' }\nparameters = { k = '1/s', a = '1' }\nder = { T = 'if(a*T > 20, -k*(T - 1 [K]), 0)' }",
            "next to `T`",
            "20 [degC]",
        ),
        ("states = { x = 'm' }\nparameters = { k = '1/s' }\nder = { x = '2^(k*time)' }", "found a pure number", ""),
        (
            "states = { x = 'm' }\nparameters = { k = 'm/s' }\nder = { x = 'if(max(5 [cm], 3) > x, k, 0)' }",
            "next to a number, which is in cm",
            "3 [cm]",
        ),
        (
            "states = { x = 'cm' }\nparameters = { c = '', k = 'm/s' }\nder = { x = 'if(x > 2*abs(c), k, 0)' }",
            "next to `x`, which is in cm",
            "declare",
        ),
        ("states = { x = 'cm' }\nparameters = { k = '1/s' }\nder = { x = '-k*x + 5' }", "next to `x`", "5 [m/s]"),
        (
            "states = { x = '%' }\nparameters = { k = '1/s' }\nder = { x = 'k*(1 - x)' }",
            "next to `x`",
            "1 [%] or 1 [1]",
        ),
        (
            "states = { th = 'deg' }\nparameters = { w = 'rpm' }\nder = { th = 'w*sin(th - 1)' }",
            "next to `th`",
            "1 [deg] or 1 [rad]",
        ),
        (
            "states = { x = 'm' }\nparameters = { k = '12 m' }\nder = { x = 'k' }",
            "expected a unit, found the number",
            "",
        ),
        ("states = { x = 'm' }\nder = { x = '1e400 [m/s]' }", "too large", ""),
        (
            "states = { x = 'm', v = 'm/s' }\nparameters = { b = '1/s' }\nder = { x = 'v', v = '0' }\nfriction.x = { viscous = 'b', peak = 'foo' }",
            "`coulomb`, which is not given",
            "",
        ),
    ] {
        let (mistake, found) = wrong(rest);
        assert!(mistake.contains(fact) && found.contains(help), "{rest}\n{mistake}\n{found}");
    }
}

#[test]
fn initial_values_are_in_the_unit_of_their_own_state() {
    let text = "states = { 'T[1]' = 'K', 'T[2]' = 'degC', th = 'deg', y = '' }\nder = { 'T[i]' = '0', th = '0', y = '0 [m/s]' }\n\
                start = { 'T[1]' = '20 degC', 'T[2]' = '20 degC', th = 'pi/2', y = '0.1 m' }";
    let response = respond(&read_ok(text), &[], &[], 1.0);
    for (signal, value) in [("T[1]", 293.15), ("T[2]", 20.0), ("th", 90.0), ("y", 0.1)] {
        assert!((at(&response, signal, 1.0) - value).abs() < 1e-12, "{signal}");
    }
}
