//! Trade-offs along a Pareto front: prices of one criterion in units of another, knee and nearest point.

use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    evaluation::Evaluation,
    front,
    problem::{FrontObjective, Problem},
    solver::Pareto,
};

/// Block `trade_offs` of a result, in addition to its `front`; points have the same order.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TradeOffs {
    /// Findings as sentences; names are in backticks.
    pub words: Vec<String>,
    /// Criteria of the front.
    pub criteria: Vec<FrontCriterion>,
    /// Properties of each point.
    pub points: Vec<FrontPoint>,
    /// Trade-off rates between neighbours; only for fronts of two criteria.
    pub neighbours: Vec<Exchange>,
    /// Knee: index of the point farthest from the plane through the ends of the front; null if the front is concave.
    pub knee: Option<usize>,
    /// Index of the point with the smallest worst weighted scaled value, nearest to the demands.
    pub nearest: usize,
    /// Hypervolume dominated by the front, each criterion normalised by its range over the front.
    pub hypervolume: f64,
    /// Reference point of the hypervolume: beyond the worst value of every criterion by a tenth of its range.
    pub reference: Vec<f64>,
}

/// A criterion of a front.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FrontCriterion {
    /// Key in `objectives` of the points of the front.
    pub key: String,
    /// Unit of its values.
    pub unit: String,
    /// Best value on the front.
    pub best: f64,
    /// Worst value on the front.
    pub worst: f64,
}

/// Properties of a point of a front.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FrontPoint {
    /// Largest weighted scaled value.
    pub worst_scaled: f64,
    /// Pareto optimality of the point.
    pub pareto: Pareto,
    /// Price weight of each criterion at the point, from its multipliers: `sum_k weights_k dc_k = 0` along the front,
    /// to first order. The price of a unit of criterion `i`, in units of criterion `j`, is `weights_i / weights_j`.
    /// Normalised so that the weights times the ranges sum to 1; null if the point was not certified.
    pub weights: Option<Vec<f64>>,
    /// True if a criterion jumps beside the point, so that it cannot be certified.
    pub is_beside_jump: bool,
    /// Reason to doubt an end of the front as the optimum of its criterion; null for other points, and if there is
    /// none.
    pub doubt: Option<String>,
}

/// Trade-off between two neighbours of a front.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Exchange {
    /// Indices of the two points.
    pub between: [usize; 2],
    /// Change of the second criterion per unit of the first.
    pub rate: f64,
}

/// A point of a front with its certification.
#[derive(Debug, Clone)]
pub struct Certified {
    /// Evaluation of the point.
    pub at: Evaluation,
    /// Pareto optimality of the point.
    pub pareto: Pareto,
    /// Price weight of each weighted scaled value.
    pub weights: Option<Vec<f64>>,
    /// True if a criterion jumps beside the point.
    pub is_beside_jump: bool,
    /// Reason to doubt an end of the front.
    pub doubt: Option<String>,
}

impl TradeOffs {
    /// Returns the trade-offs of the points of a front; `None` if there is no point, or if a point has no value.
    pub fn of(problem: &Problem, points: &[Certified]) -> Option<Self> {
        let study = problem.study();
        let shape = problem.shape();
        let objectives = problem.objectives();
        let m = objectives.len();
        let value = |at: &Evaluation, objective: &FrontObjective| Some(objective.worst(study, at)?.1.value);
        let values: Vec<f64> =
            points.iter().flat_map(|p| objectives.iter().map(|o| value(&p.at, o))).collect::<Option<_>>()?;
        // The demand, the weight and the unit of a criterion are the same in all cases.
        let rows: Vec<usize> = objectives.iter().map(|objective| objective.rows[0]).collect();
        let scaled: Vec<f64> = points
            .iter()
            .map(|p| p.at.scaled.as_ref().map(|s| shape.objectives(s)))
            .collect::<Option<Vec<_>>>()?
            .concat();
        let worst = |i: usize| scaled[i * m..(i + 1) * m].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let nearest = (0..points.len()).min_by(|&a, &b| worst(a).total_cmp(&worst(b)))?;
        let ranges = front::ranges(&scaled, m);
        // Derivative of the weighted scaled value with respect to the criterion: negative if more is better.
        let slopes: Vec<f64> =
            rows.iter().map(|&row| study.rows()[row].weight * study.rows()[row].demand.slope()).collect();
        let spread: Vec<f64> =
            ranges.iter().zip(&slopes).map(|([low, high], slope)| (high - low) / slope.abs()).collect();
        let weights = |of: &[f64]| {
            let raw: Vec<f64> = of.iter().zip(&slopes).map(|(w, slope)| w * slope).collect();
            let sum: f64 = raw.iter().zip(&spread).map(|(w, spread)| w.abs() * spread).sum();
            raw.iter().map(|w| w / sum).collect::<Vec<f64>>()
        };
        let column = |k: usize, i: usize| values[i * m + k];
        let extreme = |k: usize, least: bool| {
            let better = |&a: &usize, &b: &usize| scaled[a * m + k].total_cmp(&scaled[b * m + k]);
            let all = 0..points.len();
            column(k, if least { all.min_by(better) } else { all.max_by(better) }.unwrap_or(0))
        };
        let criteria: Vec<FrontCriterion> = (0..m)
            .map(|k| FrontCriterion {
                key: objectives[k].label.clone(),
                unit: study.rows()[rows[k]].unit.to_string(),
                best: extreme(k, true),
                worst: extreme(k, false),
            })
            .collect();
        let rate = |i: usize| (column(1, i + 1) - column(1, i)) / (column(0, i + 1) - column(0, i));
        let unit = front::normalised(&scaled, &ranges);
        Some(Self {
            words: Vec::new(),
            reference: criteria.iter().map(|c| c.worst + BEYOND * (c.worst - c.best)).collect(),
            criteria,
            points: points
                .iter()
                .enumerate()
                .map(|(i, p)| FrontPoint {
                    worst_scaled: worst(i),
                    pareto: p.pareto,
                    weights: p.weights.as_deref().map(weights).filter(|w| w.iter().all(|w| w.is_finite())),
                    is_beside_jump: p.is_beside_jump,
                    doubt: p.doubt.clone(),
                })
                .collect(),
            neighbours: (0..if m == 2 { points.len() - 1 } else { 0 })
                .map(|i| Exchange { between: [i, i + 1], rate: rate(i) })
                .collect(),
            knee: front::knee(&scaled, m),
            nearest,
            hypervolume: front::hypervolume(&unit, &vec![1.0 + BEYOND; m]),
        })
    }
}

/// Distance of the reference point of the hypervolume beyond the worst values, in ranges.
const BEYOND: f64 = 0.1;

mops_outcome::finding!(TradeOffs, "trade_offs", "Trade-offs along the Pareto front.");
