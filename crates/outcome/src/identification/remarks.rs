//! Remarks on the noise of records, in sentences.

use mops_core::study::Study;
use mops_identification::noise::{Noise, RecordNoise};

use super::words::{MANY, coefficient, distinct};

/// Returns remarks on noise that is not as declared, or not constant: a sentence each, or one for a signal of many
/// experiments.
pub(super) fn remarks(noise: &Noise, study: &Study) -> Vec<String> {
    let records: Vec<RecordNoise<'_>> = noise.of_records().collect();
    let disputed = |signal: &str| {
        records.iter().filter(|record| record.is_disputed && record.signal == signal).collect::<Vec<_>>()
    };
    let signals = records.iter().filter(|record| record.is_disputed).map(|record| record.signal);
    let often: Vec<&str> = distinct(signals).into_iter().filter(|signal| disputed(signal).len() > MANY).collect();
    let summary = |signal: &&str| {
        let shown: Vec<f64> = disputed(signal).into_iter().map(|record| record.level).collect();
        let [low, high] = [shown.iter().copied().reduce(f64::min), shown.iter().copied().reduce(f64::max)]
            .map(|level| coefficient(level.unwrap_or(f64::NAN)));
        format!(
            "The residuals of `{signal}` in {} experiments have noise levels of {low} to {high}, which differ from the declared \
             ones: the standard errors are based on the residuals.",
            shown.len()
        )
    };
    let remark = |record: &RecordNoise<'_>| {
        let place = format!("`{}` in `{}`", record.signal, study.cases()[record.case].name);
        match (record.is_disputed, record.declared) {
            (true, _) if often.contains(&record.signal) => None,
            (true, declared) => {
                let [shown, declared] = [record.level, declared?].map(coefficient);
                Some(format!(
                    "The residuals of {place} show a noise level of {shown}, not {declared} as declared: the standard errors are \
                     based on the residuals."
                ))
            }
            (false, _) => record.is_changing.then(|| {
                format!("The residuals of {place} are white, but their variance changes: the standard errors allow for this.")
            }),
        }
    };
    often.iter().map(summary).chain(records.iter().filter_map(remark)).collect()
}
