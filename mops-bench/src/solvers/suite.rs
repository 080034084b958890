//! The suites: problems written as formulas, and studies.

use super::control::Known;
use mops::Catalogue;
use mops::core::{Evaluator, Problem as Posing, Shape};
use mops_problems::{Answer, Posed, Problem, Slope};

/// Problems that belong together.
#[derive(Clone, Copy)]
pub(crate) struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// What it holds, in one sentence.
    pub about: &'static str,
    /// Accuracy that counts as solved, relative to the larger of 1 and the size of the optimum; of studies relative to the
    /// optimum.
    pub accuracy: f64,
    /// Points a run may evaluate, for so many variables.
    pub budget: fn(usize) -> usize,
    /// Whether nothing is known but what solvers find, so that each is measured by the best of all.
    pub relative: bool,
    content: Content,
}

#[derive(Clone, Copy)]
enum Content {
    Formulas(fn() -> Vec<Problem>),
    Studies(fn() -> Vec<Known>),
}

/// A problem of a suite.
pub(crate) enum Subject {
    Formula(Problem),
    Study(Known),
}

/// Every suite.
pub(crate) fn suites() -> Vec<Suite> {
    let formulas = mops_problems::suites().into_iter().map(|suite| Suite {
        name: suite.name,
        about: suite.about,
        accuracy: suite.accuracy,
        budget: suite.budget,
        relative: suite.name.starts_with("more-wild"),
        content: Content::Formulas(suite.problems),
    });
    let control = Suite {
        name: "control",
        about: "20 studies of control design and calibration whose optimum is known; slopes as in `mops run`",
        accuracy: 1e-3,
        budget: |_| mops::DEFAULT_EVALUATIONS,
        relative: false,
        content: Content::Studies(super::control::control),
    };
    std::iter::once(control).chain(formulas).collect()
}

impl Suite {
    pub fn subjects(&self) -> Vec<Subject> {
        match self.content {
            Content::Formulas(problems) => problems().into_iter().map(Subject::Formula).collect(),
            Content::Studies(studies) => studies().into_iter().map(Subject::Study).collect(),
        }
    }
}

impl Subject {
    pub fn name(&self) -> &str {
        match self {
            Self::Formula(problem) => &problem.name,
            Self::Study(known) => known.study.name,
        }
    }

    /// Tuners at the optimum; empty where they are not known.
    pub fn tuners(&self) -> &'static [f64] {
        match self {
            Self::Formula(_) => &[],
            Self::Study(known) => known.tuners,
        }
    }

    /// Source of its definition and of its answer.
    pub fn source(&self) -> &'static str {
        match self {
            Self::Formula(problem) => problem.source,
            Self::Study(known) => known.source,
        }
    }

    /// Accuracy that counts as solved, relative to the larger of 1 and the size of the optimum.
    pub fn accuracy(&self, suite: &Suite) -> f64 {
        match self {
            Self::Formula(problem) => problem.accuracy.unwrap_or(suite.accuracy),
            Self::Study(known) => {
                // Of an optimum below 1, relative to itself; one of 0 is reached where scaled values are that small.
                let size = known.minimum.abs();
                if size > 0.0 { suite.accuracy * size.min(1.0) } else { suite.accuracy }
            }
        }
    }

    /// What a solver is told of it.
    pub fn shape(&self, catalogue: &Catalogue) -> Shape {
        match self {
            Self::Formula(problem) => Posed::new(problem, Slope::Differences).shape().clone(),
            Self::Study(known) => posing(catalogue, known, 1).shape().clone(),
        }
    }

    pub fn is_study(&self) -> bool {
        matches!(self, Self::Study(_))
    }

    pub fn has_front(&self) -> bool {
        matches!(self.answer(), Answer::Front { .. })
    }

    pub fn answer(&self) -> Answer {
        match self {
            Self::Formula(problem) => problem.answer.clone(),
            Self::Study(known) => known.minimum.into(),
        }
    }
}

/// The problem of a study under a seed.
///
/// # Panics
/// If the study is written wrongly.
pub(super) fn posing(catalogue: &Catalogue, known: &Known, seed: u64) -> Posing {
    let file = known.study.open(catalogue, &[]);
    let mut study = file.unwrap_or_else(|why| panic!("{}: {why}", known.study.name)).study;
    study.set_seed(seed);
    Posing::new(std::sync::Arc::new(study))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wrong number in a study, or in its answer, would show here: the answers come from elsewhere.
    #[test]
    fn studies_have_their_known_optimum_where_it_is_known_to_be() {
        let catalogue = mops::catalogue();
        for known in super::super::control::control().iter().filter(|known| !known.tuners.is_empty()) {
            let problem = posing(&catalogue, known, 1);
            let merit = problem.evaluate_at(known.tuners).merit;
            let gap = (merit.objective - known.minimum).abs() / known.minimum.abs().max(1.0);
            // The optima of the thesis's designs are where extrema touch their bands: times go there with the square root of
            // the tuners' last digit.
            let shipped = mops::studies::shipped().iter().any(|study| study.name == known.study.name);
            let tolerance = if shipped { 2e-4 } else { 1e-5 };
            assert!(gap < tolerance, "{}: {merit:?} {}", known.study.name, known.minimum);
            assert!(merit.violation < tolerance, "{}: {merit:?}", known.study.name);
        }
    }
}
