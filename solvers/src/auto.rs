//! Default solver, which chooses a method for the problem.

use mops_core::{
    Evaluation, Halt, Merit, Objective, Oracle, Progress, Shape, Solver, SolverOptions,
    solver::{Basins, Optimality},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::chaining::Chain;
use crate::confirmation::{Confirmation, FACTOR_OTHERWISE, factor};
use crate::levenberg_marquardt::LevenbergMarquardtOptions;
use crate::multimethod::Multimethod;
use crate::multistart::{Multistart, SMALL};
use crate::noise_detection::{Smoothness, detect_smoothness};
use crate::nsga2::Nsga2Options;
use crate::nsga3::Nsga3Options;
use crate::optimality::optimality;
use crate::pattern_search::PatternSearchOptions;
use crate::polishing::pattern_at_best;
use crate::quasi_newton::QuasiNewton;
use crate::sqp::SqpOptions;
use crate::weighted_chebyshev::WeightedChebyshevOptions;

/// Chooses a method from the properties of the problem.
///
/// - Sum of squares: `levenberg-marquardt`, restarted around the best point until nothing changes.
/// - Tuners with whole numbers or lists: `pattern-search`.
/// - One criterion without constraints: noise and kinks (non-differentiable points) are detected from values along one
///   to three lines near the initial guess. With noise: `pattern-search`. Smooth: BFGS with a line search, then `sqp`;
///   a pattern search from the same initial guess may find a better basin. With kinks: `sqp`.
/// - All other problems with one objective: `sqp`.
/// - A front (`objective = "each"`): `weighted-chebyshev` for up to ten criteria and 50 tuners without whole numbers
///   or lists; otherwise `nsga2` for two criteria and `nsga3` for more.
///
/// Every method for one objective runs from several points (multistart): the initial guess of the study and the best
/// points of samples of the box, until another optimum is unlikely. Where the best point is then not shown to be
/// stationary, or the runs have ended at several optima, and the objective is no sum of squares, a pattern search
/// continues from it, and from the end of the first run if that has not converged: an optimum may lie at a
/// discontinuity (of a settling time, for example), where gradients are of no use. Unless the objective is a sum of
/// squares, the search ends once the evaluations since the last decrease of the objective by a thousandth exceed a
/// multiple of those before it: 3 times where the point is shown to be stationary and no other optimum is known, 60
/// times elsewhere.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct AutoOptions {
    /// Largest number of starting points, including the initial guess of the study.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
}

impl Default for AutoOptions {
    fn default() -> Self {
        Self { starts: 8 }
    }
}

impl SolverOptions for AutoOptions {
    const KIND: &'static str = "auto";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Auto { options: self.clone(), stage: None, methods: Vec::new(), ends: Vec::new(), confirmation: None })
    }
}

struct Auto {
    options: AutoOptions,
    stage: Option<Stage>,
    methods: Vec<&'static str>,
    /// Merits at which the runs from different starting points have ended.
    ends: Vec<Merit>,
    /// Evaluations up to the last gain, and since then, once the runs from different starting points have ended.
    confirmation: Option<Confirmation>,
}

enum Stage {
    /// Search for a front.
    Front(Box<dyn Solver>),
    /// Multistart of the chosen method.
    Global(Multistart),
    /// Derivative-free search from the best point.
    Polish(Box<dyn Solver>, Status),
    /// Multistart around the best point.
    LocalRestarts(Multistart, Status),
}

/// State of the search at the start of a stage.
#[derive(Debug, Clone, Copy)]
struct Status {
    /// True if a previous stage has converged.
    converged: bool,
    /// True if two runs have reached the best point and another optimum is unlikely.
    confirmed: bool,
    /// Limit on the evaluations since the last gain, relative to those up to it.
    limit_factor: usize,
    /// Objective at the start of the last multistart around the best point.
    previous_objective: f64,
}

/// Relative change of the objective that is regarded as zero.
const NEGLIGIBLE_CHANGE: f64 = 1e-4;

/// Half-widths of the box around the best point, used in turn.
const RESTART_RADII: &[f64] = &[0.05, 0.02, 0.005];

