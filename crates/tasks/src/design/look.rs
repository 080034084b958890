//! Jumps of the criteria near the reported point: how far a tuner, a constant or an initial value may move before a
//! criterion jumps.

use super::searched::is_robust;
use std::sync::Arc;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    criterion::Usage,
    evaluation::Evaluation,
    model::Model,
    problem::Problem,
    run::Record,
    solver::Oracle,
    study::{ParameterSource, Study},
};

/// Largest distance of a jump that is looked for: a part of a tuner's range, of a constant, or of an initial value.
pub const WITHIN: f64 = 0.01;

/// Least increase of a scaled value that is looked for, relative to the value, or to the demand if that is more.
const LEAST: f64 = 0.02;

/// Scaled value up to which a demand counts as met beyond a jump.
const MET: f64 = 1.0 + LEAST;

/// Ratio of the distances at which values are compared: a change that does not shrink by it is a jump.
const RATIO: f64 = 10.0;

/// Parts of the increase over an interval that a tenth and a half of it contain at least if it jumps there: a jump may
/// stand beside a steep change of its own size.
const SHARES: [f64; 2] = [0.5, 0.7];

/// Width of the interval in which a jump is located, relative to its distance.
const RESOLUTION: f64 = 0.05;

/// Distance below which the point lies on the jump: that of the tolerance of searches.
pub const ON_JUMP: f64 = 1e-5;

/// Largest number of evaluated points that are tried instead of the reported one.
const TRIED: usize = 16;

/// The block `jumps` of a result: criteria that jump to a worse value near the reported point.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct JumpsReport {
    /// Number of points evaluated to look for jumps.
    pub evaluations: usize,
    /// Number of quantities looked at, in both directions: tuners, constants and initial values.
    pub quantities: usize,
    /// Names of the quantities that the budget did not cover: not looked at, or with a jump that was not located.
    pub left_out: Vec<String>,
    /// Names of the active tuners with discrete values, which are not moved.
    pub discrete: Vec<String>,
    /// Jumps found within 1 %, the nearest first; those that miss a demand come before the others.
    pub found: Vec<JumpReport>,
    /// Best evaluated point at which the criterion of the first jump still meets its demand 1 % farther; null if none
    /// was found or looked for.
    pub away: Option<AwayReport>,
}

/// A criterion that jumps to a worse value.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JumpReport {
    /// Key, `case/criterion`.
    pub key: String,
    /// Kind of the quantity whose change causes the jump.
    pub kind: MovedKind,
    /// True for a constant that is fixed in the equations of a model: no parameter.
    #[serde(skip)]
    pub is_fixed: bool,
    /// True for a tuner that is not active: moved as a constant.
    #[serde(skip)]
    pub is_tuner: bool,
    /// Name of the quantity.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// Its value at the reported point.
    pub value: f64,
    /// Its value beyond the jump.
    pub beyond: f64,
    /// Distance of the value beyond the jump: a part of a tuner's range, of a constant, or of an initial value (of the
    /// scale of its state, where that is 0).
    pub distance: f64,
    /// Value of the criterion at the reported point, in its unit.
    pub here: f64,
    /// Value of the criterion beyond the jump; null if it has none.
    pub there: f64,
    /// Unit of the criterion.
    pub criterion_unit: String,
    /// True if the criterion meets its demand at the reported point and misses it beyond the jump.
    pub misses: bool,
    /// Direction of the change, 1 or -1.
    #[serde(skip)]
    sign: f64,
    /// Index of the row.
    #[serde(skip)]
    row: usize,
}

/// Kind of a quantity that is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MovedKind {
    /// Active tuner.
    Tuner,
    /// Constant of a model, or tuner that is not active.
    Constant,
    /// Initial value of a state.
    Initial,
}

/// Evaluated point that is farther from a jump.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AwayReport {
    /// Names and values of the active tuners.
    pub tuners: Vec<(String, f64)>,
    /// Objective.
    pub objective: f64,
    /// Value of the criterion that jumps, in its unit.
    pub value: f64,
}

