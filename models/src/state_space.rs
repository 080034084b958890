//! Linear system given by its matrices.

use std::collections::BTreeMap;

use mops_core::{
    Analysis, AnalysisKind, Failure, Interface, Job, Model, ModelOptions, StudyError, Variable, model::WithTangents,
};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::linear_system::{self, Bound, Entry, InTime, LinearSystem, Matrices, Rows, Units, coherent};

/// Linear system given by its matrices, for criteria of linear systems, or over time: `dx/dt = A x + B u(t - delay)`,
/// `y = C x + D u(t - delay)`.
///
/// An entry is a number, or an expression whose names are parameters that tuners, cases and the study can set. Example:
/// `a = [[0, 1], ["-k/m", "-d/m"]]`, `b = [[0], ["1/m"]]`, `c = [[1, 0]]`.
///
/// Signals are the outputs. The units of inputs, outputs and parameters are pure numbers unless given in `units`.
/// Entries are in SI units: parameters are converted to them, and the units of inputs and outputs must be SI units.
///
/// Source: T. Kailath, Linear Systems (1980), chapter 2.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct StateSpaceOptions {
    /// State matrix `A`, a list of rows.
    a: Rows<Entry>,
    /// Input matrix `B`, a list of rows.
    b: Rows<Entry>,
    /// Output matrix `C`, a list of rows.
    c: Rows<Entry>,
    /// Feedthrough matrix `D`, a list of rows; default zero.
    d: Option<Rows<Entry>>,
    /// Delay of all inputs, s; a number or an expression.
    delay: Option<Entry>,
    /// Names of the states; default `x1`, `x2`, ...
    states: Option<Vec<String>>,
    /// Names of the inputs; default `u`, or `u1`, `u2`, ...
    inputs: Option<Vec<String>>,
    /// Names of the outputs; default `y`, or `y1`, `y2`, ...
    outputs: Option<Vec<String>>,
    /// End of a simulation. With it, the system is simulated over time, from rest, for criteria over time; without it,
    /// criteria of linear systems read it. `like` makes one of the other. A delay is then above 0 s; steps are at most
    /// half as long. Before it has passed, the delayed input has its value just before 0 s.
    horizon: Option<Quantity>,
    /// Units of parameters, inputs and outputs, such as `{ k = "N/m" }`.
    #[serde(default)]
    units: BTreeMap<String, String>,
}

/// Model of the kind `state-space`.
struct Given {
    interface: Interface,
    matrices: [Rows<Bound>; 4],
    delay: Option<Bound>,
    states: Vec<String>,
}

impl ModelOptions for StateSpaceOptions {
    const KIND: &'static str = "state-space";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        let n = self.a.len();
        let (inputs, outputs) = (self.b.first().map_or(0, Vec::len), self.c.len());
        let zeros = || vec![vec![Entry(mops_language::Expression::parse("0").expect("a number")); inputs]; outputs];
        let d = self.d.unwrap_or_else(zeros);
        for (key, rows, [height, width]) in [
            ("a", &self.a, [n, n]),
            ("b", &self.b, [n, inputs]),
            ("c", &self.c, [outputs, n]),
            ("d", &d, [outputs, inputs]),
        ] {
            let fits = rows.len() == height && rows.iter().all(|row| row.len() == width);
            if !fits || height == 0 || width == 0 {
                let widths: Vec<usize> = rows.iter().map(Vec::len).collect();
                let fact = format!("expected {height} rows of {width} entries in `{key}`, found rows of {widths:?}");
                return Err(StudyError::new(key, fact).with_help(
                    "a has one row and one column per state, b one column per input, c one row per output",
                ));
            }
        }
        let states = named("states", self.states, "x", n)?;
        let inputs = named("inputs", self.inputs, "u", inputs)?;
        let outputs = named("outputs", self.outputs, "y", outputs)?;
        let mut names = Vec::new();
        let matrices = [self.a, self.b, self.c, d]
            .map(|rows| rows.iter().map(|row| Bound::all(row, &mut names)).collect::<Rows<Bound>>());
        let delay = self.delay.map(|delay| Bound::delay(&delay, &mut names)).transpose()?;
        let units: Vec<(String, String)> = self.units.into_iter().collect();
        let units = Units(&units);
        let entries = matrices.iter().flatten().flatten();
        units.check(&names, &[inputs.clone(), outputs.clone()].concat(), entries, delay.as_ref())?;
        let variables = |names: &[String], about: &str| -> Vec<Variable> {
            names.iter().map(|name| Variable::new(name, units.of(name), about)).collect()
        };
        let interface = Interface {
            signals: variables(&outputs, "output of the system"),
            inputs: variables(&inputs, "input of the system"),
            parameters: units.parameters(&names),
            analysis: AnalysisKind::Linear,
            ..Interface::default()
        };
        let horizon = linear_system::horizon(self.horizon.as_ref())?;
        let given = Given { interface: interface.clone(), matrices, delay, states: states.clone() };
        Ok(match horizon {
            Some(horizon) => Box::new(InTime::model(given, &interface, &states, horizon)),
            None => Box::new(given),
        })
    }
}

/// Returns the given names, of which there must be `count`, or numbered names.
fn named(key: &str, given: Option<Vec<String>>, letter: &str, count: usize) -> Result<Vec<String>, StudyError> {
    match given {
        Some(names) if names.len() != count => {
            Err(StudyError::new(key, format!("expected {count} names in `{key}`, found {}", names.len()))
                .with_help(format!("name all of them, or leave `{key}` out")))
        }
        Some(names) => match names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            Some((_, twice)) => {
                Err(StudyError::new(key, format!("duplicate name `{twice}` in {key}")).with_help("choose another name"))
            }
            None => Ok(names),
        },
        None if count == 1 && letter != "x" => Ok(vec![letter.to_owned()]),
        None => Ok((1..=count).map(|i| format!("{letter}{i}")).collect()),
    }
}

impl LinearSystem for Given {
    fn matrices<S: Scalar>(&self, parameters: &[S]) -> Result<Matrices<S>, Failure> {
        let parameters = &coherent(&self.interface.parameters, parameters);
        let values = |rows: &Rows<Bound>| -> Rows<S> {
            rows.iter().map(|row| row.iter().map(|entry| entry.value(parameters)).collect()).collect()
        };
        let [a, b, c, d] = self.matrices.each_ref().map(values);
        let delay = self.delay.as_ref().map(|delay| delay.value(parameters));
        Ok(Matrices { a, b, c, d, delay, states: self.states.clone() })
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
