//! Findings on the whiteness of residuals, in sentences.

use mops_identification::{UNLIKELY, Whiteness};

use super::words::{MANY, coefficient, distinct, percent};

/// Returns the statistics in words.
fn numbers(found: &Whiteness) -> String {
    let chance = match found.probability {
        p if p < 1e-4 => "< 0.01 %".to_owned(),
        p => format!("= {}", percent(p)),
    };
    format!(
        "lag-1 autocorrelation {}, Ljung-Box {} over {} lags, p {chance}",
        coefficient(found.lag1),
        coefficient(found.ljung_box),
        found.lags
    )
}

/// Returns the finding on residuals, with the beginning of the sentence and numbers.
fn finding(subject: &str, is_white: bool, numbers: &str) -> String {
    if is_white {
        format!("{subject} are consistent with white noise{numbers}, as the standard errors assume.")
    } else {
        format!(
            "{subject} are not white{numbers}. The standard errors allow for the correlation of neighbours, but \
                 intervals still cover the truth less often than stated: look for an effect that the model lacks, a \
                 delay, or an input with the wrong `hold`."
        )
    }
}

/// Returns the findings on channels of experiments, each with the names of both, as sentences: one for each, or if a
/// channel is in many experiments, one for all of these.
pub fn whiteness_words(found: &[(&str, &str, Whiteness)]) -> Vec<String> {
    let mut sentences = Vec::new();
    for channel in distinct(found.iter().map(|(channel, ..)| *channel)) {
        let own: Vec<&(&str, &str, Whiteness)> = found.iter().filter(|(name, ..)| *name == channel).collect();
        if own.len() <= MANY {
            sentences.extend(own.iter().map(|(_, experiment, found)| {
                let subject = format!("The residuals of `{channel}` in `{experiment}`");
                finding(&subject, found.is_white(), &format!(" ({})", numbers(found)))
            }));
            continue;
        }
        let Some((_, experiment, worst)) = own.iter().min_by(|a, b| a.2.probability.total_cmp(&b.2.probability)) else {
            continue;
        };
        // Bonferroni's correction: among many white records some fail a single test by chance.
        #[allow(clippy::cast_precision_loss)]
        let level = UNLIKELY / own.len() as f64;
        let coloured = own.iter().filter(|(.., found)| found.probability < level).count();
        let count = if coloured == 0 { "all" } else { &format!("{coloured} of the") };
        let subject = format!("The residuals of `{channel}` in {count} {} experiments", own.len());
        let numbers = format!(" (largest in `{experiment}`: {})", numbers(worst));
        sentences.push(finding(&subject, coloured == 0, &numbers));
    }
    sentences
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_of_many_experiments_have_one_sentence() {
        let slow = Whiteness { lag1: 0.97, ljung_box: 400.0, lags: 10, probability: 0.0 };
        let white = Whiteness { lag1: -0.16, ljung_box: 8.03, lags: 10, probability: 0.626 };
        let words = whiteness_words(&[("y", "swing", slow), ("y", "rest", white)]);
        assert!(words[0].starts_with("The residuals of `y` in `swing` are not white (lag-1"), "{words:?}");
        assert!(
            words[1].starts_with("The residuals of `y` in `rest` are consistent with white noise (lag-1"),
            "{words:?}"
        );
        let names: Vec<String> = (0..6).map(|i| format!("e-{i}")).collect();
        let many: Vec<(&str, &str, Whiteness)> =
            names.iter().map(|name| ("y", name.as_str(), if name == "e-4" { slow } else { white })).collect();
        let words = whiteness_words(&many);
        assert_eq!(words.len(), 1);
        assert!(
            words[0]
                .starts_with("The residuals of `y` in 1 of the 6 experiments are not white (largest in `e-4`: lag-1"),
            "{words:?}"
        );
        let words = whiteness_words(&many[..4].iter().chain(&many[5..]).copied().collect::<Vec<_>>());
        assert!(words[0].starts_with("The residuals of `y` in all 5 experiments are consistent"), "{words:?}");
    }
}