/// Quantity that is moved.
#[derive(Debug, Clone)]
struct Moved {
    kind: MovedKind,
    /// True for a constant of [`Model::constants`].
    is_fixed: bool,
    /// Index of a tuner that is not active.
    tuner: Option<usize>,
    name: String,
    unit: String,
    /// Coordinate of a tuner.
    coordinate: usize,
    /// Value at the reported point.
    value: f64,
    /// Change for a distance of 1, of a constant.
    size: f64,
}

/// Look for jumps around a point.
struct Look<'a> {
    problem: &'a Problem,
    oracle: &'a mut dyn Oracle,
    /// Rows that count, by index.
    rows: Vec<usize>,
    budget: usize,
    evaluations: usize,
    /// True if a jump could not be located within the budget.
    is_cut_off: bool,
}

/// Evaluation at a distance.
#[derive(Clone)]
struct Step {
    distance: f64,
    at: Evaluation,
}

impl JumpsReport {
    /// Looks for jumps along every tuner, constant and initial value, with at most `budget` evaluations, and for the
    /// best of the evaluated points that is farther from the nearest jump. The result is empty after a stop request.
    pub fn of(problem: &Problem, oracle: &mut dyn Oracle, at: &Evaluation, archive: &[Record], budget: usize) -> Self {
        let counts = |i: &usize| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows = (0..problem.study().rows().len()).filter(counts).collect();
        let mut look = Look { problem, oracle, rows, budget, evaluations: 0, is_cut_off: false };
        let mut report = Self::default();
        if at.scaled.is_none() {
            return report;
        }
        let is_discrete = |&i: &usize| problem.study().tuners()[i].spacing() > 0.0;
        let discrete = problem.active().iter().copied().filter(is_discrete);
        report.discrete = discrete.map(|i| problem.study().tuners()[i].name.clone()).collect();
        let moved = moved(problem, at);
        let ends = look.ends(&moved, at);
        report.left_out =
            moved.iter().zip(&ends).filter(|(_, end)| end.is_none()).map(|(m, _)| m.name.clone()).collect();
        report.quantities = moved.len() - report.left_out.len();
        for (quantity, ends) in moved.iter().zip(ends) {
            look.is_cut_off = false;
            for (sign, end) in [-1.0, 1.0].into_iter().zip(ends.into_iter().flatten()) {
                let Some(end) = end else { continue };
                report.found.extend(look.jumps(quantity, sign, at, end));
            }
            if look.is_cut_off {
                report.left_out.push(quantity.name.clone());
                report.quantities -= 1;
            }
        }
        report.found.sort_by(|a, b| b.misses.cmp(&a.misses).then(a.distance.total_cmp(&b.distance)));
        if let Some(nearest) = report.found.first().filter(|jump| jump.misses).cloned() {
            let key = (nearest.kind, nearest.is_fixed, nearest.is_tuner, &nearest.name);
            let quantity = moved.iter().find(|m| (m.kind, m.is_fixed, m.tuner.is_some(), &m.name) == key);
            report.away = quantity.and_then(|quantity| look.away(quantity, &nearest, at, archive));
        }
        report.evaluations = look.evaluations;
        report
    }

    /// Returns the nearest jump beyond which a demand is missed.
    pub fn cliff(&self) -> Option<&JumpReport> {
        self.found.first().filter(|jump| jump.misses)
    }

    /// Returns true if a criterion jumps within a distance along a tuner.
    pub fn is_beside(&self, distance: f64) -> bool {
        self.found.iter().any(|jump| jump.kind == MovedKind::Tuner && jump.distance <= distance)
    }
}