impl Solver for Auto {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.ends.clear();
        if oracle.shape().objective == Objective::Each {
            let (mut front, method) = front_solver(oracle.shape());
            self.record_methods(&[method]);
            front.begin(oracle, start)?;
            self.stage = Some(Stage::Front(front));
            return Ok(());
        }
        let Choice { first, local, methods } = choose(oracle, start)?;
        self.record_methods(methods);
        let global = Multistart::new(local, self.options.starts);
        let mut global = match first {
            _ if oracle.shape().residuals > 0 => global.thorough().with_local_restarts(),
            Some(first) => global.with_initial_solver(first),
            None => global.with_continuation(PatternSearchOptions::default().local()),
        };
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
                self.ends = global.ends().to_vec();
                self.confirmation = global.confirmation();
                let Some(best) = oracle.best().cloned() else { return Ok(Progress::Stalled) };
                let (converged, confirmed) = (progress == Progress::Converged, global.is_settled());
                let is_unique = Basins::of(best.merit, &self.ends).optima < 2;
                // Otherwise the best point may stand in a narrow curved valley, where derivatives show no descent.
                let is_trusted = converged && (confirmed || is_unique);
                let optimality = optimality(oracle, &best.point);
                // The test may have found a better point.
                let is_gain = is_gain(&mut self.confirmation, oracle);
                let limit_factor = if is_gain { FACTOR_OTHERWISE } else { factor(best.merit, optimality, &self.ends) };
                let status = Status { converged, confirmed, limit_factor, previous_objective: f64::INFINITY };
                let is_limit_reached = is_limit_reached(self.confirmation, oracle, limit_factor);
                match optimality {
                    Optimality::Stationary if is_trusted => Ok(Progress::Converged),
                    // At a kink, linear models may hide a narrow valley.
                    Optimality::Kink if is_trusted => self.finish_or_restart(oracle, status, progress),
                    _ if is_limit_reached => Ok(Progress::Stalled),
                    // Ends that are not optima confirm nothing.
                    _ if global.continue_in_doubt(oracle)? => Ok(Progress::Continue),
                    _ => self.polish(oracle, status),
                }
            }
            Stage::Polish(pattern, status) => {
                let progress = pattern.step(oracle)?;
                status.observe(&mut self.confirmation, oracle);
                let status = *status;
                match progress {
                    _ if is_limit_reached(self.confirmation, oracle, status.limit_factor) => {
                        Ok(status.final_progress(Progress::Stalled))
                    }
                    Progress::Continue => Ok(Progress::Continue),
                    progress => {
                        // A better point than the ends of the runs is not confirmed by them.
                        let is_settled = |best: &Evaluation| Basins::of(best.merit, &self.ends).is_settled();
                        let confirmed = status.confirmed && oracle.best().is_some_and(is_settled);
                        self.finish_or_restart(oracle, Status { confirmed, ..status }, progress)
                    }
                }
            }
            Stage::LocalRestarts(restarts, status) => {
                let progress = restarts.step(oracle)?;
                status.observe(&mut self.confirmation, oracle);
                let status = *status;
                match progress {
                    _ if is_limit_reached(self.confirmation, oracle, status.limit_factor) => {
                        Ok(status.final_progress(Progress::Stalled))
                    }
                    Progress::Continue => Ok(Progress::Continue),
                    _ if has_improved(oracle, status.previous_objective) => self.polish(oracle, status),
                    progress => Ok(status.final_progress(progress)),
                }
            }
        }
    }

    fn methods(&self) -> &[&'static str] {
        &self.methods
    }

    fn members(&self) -> &[Vec<f64>] {
        match &self.stage {
            Some(Stage::Front(front)) => front.members(),
            _ => &[],
        }
    }

    fn ends(&self) -> &[Merit] {
        match &self.stage {
            Some(Stage::Global(global)) => global.ends(),
            _ => &self.ends,
        }
    }

    fn front(&self) -> Vec<Vec<f64>> {
        match &self.stage {
            Some(Stage::Front(front)) => front.front(),
            _ => Vec::new(),
        }
    }
}

/// Takes the best point into account; returns true if it is a gain.
fn is_gain(confirmation: &mut Option<Confirmation>, oracle: &dyn Oracle) -> bool {
    confirmation.as_mut().is_some_and(|confirmation| confirmation.observe(oracle))
}

/// Returns true if the evaluations since the last gain exceed their limit.
fn is_limit_reached(confirmation: Option<Confirmation>, oracle: &dyn Oracle, limit_factor: usize) -> bool {
    confirmation.is_some_and(|confirmation| confirmation.exceeds(oracle, limit_factor))
}

impl Status {
    /// Takes the best point into account: of a better one, nothing is known yet.
    fn observe(&mut self, confirmation: &mut Option<Confirmation>, oracle: &dyn Oracle) {
        if is_gain(confirmation, oracle) {
            self.limit_factor = FACTOR_OTHERWISE;
        }
    }

    fn final_progress(self, progress: Progress) -> Progress {
        if progress == Progress::Stalled && !self.converged { Progress::Stalled } else { Progress::Converged }
    }
}

