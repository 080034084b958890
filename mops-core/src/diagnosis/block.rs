//! Block `diagnosis` of `result.json`. Numbers are in the units of the study; non-finite numbers are null.

use super::{Diagnosis, ExperimentError, Found, Noticeable, Ranked, StrengthValue};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

/// Returns the block of a diagnosis.
fn block(diagnosis: &Diagnosis) -> Value {
    let moved = diagnosis.parameters.iter().map(
        |p| json!({ "name": p.name, "unit": p.unit, "before": p.before, "after": p.after, "std_error": p.std_error }),
    );
    let unexplained = diagnosis
        .unexplained
        .as_ref()
        .map(|u| json!({ "place": u.place, "share": u.share, "over": u.over, "table": u.table }));
    let evidence = diagnosis.evidence.iter().map(
        |e| json!({ "place": e.place, "evidence": e.evidence, "share": e.share, "freedom": e.freedom, "unit": e.unit }),
    );
    let starts = diagnosis.starts.iter().map(
        |(experiment, parameter, value)| json!({ "experiment": experiment, "parameter": parameter, "value": value }),
    );
    json!({
        "verdict": diagnosis.verdict,
        "probability": diagnosis.probability,
        "p_value": diagnosis.p_value,
        "found": diagnosis.found.iter().map(found).collect::<Value>(),
        "removed": diagnosis.removed,
        "steps": diagnosis.steps,
        "ranked": diagnosis.ranked.iter().map(ranked).collect::<Value>(),
        "unexplained": unexplained,
        "next_experiment": diagnosis.next_experiment,
        "before": errors(&diagnosis.before),
        "after": errors(&diagnosis.after),
        "noise": noise(diagnosis),
        "parameters": moved.collect::<Value>(),
        "starts": starts.collect::<Value>(),
        "noticeable": diagnosis.noticeable.iter().map(noticeable).collect::<Value>(),
        "evidence": evidence.collect::<Value>(),
        "notes": diagnosis.notes,
        "simulations": diagnosis.simulations,
    })
}

fn found(found: &Found) -> Value {
    let mut value = json!({
        "effect": found.effect,
        "place": found.place,
        "name": found.name,
        "class": found.class,
        "formula": found.formula,
        "strengths": strengths(&found.strengths),
        "details": found.strengths,
        "probability": found.probability,
        "bic_gain": found.bic_gain,
        "indistinguishable": found.indistinguishable,
        "stability": found.stability,
        "held_back": found.held_back,
    });
    if let Some(companion) = &found.companion {
        value["companion"] = json!(companion);
    }
    if let Some(only) = &found.only {
        value["experiment"] = json!(only);
    }
    value
}

fn ranked(ranked: &Ranked) -> Value {
    json!({
        "effect": ranked.effect,
        "place": ranked.place,
        "class": ranked.class,
        "probability": ranked.probability,
        "bic_gain": ranked.bic_gain,
        "strengths": strengths(&ranked.strengths),
        "absorbed": ranked.absorbed,
        "normalised": ranked.normalised,
    })
}

fn noticeable(noticeable: &Noticeable) -> Value {
    let StrengthValue { name, value, unit, .. } = &noticeable.strength;
    json!({ "effect": noticeable.effect, "place": noticeable.place, "strength": name, "value": value, "unit": unit })
}

/// Returns the values of an effect's parameters by name.
fn strengths(strengths: &[StrengthValue]) -> Value {
    strengths.iter().map(|s| (s.name.clone(), json!(s.value))).collect::<Map<_, _>>().into()
}

/// Returns the errors by experiment, and by channel within each.
fn errors(errors: &[ExperimentError]) -> Value {
    let by_channel = |channels: &[(String, f64)]| -> Map<String, Value> {
        channels.iter().map(|(name, rms)| (name.clone(), json!(rms))).collect()
    };
    let error = |error: &ExperimentError| {
        let channels = by_channel(&error.channels);
        let mut value = json!({ "role": error.role, "channels": channels, "normalised": error.normalised });
        if let Some(w) = &error.in_windows {
            let channels = by_channel(&w.channels);
            value["windows"] =
                json!({ "count": w.count, "length": w.length, "channels": channels, "normalised": w.normalised });
        }
        (error.name.clone(), value)
    };
    errors.iter().map(error).collect::<Map<_, _>>().into()
}

/// Returns the standard deviation of the noise by experiment, and by channel within each.
fn noise(diagnosis: &Diagnosis) -> Value {
    let mut noise = json!({});
    for prediction in &diagnosis.predictions {
        noise[&prediction.experiment][&prediction.signal] = json!(prediction.noise);
    }
    noise
}

/// Serialises the block of `result.json`; the derived form of [`Diagnosis`] has more, and is read back.
pub(crate) fn serialize<S: Serializer>(diagnosis: &Option<Diagnosis>, serializer: S) -> Result<S::Ok, S::Error> {
    diagnosis.as_ref().map(block).serialize(serializer)
}