/// Returns the quantities whose changes are looked at: continuous active tuners, the other tuners, then constants and
/// initial values of the models. What a robust design holds uncertain is left out: it is designed against.
fn moved(problem: &Problem, at: &Evaluation) -> Vec<Moved> {
    let study = problem.study();
    let is_uncertain =
        |name: &str| is_robust(study) && study.uncertain().iter().any(|uncertain| uncertain.name == name);
    let tuner = |(coordinate, &i): (usize, &usize)| {
        let tuner = &study.tuners()[i];
        let moved = Moved {
            kind: MovedKind::Tuner,
            is_fixed: false,
            tuner: None,
            name: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            coordinate,
            value: at.tuners[i],
            size: 1.0,
        };
        (tuner.spacing() == 0.0 && !is_uncertain(&tuner.name)).then_some(moved)
    };
    let mut all: Vec<Moved> = problem.active().iter().enumerate().filter_map(tuner).collect();
    let still = study.tuners().iter().enumerate().filter(|(_, tuner)| !tuner.active && tuner.tie.is_none());
    all.extend(still.filter(|(i, tuner)| at.tuners[*i] != 0.0 && !is_uncertain(&tuner.name)).map(|(i, tuner)| Moved {
        kind: MovedKind::Constant,
        is_fixed: false,
        tuner: Some(i),
        name: tuner.name.clone(),
        unit: tuner.unit.to_string(),
        coordinate: 0,
        value: at.tuners[i],
        size: at.tuners[i].abs(),
    }));
    for job in study.jobs() {
        let model = &study.models()[job.model].1;
        let parameters = study.parameters(job, &at.tuners);
        for (index, source) in job.parameters.iter().enumerate() {
            let ParameterSource::Constant(value) = *source else { continue };
            let variable = &model.interface().parameters[index].variable;
            let is_known = all.iter().any(|m| m.kind != MovedKind::Tuner && m.name == variable.name);
            if is_known || !value.is_finite() || is_uncertain(&variable.name) {
                continue;
            }
            let state = model.interface().states.iter().find(|state| state.start == variable.name);
            let size = match state {
                Some(state) if value == 0.0 => scale_of(model.as_ref(), &state.name, &parameters),
                _ => (value != 0.0).then_some(value.abs()),
            };
            let Some(size) = size else { continue };
            let kind = if state.is_some() { MovedKind::Initial } else { MovedKind::Constant };
            let (name, unit) = (variable.name.clone(), variable.unit.to_string());
            all.push(Moved { kind, is_fixed: false, tuner: None, name, unit, coordinate: 0, value, size });
        }
    }
    for (variable, value) in study.models().iter().flat_map(|(_, model)| model.constants()) {
        let is_known = all.iter().any(|m| m.is_fixed && m.name == variable.name);
        if !is_known && value != 0.0 {
            let (name, unit) = (variable.name, variable.unit.to_string());
            let kind = MovedKind::Constant;
            all.push(Moved { kind, is_fixed: true, tuner: None, name, unit, coordinate: 0, value, size: value.abs() });
        }
    }
    all
}

/// Returns the declared scale of a state.
fn scale_of(model: &dyn Model, state: &str, parameters: &[f64]) -> Option<f64> {
    let index = model.equation_states().iter().position(|of| of.name == state)?;
    model.ported()?.plant(parameters).ok()?.scale(index)
}

/// Returns the study with a constant moved by a distance in all of its jobs.
fn with_constant(study: &Study, quantity: &Moved, distance: f64) -> Option<Study> {
    if let Some(tuner) = quantity.tuner {
        let mut moved = study.clone();
        moved.set_start(tuner, quantity.value + distance * quantity.size);
        return Some(moved);
    }
    let name = &quantity.name;
    if quantity.is_fixed {
        return study.with_model_constant(name, |value| value + distance * value.abs());
    }
    study.with_constant_parameter(name, |value| {
        value + distance * if value == 0.0 { quantity.size } else { value.abs() }
    })
}

/// Returns the point with a tuner moved by a distance, or the point and the problem with a constant moved; `None`
/// outside of the range of the quantity.
fn place(problem: &Problem, quantity: &Moved, distance: f64, point: &[f64]) -> Option<(Vec<f64>, Option<Problem>)> {
    let mut point = point.to_vec();
    if quantity.kind != MovedKind::Tuner {
        let study = with_constant(problem.study(), quantity, distance)?;
        return Some((point, Some(Problem::new(Arc::new(study)))));
    }
    let u = &mut point[quantity.coordinate];
    *u += distance;
    (0.0..=1.0).contains(u).then_some((point, None))
}