impl Auto {
    fn record_methods(&mut self, methods: &[&'static str]) {
        let new: Vec<_> = methods.iter().filter(|method| !self.methods.contains(method)).collect();
        self.methods.extend(new);
    }

    /// Starts a pattern search from the best point.
    fn polish(&mut self, oracle: &mut dyn Oracle, status: Status) -> Result<Progress, Halt> {
        let Some(pattern) = pattern_at_best(oracle)? else { return Ok(Progress::Stalled) };
        self.record_methods(&[PatternSearchOptions::KIND]);
        self.stage = Some(Stage::Polish(pattern, status));
        Ok(Progress::Continue)
    }

    /// Ends the search, or starts a multistart around the best point if no optimum has been found twice.
    fn finish_or_restart(
        &mut self,
        oracle: &mut dyn Oracle,
        status: Status,
        progress: Progress,
    ) -> Result<Progress, Halt> {
        let is_continuous = oracle.shape().spacing.iter().all(|&spacing| spacing == 0.0);
        if self.options.starts < 2
            || !is_continuous
            || status.confirmed
            || !has_improved(oracle, status.previous_objective)
        {
            return Ok(status.final_progress(progress));
        }
        let previous_objective = oracle.best().map_or(f64::INFINITY, |best| best.merit.objective);
        self.record_methods(&[SqpOptions::KIND]);
        let mut restarts =
            Multistart::restarts_around_best(SqpOptions::default().local(), RESTART_RADII, NEGLIGIBLE_CHANGE);
        if !restarts.begin_local_restarts(oracle)? {
            return Ok(status.final_progress(progress));
        }
        self.stage = Some(Stage::LocalRestarts(restarts, Status { previous_objective, ..status }));
        Ok(Progress::Continue)
    }
}

/// Returns true if the best objective has decreased from `previous_objective` by more than the negligible change.
fn has_improved(oracle: &dyn Oracle, previous_objective: f64) -> bool {
    oracle.best().is_some_and(|best| {
        previous_objective.is_infinite()
            || previous_objective - best.merit.objective > NEGLIGIBLE_CHANGE * previous_objective.abs().max(SMALL)
    })
}

/// Largest numbers of criteria and of tuners for `weighted-chebyshev`. On DTLZ2 with 4, 6, 8 and 10 criteria and 6
/// tuners more than criteria, from random starts, it found 60 points within 4e-5 of the front in 1,300 to 7,100
/// evaluations; those of `nsga3` were up to 0.05 to 0.46 away after 12,000 to 17,000.
const MAX_CHEBYSHEV: [usize; 2] = [10, 50];

/// Chooses the solver for a front: `weighted-chebyshev` for few criteria, otherwise `nsga2` (crowding) for two criteria
/// and `nsga3` (reference directions) for more.
fn front_solver(shape: &Shape) -> (Box<dyn Solver>, &'static str) {
    let objectives = shape.objective_count();
    let chebyshev = WeightedChebyshevOptions::default().build();
    let [most_criteria, most_tuners] = MAX_CHEBYSHEV;
    if objectives <= most_criteria && shape.dimension() <= most_tuners && chebyshev.accepts(shape).is_ok() {
        return (chebyshev, WeightedChebyshevOptions::KIND);
    }
    if objectives <= 2 {
        (Nsga2Options::default().build(), Nsga2Options::KIND)
    } else {
        (Nsga3Options::default().build(), Nsga3Options::KIND)
    }
}

/// Local solver of a multistart, and a different solver for the initial guess of the study if there is one.
struct Choice {
    first: Option<Box<dyn Solver>>,
    local: Box<dyn Solver>,
    methods: &'static [&'static str],
}

impl Choice {
    fn new(local: Box<dyn Solver>, methods: &'static [&'static str]) -> Self {
        Self { first: None, local, methods }
    }
}

/// Chooses the local solver of a problem.
fn choose(oracle: &mut dyn Oracle, start: &[f64]) -> Result<Choice, Halt> {
    let shape = oracle.shape().clone();
    let pattern = || Choice::new(PatternSearchOptions::default().local(), &[PatternSearchOptions::KIND]);
    // This solver counts the starting points itself.
    let least_squares = LevenbergMarquardtOptions::default().local();
    if least_squares.accepts(&shape).is_ok() {
        return Ok(Choice::new(least_squares, &[LevenbergMarquardtOptions::KIND]));
    }
    let sqp = SqpOptions::default().local();
    if sqp.accepts(&shape).is_err() || start.is_empty() {
        return Ok(pattern());
    }
    // With several criteria most kinks lie where two criteria intersect, which `sqp` handles: no noise detection.
    let quasi_newton = Box::new(QuasiNewton::default());
    if quasi_newton.accepts(&shape).is_err() {
        return Ok(Choice::new(sqp, &[SqpOptions::KIND]));
    }
    Ok(match detect_smoothness(oracle, start)? {
        Smoothness::Noisy => pattern(),
        Smoothness::Nonsmooth => Choice::new(sqp, &[SqpOptions::KIND]),
        Smoothness::Smooth => Choice {
            first: Some(Box::new(Multimethod::default())),
            local: Box::new(Chain::on_stall(quasi_newton, sqp)),
            methods: &[PatternSearchOptions::KIND, "bfgs", SqpOptions::KIND],
        },
    })
}
