//! Weighted Chebyshev method: computes a Pareto front point by point, each as the solution of a min-max problem.

mod archive;
mod rectangles;
mod reference_directions;
mod scalarisation;
mod scalarised_problem;
mod subproblem;

use mops_core::{Evaluation, Halt, Objective, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use archive::Candidate;
use archive::insert;
use rectangles::Rectangles;
use reference_directions::ReferenceDirections;
use scalarisation::Scalarisation;
use subproblem::Subproblems;

/// Weighted Chebyshev method for evenly spread points of the Pareto front (non-dominated designs). Each point solves a
/// weighted min-max problem. Needs `objective = "each"`.
///
/// An objective is a criterion in its worst case, or in every case. First every objective is minimised alone
/// (multistart), and then the others as far as possible without loss; for three and more objectives, also all but one
/// at a time. The results are the ends of the front and define the range of every objective.
///
/// Two criteria: the two neighbours `p`, `q` with the largest distance define a rectangle. The next point is the
/// deepest one in it,
///
/// ```text
/// min over x of max((f1(x) - p1) / (q1 - p1), (f2(x) - q2) / (p2 - q2))
/// ```
/// computed by `sqp` from the midpoint, from both neighbours and from known points in the rectangle. An empty rectangle
/// is a gap in the front and is closed.
///
/// Three and more criteria: `min max_i (f_i - ideal_i) / (range_i w_i)` for weights `w` spread evenly over the simplex,
/// each from the nearest known point. Weights that end at a known point, within a thousandth of the range of every
/// criterion, give no new one. While points are missing, the weights of the evaluated points farthest from the front
/// follow, then those in its largest gaps.
///
/// One more point minimises the largest scaled value, as in a single design; it meets the demands best.
///
/// If an objective has slack, it is lowered further while the others stay. All evaluated points are compared with the
/// front, and an optimality test is made at each of its points; a dominating point is a new starting point. Subproblems
/// that fail are omitted.
///
/// For few tuners and criteria that are differentiable almost everywhere: needs far fewer evaluations than `nsga2`, and
/// its points are exact. For fronts with many separate basins use `nsga2`.
///
/// Source: V. J. Bowman, in Multiple Criteria Decision Making, Lecture Notes in Economics and Mathematical Systems 130
/// (1976) 76-86 (weighted Chebyshev); H. W. Hamacher, C. R. Pedersen, S. Ruzika, Operations Research Letters 35 (2007)
/// 336-344 (rectangles); I. Das, J. E. Dennis, SIAM J. Optimization 8 (1998) 631-657 (weights); H. P. Benson, Journal
/// of Optimization Theory and Applications 26 (1978) 569-580 (slack).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct WeightedChebyshevOptions {
    /// Number of points; 0 for the number requested by the study, or 30.
    #[schemars(range(max = 10_000))]
    pub points: usize,
    /// Number of starting points for the minimum of each criterion, including the initial guess of the study.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
}

impl Default for WeightedChebyshevOptions {
    fn default() -> Self {
        Self { points: 0, starts: 6 }
    }
}

impl SolverOptions for WeightedChebyshevOptions {
    const KIND: &'static str = "weighted-chebyshev";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(WeightedChebyshev { options: self.clone(), state: None })
    }
}

/// Solver of the kind `weighted-chebyshev`.
struct WeightedChebyshev {
    options: WeightedChebyshevOptions,
    state: Option<State>,
}

struct State {
    start: Vec<f64>,
    subproblems: Subproblems,
    /// Points of the front.
    front: Vec<Candidate>,
    stage: Stage,
    /// True after the optimality test of every point.
    optimality_checked: bool,
}

enum Stage {
    /// Minimisation of one objective alone, by index.
    Anchors(usize),
    /// Minimisation of all objectives but one, by index, for three and more objectives.
    Opposites(usize),
    /// Rectangles between neighbouring points, for two criteria.
    Rectangles(Rectangles),
    /// Reference directions, for three and more criteria.
    ReferenceDirections(ReferenceDirections),
    /// Point that meets the demands best.
    MeetDemands,
    /// Replacement of dominated points of the front, with the number of the round.
    ReplaceDominated(usize),
}

