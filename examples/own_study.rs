//! A complete study in one file: a model with exact gradients, a criterion from a closure, the solution.
//!
//! A pothole gives a wheel suspension `m x'' = -k x - d x'` an initial speed of 1 m/s. Spring and damper are tuned for
//! a short settling time and a small acceleration of the load.

use mops::{
    criteria::settling_time::SettlingTime,
    models::kernel::{PlantModel, Simulated},
    prelude::*,
};

/// Mass, kg.
const MASS: f64 = 250.0;

/// Model of the suspension: its signals and parameters.
struct Suspension(Interface);

impl Suspension {
    fn new() -> Self {
        Self(Interface {
            signals: vec![Variable::new("x", "m", "deflection"), Variable::new("a", "m/s2", "acceleration")],
            parameters: vec![Parameter::new("k", "N/m", "spring"), Parameter::new("d", "N s/m", "damper")],
            horizon: Some(5.0),
            ..Interface::default()
        })
    }
}

/// Equations at given parameters, written once for values and derivatives.
struct Wheel<S> {
    k: S,
    d: S,
}

impl<S: Scalar> Wheel<S> {
    fn acceleration(&self, x: &[S]) -> S {
        -(self.k * x[0] + self.d * x[1]) / MASS
    }
}

impl<S: Scalar> Plant<S> for Wheel<S> {
    fn start(&self) -> Vec<S> {
        [0.0, 1.0].map(S::from).to_vec()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx.copy_from_slice(&[at.x[1], self.acceleration(at.x)]);
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        [at.x[0], self.acceleration(at.x)][signal]
    }
}

impl PlantModel for Suspension {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(Wheel { k: parameters[0], d: parameters[1] })
    }
}

/// Builds the study.
pub fn study() -> Result<Study, StudyError> {
    let settling = SettlingTime {
        signal: "x".into(),
        target: Some(0.0.into()),
        band: Some(1e-3.into()),
        ..SettlingTime::default()
    };
    // Root mean square of the acceleration.
    let shaking = mops::criteria::from_fn(["a"], Unit::known("m/s2"), |traces| {
        let a = traces[0];
        (a.integral(|_, a| a * a) / (a.end() - a.start())).sqrt()
    });
    StudyBuilder {
        name: "suspension".into(),
        models: vec![("wheel".into(), Simulated::new(Suspension::new()).into())],
        tuners: vec![
            ("k".into(), TunerBuilder::new(20e3, 5e3, 80e3).log()),
            ("d".into(), TunerBuilder::new(500.0, 100.0, 10e3).log()),
        ],
        criteria: vec![
            ("settling".into(), CriterionBuilder::minimise(settling, 1.0)),
            ("shaking".into(), CriterionBuilder::minimise(shaking, 2.0)),
        ],
        ..StudyBuilder::default()
    }
    .build()
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let outcome = solve(study()?, &Options::default(), &())?.outcome;
    for tuner in &outcome.tuners {
        println!("{} = {:.1} {}", tuner.name, tuner.value, tuner.unit);
    }
    for criterion in &outcome.criteria {
        println!("{} = {:.4} {}, scaled {:.4}", criterion.name, criterion.value, criterion.unit, criterion.scaled);
    }
    Ok(())
}
