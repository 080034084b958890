//! `mops-bench evidence`: given sets of effects, compared by evidence.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use mops::{
    Catalogue, Diagnostic,
    discrepancy::{
        estimation::{ErrorModel, Errors},
        selection::{Conclusion, Entry, Selection, SetFit, SetOfEffects, compare, select},
    },
    outcome::diagnosis::Dependence,
    terminal::{CommandError, print},
};

/// Free curves that are printed for each fit.
const CURVES: usize = 3;

/// Arguments of `mops-bench evidence`.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Study file with the task diagnosis.
    study: PathBuf,
    /// Set of effects, `effect@place` each, joined by `+`; sets with one effect less come first. Without any set, effects are
    /// searched.
    #[arg(long = "set", value_name = "EFFECTS")]
    sets: Vec<String>,
}

/// Runs the command.
pub(super) fn evidence(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let study = mops::read_study(catalogue, &arguments.study)?;
    let names = |set: &String| set.split('+').map(|name| name.trim().to_owned()).collect();
    let sets: Vec<Vec<String>> = arguments.sets.iter().map(names).collect();
    let compared =
        if sets.is_empty() { select(&study, &catalogue.effects) } else { compare(&study, &catalogue.effects, &sets) };
    let compared = compared.map_err(|error| Diagnostic::new(error.to_string()))?;
    print(&table(&compared)).map(|()| ExitCode::SUCCESS)
}

/// Formats the verdict.
fn verdict(selection: &Selection) -> String {
    let verdict = &selection.verdict;
    let found = selection.found.join(" + ");
    let mut text = match (verdict.conclusion, verdict.set.is_empty()) {
        (Conclusion::Effect, _) => format!("effect: {found}\n"),
        (Conclusion::Unexplained, true) => "unexplained\n".to_owned(),
        (Conclusion::Unexplained, false) => format!("unexplained; best description: {found}\n"),
        (Conclusion::None, true) => "none\n".to_owned(),
        (Conclusion::None, false) => format!("none; best description: {found}\n"),
    };
    for stated in &verdict.stated {
        let claimed = if stated.is_claimed { "" } else { ", not claimed" };
        let Entry { class, place } = &stated.entry;
        let _ = writeln!(text, "  {class} at {place}: {:.3}{claimed}", stated.probability);
    }
    let _ = write!(
        text,
        "  declared model {:.3}; lack of fit {:.1} nats, largest error {:.2} noises",
        verdict.nothing, verdict.lack_of_fit, verdict.largest_error
    );
    if let Some(share) = verdict.share {
        let _ = write!(text, "; share of the forecast error {share:.3}");
    }
    let _ = writeln!(text, "; {}first by evidence", if verdict.is_first { "" } else { "not " });
    let curve =
        |curves: &[Dependence]| curves.first().map_or("none".to_owned(), |curve| format!("{curve} {:+.1}", curve.gain));
    let [likeliest, smooth] = &verdict.declared;
    let _ =
        writeln!(text, "  curve on the declared model: {} (smooth output error: {})", curve(likeliest), curve(smooth));
    let _ = writeln!(text, "  curve on top of the set: {}", curve(&verdict.remaining));
    let _ = writeln!(text, "  {} simulations\n", selection.simulations);
    text
}

/// Formats sets of effects, the declared model first.
fn table(selection: &Selection) -> String {
    let sets = &selection.sets;
    let mut text = verdict(selection);
    let declared = sets.iter().find(|set| set.effects.is_empty()).map_or(0.0, |set| set.log_evidence);
    for set in sets {
        let title = if set.effects.is_empty() { "declared model".to_owned() } else { set.effects.join(" + ") };
        let gain = set.log_evidence - declared;
        let _ =
            write!(text, "{title}: log-evidence {:.1} ({gain:+.1}), log-odds {:+.1}", set.log_evidence, set.log_odds);
        let _ = match set.forecasts {
            Some(true) => write!(text, ", forecasts better"),
            Some(false) => write!(text, ", forecasts worse"),
            None => Ok(()),
        };
        let _ = writeln!(text, "{}", if set.is_inert { ", inert" } else { "" });
        for fit in &set.fits {
            let _ = writeln!(text, "  {}", line(set, fit));
            let curves = fit.curves.iter().take(CURVES).map(|c| format!("{c} {:+.1}", c.gain));
            if !fit.curves.is_empty() {
                let _ = writeln!(text, "    free curve over: {}", curves.collect::<Vec<_>>().join("; "));
            }
        }
        text.push('\n');
    }
    text
}

fn line(set: &SetOfEffects, fit: &SetFit) -> String {
    let mut text = match fit.kind {
        None => "least squares",
        Some(ErrorModel::SmoothOutput) => "smooth output error",
        Some(ErrorModel::RoughOutput) => "rough output error",
        Some(ErrorModel::Force) => "force error",
    }
    .to_owned();
    let _ = write!(text, ": log-likelihood {:.1}", fit.log_likelihood);
    if let Some(evidence) = fit.log_evidence {
        let _ = write!(text, ", log-evidence {evidence:.1}");
    }
    match &fit.errors {
        Errors::White => {}
        Errors::Output(errors) => {
            for e in errors {
                let _ = write!(text, "; deviation {:.3}, length {:.4} s, noise {:.3}", e.deviation, e.length, e.noise);
            }
        }
        Errors::Force(e, _) => {
            let _ = write!(text, "; deviation {:.4}, length {:.4} s, noise {:.3?}", e.deviation, e.length, e.noise);
        }
    }
    for (k, name) in set.parameters.iter().enumerate() {
        let _ = write!(text, "; {name} {}", rounded(fit.values[k]));
        if fit.at_bound[k] {
            text.push_str(" (at its bound)");
        } else if fit.deviations[k] > 0.0 {
            let _ = write!(text, " +- {}", rounded(fit.deviations[k]));
        }
    }
    for (role, error) in ["calibration", "selection", "validation"].iter().zip(fit.free_run) {
        if let Some(error) = error {
            let _ = write!(text, "; {role} {error:.2} x noise");
        }
    }
    if !fit.converged {
        text.push_str("; not converged");
    }
    text
}

/// Returns a number rounded to four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
