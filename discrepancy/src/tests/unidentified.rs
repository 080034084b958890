//! Parameters that the data cannot tell apart are uncertain, also where one of them stands at a bound by chance.

use nalgebra::DVector;

use crate::meter::Meter;
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
    let (mut fit, _, fitted, _) = fitted(&subject, &simulations);
    let value = fitted.point.globals.clone();
    // Rounding decides which of the two bounds it leans on.
    for at_bound in [None, Some(0), Some(1)] {
        if let Some(side) = at_bound {
            fit.globals[0].bounds = [0.0, 20.0];
            fit.globals[0].bounds[side] = value[0];
        }
        let covariance = fit.covariance(&fitted, 1.0);
        let error = |k: usize| covariance[(k, k)].sqrt() / value[k].abs();
        assert!((0..3).all(|k| error(k) > 0.2), "{at_bound:?}: {:?}", [0, 1, 2].map(error));
        let ratio = DVector::from_vec(vec![-1.0 / value[0], 1.0 / value[1], 0.0]);
        let of_ratio = (ratio.transpose() * &covariance * &ratio)[(0, 0)].sqrt();
        assert!(of_ratio < 1e-3, "{at_bound:?}: {of_ratio}");
    }
}
