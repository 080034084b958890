//! What a front tells a designer: what one criterion costs in terms of another, and which points are worth a look.

use serde::Serialize;

use crate::criterion::Usage;
use crate::evaluation::Evaluation;
use crate::front;
use crate::problem::Problem;

/// Whether the result can be improved in one criterion without loss in another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pareto {
    /// To first order no direction improves one criterion and worsens none.
    CertifiedLocal,
    /// Nothing was shown.
    NotShown,
    /// A direction that improves is known.
    No,
}

/// The block `trade_offs` of a result: beside the points of its `front`, in their order.
#[derive(Debug, Clone, Serialize)]
pub struct TradeOffs {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// The criteria that the front is of.
    pub criteria: Vec<FrontCriterion>,
    /// What is known of each point.
    pub points: Vec<FrontPoint>,
    /// The rates between neighbours; of fronts of two criteria alone.
    pub neighbours: Vec<Exchange>,
    /// The point farthest from the plane through the ends of the front, by index; null where the front bulges away.
    pub knee: Option<usize>,
    /// The point whose largest weighted scaled value is least, by index: nearest to what was demanded.
    pub nearest: usize,
    /// The volume that the front dominates, every criterion measured by its range over the front.
    pub hypervolume: f64,
    /// The corner up to which that volume counts: as far beyond the worst value of every criterion as a tenth of its range.
    pub reference: Vec<f64>,
}

/// A criterion of a front.
#[derive(Debug, Clone, Serialize)]
pub struct FrontCriterion {
    /// Its key in the points of the front, `case/criterion`.
    pub key: String,
    /// Unit of its values.
    pub unit: String,
    /// The best value on the front.
    pub best: f64,
    /// The worst value on the front.
    pub worst: f64,
}

/// What is known of a point of a front.
#[derive(Debug, Clone, Serialize)]
pub struct FrontPoint {
    /// The largest weighted scaled value.
    pub worst_scaled: f64,
    /// Whether one criterion can be improved at no cost.
    pub pareto: Pareto,
    /// What a unit of each criterion is worth here, from the multipliers of the point: to first order, along the front,
    /// `sum_k weights_k dc_k = 0`. The price of a unit of criterion `i`, in units of criterion `j`, is `weights_i /
    /// weights_j`. Scaled so that the weights times the ranges sum to 1; null where nothing was certified.
    pub weights: Option<Vec<f64>>,
}

/// What is exchanged between two neighbours of a front.
#[derive(Debug, Clone, Serialize)]
pub struct Exchange {
    /// The two points, by index.
    pub between: [usize; 2],
    /// Change of the second criterion per unit of the first.
    pub rate: f64,
}

/// A point of a front with what was shown of it.
#[derive(Debug, Clone)]
pub struct Certified {
    /// The point.
    pub at: Evaluation,
    /// Whether one criterion can be improved at no cost.
    pub pareto: Pareto,
    /// What a unit of each weighted scaled value is worth.
    pub weights: Option<Vec<f64>>,
}

impl TradeOffs {
    /// What the points of a front tell; `None` where there is no point, or one has no value.
    pub fn of(problem: &Problem, points: &[Certified]) -> Option<Self> {
        let study = problem.study();
        let shape = problem.shape();
        let rows: Vec<usize> = (0..study.rows.len()).filter(|&i| shape.rows[i].0 == Usage::Minimise).collect();
        let m = rows.len();
        let value = |at: &Evaluation, row: usize| Some(at.readings[row]?.value);
        let values: Vec<f64> =
            points.iter().flat_map(|p| rows.iter().map(|&row| value(&p.at, row))).collect::<Option<_>>()?;
        let scaled: Vec<f64> = points
            .iter()
            .map(|p| p.at.scaled.as_ref().map(|s| shape.objectives(s)))
            .collect::<Option<Vec<_>>>()?
            .concat();
        let worst = |i: usize| scaled[i * m..(i + 1) * m].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let nearest = (0..points.len()).min_by(|&a, &b| worst(a).total_cmp(&worst(b)))?;
        let ranges = front::ranges(&scaled, m);
        // A scaled value, with its weight, per unit of the criterion: negative where more is better.
        let slopes: Vec<f64> =
            rows.iter().map(|&row| study.rows[row].weight * study.rows[row].demand.slope()).collect();
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
                key: study.key(&study.rows[rows[k]]),
                unit: study.rows[rows[k]].unit.to_string(),
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

/// How far the reference point of the hypervolume lies beyond the worst values, in ranges.
const BEYOND: f64 = 0.1;
