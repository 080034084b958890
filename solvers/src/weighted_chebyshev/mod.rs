//! Weighted Chebyshev: a front, point by point, each the solution of a min-max problem of its own.

mod archive;
mod rectangles;
mod reference_directions;
mod scalarisation;
mod subproblem;

use mops_core::{Halt, Objective, Oracle, Progress, Shape, Solver, SolverOptions, Usage};
use schemars::JsonSchema;
use serde::Deserialize;

use archive::Candidate;
use rectangles::Rectangles;
use reference_directions::ReferenceDirections;
use subproblem::Subproblems;

/// Points of the front of designs that no other is better than in every criterion, spread evenly, each the solution of a
/// weighted min-max problem; needs `objective = "each"`. First every criterion is minimised alone (from several starts; then
/// the others as far as they go without loss), which gives the ends of the front and the range of every criterion.
///
/// Two criteria: between the two neighbours `p`, `q` that are farthest apart, the point is found that lies deepest in the
/// rectangle of the two,
///
/// ```text
/// min over x of max((f1(x) - p1) / (q1 - p1), (f2(x) - q2) / (p2 - q2))
/// ```
/// by `sqp` from between the two, from both of them, and from what is known in the rectangle. Where nothing lies in it, the
/// front has a gap, and the rectangle is closed. More criteria: `min max_i (f_i - ideal_i) / (range_i w_i)` for weights `w`
/// spread evenly over the simplex, each from the nearest point known.
///
/// One more point meets the demands best: its largest scaled value is least, as in a design.
///
/// A point where some criterion has slack is pushed on until none can be lowered alone. Everything that was evaluated on the
/// way is compared with the points found, and it is looked a step beyond each of them; what is better than one of them is a
/// new start. Subproblems that fail are left out.
///
/// For criteria with slopes almost everywhere and few tuners: far fewer points than `nsga2` needs, and those of the front are
/// exact. Fronts of many basins that lie apart from each other are `nsga2`'s.
///
/// Source: V. J. Bowman, in Multiple Criteria Decision Making, Lecture Notes in Economics and Mathematical Systems 130 (1976)
/// 76-86 (weighted Chebyshev); H. W. Hamacher, C. R. Pedersen, S. Ruzika, Operations Research Letters 35 (2007) 336-344
/// (rectangles); I. Das, J. E. Dennis, SIAM J. Optimization 8 (1998) 631-657 (weights); H. P. Benson, Journal of Optimization
/// Theory and Applications 26 (1978) 569-580 (slack).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct WeightedChebyshevOptions {
    /// Number of points; 0 for as many as the study asks for, else 30. Three criteria and more take the largest number of
    /// evenly spread weights that is not above it.
    #[schemars(range(max = 10_000))]
    pub points: usize,
    /// Starts of the search for the least of each criterion, the study's own included.
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

/// The solver of the kind `weighted-chebyshev`.
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
    /// Whether it was looked beyond every point.
    optimality_checked: bool,
}

enum Stage {
    /// The least of this criterion alone.
    SingleCriterion(usize),
    /// Between neighbours of two criteria.
    Rectangles(Rectangles),
    /// Along the rays of more criteria.
    ReferenceDirections(ReferenceDirections),
    /// The point that meets the demands best.
    MeetDemands,
    /// What is known to be better than a point of the front.
    ReplaceDominated(usize),
}

impl Solver for WeightedChebyshev {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.objective != Objective::Each {
            return Err(
                "`weighted-chebyshev` looks for a front; set objective = \"each\" in [study], or take `sqp`".into()
            );
        }
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`weighted-chebyshev` follows slopes and cannot treat tuners with whole numbers or lists; take `nsga2`"
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
            stage: Stage::SingleCriterion(0),
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
        let criteria = oracle.shape().rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
        match &mut state.stage {
            Stage::SingleCriterion(k) => {
                let k = *k;
                if k < criteria {
                    if let Some(candidate) = state.subproblems.minimise_single(oracle, &state.start, k, criteria)? {
                        state.front.push(candidate);
                    }
                    state.stage = Stage::SingleCriterion(k + 1);
                    return Ok(Progress::Continue);
                }
                if criteria == 0 {
                    return state.subproblems.find_feasible(oracle, &state.start);
                }
                if state.front.is_empty() {
                    return Ok(Progress::Stalled);
                }
                state.subproblems.set_ranges(&state.front);
                state.stage = match criteria {
                    1 => Stage::ReplaceDominated(0),
                    2 => Stage::Rectangles(Rectangles::default()),
                    _ => Stage::ReferenceDirections(ReferenceDirections::new(criteria, points)),
                };
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
                if !reference_directions.solve_next(oracle, &mut state.subproblems, &mut state.front)? {
                    state.stage = Stage::MeetDemands;
                }
                Ok(Progress::Continue)
            }
            Stage::MeetDemands => {
                let candidate = state.subproblems.solve_for_demands(oracle, criteria)?;
                insert(&mut state.front, candidate);
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
        // Cut short before the ends were known: all that was evaluated is worth more.
        if matches!(state.stage, Stage::SingleCriterion(_)) {
            return Vec::new();
        }
        state.front.iter().map(|candidate| candidate.point.clone()).collect()
    }
}

/// Rounds in which points known to be better replace those of the front.
const MAX_ROUNDS: usize = 5;

/// Keeps a point of the front, and no point that it is better than; whether it is one.
fn insert(front: &mut Vec<Candidate>, candidate: Candidate) -> bool {
    let range = vec![1.0; candidate.criteria.len()];
    let is_dominated =
        |other: &Candidate| other.criteria == candidate.criteria || other.dominates(&candidate, &range, 0.0);
    if front.iter().any(is_dominated) {
        return false;
    }
    front.retain(|other| !candidate.dominates(other, &range, 0.0));
    front.push(candidate);
    true
}
