//! The judgement: whether what was found explains the data, and a table where nothing does.

use mops_core::Role;
use mops_core::statistics::chi_squared_sf;

use crate::diagnose::UNEXPLAINED;
use crate::fit::dot;
use crate::held_out::predictive_gain;
use crate::locate::{Located, locate};
use crate::repaired::Calibrated;
use crate::screen::Scene;
use crate::search::{Search, Trial};
use crate::stopgap::{is_table, stopgap, unexplained};
use crate::subject::Measurement;
use crate::variant::Added;
use mops_core::diagnosis::{Unexplained, Verdict};

/// Probability, were the model right, of what counts as calibration data that contradict all data together.
const CONTRADICTED: f64 = 1e-4;

/// Share by which a free signal must lower the error on samples left out to count as something that is missing.
const FORETOLD: f64 = 0.1;

/// Error of forecasts of selection data, in units of the noise, above which a model is mistaken, where calibration data
/// contradict it too. Of ten forces outside of the catalogue (`mops bench diagnosis --outside 12 --sizes 20,5 --seed 111`) two
/// were named by three effects, with forecasts of 1.32 and 1.39.
const MISTAKEN: f64 = 1.2;

/// What is concluded of a model that grew.
pub struct Judgement<'a> {
    /// Whether something is missing.
    pub verdict: Verdict,
    /// The model, perhaps with a table in it.
    pub last: Trial<'a>,
    /// Tuners of declared terms that it does not need.
    pub held: Vec<usize>,
    /// The same fitted to calibration data alone.
    pub after: Calibrated<'a>,
    /// What no effect explains.
    pub unexplained: Option<Unexplained>,
    /// A fact about what is left.
    pub note: Option<String>,
}

/// Judges the model that the search ended with, without the declared terms `held`; `base` is the declared one, and `located`
/// where its residual comes from.
#[allow(clippy::cast_precision_loss)]
pub fn judge<'a>(
    search: &Search<'a>,
    base: &Trial<'a>,
    located: &[Located],
    last: Trial<'a>,
    held: Vec<usize>,
    after: Calibrated<'a>,
) -> Judgement<'a> {
    let (left, note) = if last.fitted.normalised() > UNEXPLAINED { left(&last) } else { (0.0, None) };
    // A bad forecast counts where calibration data alone contradict what all data together want; else it only shows how
    // little they determine.
    let mistaken = after.error_on(Role::Selection, search.subject).is_some_and(|error| error > MISTAKEN)
        && contradicts(contradiction(&last, &after), after.unknowns());
    let verdict = match (last.added.is_empty(), left > FORETOLD || mistaken) {
        (_, true) => Verdict::Unexplained,
        (true, false) => Verdict::None,
        (false, false) => Verdict::Effect,
    };
    let mut judgement = Judgement { verdict, last, held, after, unexplained: None, note };
    if verdict == Verdict::Unexplained {
        judgement.unexplained = located.first().and_then(Located::unexplained);
        for place in located.iter().take(2) {
            judgement.stand_in(search, base, place);
        }
        if judgement.last.added.iter().any(is_table) {
            judgement.note = judgement.note.map(|note| format!("without the table, {note}"));
        }
    }
    judgement
}

impl<'a> Judgement<'a> {
    /// Puts a table at a place in, alone, where that is better.
    fn stand_in(&mut self, search: &Search<'a>, base: &Trial<'a>, place: &Located) -> Option<()> {
        let (trial, table) = stopgap(search, base, place)?;
        let trial = search.over_whole(&trial)?;
        let calibrated = search.calibrate(&trial, &[])?;
        let found = unexplained(place, &table, &calibrated.added.last()?.strengths);
        let now = self.after.error_on(Role::Selection, search.subject);
        let better = if self.last.added.is_empty() {
            trial.fitted.chi2 < self.last.fitted.chi2
        } else {
            now > Some(MISTAKEN) && calibrated.error_on(Role::Selection, search.subject) < now
        };
        if better {
            (self.after, self.last, self.unexplained) = (calibrated, trial, Some(found));
            // Every declared term was fitted with it.
            self.held.clear();
        }
        Some(())
    }
}

