//! Comparison by least squares: of the single effects that leave little of the error, the class that is most probable
//! if the residuals are noise.
//!
//! Where a record is one smooth stroke, a smooth error at the outputs explains any residual at no cost: evidence then
//! hardly changes with an effect that removes nearly all of the error. Here the residuals are white noise of fitted
//! size. Neighbouring residuals are correlated, so that `n` samples count as `n (1 - r)/(1 + r)` independent ones; `r`
//! is the lag-one autocorrelation of the residuals of the closest set. Source: G. V. Bayley, J. M. Hammersley, The
//! "effective" number of independent observations in an autocorrelated time series, Supplement to the Journal of the
//! Royal Statistical Society 8 (1946) 184.

use mops_math as math;

use super::entry::{Entry, entry};
use super::fitted_set::{FittedSet, Key, STRONG, squares, white_log_likelihood};
use super::forecast::Forecasts;
use super::sets::FittedSets;
use crate::error_models::{Kernel, OutputError};
use crate::estimation::{Channels, Errors};
use crate::fit::Piece;
use crate::records::Series;

/// What least squares proposes.
pub struct Proposal {
    /// The simplest set of the class and place with most weight.
    pub set: Key,
    /// Its class and place.
    pub entry: Entry,
    /// Classes and places of other sets that are hardly less likely.
    pub alike: Vec<Entry>,
}

/// Set that leaves little, with the logarithm of its weight.
struct Rival<'s, 'a> {
    set: &'s FittedSet<'a>,
    entry: Entry,
    /// Share of the forecast error of the declared model above noise that the set removes.
    share: f64,
    log_weight: f64,
}

/// Returns the share of the forecast error above noise that a set must remove to leave little: of that of selection
/// records nearly all. Ends of calibration records show less: of their error most.
fn wanted_share(sets: &FittedSets<'_, '_>, forecasts: &Forecasts) -> f64 {
    let settings = sets.settings();
    if forecasts.are_of_other_records() { 1.0 - settings.little * settings.little } else { settings.most }
}

/// Returns true if a set leaves little, on calibration records and where it forecasts.
pub fn is_in_proportion(sets: &FittedSets<'_, '_>, forecasts: &Forecasts, key: &Key) -> bool {
    let leaves_little = sets.get(key).is_some_and(|set| !set.key.is_empty() && sets.leaves_little(set));
    let share = || forecasts.share_of_declared(sets, key);
    leaves_little && share().is_some_and(|share| share >= wanted_share(sets, forecasts))
}

/// Returns the class and place that explain most of the error if the residuals are noise; `None` if no effect alone
/// leaves little, or the leading one does not forecast well.
pub fn by_least_squares(sets: &FittedSets<'_, '_>, forecasts: &Forecasts) -> Option<Proposal> {
    let leaves_little = |set: &&FittedSet<'_>| {
        set.key.len() == 1 && set.is_settled && sets.leaves_little(set) && !sets.is_at_limit(set)
    };
    // A rival may forecast less well than what is proposed, but better than the declared model by far.
    let rivals = sets.sets.iter().filter(leaves_little).filter_map(|set| {
        let share = forecasts.share_of_declared(sets, &set.key)?;
        (share >= sets.settings().most).then_some((set, share))
    });
    let rivals = weighed(sets, rivals.collect())?;
    let weight = |entry: &Entry| -> f64 {
        rivals.iter().filter(|rival| rival.entry == *entry).map(|rival| math::exp(rival.log_weight)).sum()
    };
    let mut entries: Vec<(Entry, f64)> = Vec::new();
    for rival in &rivals {
        if entries.iter().all(|(entry, _)| *entry != rival.entry) {
            entries.push((rival.entry.clone(), weight(&rival.entry)));
        }
    }
    entries.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (leading, most) = entries.first()?.clone();
    let own: Vec<&Rival<'_, '_>> = rivals.iter().filter(|rival| rival.entry == leading).collect();
    let likeliest = own.iter().map(|rival| rival.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let near = own.iter().filter(|rival| rival.log_weight > likeliest - 0.5 * STRONG);
    let simplest = near.min_by_key(|rival| rival.set.parameters())?;
    let is_near = |(_, weight): &&(Entry, f64)| math::ln(most / weight) < 0.5 * STRONG;
    let alike = entries[1..].iter().filter(is_near).map(|(entry, _)| entry.clone()).collect();
    let wanted = wanted_share(sets, forecasts);
    own.iter().any(|rival| rival.share >= wanted).then(|| Proposal {
        set: simplest.set.key.clone(),
        entry: leading,
        alike,
    })
}

