//! Several models as one, so that a criterion can compare their signals.

use std::sync::Arc;

use crate::error::StudyError;
use crate::failure::Failure;
use crate::model::{
    Analysis, AnalysisKind, Event, Interface, Job, Model, Parameter, Response, Variable, WithTangents, Work,
};

/// Models that are simulated side by side. The signal `y` of the model `loop` is `loop_y`; characters that cannot be
/// part of a name in a formula become `_`. Parameters and initial values of the same name are one, and so are inputs
/// that the case gives.
#[derive(Clone)]
pub struct Joined {
    parts: Vec<Part>,
    interface: Interface,
}

#[derive(Clone)]
struct Part {
    /// Beginning of the names of its signals.
    prefix: String,
    model: Arc<dyn Model>,
    /// Index in the joined model, for each parameter of this one.
    parameters: Vec<usize>,
    /// Index of the first signal in the joined model.
    first: usize,
}

impl Joined {
    /// Joins models, with their names.
    ///
    /// # Errors
    /// Returns an error if there are fewer than two models, if one is a linear system without time, or if parameters or
    /// inputs with one name differ in their units.
    pub fn new(models: Vec<(String, Box<dyn Model>)>) -> Result<Self, StudyError> {
        if models.len() < 2 {
            let fact = format!("expected at least two models in `join`, found {}", models.len());
            return Err(StudyError::here(fact).with_help("add another model"));
        }
        let mut interface = Interface::default();
        let mut parts = Vec::new();
        for (name, model) in models {
            let of = model.interface();
            let prefix = prefix(&name);
            if of.analysis == AnalysisKind::Linear {
                let fact = format!("`{name}` is a linear system without simulation");
                return Err(StudyError::here(fact).with_help("give it a `horizon`, or leave it out"));
            }
            let first = interface.signals.len();
            let own = |signal: &Variable| Variable { name: format!("{prefix}{}", signal.name), ..signal.clone() };
            interface.signals.extend(of.signals.iter().map(own));
            for input in &of.inputs {
                match interface.inputs.iter().find(|known| known.name == input.name) {
                    Some(known) if known.unit != input.unit => return Err(in_two_units(known, input)),
                    Some(_) => {}
                    None => interface.inputs.push(input.clone()),
                }
            }
            let mut parameters = Vec::new();
            for parameter in &of.parameters {
                parameters.push(shared(&mut interface.parameters, parameter)?);
            }
            interface.horizon = interface.horizon.into_iter().chain(of.horizon).reduce(f64::max);
            parts.push(Part { prefix, model: model.into(), parameters, first });
        }
        Ok(Self { parts, interface })
    }

    /// Passes the job of every part with requested signals, and the seeds of its parameters, to `run`.
    fn each<T>(
        &self,
        job: &Job<'_>,
        seeds: &[Vec<f64>],
        mut run: impl FnMut(&Part, &Job<'_>, &[Vec<f64>]) -> Option<Result<T, Failure>>,
    ) -> Option<Result<Vec<(&Part, T)>, Failure>> {
        let mut found = Vec::new();
        for part in &self.parts {
            let own = part.first..part.first + part.model.interface().signals.len();
            let signals: Vec<usize> = job.signals.iter().filter(|i| own.contains(i)).map(|i| i - part.first).collect();
            if signals.is_empty() {
                continue;
            }
            let take = |of: &[f64]| part.parameters.iter().map(|&i| of[i]).collect::<Vec<f64>>();
            let parameters = take(job.parameters);
            let seeds: Vec<Vec<f64>> = seeds.iter().map(|seed| take(seed)).collect();
            match run(part, &Job { parameters: &parameters, signals: &signals, ..*job }, &seeds)? {
                Ok(analysis) => found.push((part, analysis)),
                Err(failure) => return Some(Err(failure)),
            }
        }
        Some(Ok(found))
    }
}

/// Returns the beginning of the names of the signals of a model.
fn prefix(model: &str) -> String {
    model.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).chain(['_']).collect()
}

/// Returns the index of a parameter among those known so far, to which it is added if it is new.
fn shared(known: &mut Vec<Parameter>, new: &Parameter) -> Result<usize, StudyError> {
    let Some(index) = known.iter().position(|known| known.variable.name == new.variable.name) else {
        known.push(new.clone());
        return Ok(known.len() - 1);
    };
    let old = &mut known[index];
    if old.variable.unit != new.variable.unit {
        return Err(in_two_units(&old.variable, &new.variable));
    }
    let same = old.default.map(f64::to_bits) == new.default.map(f64::to_bits);
    old.default = old.default.filter(|_| same);
    old.range = [old.range[0].max(new.range[0]), old.range[1].min(new.range[1])];
    old.infinite &= new.infinite;
    Ok(index)
}

fn in_two_units(one: &Variable, other: &Variable) -> StudyError {
    let fact = format!("`{}` has the unit `{}` in one model and `{}` in another", one.name, one.unit, other.unit);
    StudyError::here(fact).with_help("rename it in one of them, or give it one unit")
}

/// Returns the analyses of the parts as one, with the names of their signals.
fn merged(parts: Vec<(&Part, Analysis)>) -> Analysis {
    let mut all = Response::default();
    for (part, analysis) in parts {
        let Analysis::Time(response) = analysis else { unreachable!("checked when the models were joined") };
        let name = |text: String| format!("{}{text}", part.prefix);
        all.traces.extend(response.traces.into_iter().map(|(signal, trace)| (name(signal), trace)));
        all.events.extend(response.events.into_iter().map(|event| Event { what: name(event.what), ..event }));
        let Work { steps, rejected, derivatives, rough } = response.work;
        all.work = Work {
            steps: all.work.steps + steps,
            rejected: all.work.rejected + rejected,
            derivatives: all.work.derivatives + derivatives,
            rough: all.work.rough + rough,
        };
    }
    all.events.sort_by(|a, b| a.time.total_cmp(&b.time));
    Analysis::Time(all)
}

impl Model for Joined {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn constants(&self) -> Vec<(Variable, f64)> {
        let mut all: Vec<(Variable, f64)> = Vec::new();
        for constant in self.parts.iter().flat_map(|part| part.model.constants()) {
            if all.iter().all(|(known, _)| known.name != constant.0.name) {
                all.push(constant);
            }
        }
        all
    }

    fn with_constant(&self, name: &str, value: f64) -> Option<Arc<dyn Model>> {
        let mut moved = self.clone();
        let mut is_known = false;
        for part in &mut moved.parts {
            if part.model.constants().iter().any(|(constant, _)| constant.name == name) {
                part.model = part.model.with_constant(name, value)?;
                is_known = true;
            }
        }
        is_known.then(|| Arc::new(moved) as Arc<dyn Model>)
    }

    fn notes(&self) -> Vec<String> {
        self.parts.iter().flat_map(|part| part.model.notes()).collect()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let parts = self.each(job, &[], |part, job, _| Some(part.model.analyse(job)));
        parts.expect("every part is analysed").map(merged)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        let parts = self.each(job, seeds, |part, job, seeds| part.model.tangents(job, seeds))?;
        Some(parts.map(|parts| {
            let mut analyses = Vec::new();
            let mut along: Vec<Vec<(&Part, Analysis)>> = seeds.iter().map(|_| Vec::new()).collect();
            for (part, (analysis, tangents)) in parts {
                analyses.push((part, analysis));
                along.iter_mut().zip(tangents).for_each(|(along, tangent)| along.push((part, tangent)));
            }
            (merged(analyses), along.into_iter().map(merged).collect())
        }))
    }
}
