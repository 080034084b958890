//! Sensitivities at a point, and the covariance of estimates there.

use mops_core::{
    criterion::Usage,
    problem::Problem,
    run::{Budget, Run},
    solver::{Oracle, SMALL_OBJECTIVE},
    study::{Grid, Study, Tuner},
    task::SensitivityTask,
};
use nalgebra::{DMatrix, DVector};

use crate::alike::{Alike, alike};
use crate::coordinate::Coordinate;
use crate::covariance::Covariance;
use crate::noise::{Noise, Spread};
use crate::records::{Record, records};
use crate::sensitivity::{DIFFERENCES, Sensitivity, TANGENTS};

/// Change of a scaled value over the whole range of a tuner, relative to the value, that is negligible.
pub const NEGLIGIBLE: f64 = 1e-3;

/// Kind of point at which sensitivities are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Point {
    /// Minimum of the sum of squares: residuals show the noise.
    Minimum,
    /// Any other point: residuals are mostly misfit, so that only declared noise counts.
    Elsewhere,
}

/// Sensitivities at a point, and the resulting accuracy of the estimates.
pub struct Local {
    /// Sensitivity matrix and derived quantities.
    pub sensitivity: Sensitivity,
    /// Covariance of the estimates; `None` without residuals, or if they do not show the noise.
    pub covariance: Option<Covariance>,
    /// Estimates with equal sample weights, if records differ much in length.
    pub alike: Option<Alike>,
    /// Standard error of every tuner if all others were known; NaN without a covariance.
    pub alone: Vec<f64>,
    /// True if the derivatives are exact.
    pub exact: bool,
    /// True for derivatives of residuals; false for those of the scaled criteria that count.
    pub residuals: bool,
    /// True for each tuner that is an initial state of an experiment.
    pub starts: Vec<bool>,
}

impl Local {
    /// Returns the spread of the estimate of an active tuner; NaN if the data do not determine it.
    pub fn spread(&self, k: usize) -> Spread {
        let unknown = Spread { deviation: f64::NAN, freedom: f64::NAN };
        self.covariance.as_ref().map_or(unknown, |covariance| covariance.of_tuner(k))
    }
}

impl Covariance {
    /// Computes the covariance at the estimates; `None` without measurements, if a simulation fails, or if no residual
    /// shows the noise.
    pub fn at(problem: &Problem, tuners: &[f64]) -> Option<Self> {
        let zero = problem.study().options::<SensitivityTask>().and_then(|task| task.zero);
        local(problem, tuners, Point::Minimum, zero)?.covariance
    }
}

/// Returns the sensitivities of the active tuners; `None` without tuners, criteria that count, or derivatives.
pub fn local(problem: &Problem, tuners: &[f64], point: Point, zero: Option<f64>) -> Option<Local> {
    let study = problem.study();
    let n = problem.active().len();
    // A separate run, so that derivatives are computed even if the budget is exhausted.
    let mut probe = Run::new(problem, Budget { evaluations: usize::MAX }, &());
    let found = probe.linearise(&problem.point_of(tuners), 1.0).ok().flatten()?;
    let exact = probe.linearisations() > 0;
    let residuals = !found.at.residuals.is_empty();
    let counting = counting(problem);
    let rows = if residuals { found.at.residuals.len() } else { counting.len() };
    if n == 0 || rows == 0 || (residuals && found.residuals.iter().any(|column| column.len() != rows)) {
        return None;
    }
    let scaled = found.at.scaled.as_ref()?;
    // What is negligible over the whole range is rounding, as at a stationary point.
    let slope_of = |row: usize, k: usize| {
        let slope = found.rows[row][k];
        if slope.abs() > NEGLIGIBLE * (scaled[row].abs() + SMALL_OBJECTIVE) { slope } else { 0.0 }
    };
    let active: Vec<&Tuner> = problem.active().iter().map(|&i| &study.tuners()[i]).collect();
    let values: Vec<f64> = problem.active().iter().map(|&i| tuners[i]).collect();
    let mut jacobian = DMatrix::from_fn(rows, n, |i, k| {
        let slope = if residuals { found.residuals[k][i] } else { slope_of(counting[i], k) };
        slope / unit_slope(active[k], values[k])
    });
    let coordinates = active.iter().zip(&values).map(|(tuner, &value)| Coordinate {
        name: tuner.name.clone(),
        value,
        range: tuner.bounds[1] - tuner.bounds[0],
        span: unit_slope(tuner, value).abs(),
        unit: tuner.unit.to_string(),
        counts_from_any_zero: tuner.unit.zero() != 0.0,
    });
    let mut at = found.at.residuals.clone();
    let mut records = records(problem, tuners).filter(|_| residuals);
    let given = jacobian.clone();
    let holds = |record: &mut Record| match point {
        Point::Minimum => record.as_squares(&mut at, &mut jacobian),
        Point::Elsewhere => {
            record.without_loss(&mut jacobian, &at);
            true
        }
    };
    if !records.iter_mut().flatten().all(holds) {
        (records, jacobian) = (None, given);
    }
    let zero = zero.unwrap_or(if exact { TANGENTS } else { DIFFERENCES });
    let mut sensitivity = Sensitivity::of(&jacobian, coordinates.collect(), zero);
    let of_residuals = records.map(|records| match point {
        Point::Minimum => Noise::of(records, &at, &jacobian, &sensitivity.basis),
        Point::Elsewhere => Noise::declared(records, n),
    });
    let mut covariance = of_residuals.and_then(|noise| Covariance::of(noise, &jacobian, &sensitivity));
    let mut alone = vec![f64::NAN; n];
    let mut alike = None;
    if let Some(covariance) = &covariance {
        sensitivity.judge(&jacobian, covariance.noise(), &covariance.matrix());
        alike = self::alike(covariance.noise());
        let error =
            |column: &DVector<f64>| covariance.noise().along((column / column.norm_squared()).as_slice()).deviation;
        alone = jacobian.column_iter().map(|column| error(&column.into_owned())).collect();
    }
    covariance = covariance.map(|covariance| covariance.without(&sensitivity.undetermined));
    let starts = start_parameters(study);
    let starts =
        active.iter().map(|tuner| tuner.case.is_some() && starts.contains(&tuner.parameter.as_str())).collect();
    Some(Local { sensitivity, covariance, alike, alone, exact, residuals, starts })
}

/// Returns the derivative of a tuner with respect to its unit-box coordinate.
fn unit_slope(tuner: &Tuner, value: f64) -> f64 {
    match tuner.grid {
        Grid::List(_) => tuner.bounds[1] - tuner.bounds[0],
        _ => tuner.slope_at(value),
    }
}

/// Returns the indices of rows that enter the objective or a constraint.
pub fn counting(problem: &Problem) -> Vec<usize> {
    let rows = problem.shape().rows.iter().enumerate();
    rows.filter(|(_, (usage, _))| *usage != Usage::Monitor).map(|(i, _)| i).collect()
}

/// Returns the names of parameters that are initial states.
pub fn start_parameters(study: &Study) -> Vec<&str> {
    study.models().iter().flat_map(|(_, m)| m.interface().states.iter().map(|s| s.start.as_str())).collect()
}
