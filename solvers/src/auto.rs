//! The solver for those who do not choose one.

use mops_core::{Halt, Objective, Oracle, Progress, Shape, Solver, SolverOptions, Usage};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::levenberg_marquardt::LevenbergMarquardtOptions;
use crate::multistart::Multistart;
use crate::nsga2::Nsga2Options;
use crate::nsga3::Nsga3Options;
use crate::pattern_search::PatternSearchOptions;
use crate::sqp::SqpOptions;
use crate::weighted_chebyshev::WeightedChebyshevOptions;

/// Looks at the problem and chooses: `levenberg-marquardt` for a sum of squares, `pattern-search` where tuners have whole
/// numbers or lists, else `sqp`; from several starts: the study's own, and the best points of a sample of the box. Where
/// the objective is no sum of squares a pattern search follows from the best point found, because an optimum may lie on a
/// jump (of a settling time, say), where slopes lead no further; a sum of squares is started again around the best point
/// until nothing changes. Where every criterion counts for itself (`objective = "each"`) it is `weighted-chebyshev` for up to
/// three criteria and 50 tuners without whole numbers or lists, else `nsga2` for two criteria and `nsga3` for more.
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
        Box::new(Auto { options: self.clone(), stage: None })
    }
}

struct Auto {
    options: AutoOptions,
    stage: Option<Stage>,
}

enum Stage {
    /// Where every criterion counts for itself.
    Front(Box<dyn Solver>),
    /// From several starts.
    Global(Multistart),
    /// From the best point; with whether the first stage met a test of an optimum.
    Polish(Box<dyn Solver>, bool),
}

impl Solver for Auto {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        if oracle.shape().objective == Objective::Each {
            let mut front = front(oracle.shape());
            front.begin(oracle, start)?;
            self.stage = Some(Stage::Front(front));
            return Ok(());
        }
        let mut global = Multistart::new(choose(oracle.shape()), self.options.starts);
        if oracle.shape().residuals > 0 {
            global = global.until_nothing_changes();
        }
        global.begin(oracle, start)?;
        self.stage = Some(Stage::Global(global));
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        match self.stage.as_mut().expect("begin comes first") {
            Stage::Front(front) => front.step(oracle),
            Stage::Global(global) => {
                let progress = global.step(oracle)?;
                if progress == Progress::Continue || oracle.shape().residuals > 0 {
                    return Ok(progress);
                }
                let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(progress) };
                let mut pattern = PatternSearchOptions { size: 0.02, ..Default::default() }.build();
                pattern.begin(oracle, &best)?;
                self.stage = Some(Stage::Polish(pattern, progress == Progress::Converged));
                Ok(Progress::Continue)
            }
            Stage::Polish(pattern, converged) => match pattern.step(oracle)? {
                Progress::Continue => Ok(Progress::Continue),
                Progress::Stalled if !*converged => Ok(Progress::Stalled),
                _ => Ok(Progress::Converged),
            },
        }
    }

    fn front(&self) -> Vec<Vec<f64>> {
        match &self.stage {
            Some(Stage::Front(front)) => front.front(),
            _ => Vec::new(),
        }
    }
}

/// Few criteria are followed along their front; crowding spreads two objectives evenly, reference directions more of them.
fn front(shape: &Shape) -> Box<dyn Solver> {
    let objectives = shape.rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
    let along = WeightedChebyshevOptions::default().build();
    if objectives <= 3 && shape.dimension() <= 50 && along.accepts(shape).is_ok() {
        return along;
    }
    if objectives <= 2 { Nsga2Options::default().build() } else { Nsga3Options::default().build() }
}

fn choose(shape: &Shape) -> Box<dyn Solver> {
    // The starts are counted here, not in the chosen solver.
    let least_squares = LevenbergMarquardtOptions::default().local();
    let sqp = SqpOptions::default().build();
    let choices = [least_squares, sqp, PatternSearchOptions::default().build()];
    choices.into_iter().find(|solver| solver.accepts(shape).is_ok()).expect("pattern search accepts every problem")
}