/// A model fitted to all data from where its fit to calibration data alone ended, where that contradicts it and leads on, and
/// that fit again; else none.
pub fn agreed<'a>(
    search: &Search<'a>,
    last: &Trial<'a>,
    after: &Calibrated<'a>,
) -> Option<(Trial<'a>, Calibrated<'a>)> {
    if last.added.is_empty() || !contradicts(contradiction(last, after), after.unknowns()) {
        return None;
    }
    let other = search.led_by(after).filter(|other| other.fitted.chi2 < last.fitted.chi2)?;
    let after = search.calibrate(&other, &[])?;
    Some((other, after))
}

/// A model without what only an effect at its limit explains, and its fit to calibration data alone; `None` where no effect is at
/// its limit, neither for all data nor for these.
pub fn within_limits<'a>(
    search: &Search<'a>,
    last: &Trial<'a>,
    after: &Calibrated<'a>,
) -> Option<(Trial<'a>, Calibrated<'a>)> {
    let is_within = |(both, alone): &(&Added, &Added)| !both.is_at_limit() && !alone.is_at_limit();
    let pairs = || last.added.iter().zip(&after.added);
    if pairs().all(|pair| is_within(&pair)) {
        return None;
    }
    let kept: Vec<Added> = pairs().filter(is_within).map(|(both, _)| both.clone()).collect();
    let less = search.from(last, &kept, 40)?;
    let after = search.calibrate(&less, &[])?;
    // What is left may end at its own limit without it.
    within_limits(search, &less, &after).or(Some((less, after)))
}

/// By how much the sum of squares over calibration data is larger where all data were fitted than where these alone were.
fn contradiction(last: &Trial<'_>, after: &Calibrated<'_>) -> f64 {
    let own = |measurement: usize| last.fit.subject.measurements[measurement].role == Role::Calibration;
    let together = last.fit.pieces.iter().zip(&last.fitted.residuals).filter(|(piece, _)| own(piece.measurement));
    let together: f64 = together.map(|(_, residuals)| dot(residuals, residuals)).sum();
    (together - after.fitted.chi2) / after.dispersion.weight()
}

/// Whether a rise of the sum of squares over calibration data is more than the unknowns of a right model make it: at most a
/// chi-squared variable, of as many degrees of freedom as there are unknowns.
///
/// Source: S. S. Wilks, The large-sample distribution of the likelihood ratio for testing composite hypotheses, Annals of
/// Mathematical Statistics 9 (1938) 60.
#[allow(clippy::cast_precision_loss)]
fn contradicts(rise: f64, unknowns: usize) -> bool {
    unknowns > 0 && chi_squared_sf(rise, unknowns as f64) < CONTRADICTED
}

/// By which share a free signal at the likeliest place would lower the error that a model leaves on samples left out; and
/// that in words.
fn left(last: &Trial<'_>) -> (f64, Option<String>) {
    let model = &last.variant.model;
    let Some(scene) = Scene::new(&last.fit, model, &last.fitted) else { return (1.0, None) };
    let Some(place) = locate(&last.fit, model, &scene).into_iter().next() else { return (0.0, None) };
    let gain = predictive_gain(&place, &last.fit, model, &scene);
    let (error, at, share) = (last.fitted.normalised(), &place.evidence.place, 100.0 * gain);
    let is_selection = |m: &Measurement| m.role == Role::Selection;
    let data = if last.fit.subject.measurements.iter().any(is_selection) { " and selection" } else { "" };
    let what = if gain > 0.0 {
        format!("a free signal at `{at}` would lower the error on samples left out by {share:.0} %")
    } else {
        format!(
            "a free signal at `{at}`, the likeliest place, does not foretell it; the noise may be larger than supposed"
        )
    };
    let note = format!("{error:.2} times the noise is left on calibration{data} data; {what}");
    (gain, Some(note))
}

#[cfg(test)]
mod tests {
    use super::contradicts;

    #[test]
    fn calibration_data_contradict_where_one_right_model_in_ten_thousand_would_do_as_badly() {
        // Quantiles at 0.9999 of tables of the chi-squared distribution.
        for (unknowns, quantile) in [(1, 15.137), (2, 18.421), (10, 35.564)] {
            assert!(contradicts(quantile + 0.01, unknowns) && !contradicts(quantile - 0.01, unknowns), "{unknowns}");
        }
    }
}
