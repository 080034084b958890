//! Verdict on a calibrated model.

use mops_content::numbers::significant;
use mops_content::section::{Tone, Verdict};
use mops_core::Role;
use mops_outcome::{ChannelReport, Outcome};

use crate::room::Solution;
use crate::verdict::changed;

/// Returns the verdict on a calibrated model.
pub(super) fn verdict(of: &Solution<'_>) -> Verdict {
    let outcome = of.outcome;
    let start = of.archive.first().map_or(f64::NAN, |record| record.merit.objective);
    let mut text = changed("The objective", start, outcome.objective) + ".";
    for role in [Role::Calibration, Role::Selection, Role::Validation] {
        let experiments = outcome.calibration.iter().flat_map(|c| &c.experiments).filter(|e| e.role == role);
        let channels = experiments.flat_map(|e| e.channels.iter().map(move |c| (e, c)));
        let worst = channels
            .filter(|(_, c)| c.fit_percent.is_finite())
            .min_by(|a, b| a.1.fit_percent.total_cmp(&b.1.fit_percent));
        if let Some((experiment, channel)) = worst {
            text.push_str(&format!(
                " On {} data the worst fit is {:.1} % (`{}` in `{}`).",
                role.name(),
                channel.fit_percent,
                channel.name,
                experiment.name
            ));
        }
    }
    let doubts = doubts_of_fit(outcome);
    let tone = if doubts.is_empty() { Tone::Good } else { Tone::Mixed };
    Verdict::new(tone, doubts + &text)
}

/// Residuals above this multiple of the noise show that the model does not describe the data.
const MISFIT: f64 = 2.0;

/// Returns what speaks against a calibrated model, as sentences: residuals far above the noise, a fit worse than the
/// mean of the data, tuners at their bounds.
fn doubts_of_fit(outcome: &Outcome) -> String {
    let experiments = outcome.calibration.iter().flat_map(|c| &c.experiments);
    let channels: Vec<_> = experiments.flat_map(|e| e.channels.iter().map(move |c| (e, c))).collect();
    let ratio = |channel: &ChannelReport| channel.noise.map_or(0.0, |noise| channel.rmse / noise);
    let mut text = String::new();
    let misfit = channels.iter().filter(|(e, _)| e.role == Role::Calibration);
    if let Some((experiment, channel)) = misfit.max_by(|a, b| ratio(a.1).total_cmp(&ratio(b.1)))
        && ratio(channel) > MISFIT
    {
        text += &format!(
            "The residuals of `{}` in `{}` are {} times the stated noise: the model does not describe the data, the noise is \
             larger, or the data have outliers. ",
            channel.name,
            experiment.name,
            significant(ratio(channel), 3)
        );
    }
    if let Some((experiment, channel)) = channels.iter().find(|(_, c)| c.fit_percent < 0.0) {
        text +=
            &format!("The mean of the data fits `{}` in `{}` better than the model. ", channel.name, experiment.name);
    }
    let bounds: Vec<String> =
        outcome.tuners.iter().filter(|t| t.at_bound.is_some()).map(|tuner| format!("`{}`", tuner.name)).collect();
    if !bounds.is_empty() {
        text += &format!("At a bound: {}. ", bounds.join(", "));
    }
    text
}
