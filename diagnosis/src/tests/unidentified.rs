//! Parameters that the data cannot distinguish are uncertain, also where one of them stands at a bound by chance.

use crate::estimation::ErrorModel;
use crate::fit::Meter;
use crate::selection::estimation;
use crate::testing::{Record, fitted, integrated, subject};

/// A block on a spring, of which only ratios show: `m v' = -k x - d v`.
const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { m = "kg", k = "N/m", d = "N s/m" }
der        = { x = "v", v = "m*v' = -k*x - d*v" }
"#;

#[test]
fn of_ratios_that_alone_are_known_no_part_is_certain() {
    let states = integrated(|_, x: &[f64; 2]| [x[1], -9.0 * x[0] - 0.4 * x[1]], [1.0, 0.0], 0.02, 250);
    let record = Record::of_first("x", &states, 0.02, 0.002, "ratios");
    let subject = subject(BLOCK, &[2.0, 16.0, 1.0, 1.0, 0.0], 2, vec![record]);
    let simulations = Meter::new(&());
    let (fit, variant, point, _) = fitted(&subject, &simulations);
    let estimation = estimation(&subject, &fit, &variant, &[], &[], &point);
    let found = estimation.under(ErrorModel::SmoothOutput, point, None, None).expect("it simulates");
    let error = |k: usize| found.deviations[k] / found.point.globals[k].abs();
    assert!((0..3).all(|k| error(k) > 0.2), "{:?}", [0, 1, 2].map(error));
}
