//! Stiff stops: contact is short, and a soft one spread over the whole motion is where a fit from nothing ends.

use mops_core::{Input, case::Hold};

use crate::records::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{Diagnosis, Verdict};

/// A mass on a weak spring.
const MASS: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", c = "N*s/m", k = "N/m" }
der        = { x = "v", v = "m*v' = u - c*v - k*x" }
"#;

const NOISE: f64 = 1e-3;

/// 6 s with a stop of 20 N/mm at 0.18 m that takes energy, and pushes of 0.3 s: when they begin, s, and how hard, N.
fn run(label: &str, pushes: &[(f64, f64)]) -> Record {
    const EVERY: f64 = 0.01;
    const COUNT: usize = 600;
    let pushed = |t: f64| pushes.iter().filter(|(from, _)| (*from..from + 0.3).contains(&t)).map(|p| p.1).sum::<f64>();
    let forces: Vec<f64> = (0..=COUNT).map(|k| pushed(EVERY * (k as f64 + 0.5))).collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let rates = |t: f64, x: &[f64; 2]| {
        let u = forces[((t / EVERY + 1e-9) as usize).min(COUNT)];
        let deep = x[0] - 0.18;
        let stop = if deep > 0.0 { (20_000.0 * deep + 60.0 * x[1]).max(0.0) } else { 0.0 };
        [x[1], (u - 1.5 * x[1] - 60.0 * x[0] - stop) / 1.6]
    };
    let states = integrated(rates, [0.0; 2], EVERY, COUNT);
    let noise = white(label, NOISE, states.len());
    let values = states.iter().zip(noise).map(|(x, e)| x[0] + e).collect();
    let times = (0..=COUNT).map(|k| EVERY * k as f64).collect();
    let input = Input::Sampled { times, values: forces.clone(), hold: Hold::Zero };
    Record {
        inputs: vec![("u", input)],
        times: (0..COUNT).map(|k| EVERY * k as f64).collect(),
        signals: vec![("x", values, NOISE)],
    }
}

fn diagnosis(records: Vec<Record>) -> Diagnosis {
    let subject: Subject = subject(MASS, &[1.0, 1.0, 50.0, 0.0, 0.0], 2, records);
    let effects = catalogue(&["end-stop", "cubic-stiffness", "quadratic-stiffness", "wind-gust", "coulomb-friction"]);
    diagnose(&study(&subject), &effects, &Options { max_effects: 1, level: 0.01, ..Options::default() }, &()).unwrap()
}

#[test]
#[ignore = "full tier"]
fn a_stiff_stop_is_found_where_it_is() {
    let often = [(0.5, 20.0), (2.0, 25.0), (3.5, 22.0), (4.8, 24.0)];
    let made = diagnosis(vec![run("often", &often), run("now and then", &[(1.0, 22.0), (3.2, 20.0)])]);
    assert_eq!(made.verdict, Verdict::Effect, "{:?}", made.found);
    assert_eq!(made.found[0].effect, "end-stop");
    let high = &made.found[0].strengths[2];
    assert!((high.value - 0.18).abs() < 1e-3, "{:?}", made.found[0].strengths);
    assert!(made.after.iter().all(|error| error.normalised < 1.1), "{:?}", made.after);
}

/// What a stop does once, a gust at that moment could have done, if it were ten times as strong as all else.
#[test]
fn a_stop_that_is_touched_once_is_more_probable_than_a_violent_gust() {
    let found = diagnosis(vec![run("once", &[(0.5, 20.0)]), run("never", &[(1.0, 5.0), (3.2, -9.0)])]);
    assert_eq!(found.verdict, Verdict::Effect);
    assert_eq!(found.found[0].effect, "end-stop");
    let gust = found.ranked.iter().find(|ranked| ranked.effect == "wind-gust").expect("it was fitted");
    assert!(gust.normalised < 1.1 && gust.strengths[0].value.abs() > 200.0, "{gust:?}");
}
