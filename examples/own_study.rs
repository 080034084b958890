//! A study wholly in Rust: a model of one's own, a criterion of one's own, the run and its result.
//!
//! A wheel suspension `m x'' = -k x - d x'` is hit by a pothole that gives it a speed of 1 m/s. Spring and damper are to
//! be chosen so that it settles soon and shakes its load little.

use mops::criteria::settling_time::SettlingTime;
use mops::models::kernel::{self, Dynamics, Recording, Simulate, Tolerance, record, wanted};
use mops::{
    Analysis, Case, Criterion, CriterionDraft, CriterionSpec, Draft, Failure, Interface, Job, Mistake, Model, Options,
    Parameter, Scalar, Study, TunerDraft, Unit, Value, Variable, WithTangents,
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

/// Mass, kg.
const MASS: f64 = 250.0;

/// The equations, written once for values and for derivatives.
struct Wheel<S> {
    k: S,
    d: S,
}

impl<S: Scalar> Wheel<S> {
    fn acceleration(&self, x: &[S; 2]) -> S {
        -(self.k * x[0] + self.d * x[1]) / MASS
    }
}

impl<S: Scalar> Dynamics<S> for Wheel<S> {
    type State = [S; 2];

    fn derivative(&self, _: f64, x: &[S; 2], dx: &mut [S; 2]) {
        *dx = [x[1], self.acceleration(x)];
    }
}

impl Model for Suspension {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        kernel::analyse(self, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(kernel::tangents(self, job, seeds))
    }
}

impl Simulate for Suspension {
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        let mut wheel = Wheel { k: parameters[0], d: parameters[1] };
        let start = [0.0, 1.0].map(S::from);
        let output = |wheel: &Wheel<S>, signal: usize, _: f64, x: &[S; 2]| [x[0], wheel.acceleration(x)][signal];
        record(&mut wheel, start, job.horizon, &Tolerance::default(), &wanted(job, &self.0.signals), &output)
    }
}

/// The criterion: root mean square of the acceleration, m/s2.
#[derive(Clone)]
struct Shaking;

impl CriterionSpec for Shaking {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, Mistake> {
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
