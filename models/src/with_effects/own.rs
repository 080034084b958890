//! A model of one's own: its plant is written once over the scalar, and all else follows.

use mops_core::{
    Along, Analysis, Failure, Instant, Interface, Job, Local, Model, Open, OperatingPoint, Plant, Scalar, Variable,
    WithTangents,
};

use super::alone;
use crate::kernel::{self, Equations, Tolerance};

/// A plant that is written once over the scalar; [`Own`] makes a model of it.
///
/// The states are named by [`Interface::states`]; where that names signals for them, these have their units. What
/// [`Interface::ports`] lists takes effects, and tells the order of the forces `w` that the plant adds to its equations.
pub trait OwnModel: Send + Sync {
    /// What the model offers and takes.
    fn interface(&self) -> &Interface;

    /// The plant at these values of the parameters.
    ///
    /// # Errors
    /// Parameters for which it is not defined.
    fn plant<S: Scalar>(&self, parameters: &[S]) -> Result<impl Plant<S> + use<S, Self>, Failure>;

    /// Accuracy and limits of its simulations.
    fn tolerance(&self) -> Tolerance {
        Tolerance::default()
    }
}

/// The model of a plant: simulated, with exact tangents, linearised, and open at its ports.
///
/// A pendulum with viscous friction, open at its joint:
///
/// ```
/// use mops_core::{Failure, Instant, Interface, Parameter, Plant, Scalar, Variable};
/// use mops_models::{Own, OwnModel, kernel::mechanism};
///
/// /// `J theta'' = u - d sin(theta) - b theta' + w`, `w` a torque that effects add.
/// struct Pendulum(Interface);
///
/// impl Pendulum {
///     fn new() -> Self {
///         let joint = mechanism::Joint { angle: "theta", about: "pendulum", start: 0.5, events: [""; 4] };
///         let parameters = [("J", "kg m2", "inertia"), ("d", "N m", "gravity torque"), ("b", "N m s/rad", "friction")];
///         let parameters = parameters.map(|(name, unit, about)| Parameter::new(name, unit, about)).to_vec();
///         let torque = Variable::new("u", "N m", "torque");
///         let interface = mechanism::interface(&[joint], parameters, vec![torque]);
///         Self(Interface { ports: mechanism::ports(&["theta"], &["u"]), horizon: Some(5.0), ..interface })
///     }
/// }
///
/// struct At<S>([S; 5]);
///
/// impl<S: Scalar> Plant<S> for At<S> {
///     fn start(&self) -> Vec<S> {
///         self.0[3..].to_vec()
///     }
///     fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
///         let [inertia, gravity, friction, ..] = self.0;
///         dx[0] = at.x[1];
///         dx[1] = (at.u[0] - gravity * at.x[0].sin() - friction * at.x[1] + at.w[0]) / inertia;
///     }
/// }
///
/// impl OwnModel for Pendulum {
///     fn interface(&self) -> &Interface {
///         &self.0
///     }
///     fn plant<S: Scalar>(&self, parameters: &[S]) -> Result<impl Plant<S> + use<S>, Failure> {
///         Ok(At(parameters.try_into().expect("three parameters and two start values")))
///     }
/// }
///
/// // A model like any other: `Own(Pendulum::new()).into()` is a `ModelDraft`, which takes effects.
/// use mops_core::{Catalogue, EffectDraft, ModelDraft};
/// let catalogue = Catalogue {
///     effects: mops_models::effects::effects(),
///     augment: Some(|model, effects| Ok(Box::new(mops_models::WithEffects::new(model, effects)?))),
///     ..Catalogue::default()
/// };
/// let bearing = [EffectDraft::new("bearing", "coulomb-friction", "joint:theta")];
/// let model = ModelDraft::from(Own(Pendulum::new())).with_effects(&catalogue, &bearing)?;
/// assert_eq!(model.model.interface().parameters.last().unwrap().variable.name, "bearing.c");
/// # Ok::<(), mops_core::Mistake>(())
/// ```
pub struct Own<M>(pub M);

impl<M: OwnModel> Model for Own<M> {
    fn interface(&self) -> &Interface {
        self.0.interface()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let plant = Box::new(self.0.plant(job.parameters)?);
        let recording = alone(self.0.interface(), plant, &self.0.tolerance(), job)?;
        Ok(Analysis::Time(recording.response))
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        if seeds.is_empty() {
            return Some(self.analyse(job).map(|analysis| (analysis, Vec::new())));
        }
        let simulate = |parameters: &[Along]| {
            alone(self.0.interface(), Box::new(self.0.plant(parameters)?), &self.0.tolerance(), job)
        };
        Some(kernel::tangents_of(simulate, job.parameters, seeds))
    }

    fn equation_states(&self) -> Vec<Variable> {
        let Interface { states, signals, .. } = self.0.interface();
        let variable = |name: &str, signal: Option<&String>| {
            let shown = signals.iter().find(|v| signal.is_some_and(|signal| v.name == *signal));
            shown.map_or_else(|| Variable::new(name, "1", "state"), |v| Variable { name: name.to_owned(), ..v.clone() })
        };
        states.iter().map(|state| variable(&state.name, state.signal.as_ref())).collect()
    }

    fn start_values(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        self.0.plant(parameters).ok().map(|plant| plant.start())
    }

    fn local(&self, at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        Some(kernel::local(self, at))
    }

    fn ported(&self) -> Option<&dyn Open> {
        (!self.0.interface().ports.is_empty()).then_some(self)
    }
}

impl<M: OwnModel> Equations for Own<M> {
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure> {
        let mut plant = self.0.plant(at.parameters)?;
        let w = vec![S::from(0.0); self.0.interface().ports.len()];
        let here = Instant { t: 0.0, x: at.states, u: at.inputs, w: &w };
        plant.settle(&here);
        let mut rates = at.states.to_vec();
        plant.rates(&here, &mut rates);
        let signals = (0..self.0.interface().signals.len()).map(|signal| plant.signal(signal, &here)).collect();
        Ok([rates, signals])
    }
}

impl<M: OwnModel> Open for Own<M> {
    fn open<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure> {
        Ok(Box::new(self.0.plant(parameters)?))
    }

    fn open_along<'a>(&'a self, parameters: &'a [Along]) -> Result<Box<dyn Plant<Along> + 'a>, Failure> {
        Ok(Box::new(self.0.plant(parameters)?))
    }

    fn tolerance(&self) -> Tolerance {
        self.0.tolerance()
    }
}