/// Returns sets with their weights: likelihood of white noise of fitted size, samples counted by the correlation of
/// neighbours, times priors and Occam factor. `None` if there are none.
fn weighed<'s, 'a>(sets: &FittedSets<'_, 'a>, rivals: Vec<(&'s FittedSet<'a>, f64)>) -> Option<Vec<Rival<'s, 'a>>> {
    let residuals = |set: &FittedSet<'_>| set.fit.all(&set.least_squares.point);
    let likelihood = |set: &FittedSet<'_>| set.least_squares.log_likelihood;
    let (closest, _) = rivals.iter().max_by(|a, b| likelihood(a.0).total_cmp(&likelihood(b.0)))?;
    let counted = independent(&closest.fit.pieces, &residuals(closest)?);
    let weigh = |&(set, share): &(&'s FittedSet<'a>, f64)| {
        let residuals = residuals(set)?;
        let size = |(square, count): (f64, f64)| (square / (count.max(1.0) * counted)).sqrt().max(f64::MIN_POSITIVE);
        let white =
            |noise: f64| OutputError { kernel: Kernel::OrnsteinUhlenbeck, deviation: NONE * noise, length: 1.0, noise };
        let noises = squares(&set.fit.pieces, &residuals).into_iter().map(size);
        let errors = Errors::Output(noises.map(white).collect());
        let there = set.estimation(&[]).with(&errors, set.least_squares.point.clone(), 0)?;
        let occam = there.log_evidence? - there.log_likelihood;
        let log_weight = counted * white_log_likelihood(&set.fit.pieces, &residuals) + occam;
        Some(Rival { set, share, entry: entry(sets, &sets.refit.candidates[set.key[0]]), log_weight })
    };
    let mut weighed: Vec<Rival<'s, 'a>> = rivals.iter().filter_map(weigh).collect();
    let most = weighed.iter().map(|rival| rival.log_weight).fold(f64::NEG_INFINITY, f64::max);
    weighed.iter_mut().for_each(|rival| rival.log_weight -= most);
    Some(weighed)
}

/// Deviation of a correlated error that is none, noises.
const NONE: f64 = 1e-9;

/// Returns the share of correlated residuals that count as independent: `(1 - r)/(1 + r)` with the correlation of
/// neighbours `r`, no less than 0.
#[allow(clippy::cast_precision_loss)]
fn independent(pieces: &[Piece], residuals: &[Vec<f64>]) -> f64 {
    let channels = Channels::new(pieces);
    let sizes: Vec<f64> = squares(pieces, residuals).iter().map(|(square, count)| square / count.max(1.0)).collect();
    let (mut products, mut pairs) = (0.0, 0.0);
    for (index, (piece, residuals)) in pieces.iter().zip(residuals).enumerate() {
        for (k, (_, own)) in Series::with_parts(&piece.series, residuals).enumerate() {
            let size = sizes[channels.of(index, k)].max(f64::MIN_POSITIVE);
            products += own.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / size;
            pairs += own.len().saturating_sub(1) as f64;
        }
    }
    let correlation = (products / f64::max(pairs, 1.0)).clamp(0.0, 1.0 - 1.0 / f64::max(pairs, 2.0));
    (1.0 - correlation) / (1.0 + correlation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Record, subject, white};

    #[test]
    fn correlated_samples_count_as_fewer() {
        const COUNT: usize = 4000;
        let text = "states = { x = \"m\" }\nparameters = { a = \"1/s\" }\nder = { x = \"-a*x\" }\n";
        let times: Vec<f64> = (0..COUNT).map(|k| f64::from(u32::try_from(k).expect("it is small"))).collect();
        let record = Record { inputs: Vec::new(), times, signals: vec![("x", vec![0.0; COUNT], 1.0)] };
        let subject = subject(text, &[1.0, 1.0], 1, vec![record]);
        let pieces = crate::fit::pieces::pieces(&subject, |_| true);
        for correlation in [0.0_f64, 0.5, 0.9] {
            let innovation = (1.0 - correlation * correlation).sqrt();
            let mut state = 0.0;
            let residuals = white("neighbours", 1.0, COUNT).into_iter().map(|e| {
                state = correlation * state + innovation * e;
                state
            });
            let counted = independent(&pieces, &[residuals.collect()]);
            let expected = (1.0 - correlation) / (1.0 + correlation);
            assert!((counted / expected - 1.0).abs() < 0.25, "{correlation}: {counted}, expected {expected}");
        }
    }
}
