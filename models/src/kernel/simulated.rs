//! Model of a plant: its simulation, and its equations at a point.

use std::sync::Arc;

use mops_core::model::{Cut, Local, OperatingPoint, WithTangents};
use mops_core::plant::Ported;
use mops_core::{Analysis, Failure, Interface, Job, Model, Plant, StudyError, Variable};
use mops_language::{Dual7, Scalar};
use mops_linear::Clock;

use super::drive::Drive;
use super::plant_model::PlantModel;
use super::plant_model::shown;
use super::{Driven, Inputs, Recording, Tolerance, Wanted, local, record, tangents_of, wanted};

/// Returns the interface of a model whose loop is cut at the signal `at`, and the ends of the cut: the last input acts
/// in the place of the signal, and the last signal is minus the value that the model computes.
///
/// # Errors
/// `variables` are not this signal alone.
pub(crate) fn cut_at(
    at: &str,
    of: &Interface,
    variables: &[String],
) -> Result<(Interface, Vec<[usize; 2]>), StudyError> {
    if let Some(other) = variables.iter().find(|variable| *variable != at) {
        return Err(StudyError::here(format!("the loop can be cut at `{at}` only, not at `{other}`")));
    }
    let mut interface = of.clone();
    let signal = of.signal(at)?;
    interface.inputs.push(Variable { about: "input of the cut loop".into(), ..signal.clone() });
    let name = format!("-{at}");
    interface.signals.push(Variable { name, about: "output of the cut loop".into(), ..signal.clone() });
    Ok((interface, vec![[of.inputs.len(), of.signals.len()]]))
}

/// Model of a plant: simulated, with exact tangents, linearised, and open at its ports.
///
/// Example: a pendulum with viscous friction, open at its joint:
///
/// ```
/// use mops_core::{Failure, Instant, Interface, Parameter, Plant, Variable};
/// use mops_language::Scalar;
/// use mops_models::kernel::{PlantModel, Simulated, mechanism};
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
/// struct WithParameters<S>([S; 5]);
///
/// impl<S: Scalar> Plant<S> for WithParameters<S> {
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
/// impl PlantModel for Pendulum {
///     fn interface(&self) -> &Interface {
///         &self.0
///     }
///     fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
///         Ok(WithParameters(parameters.try_into().expect("three parameters and two initial states")))
///     }
/// }
///
/// // A model like any other: `Simulated::new(Pendulum::new()).into()` is a `ModelBuilder`, which accepts effects.
/// use mops_core::{Catalogue, catalogue::EffectBuilder, study::ModelBuilder};
/// let catalogue = Catalogue {
///     effects: mops_effects::effects(),
///     augment: Some(|model, effects| Ok(Box::new(mops_models::WithEffects::new(model, effects)?))),
///     ..Catalogue::default()
/// };
/// let bearing = [EffectBuilder::new("bearing", "coulomb-friction", "joint:theta")];
/// let model = ModelBuilder::from(Simulated::new(Pendulum::new())).with_effects(&catalogue, &bearing)?;
/// assert_eq!(model.model.interface().parameters.last().unwrap().variable.name, "bearing.c");
/// # Ok::<(), mops_core::StudyError>(())
/// ```
pub struct Simulated<M> {
    of: M,
    /// Index of the state that each signal equals, if any.
    shows: Vec<Option<usize>>,
}

impl<M: PlantModel> Simulated<M> {
    /// Creates the model of a plant.
    pub fn new(of: M) -> Self {
        let shows = shown(of.interface(), &of.states());
        Self { of, shows }
    }

    /// Returns the plant that the model was created from.
    pub fn plant_model(&self) -> &M {
        &self.of
    }

    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        let interface = self.of.interface();
        if !job.case.disturbances.is_empty() {
            return Err(Failure::Undefined("external forces need a model with open equations".into()));
        }
        let simulation = Simulation {
            plant: &|| self.of.plant(parameters),
            inputs: &|| {
                let input = |(i, input): (usize, &Variable)| {
                    Drive::new(job.case.input(&input.name).or_else(|| self.of.input(i)))
                };
                let drives = interface.inputs.iter().enumerate().map(input).collect();
                Inputs::new(drives, interface.forces()).beginning_at(job.case.begins)
            },
            shows: &self.shows,
            tolerance: &self.of.tolerance(),
        };
        Ok(simulation.run(job, &wanted(job, &interface.signals))?.0)
    }
}

