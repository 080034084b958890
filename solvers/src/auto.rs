//! The solver for those who do not choose one.

use mops_core::{Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::levenberg_marquardt::LevenbergMarquardtOptions;
use crate::multistart::Multistart;
use crate::pattern_search::PatternSearchOptions;
use crate::sqp::SqpOptions;

/// Looks at the problem and chooses: `levenberg-marquardt` for a sum of squares, `pattern-search` where tuners have whole
/// numbers or lists, else `sqp` from several starts: the study's own, and the best points of a sample of the box.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct AutoOptions {
    /// Number of starts, the study's own included.
    pub starts: usize,
}

impl Default for AutoOptions {
    fn default() -> Self {
        Self { starts: 6 }
    }
}

impl SolverOptions for AutoOptions {
    const KIND: &'static str = "auto";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Auto { options: self.clone(), chosen: None })
    }
}

struct Auto {
    options: AutoOptions,
    chosen: Option<Multistart>,
}

impl Solver for Auto {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        let mut chosen = Multistart::new(choose(oracle.shape()), self.options.starts);
        chosen.begin(oracle, start)?;
        self.chosen = Some(chosen);
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        self.chosen.as_mut().expect("begin comes first").step(oracle)
    }
}

fn choose(shape: &Shape) -> Box<dyn Solver> {
    // The starts are counted here, not in the chosen solver.
    let least_squares = LevenbergMarquardtOptions { starts: 1, ..Default::default() }.build();
    let sqp = SqpOptions::default().build();
    let choices = [least_squares, sqp, PatternSearchOptions::default().build()];
    choices.into_iter().find(|solver| solver.accepts(shape).is_ok()).expect("pattern search accepts every problem")
}