impl Solver for WeightedChebyshev {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.objective != Objective::Each {
            return Err(
                "`weighted-chebyshev` computes a Pareto front: set objective = \"each\" in [study], or use `sqp`"
                    .into(),
            );
        }
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`weighted-chebyshev` needs gradients, but a tuner has whole numbers or a list of values; use `nsga2`"
                    .into(),
            );
        }
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        oracle.evaluate(&[start.to_vec()])?;
        self.state = Some(State {
            start: start.to_vec(),
            subproblems: Subproblems::new(self.options.starts),
            front: Vec::new(),
            stage: Stage::Anchors(0),
            optimality_checked: false,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.start.is_empty() {
            return Ok(Progress::Converged);
        }
        let points = match (self.options.points, oracle.shape().points) {
            (0, 0) => 30,
            (0, requested) => requested,
            (points, _) => points,
        };
        let objectives = oracle.shape().objective_count();
        match &mut state.stage {
            Stage::Anchors(k) => {
                let k = *k;
                if k < objectives {
                    if let Some(candidate) = state.subproblems.anchor(oracle, &state.start, k, objectives)? {
                        state.front.push(candidate);
                    }
                    state.stage = Stage::Anchors(k + 1);
                    return Ok(Progress::Continue);
                }
                if objectives == 0 {
                    return state.subproblems.find_feasible(oracle, &state.start);
                }
                if state.front.is_empty() {
                    return Ok(Progress::Stalled);
                }
                state.keep_non_dominated();
                state.stage = match objectives {
                    1 => Stage::ReplaceDominated(0),
                    2 => Stage::Rectangles(Rectangles::default()),
                    _ => Stage::Opposites(0),
                };
                Ok(Progress::Continue)
            }
            Stage::Opposites(k) => {
                let k = *k;
                if k < objectives {
                    let candidate = state.subproblems.opposite(oracle, k)?;
                    insert(&mut state.front, candidate, &state.subproblems.range);
                    state.stage = Stage::Opposites(k + 1);
                    return Ok(Progress::Continue);
                }
                state.keep_non_dominated();
                state.stage = Stage::ReferenceDirections(ReferenceDirections::new(objectives, points));
                Ok(Progress::Continue)
            }
            Stage::Rectangles(rectangles) => {
                let more = rectangles.bisect(oracle, &mut state.subproblems, &mut state.front, points)?;
                if !more {
                    state.stage = Stage::MeetDemands;
                }
                Ok(Progress::Continue)
            }
            Stage::ReferenceDirections(reference_directions) => {
                if !reference_directions.solve_next(oracle, &mut state.subproblems, &mut state.front, points)? {
                    state.stage = Stage::MeetDemands;
                }
                Ok(Progress::Continue)
            }
            Stage::MeetDemands => {
                let candidate = state.subproblems.solve_for_demands(oracle, objectives)?;
                insert(&mut state.front, candidate, &state.subproblems.range);
                state.stage = Stage::ReplaceDominated(0);
                Ok(Progress::Continue)
            }
            Stage::ReplaceDominated(round) => {
                *round += 1;
                if *round <= MAX_ROUNDS && state.subproblems.replace_dominated(oracle, &mut state.front)? {
                    return Ok(Progress::Continue);
                }
                if state.optimality_checked {
                    return Ok(Progress::Converged);
                }
                state.optimality_checked = true;
                state.stage = Stage::ReplaceDominated(0);
                state.subproblems.check_optimality(oracle, &state.front);
                Ok(Progress::Continue)
            }
        }
    }

    fn front(&self) -> Vec<Vec<f64>> {
        let Some(state) = &self.state else { return Vec::new() };
        // Without the ends of the front, all evaluated points are a better result.
        if matches!(state.stage, Stage::Anchors(_)) {
            return Vec::new();
        }
        state.front.iter().map(|candidate| candidate.point.clone()).collect()
    }
}

impl State {
    /// Removes dominated points of the front, and sets the ranges of the objectives to those of the others.
    fn keep_non_dominated(&mut self) {
        for candidate in std::mem::take(&mut self.front) {
            insert(&mut self.front, candidate, &[]);
        }
        self.subproblems.set_ranges(&self.front);
    }
}

/// Lowers the objectives of a point that are smaller than the largest one, while the others stay; `None` if the point
/// is infeasible.
///
/// # Errors
/// Returns [`Halt`] if the run is over.
pub fn remove_slack(oracle: &mut dyn Oracle, point: &[f64]) -> Result<Option<Evaluation>, Halt> {
    let answers = oracle.evaluate(&[point.to_vec()])?;
    let mut subproblems = Subproblems::new(1);
    subproblems.archive.record(oracle.shape(), &answers);
    let Some(candidate) = subproblems.archive.candidates().first().cloned() else { return Ok(None) };
    let m = oracle.shape().objective_count();
    let scalarisation = Scalarisation::chebyshev(&vec![0.0; m], &vec![1.0; m]);
    let found = subproblems.remove_slack(oracle, &scalarisation, candidate)?;
    Ok(oracle.evaluate(&[found.point])?.pop())
}

/// Maximum number of rounds that replace dominated points.
const MAX_ROUNDS: usize = 5;
