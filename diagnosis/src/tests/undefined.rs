//! Start values at which the declared model cannot be simulated: what is drawn around them leads to the right ones.

use crate::fit::Meter;
use crate::selection::baseline;
use crate::testing::{Record, integrated, subject};

/// A decay whose rate is no number for `k` below 1; of what is drawn around 0.62, one in twenty-five lies above.
const MODEL: &str = r#"
states     = { x = "m" }
parameters = { k = "1/s2" }
der        = { x = "-sqrt(k - 1)*x" }
"#;

#[test]
fn a_base_fit_gets_away_from_start_values_that_cannot_be_simulated() {
    let states = integrated(|_, x: &[f64; 2]| [-0.5 * x[0], 0.0], [1.0, 0.0], 0.05, 100);
    let record = Record::of_first("x", &states, 0.05, 1e-3, "undefined");
    let subject = subject(MODEL, &[0.62, 1.0], 1, vec![record]);
    let found = baseline(&subject, &Meter::new(&())).expect("it finds where the model is defined");
    assert!((found.tuners[0] - 1.25).abs() < 0.005, "{:?}", found.tuners);
}