/// Simulation of a plant.
pub(crate) struct Simulation<'s, 'a, S, P> {
    /// Makes the plant.
    pub plant: &'s dyn Fn() -> Result<P, Failure>,
    /// Makes its inputs.
    pub inputs: &'s dyn Fn() -> Inputs<'a, S>,
    /// State that each signal equals, if any.
    pub shows: &'s [Option<usize>],
    /// Accuracy and limits.
    pub tolerance: &'s Tolerance,
}

impl<'a, S: Scalar, P: Plant<S>> Simulation<'_, 'a, S, P> {
    /// Simulates over the horizon of a job and records signals. Returns the plant at the end as well.
    ///
    /// # Errors
    /// The failure of the simulation.
    pub fn run(&self, job: &Job<'_>, wanted: &Wanted) -> Result<(Recording, P), Failure> {
        let mut driven = self.driven()?;
        let start = driven.begin()?;
        let jumps = driven.jumps_at_start();
        let recording = record(&mut driven, &start, job.horizon, self.tolerance, wanted);
        let mut recording = recording.map_err(|failure| driven.plant.explain(failure))?;
        if jumps {
            let mut before = self.driven()?;
            let start = before.begin()?;
            recording.set_initial(&before.initial(&start, job.signals));
        }
        Ok((recording, driven.plant))
    }

    fn driven(&self) -> Result<Driven<'a, S, P>, Failure> {
        Ok(Driven::new((self.plant)()?, (self.inputs)(), self.shows))
    }
}

impl<M: PlantModel> Model for Simulated<M> {
    fn interface(&self) -> &Interface {
        self.of.interface()
    }

    fn notes(&self) -> Vec<String> {
        self.of.notes()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        self.simulate(job, job.parameters).map(|recording| Analysis::Time(recording.response))
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        if seeds.is_empty() {
            return Some(self.analyse(job).map(|analysis| (analysis, Vec::new())));
        }
        Some(tangents_of(|parameters| self.simulate(job, parameters), job.parameters, seeds))
    }

    fn equation_states(&self) -> Vec<Variable> {
        self.of.states()
    }

    fn start_values(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        self.of.plant(parameters).ok().map(|plant| plant.start())
    }

    fn local(&self, at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        Some(local::local(&self.of, at))
    }

    fn delays(&self, parameters: &[f64]) -> Result<Vec<f64>, Failure> {
        Ok(self.of.plant(parameters)?.memory().map_or_else(Vec::new, |memory| memory.delays()))
    }

    fn clocks(&self, parameters: &[f64]) -> Result<Vec<Clock>, Failure> {
        Ok(self.of.plant(parameters)?.breaks().map_or_else(Vec::new, |breaks| breaks.clocks()))
    }

    fn not_linear(&self) -> Option<&'static str> {
        self.of.not_linear()
    }

    fn cut(&self, variables: &[String]) -> Option<Result<Cut, StudyError>> {
        self.of.cut(variables)
    }

    fn constants(&self) -> Vec<(Variable, f64)> {
        self.of.constants()
    }

    fn with_constant(&self, name: &str, value: f64) -> Option<Arc<dyn Model>> {
        self.of.with_constant(name, value)
    }

    fn ported(&self) -> Option<&dyn Ported> {
        (!self.of.interface().ports.is_empty()).then_some(self)
    }
}

impl<M: PlantModel> Ported for Simulated<M> {
    fn plant<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure> {
        Ok(Box::new(self.of.ported_plant(parameters)?))
    }

    fn dual_plant<'a>(&'a self, parameters: &'a [Dual7]) -> Result<Box<dyn Plant<Dual7> + 'a>, Failure> {
        Ok(Box::new(self.of.ported_plant(parameters)?))
    }

    fn tolerance(&self) -> Tolerance {
        self.of.tolerance()
    }
}
