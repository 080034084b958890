//! Jobs (model-case pairs) and the sources of their parameters.

use mops_language::Unit;

use crate::model::{AnalysisKind, Interface};
use crate::study::{JobPlan, ParameterSource, Study, StudyError};

/// Returns the job of a model in a case, created on first use and completed later. Adds the signals to those it
/// computes.
pub(super) fn job(study: &mut Study, model: usize, case: usize, wanted: &[String]) -> Result<usize, StudyError> {
    let interface = study.models[model].1.interface();
    let wanted = wanted.iter().map(|name| interface.signal_index(name)).collect::<Result<Vec<_>, _>>()?;
    let index = match study.jobs.iter().position(|j| j.model == model && j.case == case) {
        Some(index) => index,
        None => {
            study.jobs.push(JobPlan { model, case, parameters: Vec::new(), signals: Vec::new(), horizon: 0.0 });
            study.jobs.len() - 1
        }
    };
    let job = &mut study.jobs[index];
    job.signals.extend(wanted);
    job.signals.sort_unstable();
    job.signals.dedup();
    Ok(index)
}

impl Study {
    /// Returns the job of a model in a case, with all its signals, whether a criterion reads it or not.
    ///
    /// # Errors
    /// Returns an error if a parameter has no value in the case, or if a simulation has no end.
    pub fn plan(&self, model: usize, case: usize) -> Result<JobPlan, StudyError> {
        let (horizon, parameters) = complete(self, model, case)?;
        let signals = (0..self.models[model].1.interface().signals.len()).collect();
        Ok(JobPlan { model, case, parameters, signals, horizon })
    }

    /// Returns the sources of the parameters of a model in a case. The caller sets the parameters `set` itself, so that
    /// they need none.
    ///
    /// # Errors
    /// Returns an error if a parameter has no value in the case.
    pub fn parameter_sources(
        &self,
        model: usize,
        case: usize,
        set: &[&str],
    ) -> Result<Vec<ParameterSource>, StudyError> {
        sources(self, self.models[model].1.interface(), &self.fixed[model], case, set)
    }
}

/// Returns the horizon and the parameters of a job.
pub(super) fn complete(study: &Study, model: usize, case: usize) -> Result<(f64, Vec<ParameterSource>), StudyError> {
    let interface = study.models[model].1.interface();
    let horizon = match (study.cases[case].horizon.or(interface.horizon), interface.analysis) {
        (Some(horizon), _) => horizon,
        (None, AnalysisKind::Linear) => 0.0,
        (None, AnalysisKind::Time) => {
            let fact = format!("case `{}` has no horizon", study.cases[case].name);
            return Err(StudyError::here(fact).with_help("set `horizon` in the case or in the model"));
        }
    };
    Ok((horizon, study.parameter_sources(model, case, &[])?))
}

/// Returns the error for a parameter with incompatible units in two models.
fn apart(name: &str, unit: &Unit, other: &Unit) -> StudyError {
    StudyError::here(format!("`{name}` is in {unit} in one model and in {other} in another"))
        .with_help("give them different names, or one unit")
}

/// Returns the source of each parameter. The first existing one is used: a tuner of the case, a value in the case, a
/// tuner of the study, the table of the model, the default. Parameters in `set` without a source are NaN.
fn sources(
    study: &Study,
    interface: &Interface,
    fixed: &[(String, f64)],
    case: usize,
    set: &[&str],
) -> Result<Vec<ParameterSource>, StudyError> {
    let find = |list: &[(String, f64)], name: &str| list.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    interface
        .parameters
        .iter()
        .map(|p| {
            let name = &p.variable.name;
            let tuner = |of: Option<usize>| study.tuners.iter().position(|t| t.parameter == *name && t.case == of);
            let by = |tuner: usize| {
                let unit = &study.tuners[tuner].unit;
                match unit.factor_to(&p.variable.unit).filter(|_| unit.zero() == p.variable.unit.zero()) {
                    Some(factor) => Ok(ParameterSource::Tuner { tuner, factor }),
                    None => Err(apart(name, unit, &p.variable.unit)),
                }
            };
            if let Some(tuner) = tuner(Some(case)) {
                return by(tuner);
            }
            if let Some(value) = find(&study.cases[case].parameters, name) {
                // Values of a case are in the unit of the first model that has the parameter.
                let models = study.models.iter().flat_map(|(_, model)| &model.interface().parameters);
                let first = models.map(|p| &p.variable).find(|variable| variable.name == *name);
                let unit = first.map_or(&p.variable.unit, |variable| &variable.unit);
                let value = unit.convert(value, &p.variable.unit).ok_or_else(|| apart(name, unit, &p.variable.unit))?;
                return Ok(ParameterSource::Constant(value));
            }
            if let Some(tuner) = tuner(None) {
                return by(tuner);
            }
            let later = set.contains(&name.as_str()).then_some(f64::NAN);
            find(fixed, name).or(p.default).or(later).map(ParameterSource::Constant).ok_or_else(|| {
                StudyError::here(format!("the parameter `{name}` has no value in case `{}`", study.cases[case].name))
                    .with_help(format!("make `{name}` a tuner, or set it in the case or in `parameters` of the model"))
            })
        })
        .collect()
}