impl Look<'_> {
    /// Returns the scaled value of a row, of an equality plus its deviation from 1; infinite without a value.
    fn level(&self, row: usize, at: &Evaluation) -> f64 {
        let Some(scaled) = at.readings[row].map(|reading| reading.scaled) else { return f64::INFINITY };
        if self.problem.shape().rows[row].0 == Usage::Equality { 1.0 + (scaled - 1.0).abs() } else { scaled }
    }

    /// Returns the increase of the level of a row, relative to the level or the demand; infinite without a value.
    fn increase(&self, row: usize, at: &Evaluation, there: &Evaluation) -> f64 {
        let [here, there] = [at, there].map(|at| self.level(row, at));
        if there.is_finite() { (there - here) / here.abs().max(1.0) } else { f64::INFINITY }
    }

    /// Evaluates a quantity moved from a point by a distance; `None` outside of its range, beyond the budget, or after
    /// a stop request.
    fn step(&mut self, quantity: &Moved, distance: f64, point: &[f64]) -> Option<Step> {
        if self.evaluations >= self.budget || self.problem.is_cancelled() {
            return None;
        }
        let (point, problem) = place(self.problem, quantity, distance, point)?;
        let at = match problem {
            Some(problem) => problem.evaluate(&point),
            None => self.oracle.evaluate(&[point]).ok()?.pop()?,
        };
        self.evaluations += 1;
        (!at.is_cancelled()).then_some(Step { distance: distance.abs(), at })
    }

    /// Evaluates every quantity at both ends of its range of [`WITHIN`]. `None` for a quantity that the budget does not
    /// cover.
    fn ends(&mut self, moved: &[Moved], at: &Evaluation) -> Vec<Option<[Option<Step>; 2]>> {
        // A third of the budget is left to locate jumps.
        let covered = moved.len().min(self.budget / 3);
        // Simulations with a changed constant are independent: they run in parallel, in an order that changes no bit.
        let problem = self.problem;
        let both = |quantity: &Moved| {
            [-WITHIN, WITHIN].map(|distance| {
                let (point, moved) = place(problem, quantity, distance, &at.point)?;
                let at = moved?.evaluate(&point);
                (!at.is_cancelled()).then_some(Step { distance: WITHIN, at })
            })
        };
        let constants: Vec<_> = moved[..covered].par_iter().map(both).collect();
        let mut ends: Vec<Option<[Option<Step>; 2]>> = Vec::new();
        for (quantity, found) in moved.iter().zip(constants) {
            if quantity.kind == MovedKind::Tuner {
                ends.push(Some([-WITHIN, WITHIN].map(|distance| self.step(quantity, distance, &at.point))));
            } else {
                self.evaluations += found.iter().flatten().count();
                ends.push(Some(found));
            }
        }
        ends.resize(moved.len(), None);
        ends
    }

    /// Returns the jumps of the rows along a quantity in one direction, with the evaluation at the far end.
    fn jumps(&mut self, quantity: &Moved, sign: f64, at: &Evaluation, end: Step) -> Vec<JumpReport> {
        let mut known = vec![end];
        let mut found = Vec::new();
        for row in self.rows.clone() {
            if self.increase(row, at, &known[0].at) >= LEAST
                && let Some(beyond) = self.locate(row, (quantity, sign), at, &mut known)
            {
                found.push(self.report(row, (quantity, sign), at, &beyond));
            }
        }
        found
    }

    /// Locates the jump of a row: the interval with most of the increase is divided until it is much shorter than its
    /// distance. Returns the evaluation beyond the jump; `None` if the increase shrinks with the interval. `known`:
    /// steps evaluated so far, the farthest first.
    fn locate(&mut self, row: usize, along: (&Moved, f64), at: &Evaluation, known: &mut Vec<Step>) -> Option<Step> {
        let (quantity, sign) = along;
        // What counts is whether the increase lies on this or the other side of a distance: infinite ones are equal.
        let part = |high: f64, low: f64| if high == low { 0.0 } else { high - low };
        let (mut near, mut far) = (None::<Step>, known[0].clone());
        loop {
            let [low, high] = [near.as_ref().map_or(0.0, |near| near.distance), far.distance];
            let is_located = high - low <= RESOLUTION * high;
            if is_located || high <= ON_JUMP {
                // Less than what is looked for is left of a steep change.
                return (self.increase(row, at, &far.at) >= LEAST).then_some(far);
            }
            let (middle, share) = if low == 0.0 { (high / RATIO, SHARES[0]) } else { (0.5 * (low + high), SHARES[1]) };
            let step = match known.iter().find(|step| step.distance == middle) {
                Some(step) => step.clone(),
                None => {
                    let Some(step) = self.step(quantity, sign * middle, &at.point) else {
                        self.is_cut_off = true;
                        return None;
                    };
                    known.push(step.clone());
                    step
                }
            };
            let [lower, here, upper] = [near.as_ref(), Some(&step), Some(&far)]
                .map(|step| step.map_or(0.0, |step| self.increase(row, at, &step.at)));
            let all = part(upper, lower);
            if part(here, lower) >= share * all {
                far = step;
            } else if part(upper, here) >= share * all {
                near = Some(step);
            } else {
                return None;
            }
        }
    }

    fn report(&self, row: usize, (quantity, sign): (&Moved, f64), at: &Evaluation, beyond: &Step) -> JumpReport {
        let study = self.problem.study();
        let of = &study.rows()[row];
        let value = |at: &Evaluation| at.readings[row].map_or(f64::NAN, |reading| reading.value);
        let moved = match quantity.kind {
            MovedKind::Tuner => beyond.at.tuners[self.problem.active()[quantity.coordinate]],
            _ => quantity.value + sign * beyond.distance * quantity.size,
        };
        JumpReport {
            key: study.key(of),
            kind: quantity.kind,
            is_fixed: quantity.is_fixed,
            is_tuner: quantity.tuner.is_some(),
            name: quantity.name.clone(),
            unit: quantity.unit.clone(),
            value: quantity.value,
            beyond: moved,
            distance: beyond.distance,
            here: value(at),
            there: value(&beyond.at),
            criterion_unit: of.unit.to_string(),
            misses: self.level(row, at) <= MET && self.level(row, &beyond.at) > MET,
            sign,
            row,
        }
    }

    /// Returns the best of the evaluated points at which the criterion that jumps still meets its demand when the
    /// quantity is moved by
    /// [`WITHIN`].
    fn away(&mut self, quantity: &Moved, jump: &JumpReport, at: &Evaluation, archive: &[Record]) -> Option<AwayReport> {
        let mut best: Vec<&Record> = archive.iter().filter(|record| record.merit.is_feasible()).collect();
        best.sort_by(|a, b| a.merit.objective.total_cmp(&b.merit.objective));
        let mut tried: Vec<Vec<f64>> = vec![at.point.clone()];
        for record in best {
            let point = self.problem.point_of(&record.tuners);
            let is_near = |tried: &Vec<f64>| tried.iter().zip(&point).all(|(a, b)| (a - b).abs() < 0.5 * WITHIN);
            if tried.iter().any(is_near) {
                continue;
            }
            if tried.len() > TRIED {
                return None;
            }
            let moved = self.step(quantity, jump.sign * WITHIN, &point);
            tried.push(point);
            if moved.is_some_and(|moved| self.level(jump.row, &moved.at) <= MET) {
                let study = self.problem.study();
                let tuners = self.problem.active().iter();
                return Some(AwayReport {
                    tuners: tuners.map(|&i| (study.tuners()[i].name.clone(), record.tuners[i])).collect(),
                    objective: record.merit.objective,
                    value: record.values[jump.row],
                });
            }
        }
        None
    }
}

mops_outcome::finding!(JumpsReport, "jumps", "Jumps of the criteria near a design.");
