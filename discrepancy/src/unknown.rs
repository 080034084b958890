//! An unknown signal at a place: what it may be a function of, and what it would do to the residuals.

use mops_core::effect::Port;
use mops_models::WithEffects;
use nalgebra::{DMatrix, DVector};

use crate::family::{Family, Look, Over};
use crate::fit::{Fit, Piece, dot};
use crate::gaussian::{Normals, Prior, joined};
use crate::scene::Scene;
use crate::trace_of::{Spot, spot};

/// Knots of a free signal over all pieces.
const FREE: usize = 100;

/// A place with the unknown signals that may act there.
pub struct Unknown {
    /// What it looks like in each piece, at the times of the signal.
    pub looks: Vec<Vec<Look>>,
    /// The families of signals.
    pub families: Vec<Family>,
    /// What each signal adds to the residuals, without what the unknowns of the fit absorb.
    pub columns: DMatrix<f64>,
    /// The residuals without the same.
    pub residuals: DVector<f64>,
    /// Their normal equations.
    pub normals: Normals,
}

/// A family in a prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Which family.
    pub family: usize,
    /// Over which length it changes.
    pub length: f64,
    /// Its size beside the other families.
    pub factor: f64,
}

impl Unknown {
    /// The unknown signals at a port; `None` where no signal reaches the data.
    #[allow(clippy::cast_precision_loss)]
    pub fn new(port: &Port, fit: &Fit<'_>, model: &WithEffects, scene: &Scene) -> Option<Self> {
        let spots: Vec<Option<Spot>> = fit.pieces.iter().map(|piece| spot(port, model, piece)).collect();
        let looks: Vec<Vec<Look>> = (0..spots.len()).map(|piece| looks(spots[piece], piece, fit, scene)).collect();
        let span = |piece: &Piece| [piece.case.begins, piece.case.begins + piece.horizon];
        let spans: Vec<[f64; 2]> = fit.pieces.iter().map(span).collect();
        let samples: Vec<usize> =
            fit.pieces.iter().map(|piece| piece.series.iter().map(|s| s.times.len()).max().unwrap_or(0)).collect();
        let mut families = vec![Family::free(&spans, &samples, FREE, 0)];
        for over in [Over::Position, Over::Speed, Over::Input, Over::Time] {
            let first = families[families.len() - 1].columns.end;
            let values = looks.iter().flatten().map(|look| look.of(over));
            // A force at a joint as a function of the input would be a signal at the actuator.
            let foreign = over == Over::Input && !matches!(spots.iter().flatten().next()?, Spot::Actuator(_));
            families.extend(Family::function(over, values, first).filter(|_| !foreign));
        }
        let count = families[families.len() - 1].columns.end;
        let rows = scene.residuals.len();
        let mut columns = DMatrix::zeros(rows, count);
        for (piece, looks) in looks.iter().enumerate() {
            let Some(here) = spots[piece] else { continue };
            for (column, signal) in families.iter().flat_map(|family| family.signals(piece, looks)) {
                let change = respond(here, piece, &signal, fit, scene);
                columns.column_mut(column).rows_mut(scene.begins[piece], change.len()).copy_from_slice(&change);
            }
        }
        if !columns.iter().all(|c| c.is_finite()) || columns.amax() == 0.0 {
            return None;
        }
        let basis = basis(scene);
        columns -= &basis * (basis.transpose() * &columns);
        let residuals = DVector::from_vec(scene.project(&scene.residuals));
        let turned = columns.transpose();
        let normals = Normals {
            gram: &turned * &columns,
            pull: -(&turned * &residuals),
            chi2: dot(residuals.as_slice(), residuals.as_slice()),
            freedom: rows.saturating_sub(basis.ncols()).max(1) as f64,
        };
        Some(Self { looks, families, columns, residuals, normals })
    }

    /// What is expected of a sum of families; `None` where a length is too long for the numbers.
    pub fn prior(&self, terms: &[Term]) -> Option<Prior> {
        let roots: Option<Vec<DMatrix<f64>>> = terms.iter().map(|t| self.families[t.family].root(t.length)).collect();
        let roots = roots?;
        let parts: Vec<(f64, &DMatrix<f64>)> = terms.iter().map(|t| t.factor).zip(&roots).collect();
        let columns = terms.iter().flat_map(|t| self.families[t.family].columns.clone()).collect();
        Some(Prior { columns, root: joined(&parts) })
    }

    /// The signal in a piece, at the times of its looks.
    pub fn signal(&self, terms: &[Term], coefficients: &[f64], piece: usize) -> Vec<f64> {
        let mut signal = vec![0.0; self.looks[piece].len()];
        for term in terms {
            self.families[term.family].add(coefficients, piece, &self.looks[piece], &mut signal);
        }
        signal
    }
}

/// The absorbed directions as the columns of a matrix.
pub fn basis(scene: &Scene) -> DMatrix<f64> {
    let rows = scene.residuals.len();
    let mut basis = DMatrix::zeros(rows, scene.basis.len());
    for (mut column, q) in basis.column_iter_mut().zip(&scene.basis) {
        column.rows_mut(q.begin, q.values.len()).copy_from_slice(&q.values);
    }
    basis
}

/// What a place looks like: at the nodes of the motion, or at the samples of a sensor.
fn looks(here: Option<Spot>, piece: usize, fit: &Fit<'_>, scene: &Scene) -> Vec<Look> {
    let along = &scene.trajectories[piece];
    let begins = fit.pieces[piece].case.begins;
    let moment = |m: &mops_models::Moment| {
        let input = m.u.first().copied().unwrap_or(0.0);
        match here {
            Some(Spot::Joint(_, q, v)) => Look { t: begins + m.t, position: m.x[q], speed: m.x[v], input },
            Some(Spot::Process(_, s)) => Look { t: begins + m.t, position: m.x[s], speed: 0.0, input },
            Some(Spot::Actuator(i)) => Look { t: begins + m.t, position: 0.0, speed: 0.0, input: m.u[i] },
            _ => Look::default(),
        }
    };
    match here {
        None => Vec::new(),
        Some(Spot::Sensor(series)) => {
            let (t, y) = (&fit.pieces[piece].series[series].times, &along.predicted[series]);
            let last = y.len().saturating_sub(1);
            let rate = |k: usize| {
                let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
                if b > a { (y[b] - y[a]) / (t[b] - t[a]) } else { 0.0 }
            };
            (0..y.len()).map(|k| Look { t: begins + t[k], position: y[k], speed: rate(k), input: 0.0 }).collect()
        }
        Some(_) => along.moments.iter().map(moment).collect(),
    }
}

/// What a signal adds to the residuals of a piece.
pub fn respond(here: Spot, piece: usize, signal: &[f64], fit: &Fit<'_>, scene: &Scene) -> Vec<f64> {
    let along = &scene.trajectories[piece];
    match here {
        Spot::Joint(w, ..) | Spot::Process(w, _) => {
            let forward: Vec<f64> = signal.iter().map(|s| s * along.forward[w]).collect();
            along.response(along.inputs() + w, &forward)
        }
        Spot::Actuator(input) => along.response(input, signal),
        Spot::Sensor(series) => {
            let all = &fit.pieces[piece].series;
            let before: usize = all[..series].iter().map(|s| s.times.len()).sum();
            let total: usize = all.iter().map(|s| s.times.len()).sum();
            let mut change = vec![0.0; total];
            change[before..].iter_mut().zip(signal).for_each(|(c, s)| *c = s / all[series].noise);
            change
        }
    }
}
