//! Linear system given by its transfer function.

use std::collections::BTreeMap;

use mops_core::{
    Analysis, AnalysisKind, Failure, Interface, Job, Model, ModelOptions, StudyError, Variable, model::WithTangents,
};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::linear_system::{self, Bound, Entry, InTime, LinearSystem, Matrices, Units, canonical, coherent};
use crate::rational::from_roots;

/// Linear system given by its transfer function, for criteria of linear systems, or over time:
/// `G(s) = numerator(s)/denominator(s) exp(-s delay)`, or
/// `gain (s - z1)(s - z2).../((s - p1)(s - p2)...) exp(-s delay)`.
///
/// A coefficient is a number, or an expression whose names are parameters that tuners, cases and the study can set.
/// Example: `numerator = ["K"]`, `denominator = ["T", 1]`, `delay = "L"`. Coefficients are in descending powers of s.
///
/// The signal is `y` and the input is `u`, unless `output` and `input` name them. Their units, and those of parameters,
/// are pure numbers unless given in `units`. Coefficients are in SI units: parameters are converted to them, and the
/// units of input and output must be SI units.
///
/// Source: T. Kailath, Linear Systems (1980), section 2.1.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct TransferFunctionOptions {
    /// Coefficients of the numerator, in descending powers of s.
    numerator: Option<Vec<Entry>>,
    /// Coefficients of the denominator, in descending powers of s.
    denominator: Option<Vec<Entry>>,
    /// Real zeros, 1/s; require `poles`.
    zeros: Option<Vec<Entry>>,
    /// Real poles, 1/s, instead of a denominator.
    poles: Option<Vec<Entry>>,
    /// Factor of zeros and poles; default 1.
    gain: Option<Entry>,
    /// Delay, s; a number or an expression.
    delay: Option<Entry>,
    /// Name of the input; default `u`.
    input: Option<String>,
    /// Name of the output; default `y`.
    output: Option<String>,
    /// End of a simulation. With it, the system is simulated over time, from rest, for criteria over time; without it,
    /// criteria of linear systems read it. `like` makes one of the other. A delay is then above 0 s; steps are at most
    /// half as long. Before it has passed, the delayed input has its value just before 0 s.
    horizon: Option<Quantity>,
    /// Units of parameters, input and output, such as `{ T = "s" }`.
    units: BTreeMap<String, String>,
}

enum Form {
    Coefficients { numerator: Vec<Bound>, denominator: Vec<Bound> },
    Roots { zeros: Vec<Bound>, poles: Vec<Bound>, gain: Option<Box<Bound>> },
}

/// Model of the kind `transfer-function`.
struct Given {
    interface: Interface,
    form: Form,
    delay: Option<Bound>,
}

impl ModelOptions for TransferFunctionOptions {
    const KIND: &'static str = "transfer-function";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        let mut names = Vec::new();
        let form = match (&self.numerator, &self.denominator, &self.poles) {
            (Some(numerator), Some(denominator), None) if self.zeros.is_none() && self.gain.is_none() => {
                Form::Coefficients {
                    numerator: Bound::all(numerator, &mut names),
                    denominator: Bound::all(denominator, &mut names),
                }
            }
            (None, None, Some(poles)) => Form::Roots {
                zeros: Bound::all(self.zeros.as_deref().unwrap_or_default(), &mut names),
                poles: Bound::all(poles, &mut names),
                gain: self.gain.as_ref().map(|gain| Box::new(Bound::new(gain, &mut names))),
            },
            _ => {
                return Err(StudyError::here(
                    "expected numerator and denominator, or poles, zeros and gain",
                )
                .with_help(
                    "for example { numerator = [\"K\"], denominator = [\"T\", 1] }, or { gain = \"K\", poles = [0, -4, -1] }",
                ));
            }
        };
        let (above, below) = match &form {
            Form::Coefficients { numerator, denominator } => (numerator.len(), denominator.len()),
            Form::Roots { zeros, poles, .. } => (zeros.len() + 1, poles.len() + 1),
        };
        if above == 0 || above > below {
            let fact = format!(
                "expected a proper transfer function, found order {} over order {}",
                above.saturating_sub(1),
                below.saturating_sub(1)
            );
            return Err(
                StudyError::here(fact).with_help("the order of the denominator must be at least that of the numerator")
            );
        }
        let delay = self.delay.as_ref().map(|delay| Bound::delay(delay, &mut names)).transpose()?;
        let (input, output) = (self.input.unwrap_or_else(|| "u".into()), self.output.unwrap_or_else(|| "y".into()));
        let units: Vec<(String, String)> = self.units.into_iter().collect();
        let units = Units(&units);
        let entries: Vec<&Bound> = match &form {
            Form::Coefficients { numerator, denominator } => numerator.iter().chain(denominator).collect(),
            Form::Roots { zeros, poles, gain } => zeros.iter().chain(poles).chain(gain.as_deref()).collect(),
        };
        units.check(&names, &[input.clone(), output.clone()], entries, delay.as_ref())?;
        let interface = Interface {
            signals: vec![Variable::new(&output, units.of(&output), "output of the system")],
            inputs: vec![Variable::new(&input, units.of(&input), "input of the system")],
            parameters: units.parameters(&names),
            analysis: AnalysisKind::Linear,
            ..Interface::default()
        };
        let horizon = linear_system::horizon(self.horizon.as_ref())?;
        let given = Given { interface: interface.clone(), form, delay };
        Ok(match horizon {
            Some(horizon) => Box::new(InTime::model(given, &interface, &states(below - 1), horizon)),
            None => Box::new(given),
        })
    }
}

fn states(order: usize) -> Vec<String> {
    (1..=order).map(|i| format!("x{i}")).collect()
}

impl LinearSystem for Given {
    fn matrices<S: Scalar>(&self, parameters: &[S]) -> Result<Matrices<S>, Failure> {
        let parameters = &coherent(&self.interface.parameters, parameters);
        let values = |list: &[Bound]| -> Vec<S> { list.iter().map(|entry| entry.value(parameters)).collect() };
        let (mut numerator, mut denominator) = match &self.form {
            Form::Coefficients { numerator, denominator } => {
                let (mut above, mut below) = (values(numerator), values(denominator));
                above.reverse();
                below.reverse();
                (above, below)
            }
            Form::Roots { zeros, poles, gain } => {
                let gain = gain.as_ref().map_or(S::from(1.0), |gain| gain.value(parameters));
                (from_roots(&values(zeros)).into_iter().map(|c| gain * c).collect(), from_roots(&values(poles)))
            }
        };
        let leading = denominator.pop().expect("there is a denominator");
        if leading.value() == 0.0 {
            return Err(Failure::Undefined("the leading coefficient of the denominator is 0".into()));
        }
        numerator.iter_mut().chain(&mut denominator).for_each(|c| *c = *c / leading);
        let delay = self.delay.as_ref().map(|delay| delay.value(parameters));
        Ok(canonical(&numerator, &denominator, states(denominator.len()), delay))
    }

    fn channels(&self) -> [Vec<String>; 2] {
        [&self.interface.inputs, &self.interface.signals].map(|list| list.iter().map(|v| v.name.clone()).collect())
    }
}

impl Model for Given {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        linear_system::analyse(self, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(linear_system::tangents(self, job, seeds))
    }
}
