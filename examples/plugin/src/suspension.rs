//! The study `suspension`, built in Rust: its model and one of its criteria are closures.
//!
//! A wheel `m x'' = -k x - d x'` is hit by a pothole that gives it a speed of 1 m/s. Spring and damper shall let it
//! settle soon and shake its load little.

use mops::{criteria::settling_time::SettlingTime, prelude::*};

/// Mass, kg.
const MASS: f64 = 250.0;

/// Describes the study.
pub fn study() -> StudyBuilder {
    let interface = Interface {
        signals: vec![Variable::new("x", "m", "deflection"), Variable::new("v", "m/s", "speed")],
        parameters: vec![Parameter::new("k", "N/m", "spring"), Parameter::new("d", "N s/m", "damper")],
        horizon: Some(5.0),
        ..Interface::default()
    };
    let wheel = mops::models::from_fn(interface, [0.0, 1.0], |at, p, dx| {
        dx[0] = at.x[1];
        dx[1] = -(p[0] * at.x[0] + p[1] * at.x[1]) / MASS;
    });
    let settling = SettlingTime {
        signal: "x".into(),
        target: Some(0.0.into()),
        band: Some(1e-3.into()),
        ..SettlingTime::default()
    };
    // Root mean square of the speed.
    let shaking = mops::criteria::from_fn(["v"], Unit::known("m/s"), |traces| {
        let v = traces[0];
        (v.integral(|_, v| v * v) / (v.end() - v.start())).sqrt()
    });
    StudyBuilder {
        models: vec![("wheel".into(), wheel.into())],
        tuners: vec![
            ("k".into(), TunerBuilder::new(20e3, 5e3, 80e3).log()),
            ("d".into(), TunerBuilder::new(500.0, 100.0, 10e3).log()),
        ],
        criteria: vec![
            ("settling".into(), CriterionBuilder::minimise(settling, 1.0)),
            ("shaking".into(), CriterionBuilder::minimise(shaking, 0.1)),
        ],
        ..StudyBuilder::default()
    }
}
