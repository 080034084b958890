//! Suites of problems, which are formulas or studies.

use mops::{
    Catalogue,
    core::{Problem as Posing, Shape, problem::Evaluator},
};
use mops_problems::{Answer, Posed, Problem, Slope};

use super::control::Known;

/// Suite of problems.
#[derive(Clone, Copy)]
pub(crate) struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
    /// Accuracy that counts as solved, relative to max(1, |optimum|); for studies relative to the optimum.
    pub accuracy: f64,
    /// Budget of a run in evaluations, as a function of the number of variables.
    pub budget: fn(usize) -> usize,
    /// True if the minima are unknown, and each run is compared with the best of all runs.
    pub relative: bool,
    content: Content,
}

#[derive(Clone, Copy)]
enum Content {
    Formulas(fn() -> Vec<Problem>),
    Studies(fn() -> Vec<Known>),
}

/// Problem of a suite.
pub(crate) enum Subject {
    Formula(Problem),
    Study(Known),
}

/// Returns all suites.
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
        about: "20 studies of control design and calibration with known optimum; gradients as in `mops run`",
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

    /// Returns the tuners at the optimum; empty if unknown.
    pub fn tuners(&self) -> &'static [f64] {
        match self {
            Self::Formula(_) => &[],
            Self::Study(known) => known.tuners,
        }
    }

    /// Returns the source of the problem and of its solution.
    pub fn source(&self) -> &'static str {
        match self {
            Self::Formula(problem) => problem.source,
            Self::Study(known) => known.source,
        }
    }

    /// Returns the accuracy that counts as solved, relative to max(1, |optimum|).
    pub fn accuracy(&self, suite: &Suite) -> f64 {
        match self {
            Self::Formula(problem) => problem.accuracy.unwrap_or(suite.accuracy),
            Self::Study(known) => {
                // Relative to an optimum below 1; for the optimum 0 the accuracy is absolute.
                let size = known.minimum.abs();
                if size > 0.0 { suite.accuracy * size.min(1.0) } else { suite.accuracy }
            }
        }
    }

    /// Returns the problem dimensions, the input of a solver.
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

/// Returns the problem of a study with a seed.
///
/// # Panics
/// If the study has a mistake.
pub(super) fn posing(catalogue: &Catalogue, known: &Known, seed: u64) -> Posing {
    let file = mops::file::read_shipped(catalogue, &known.study, &[]);
    let mut study = file.unwrap_or_else(|why| panic!("{}: {why}", known.study.name)).study;
    study.set_seed(seed);
    Posing::new(std::sync::Arc::new(study))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Detects wrong numbers in a study or its solution, as the solutions have independent sources.
    #[test]
    fn studies_have_their_known_optimum_at_the_known_tuners() {
        let catalogue = mops::catalogue();
        for known in super::super::control::control().iter().filter(|known| !known.tuners.is_empty()) {
            let problem = posing(&catalogue, known, 1);
            let merit = problem.evaluate_at(known.tuners).merit;
            let gap = (merit.objective - known.minimum).abs() / known.minimum.abs().max(1.0);
            // At the optima of the designs of the thesis, extrema touch their bands: times change there with the square
            // root of the last digit of the tuners.
            let shipped = mops::studies::shipped().iter().any(|study| study.name == known.study.name);
            let tolerance = if shipped { 2e-4 } else { 1e-5 };
            assert!(gap < tolerance, "{}: {merit:?} {}", known.study.name, known.minimum);
            assert!(merit.violation < tolerance, "{}: {merit:?}", known.study.name);
        }
    }
}
