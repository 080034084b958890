//! Answer to a case: verdict, ranked effects, errors, and the outputs predicted by the repaired model.

use std::fmt::Write;
use std::sync::Arc;

use mops::{
    core::Effect,
    outcome::diagnosis::{Diagnosis, ExperimentError, Prediction},
};
use serde_json::{Map, Value, json};

use super::super::tool::spelt;
use super::declared::{Declared, stem};

/// Returns the answer as JSON; a special case of an effect is named by the wider effect.
pub(super) fn answer(
    case: &str,
    declared: &Declared,
    diagnosis: &Diagnosis,
    seconds: f64,
    effects: &[Arc<dyn Effect>],
) -> String {
    let wider = |name: &str| effects.iter().find(|e| e.name() == name).and_then(|e| e.form_of());
    let entry = |effect: &str, place: &str| {
        (wider(effect).unwrap_or(effect).replace('-', "_"), located(place, &declared.locations))
    };
    let mut ranked: Vec<(String, String, f64)> = Vec::new();
    let found = diagnosis.found.iter().map(|f| (&f.effect, &f.place, f.probability));
    let others = diagnosis.found.iter().flat_map(|f| &f.indistinguishable);
    let others = others.map(|r| (&r.effect, &r.place, r.probability));
    let tried = diagnosis.ranked.iter().map(|r| (&r.effect, &r.place, r.probability));
    for (effect, place, p) in found.chain(others).chain(tried) {
        let (class, location) = entry(effect, place);
        if !ranked.iter().any(|(c, l, _)| *c == class && *l == location) {
            ranked.push((class, location, p));
        }
    }
    let added = diagnosis.found.iter().map(|f| {
        let (class, location) = entry(&f.effect, &f.place);
        json!({ "class": class, "location": location, "p": f.probability, "strengths": f.strengths })
    });
    let unexplained = diagnosis.unexplained.as_ref().map(|u| &u.place);
    let residual = unexplained.or_else(|| diagnosis.found.first().map(|f| &f.place));
    let residual = residual.or_else(|| diagnosis.places.first().map(|curve| &curve.place));
    let value = json!({
        "case": case,
        "verdict": spelt(diagnosis.verdict),
        "probability": diagnosis.probability,
        "ranked_effects": ranked.iter().map(|(c, l, p)| json!({ "class": c, "location": l, "p": p })).collect::<Value>(),
        "added_effects": added.collect::<Value>(),
        "residual_location": residual.map(|place| located(place, &declared.locations)),
        "rmse_before": errors(&diagnosis.before),
        "rmse_after": errors(&diagnosis.after),
        "simulations": diagnosis.simulations,
        "seconds": seconds,
    });
    serde_json::to_string_pretty(&value).expect("an answer is JSON") + "\n"
}

fn errors(errors: &[ExperimentError]) -> Value {
    errors.iter().map(|e| (e.name.clone(), json!(e.normalised))).collect::<Map<_, _>>().into()
}

/// Returns the place as spelt in the case, as an equation can have several names.
pub(super) fn located(place: &str, locations: &[String]) -> String {
    let known = |place: &str| locations.iter().any(|l| l == place);
    let (kind, name) = place.split_once(':').unwrap_or(("", place));
    if !known(place) && ["process", "joint"].contains(&kind) {
        let other = ["process", "joint", "extra_state"].map(|kind| format!("{kind}:{name}"));
        if let Some(other) = other.into_iter().find(|other| known(other)) {
            return other;
        }
    }
    place.to_owned()
}

/// Returns the outputs predicted at the rows of every file, as CSV. Rows without a prediction, whose sample was
/// discarded as faulty, are interpolated.
pub(super) fn predictions(
    declared: &Declared,
    diagnosis: &Diagnosis,
    times: &[(String, Vec<f64>)],
) -> Vec<(String, String)> {
    let of_file = |file: &String| {
        let (name, times) = times.iter().find(|(name, _)| name == stem(file))?;
        let channels: Option<Vec<&Prediction>> = declared
            .outputs
            .iter()
            .map(|o| diagnosis.predictions.iter().find(|p| p.experiment == *name && p.signal == o.name))
            .collect();
        let channels = channels?;
        let header: Vec<&str> = declared.outputs.iter().map(|o| o.name.as_str()).collect();
        let mut text = header.join(",") + "\n";
        for &t in times {
            let row: Vec<String> = channels.iter().map(|c| format!("{:e}", at(c, t))).collect();
            writeln!(text, "{}", row.join(",")).expect("a text takes everything");
        }
        Some((name.clone(), text))
    };
    declared.files.iter().filter_map(of_file).collect()
}

/// Interpolates a prediction at a time.
fn at(prediction: &Prediction, t: f64) -> f64 {
    let (times, values) = (&prediction.times, &prediction.after);
    let next = times.partition_point(|&s| s < t).min(times.len() - 1);
    if times[next] <= t || next == 0 {
        return values[next];
    }
    let share = (t - times[next - 1]) / (times[next] - times[next - 1]);
    values[next - 1] + share * (values[next] - values[next - 1])
}
