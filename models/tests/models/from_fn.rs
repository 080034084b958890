//! Tests of models from closures.

use std::sync::Arc;

use mops_core::model::{Linearise, Linearised};
use mops_core::{Case, Input, Interface, Job, Model, Parameter, Variable};
use mops_math as math;
use mops_models::from_fn;

/// `T = P/k (1 - exp(-k t/C))`.
#[test]
fn a_tank_from_a_closure_warms_as_the_closed_form_says() {
    let interface = Interface {
        signals: vec![Variable::new("T", "K", "temperature above ambient")],
        inputs: vec![Variable::new("P", "W", "heating power")],
        parameters: vec![Parameter::new("C", "J/K", "heat capacity"), Parameter::new("k", "W/K", "heat loss")],
        horizon: Some(600.0),
        ..Interface::default()
    };
    let tank = from_fn(interface, [0.0], |at, p, dx| dx[0] = (at.u[0] - p[1] * at.x[0]) / p[0]);
    let case = Case { inputs: vec![("P".into(), Input::Constant(50.0))], ..Case::default() };
    let (c, k) = (4e3, 20.0);
    let job = Job { case: &case, parameters: &[c, k], signals: &[0], horizon: 600.0 };
    let analysis = tank.analyse(&job).unwrap();
    for t in [50.0, 200.0, 600.0] {
        let expected = 50.0 / k * (1.0 - math::exp(-k * t / c));
        let found = analysis.trace("T").at(t);
        assert!((found - expected).abs() < 1e-6, "{t}: {found} {expected}");
    }
    assert!(tank.tangents(&job, &[vec![1.0, 0.0]]).is_none());
    let refused = Linearised::new(Arc::new(tank), &Linearise::default()).err().unwrap().to_string();
    assert!(refused.contains("needs the derivatives") && refused.contains("`PlantModel`"), "{refused}");
}
