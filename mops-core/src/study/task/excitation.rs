//! `task = "excitation"`: the order of persistent excitation of the inputs, and regressions on them.

use mops_language::entries::Entries;
use mops_language::{Quantity, Unit, suggestion};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Place, TaskOptions, TaskSpec};
use crate::study::{Study, StudyError};

/// Settings of the excitation analysis, for `task = "excitation"` and the report of every calibration.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct ExcitationTask {
    /// Inputs to analyse; default all.
    pub inputs: Option<Vec<String>>,
    /// Sample time; default is the sample time of the recording.
    pub sample_time: Option<Quantity>,
    /// Standard deviation of the noise of each input, such as { u = 0.01 }; weaker components do not count as
    /// excitation.
    pub noise: Entries<Quantity>,
    /// Number of parameters to estimate; default is the number of active tuners.
    pub parameters: Option<usize>,
    /// FIR and ARX models estimated by least squares, by name: { fir = { input = "u", output = "y", b = 20 } }.
    pub regressions: Entries<RegressionOptions>,
}

/// A model `y(t) + a1 y(t-1) + ... = b1 u(t-delay) + ...`, by least squares and recursively.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct RegressionOptions {
    /// Experiment; default is the first one with the output.
    pub experiment: Option<String>,
    /// Input of the model.
    pub input: String,
    /// Measured output of the model.
    pub output: String,
    /// Number of past outputs; default 0, a finite impulse response.
    #[serde(default)]
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay in samples from an input to the first output that it affects; default 1.
    pub delay: Option<usize>,
    /// Forgetting factor of the recursive estimate; default 1, no forgetting.
    pub forgetting: Option<f64>,
}

/// Settings of the excitation analysis of the inputs of a study.
#[derive(Debug, Clone, Default)]
pub struct ExcitationQuestion {
    /// Inputs; `None` for all.
    pub inputs: Option<Vec<String>>,
    /// Sample time, s; `None` for the sample time of the recording.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise of each input, in the units of the models.
    pub noise: Vec<(String, f64)>,
    /// Number of parameters to estimate; `None` for the number of tuners that act in the case.
    pub parameters: Option<usize>,
}

/// A FIR or ARX model of an experiment of a study.
#[derive(Debug, Clone)]
pub struct Regression {
    /// Name.
    pub name: String,
    /// Experiment, as index into the cases.
    pub case: usize,
    /// Input of the model.
    pub input: String,
    /// Measured output of the model.
    pub output: String,
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay from input to output, in samples.
    pub delay: usize,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
}

impl ExcitationTask {
    /// Returns the settings for the inputs of a study.
    ///
    /// # Errors
    /// If an input is unknown, or for a sample time or a noise that is not a positive quantity of its unit.
    pub fn question(&self, study: &Study) -> Result<ExcitationQuestion, StudyError> {
        let known: Vec<&str> =
            study.cases().iter().flat_map(|case| case.inputs.iter().map(|(name, _)| name.as_str())).collect();
        let check = |name: &str| -> Result<(), StudyError> {
            if known.contains(&name) {
                return Ok(());
            }
            Err(StudyError::new(name, format!("no case and no experiment has an input `{name}`"))
                .with_help(suggestion(name, known.iter().copied())))
        };
        for name in self.inputs.iter().flatten() {
            check(name).map_err(|m| m.within("inputs"))?;
        }
        let sample_time = self.sample_time.as_ref().map(seconds).transpose().map_err(|m| m.within("sample-time"))?;
        let mut noise = Vec::new();
        for (name, quantity) in &self.noise.0 {
            let within = |m: StudyError| m.within("noise");
            check(name).map_err(within)?;
            let mut variables = study.models().iter().flat_map(|(_, m)| &m.interface().inputs);
            let variable = variables.find(|v| v.name == *name).expect("inputs of cases are those of models");
            let unit = &variable.unit;
            let value = quantity.to(unit).map_err(|why| {
                within(StudyError::new(name, why).with_help(format!("a number without a unit is in `{unit}`")))
            })?;
            if !(value.is_finite() && value > 0.0) {
                return Err(within(
                    StudyError::new(name, format!("a standard deviation must be positive, not {value}"))
                        .with_help("omit it if the noise is unknown"),
                ));
            }
            noise.push((name.clone(), value));
        }
        Ok(ExcitationQuestion { inputs: self.inputs.clone(), sample_time, noise, parameters: self.parameters })
    }

