//! A declared model that was fitted in a worse optimum is reported at the better one that the search finds.

use mops_core::Role;

use crate::fit::Meter;
use crate::report::Findings;
use crate::selection::{Forecasts, decide, prepare, with_given};
use crate::testing::{Record, catalogue, integrated, subject, white};

const FALL: &str = r#"
states     = { v = "m/s" }
parameters = { g = "m/s^2", d = "1/s" }
der        = { v = "g - d*v" }
"#;
const STEP: f64 = 0.05;
const COUNT: usize = 60;
const NOISE: f64 = 0.01;

#[test]
fn a_better_optimum_of_the_declared_model_replaces_that_of_its_first_fit() {
    let record = |number: usize| {
        let states = integrated(|_, v: &[f64; 1]| [9.8 - 0.4 * v[0]], [0.0], STEP, COUNT);
        let noise = white(&format!("fall {number}"), NOISE, COUNT);
        let values = states.iter().zip(noise).map(|(v, e)| v[0] + e).collect();
        let times = (0..COUNT).map(|k| k as f64 * STEP).collect();
        Record { inputs: Vec::new(), times, signals: vec![("v", values, NOISE)] }
    };
    let mut subject = subject(FALL, &[9.8, 0.4, 0.0], 1, (0..2).map(record).collect());
    subject.measurements[1].role = Role::Selection;
    let simulations = Meter::new(&());
    let (refit, declared) = prepare(&subject, &catalogue(&["quadratic-drag"]), &simulations).expect("it simulates");
    let mut worse = declared.start_at(&declared.least_squares.point);
    worse.tuners = vec![8.0, 0.3];
    let worse = refit.at_start(&declared.key, &worse).expect("it simulates");
    let [first, second] = [declared.clone(), worse].map(|nominal| {
        let sets = with_given(&refit, declared.clone(), &[], 1, 0.05).expect("it is fitted");
        let (sets, forecasts) = Forecasts::of(sets.with_single_effects().searched());
        let verdict = decide(&sets, &forecasts);
        let curves = sets.free_curves(&Vec::new());
        Findings { nominal, alignment: Vec::new(), curves, sets, forecasts, verdict, is_stopped: false }.diagnosis()
    });
    assert_eq!(first.before, second.before);
    assert!(first.before[0].normalised < 1.2, "{:?}", first.before);
    let named = |notes: &[String]| notes.iter().any(|note| note.contains("worse optimum: start at g = 9."));
    assert!(named(&second.notes) && !named(&first.notes), "{:?} {:?}", first.notes, second.notes);
}
