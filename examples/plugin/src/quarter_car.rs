//! The model `quarter-car`.

use mops::{
    models::kernel::{PlantModel, Simulated},
    prelude::*,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// A quarter of a car on a road: body and wheel, coupled by the suspension, the wheel on its tyre.
///
/// `m x'' = -k (x - z) - d (x' - z')` for the body, `mw z'' = k (x - z) + d (x' - z') - kt (z - road)` for the wheel.
///
/// Source: D. Hrovat, Survey of advanced suspension developments, Automatica 33 (1997) 1781-1817, section 2.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct QuarterCarOptions {}

impl ModelOptions for QuarterCarOptions {
    const KIND: &'static str = "quarter-car";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        Ok(Box::new(Simulated::new(QuarterCar::new())))
    }
}

/// The interface: what studies can read and set.
pub struct QuarterCar(Interface);

impl QuarterCar {
    /// Creates the model.
    pub fn new() -> Self {
        Self(Interface {
            signals: vec![
                Variable::new("x", "m", "deflection of the body"),
                Variable::new("z", "m", "deflection of the wheel"),
                Variable::new("a", "m/s2", "acceleration of the body"),
            ],
            inputs: vec![Variable::new("road", "m", "height of the road")],
            parameters: vec![
                Parameter::new("m", "kg", "mass of the body").with_default(300.0),
                Parameter::new("mw", "kg", "mass of the wheel").with_default(40.0),
                Parameter::new("k", "N/m", "spring"),
                Parameter::new("d", "N s/m", "damper"),
                Parameter::new("kt", "N/m", "tyre").with_default(180e3),
            ],
            horizon: Some(3.0),
            ..Interface::default()
        })
    }
}

impl Default for QuarterCar {
    fn default() -> Self {
        Self::new()
    }
}

/// The equations at given parameters, written once for values and for exact derivatives.
struct Equations<S> {
    m: S,
    mw: S,
    k: S,
    d: S,
    kt: S,
}

impl<S: Scalar> Equations<S> {
    /// Force of the suspension on the body.
    fn suspension(&self, [x, z, v, w]: [S; 4]) -> S {
        -(self.k * (x - z) + self.d * (v - w))
    }
}

impl<S: Scalar> Plant<S> for Equations<S> {
    fn start(&self) -> Vec<S> {
        vec![S::from(0.0); 4]
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let [x, z, v, w] = [at.x[0], at.x[1], at.x[2], at.x[3]];
        let force = self.suspension([x, z, v, w]);
        dx.copy_from_slice(&[v, w, force / self.m, (-force - self.kt * (z - at.u[0])) / self.mw]);
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        match signal {
            2 => self.suspension([at.x[0], at.x[1], at.x[2], at.x[3]]) / self.m,
            state => at.x[state],
        }
    }
}

impl PlantModel for QuarterCar {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let [m, mw, k, d, kt] = [0, 1, 2, 3, 4].map(|i| parameters[i]);
        Ok(Equations { m, mw, k, d, kt })
    }

    fn states(&self) -> Vec<Variable> {
        vec![
            Variable::new("x", "m", "deflection of the body"),
            Variable::new("z", "m", "deflection of the wheel"),
            Variable::new("v", "m/s", "speed of the body"),
            Variable::new("w", "m/s", "speed of the wheel"),
        ]
    }
}