    /// Returns the models to be estimated from the experiments of a study.
    ///
    /// # Errors
    /// If an experiment, an input or an output is unknown, or for a number outside of its range.
    pub fn models(&self, study: &Study) -> Result<Vec<Regression>, StudyError> {
        let one = |(name, options): &(String, RegressionOptions)| {
            regression(name, options, study).map_err(|m| m.within(name).within("regressions"))
        };
        self.regressions.0.iter().map(one).collect()
    }
}

/// Returns a sample time in s.
fn seconds(quantity: &Quantity) -> Result<f64, StudyError> {
    let time = quantity
        .to(&Unit::known("s"))
        .map_err(|why| StudyError::here(why).with_help("a number without a unit is in s"))?;
    if time.is_finite() && time > 0.0 {
        return Ok(time);
    }
    Err(StudyError::here(format!("the time between samples must be positive, not {time} s"))
        .with_help("omit it to use the sample time of the recording"))
}

fn regression(name: &str, options: &RegressionOptions, study: &Study) -> Result<Regression, StudyError> {
    let RegressionOptions { experiment, input, output, a, b, delay, forgetting } = options;
    let cases = study.cases();
    let measures = |i: &usize| cases[*i].experiment.as_ref().is_some_and(|e| e.channel(output).is_some());
    let case = match experiment {
        Some(wanted) => {
            let measured = || cases.iter().filter(|c| c.experiment.is_some()).map(|c| c.name.as_str());
            let found = cases.iter().position(|c| c.name == *wanted && c.experiment.is_some()).ok_or_else(|| {
                StudyError::new("experiment", format!("the study has no experiment `{wanted}`"))
                    .with_help(suggestion(wanted, measured().collect::<Vec<_>>()))
            })?;
            let channels = cases[found].experiment.iter().flat_map(|e| &e.channels).map(|c| c.signal.as_str());
            if !measures(&found) {
                return Err(StudyError::new(
                    "output",
                    format!("the experiment `{wanted}` does not measure `{output}`"),
                )
                .with_help(suggestion(output, channels.collect::<Vec<_>>())));
            }
            found
        }
        None => (0..cases.len()).find(measures).ok_or_else(|| {
            StudyError::new("output", format!("no experiment measures `{output}`"))
                .with_help("add it to the `channels` of an experiment")
        })?,
    };
    let inputs = &cases[case].inputs;
    if !inputs.iter().any(|(known, _)| known == input) {
        return Err(StudyError::new("input", format!("the experiment `{}` has no input `{input}`", cases[case].name))
            .with_help(match inputs.is_empty() {
                true => "the experiment has no inputs: add `inputs`".to_owned(),
                false => suggestion(input, inputs.iter().map(|(known, _)| known.as_str())),
            }));
    }
    if *b == 0 {
        return Err(StudyError::new("b", "expected at least 1 coefficient of the input, found 0")
            .with_help("`b` is the number of coefficients of the input"));
    }
    if a + b > 200 {
        return Err(StudyError::new("b", format!("expected at most 200 coefficients, found {}", a + b))
            .with_help("use a longer sample time, or an ARX model: past outputs (`a`) shorten the response"));
    }
    let forgetting = forgetting.unwrap_or(1.0);
    if !(forgetting > 0.0 && forgetting <= 1.0) {
        return Err(StudyError::new(
            "forgetting",
            format!("expected a forgetting factor above 0 and at most 1, found {forgetting}"),
        )
        .with_help("1 disables forgetting; 0.98 forgets within about fifty samples"));
    }
    Ok(Regression {
        name: name.to_owned(),
        case,
        input: input.clone(),
        output: output.clone(),
        a: *a,
        b: *b,
        delay: delay.unwrap_or(1),
        forgetting,
    })
}

impl TaskOptions for ExcitationTask {
    const NAME: &'static str = "excitation";
    const ABOUT: &'static str = "Report the order of persistent excitation of the inputs.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for ExcitationTask {
    fn at(&self) -> Option<Place> {
        None
    }

    fn needs_criteria(&self) -> bool {
        false
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        let within = |mistake: StudyError| mistake.within(Self::TABLE);
        self.question(study).map_err(within)?;
        self.models(study).map_err(within)?;
        if is_performed && study.cases().iter().all(|case| case.inputs.is_empty()) {
            return Err(StudyError::new("task", "no case and no experiment has an input signal")
                .with_help("add `inputs` to a case, such as inputs = { u = { step = { after = 1.0 } } }")
                .within("study"));
        }
        Ok(())
    }
}
