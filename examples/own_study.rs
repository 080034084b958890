//! A study wholly in Rust: a model of one's own, a criterion of one's own, the run and its result.
//!
//! A wheel suspension `m x'' = -k x - d x'` is hit by a pothole that gives it a speed of 1 m/s. Spring and damper are to
//! be chosen so that it settles soon and shakes its load little.

use mops::criteria::settling_time::SettlingTime;
use mops::models::kernel::{Dynamics, Tolerance, record};
use mops::{
    Analysis, Case, Criterion, CriterionDraft, CriterionSpec, Draft, Failure, Interface, Job, Mistake, Model, Options,
    Parameter, Study, TunerDraft, Unit, Value, Variable,
};

/// The model: what it offers, and how it is simulated.
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

/// The equations.
struct Wheel {
    k: f64,
    d: f64,
}

impl Wheel {
    const MASS: f64 = 250.0;

    fn acceleration(&self, x: &[f64; 2]) -> f64 {
        -(self.k * x[0] + self.d * x[1]) / Self::MASS
    }
}

impl Dynamics<f64> for Wheel {
    type State = [f64; 2];

    fn derivative(&self, _: f64, x: &[f64; 2], dx: &mut [f64; 2]) {
        *dx = [x[1], self.acceleration(x)];
    }
}

impl Model for Suspension {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let mut wheel = Wheel { k: job.parameters[0], d: job.parameters[1] };
        let names = job.signals.iter().map(|&i| self.0.signals[i].name.clone());
        let outputs = |wheel: &Wheel, _: f64, x: &[f64; 2], y: &mut [f64]| {
            for (y, &signal) in y.iter_mut().zip(job.signals) {
                *y = [x[0], wheel.acceleration(x)][signal];
            }
        };
        record(&mut wheel, [0.0, 1.0], job.horizon, &Tolerance::default(), names, &outputs).map(Analysis::Time)
    }
}

/// The criterion: root mean square of the acceleration, m/s2.
#[derive(Clone)]
struct Shaking;

impl CriterionSpec for Shaking {
    fn bind(&self, _: &[Variable]) -> Result<Box<dyn Criterion>, Mistake> {
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

/// The study.
pub fn study() -> Result<Study, Mistake> {
    let settling = SettlingTime {
        signal: "x".into(),
        target: Some(0.0.into()),
        band: Some(1e-3.into()),
        ..SettlingTime::default()
    };
    Draft {
        name: "suspension".into(),
        models: vec![("wheel".into(), Suspension::new().into())],
        tuners: vec![
            ("k".into(), TunerDraft::new(20e3, 5e3, 80e3).log()),
            ("d".into(), TunerDraft::new(500.0, 100.0, 10e3).log()),
        ],
        criteria: vec![
            ("settling".into(), CriterionDraft::minimise(settling, 1.0)),
            ("shaking".into(), CriterionDraft::minimise(Shaking, 2.0)),
        ],
        ..Draft::default()
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
