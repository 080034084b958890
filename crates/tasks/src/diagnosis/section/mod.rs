//! Report of a diagnosis: missing effects, errors before and after, evidence by place, candidate effects.

mod errors;
mod places;
mod ranking;
mod residuals;
mod spectrum;

use mops_content::{
    numbers::significant,
    section::{Block, Card, Part, Section},
};
use mops_outcome::diagnosis::{Diagnosis, Found, Verdict};

use super::words;

/// Returns the facts below the verdict: name and value.
pub(super) fn facts(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    let p_value = words::chance(diagnosis.p_value);
    let probability = (format!("Probability {}", words::of_what(diagnosis)), words::probability(diagnosis.probability));
    let probability = (!diagnosis.probability.is_nan()).then_some(probability);
    probability.into_iter().chain([("p-value if nothing is missing".to_owned(), p_value)]).collect()
}

/// Returns the sections, the main findings first.
pub(super) fn sections(diagnosis: &Diagnosis) -> Vec<Section> {
    let has_verdict = diagnosis.verdict != Verdict::None;
    let mut sections = Vec::new();
    let mut add = |title: &str, blocks: Vec<Block>| {
        if !blocks.is_empty() {
            sections.push(Section::new(title, blocks));
        }
    };
    if let Some(dependence) = &diagnosis.depends_on {
        let about = format!(
            "Without any formula, what the nominal model lacks depends on {}, with a gain in log-evidence of {} nats.",
            words::depends_on(dependence),
            significant(dependence.gain, 3)
        );
        let plots = places::dependence(diagnosis).into_iter().map(Block::Plots);
        add("What is missing", std::iter::once(Block::text(about)).chain(plots).collect());
    }
    if diagnosis.changes_study() {
        add(changes(diagnosis), missing(diagnosis));
    }
    if !diagnosis.before.is_empty() {
        let title = if has_verdict { "Errors before and after" } else { "Errors relative to the noise" };
        add(title, errors::blocks(diagnosis).into());
    }
    let residuals: Vec<Block> = residuals::groups(diagnosis).into_iter().map(Block::Plots).collect();
    if !residuals.is_empty() {
        let about = Block::text(residuals::WHITE_RESIDUALS);
        add("Residuals of the nominal model", std::iter::once(about).chain(residuals).collect());
    }
    if !diagnosis.places.is_empty() {
        let plots = places::groups(diagnosis).into_iter().map(Block::Plots);
        add("Evidence by place", places::blocks(diagnosis).into_iter().chain(plots).collect());
    }
    if !diagnosis.ranked.is_empty() {
        add("Candidate effects", ranking::blocks(diagnosis));
    }
    if !diagnosis.steps.is_empty() {
        add("Steps of the search", ranking::steps(diagnosis));
    }
    if !diagnosis.parameters.is_empty() && has_verdict {
        add("Parameter shifts", ranking::parameters(diagnosis).into());
    }
    if !diagnosis.noticeable.is_empty() {
        add("Detection limits", ranking::noticeable(diagnosis).into());
    }
    add("Next experiment", diagnosis.next_experiment.iter().map(Block::text).collect());
    add("Measured and predicted", residuals::predictions(diagnosis).into_iter().map(Block::Plots).collect());
    if !diagnosis.notes.is_empty() {
        add("Notes", vec![Block::Findings(diagnosis.notes.clone())]);
    }
    sections
}

/// Returns the title of the section on the changes of the study.
fn changes(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.found.is_empty() && diagnosis.removed.is_empty() { "Repaired study" } else { "Missing effects" }
}

/// Returns the added effects and the dropped terms.
fn missing(diagnosis: &Diagnosis) -> Vec<Block> {
    let dropped = diagnosis.removed.iter().map(|dropped| {
        Block::text(format!("The term {} of the nominal model is not needed and was dropped.", words::term(dropped)))
    });
    let files = [
        Part::text("The recalibrated study is "),
        Part::Code("repaired.toml".to_owned()),
        Part::text(", next to this page. Its predictions are in the folder "),
        Part::Code("predictions".to_owned()),
        Part::text("."),
    ];
    let effects = diagnosis.found.iter().map(|found| Block::Card(card(found)));
    effects.chain(dropped).chain([Block::Paragraph(files.into())]).collect()
}

fn card(found: &Found) -> Card {
    let companion = found.companion.as_ref().filter(|_| found.places() == found.place);
    let mut items: Vec<Vec<Part>> = Vec::new();
    for strength in &found.strengths {
        let interval = strength.interval95.map(|_| Part::Quiet(", 95 % interval".to_owned()));
        items.push(std::iter::once(Part::text(words::strength(strength))).chain(interval).collect());
    }
    let status = match words::status(found) {
        "claimed" => "Claimed",
        "given" => "Given by the study",
        _ => "Proposed, not claimed",
    };
    let mut known = vec![Part::text(status)];
    if found.class_probability.is_finite() {
        known.push(Part::text(format!(": probability of {} here ", words::class(&found.class))));
        known.push(Part::Strong(words::probability(found.class_probability)));
        if found.probability.is_finite() {
            known.push(Part::text(format!(", of this one {}", words::probability(found.probability))));
        }
    }
    known.push(Part::text(format!(". BIC lower by {}.", significant(found.bic_gain, 3))));
    items.push(known);
    items.extend(words::remarks(found).into_iter().map(|text| vec![Part::text(text)]));
    Card {
        title: format!("{} {}", found.effect, words::at(&found.places())),
        remark: companion.map_or_else(String::new, |place| format!("second place: {}", words::at(place))),
        formula: found.formula.clone(),
        items,
    }
}
