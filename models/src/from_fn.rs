//! Models from closures.

use std::sync::Arc;

use mops_core::{Analysis, Failure, Instant, Interface, Job, Model, Plant};
use mops_language::Scalar;

use crate::kernel::{PlantModel, Simulated};

/// Time derivative of the states: the instant (time, states, inputs), the parameters, the derivatives to fill in.
type Rates = Arc<dyn Fn(&Instant<'_, f64>, &[f64], &mut [f64]) + Send + Sync>;

/// Model given by a closure; see [`from_fn`].
pub struct FnModel(Simulated<Equations>);

struct Equations {
    interface: Interface,
    initial_states: Vec<f64>,
    rates: Rates,
}

/// Creates a model `x' = f(t, x, u, p)` from a closure. `rates` receives the instant (`at.t`, states `at.x`, inputs
/// `at.u`) and the parameters, and fills in the derivatives of the states. The signals of `interface` are the first
/// states, in their order.
///
/// Derivatives with respect to parameters are finite differences; a [`PlantModel`], written once over the scalar, has
/// exact ones, and can be linearised and augmented with effects.
///
/// # Panics
/// If `interface` has more signals than there are states.
///
/// ```
/// use mops_core::{Interface, Parameter, Variable};
///
/// // A heated tank: C T' = P - k T.
/// let interface = Interface {
///     signals: vec![Variable::new("T", "K", "temperature above ambient")],
///     inputs: vec![Variable::new("P", "W", "heating power")],
///     parameters: vec![Parameter::new("C", "J/K", "heat capacity"), Parameter::new("k", "W/K", "heat loss")],
///     horizon: Some(600.0),
///     ..Interface::default()
/// };
/// let tank = mops_models::from_fn(interface, [0.0], |at, p, dx| dx[0] = (at.u[0] - p[1] * at.x[0]) / p[0]);
/// ```
pub fn from_fn<const N: usize>(
    interface: Interface,
    initial_states: [f64; N],
    rates: impl Fn(&Instant<'_, f64>, &[f64], &mut [f64]) + Send + Sync + 'static,
) -> FnModel {
    assert!(interface.signals.len() <= N, "every signal of a model from a closure is one of its {N} states");
    let initial_states = initial_states.to_vec();
    FnModel(Simulated::new(Equations { interface, initial_states, rates: Arc::new(rates) }))
}

struct Bound<'a> {
    of: &'a Equations,
    parameters: Vec<f64>,
}

/// Plain numbers of scalars.
fn plain<S: Scalar>(values: &[S]) -> Vec<f64> {
    values.iter().map(|value| value.value()).collect()
}

impl<S: Scalar> Plant<S> for Bound<'_> {
    fn start(&self) -> Vec<S> {
        self.of.initial_states.iter().map(|&x| S::from(x)).collect()
    }

    // N.B.: the scalar is a plain number here, as `FnModel` asks for no derivatives.
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let (x, u, w) = (plain(at.x), plain(at.u), plain(at.w));
        let at = Instant { t: at.t, x: &x, u: &u, w: &w };
        let mut derivatives = vec![0.0; dx.len()];
        (self.of.rates)(&at, &self.parameters, &mut derivatives);
        for (dx, derivative) in dx.iter_mut().zip(derivatives) {
            *dx = S::from(derivative);
        }
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        at.x[signal]
    }
}

impl PlantModel for Equations {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(Bound { of: self, parameters: plain(parameters) })
    }
}

impl Model for FnModel {
    fn interface(&self) -> &Interface {
        self.0.interface()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        self.0.analyse(job)
    }
}
