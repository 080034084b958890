//! Defines a study in Rust: a new model, a new criterion, the run and its result.
//!
//! A pothole gives a wheel suspension `m x'' = -k x - d x'` an initial speed of 1 m/s. Spring and damper are chosen for a short
//! settling time and a small acceleration of the load.

use mops::criteria::settling_time::SettlingTime;
use mops::models::kernel::{PlantModel, Simulated};
use mops::{
    Analysis, Case, Criterion, CriterionBuilder, CriterionSpec, Failure, Instant, Interface, Options, Parameter, Plant,
    Scalar, Study, StudyBuilder, StudyError, TunerBuilder, Unit, Value, Variable,
};

/// Interface of the model: its signals and parameters.
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

/// Mass, kg.
const MASS: f64 = 250.0;

/// Plant, written once for values and derivatives.
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

/// Root mean square of the acceleration, m/s2.
#[derive(Clone)]
struct Shaking;

impl CriterionSpec for Shaking {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(self.clone()))
    }
}

impl Criterion for Shaking {
    fn unit(&self) -> Unit {
        Unit::known("m/s2")
    }

    fn signals(&self) -> Vec<String> {
        vec!["a".into()]
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let a = analysis.trace("a");
        Ok((a.integral(|_, a| a * a) / (a.end() - a.start())).sqrt().into())
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
    StudyBuilder {
        name: "suspension".into(),
        models: vec![("wheel".into(), Simulated::new(Suspension::new()).into())],
        tuners: vec![
            ("k".into(), TunerBuilder::new(20e3, 5e3, 80e3).log()),
            ("d".into(), TunerBuilder::new(500.0, 100.0, 10e3).log()),
        ],
        criteria: vec![
            ("settling".into(), CriterionBuilder::minimise(settling, 1.0)),
            ("shaking".into(), CriterionBuilder::minimise(Shaking, 2.0)),
        ],
        ..StudyBuilder::default()
    }
    .build()
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let outcome = mops::solve(study()?, &Options::default(), &())?.outcome;
    for tuner in &outcome.tuners {
        println!("{} = {:.1} {}", tuner.name, tuner.value, tuner.unit);
    }
    for criterion in &outcome.criteria {
        println!("{} = {:.4} {}, scaled {:.4}", criterion.name, criterion.value, criterion.unit, criterion.scaled);
    }
    Ok(())
}
