//! Stability: whether the choice of an effect hangs on a few stretches of the data, or on one experiment.

use mops_core::diagnosis::{HangsOn, Stability};
use mops_core::stream;
use rand::Rng;
use rayon::prelude::*;

use crate::growth::least;
use crate::round::Round;
use crate::search::Trial;
use crate::weigh::{Dispersion, criterion};

/// Records that are drawn anew.
const DRAWS: usize = 1000;

/// Effects, the best first, that are fitted again without an experiment.
const REFITTED: usize = 5;

/// The stability of the effect of one of the models of a round; `None` where it has no rival over the same data.
pub fn stability(round: &Round<'_>, own: usize) -> Option<Stability> {
    let own = &round.trials[own];
    let of = Dispersion::of(own);
    let others = round.trials.iter().enumerate().filter(|(_, t)| !std::ptr::eq(*t, own) && t.windows == own.windows);
    let rivals: Vec<&Trial<'_>> = std::iter::once(own).chain(others.map(|(_, t)| t)).collect();
    if rivals.len() < 2 {
        return None;
    }
    let squares: Vec<Vec<f64>> = rivals.iter().map(|t| blocks(t, &of)).collect();
    // What a criterion has beside the sum of squares.
    let beside = |t: &Trial<'_>| criterion(t, &of) - t.fitted.chi2 / of.weight();
    let beside: Vec<f64> = rivals.iter().map(|t| beside(t)).collect();
    let leader = |weights: &[f64]| {
        let value = |i: usize| {
            let chi2: f64 = squares[i].iter().zip(weights).map(|(square, weight)| square * weight).sum();
            chi2 / of.weight() + beside[i]
        };
        (0..rivals.len()).min_by(|&a, &b| value(a).total_cmp(&value(b))).expect("there are two")
    };
    let owner = owners(own, &of);
    let mut random = stream(0, "stability");
    let mut same = 0;
    for _ in 0..DRAWS {
        let mut weights = vec![0.0; owner.len()];
        (0..owner.len()).for_each(|_| weights[random.random_range(0..owner.len())] += 1.0);
        same += usize::from(leader(&weights) == 0);
    }
    let mut measurements: Vec<usize> = owner.clone();
    measurements.dedup();
    let few = &rivals[..rivals.len().min(REFITTED)];
    let without = |&left_out: &usize| {
        let trials: Vec<Trial<'_>> = few.par_iter().filter_map(|t| refitted_without(t, left_out)).collect();
        let of = Dispersion::of(trials.iter().min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2))?);
        let (own_effect, other) = (own.newest()?, least(&trials, &of)?.newest()?);
        let experiment = own.fit.subject.measurements[left_out].name.clone();
        let (effect, place) = (other.effect.name().to_owned(), other.place());
        (!own_effect.is(other)).then_some(HangsOn { experiment, effect, place })
    };
    // What all data prefer to it is told as its rival.
    let leads = leader(&vec![1.0; owner.len()]) == 0;
    let hangs_on =
        if leads && measurements.len() > 1 { measurements.iter().filter_map(without).collect() } else { Vec::new() };
    #[allow(clippy::cast_precision_loss)]
    Some(Stability { share: same as f64 / DRAWS as f64, hangs_on })
}

/// A model that is fitted again without one of the experiments.
fn refitted_without<'a>(trial: &Trial<'a>, left_out: usize) -> Option<Trial<'a>> {
    let (mut fit, mut point) = (trial.fit.clone(), trial.fitted.point.clone());
    let kept: Vec<usize> = (0..fit.pieces.len()).filter(|&k| fit.pieces[k].measurement != left_out).collect();
    fit.pieces = kept.iter().map(|&k| fit.pieces[k].clone()).collect();
    point.locals = kept.iter().map(|&k| point.locals[k].clone()).collect();
    let fitted = fit.solve(point, 20)?;
    Some(Trial { fit, fitted, ..trial.clone() })
}

/// Number of blocks that a piece of so many samples is cut into: of at least ten independent samples, and at most 40.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn count(samples: usize, of: &Dispersion) -> usize {
    ((samples as f64 / (10.0 * of.repeats)) as usize).clamp(1, 40)
}

/// Sums of squares of all channels over the blocks of all pieces.
fn blocks(trial: &Trial<'_>, of: &Dispersion) -> Vec<f64> {
    let mut all = Vec::new();
    for (piece, residuals) in trial.fit.pieces.iter().zip(&trial.fitted.residuals) {
        let longest = piece.series.iter().map(|s| s.times.len()).max().unwrap_or(0);
        let mut sums = vec![0.0; count(longest, of)];
        let mut at = 0;
        for s in &piece.series {
            for (&t, r) in s.times.iter().zip(&residuals[at..]) {
                #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let block = (t / piece.horizon.max(f64::MIN_POSITIVE) * sums.len() as f64) as usize;
                let last = sums.len() - 1;
                sums[block.min(last)] += r * r;
            }
            at += s.times.len();
        }
        all.extend(sums);
    }
    all
}

/// The experiment of each block.
fn owners(trial: &Trial<'_>, of: &Dispersion) -> Vec<usize> {
    let of_piece = |piece: &crate::fit::Piece| {
        let longest = piece.series.iter().map(|s| s.times.len()).max().unwrap_or(0);
        std::iter::repeat_n(piece.measurement, count(longest, of))
    };
    trial.fit.pieces.iter().flat_map(of_piece).collect()
}
