//! Text of a diagnosis on the terminal: verdict, effects found, errors before and after, indistinguishable effects.

use mops_outcome::diagnosis::{Diagnosis, Verdict};

use crate::diagnosis::{errors, words};
use crate::numbers::significant;
use crate::terminal::{number, table};

/// Number of ranked effects that are printed.
const SHOWN: usize = 6;

/// Formats the result of a diagnosis.
pub(super) fn text(diagnosis: &Diagnosis, seconds: f64) -> String {
    let mut text = format!("\n{}\n", plain(&words::verdict(diagnosis)));
    if !diagnosis.found.is_empty() {
        text += &format!("\n{}", found(diagnosis));
    }
    for removed in &diagnosis.removed {
        text += &plain(&format!("\nterm removed from the model: {}\n", words::term(removed)));
    }
    if !diagnosis.before.is_empty() {
        text += &format!("\n{}", errors_table(diagnosis));
    }
    let remarks = diagnosis.found.iter().flat_map(words::remarks);
    let sentences: String = remarks.map(|sentence| format!("- {}\n", plain(&sentence))).collect();
    if !sentences.is_empty() {
        text += &format!("\n{sentences}");
    }
    if diagnosis.verdict != Verdict::None && !diagnosis.ranked.is_empty() {
        text += &format!("\n{}", ranking(diagnosis));
    }
    if !diagnosis.parameters.is_empty() && diagnosis.verdict != Verdict::None {
        text += &format!("\n{}", parameters(diagnosis));
    }
    if !diagnosis.noticeable.is_empty() {
        text += &format!("\n{}", noticeable(diagnosis));
    }
    if let Some(next) = &diagnosis.next_experiment {
        text += &format!("\nnext experiment: {}\n", plain(next));
    }
    for note in &diagnosis.notes {
        text += &format!("\nnote: {}", plain(note));
    }
    if !diagnosis.notes.is_empty() {
        text += "\n";
    }
    let [probability, chance] = [words::probability(diagnosis.probability), words::chance(diagnosis.p_value)];
    let of = words::of_what(diagnosis);
    text += &format!(
        "\nprobability {of} {probability}; p-value without a missing effect {chance}; {} simulations, {seconds:.2} s\n",
        diagnosis.simulations
    );
    text
}

/// Removes the backticks around names.
fn plain(text: &str) -> String {
    text.replace('`', "")
}

fn found(diagnosis: &Diagnosis) -> String {
    let mut rows = Vec::new();
    for found in &diagnosis.found {
        for (i, strength) in found.strengths.iter().enumerate() {
            // Cells common to all rows are filled in the first only.
            let once = |text: String| if i == 0 { text } else { String::new() };
            let [low, high] = strength.interval95.map_or([f64::NAN; 2], |ends| ends).map(|end| significant(end, 3));
            let known = strength.interval95.is_some();
            rows.push(vec![
                once(found.effect.clone()),
                once(found.places()),
                strength.name.clone(),
                significant(strength.value, 4),
                if known { low } else { String::new() },
                if known { high } else { String::new() },
                strength.unit.clone(),
                once(words::probability(found.probability)),
                once(words::probability(found.class_probability)),
                once(words::status(found).to_owned()),
            ]);
        }
    }
    let header = [
        "effect found",
        "place",
        "parameter",
        "value",
        "95 % from",
        "to",
        "unit",
        "probability",
        "class and place",
        "",
    ];
    table(&header, &[3, 4, 5, 7, 8], rows)
}

fn errors_table(diagnosis: &Diagnosis) -> String {
    let mut rows = Vec::new();
    for line in errors::lines(diagnosis) {
        let mut row = vec![line.experiment.name.clone(), line.experiment.role.name().to_owned(), line.label()];
        if line.channel.is_some() {
            row.extend(line.raw.map(|value| significant(value, 4)));
            row.extend([significant(line.noise, 4), line.unit.to_owned()]);
        }
        row.resize(7, String::new());
        row.extend(line.scaled.map(words::times));
        rows.push(row);
    }
    let header = ["experiment", "role", "channel", "before", "after", "noise", "unit", "before/noise", "after/noise"];
    table(&header, &[3, 4, 5, 7, 8], rows)
}

fn ranking(diagnosis: &Diagnosis) -> String {
    let rows = diagnosis.ranked.iter().take(SHOWN).map(|ranked| {
        let strengths: Vec<String> = ranked.strengths.iter().map(words::strength).collect();
        vec![
            ranked.effect.clone(),
            ranked.place.clone(),
            if ranked.probability.is_finite() { words::probability(ranked.probability) } else { String::new() },
            if ranked.bic_gain.is_finite() { significant(ranked.bic_gain, 4) } else { "screened".to_owned() },
            words::share(ranked.absorbed),
            ranked.failed.map_or("claimed", words::failed).to_owned(),
            strengths.join(", "),
        ]
    });
    let mut text = table(
        &["candidate", "place", "probability", "BIC gain", "absorbed", "result", "parameters"],
        &[2, 3, 4],
        rows.collect(),
    );
    if diagnosis.ranked.len() > SHOWN {
        text += &format!("... and {} more, in the report\n", diagnosis.ranked.len() - SHOWN);
    }
    text
}

fn parameters(diagnosis: &Diagnosis) -> String {
    let rows = diagnosis.parameters.iter().map(|p| {
        let [low, high] = p.interval95.map_or_else(Default::default, |ends| ends.map(|end| significant(end, 4)));
        let change =
            if p.before == 0.0 { String::new() } else { format!("{:+.1} %", 100.0 * (p.after / p.before - 1.0)) };
        vec![p.name.clone(), number(p.before), number(p.after), low, high, p.unit.clone(), change]
    });
    table(&["parameter", "before", "after", "95 % from", "to", "unit", "change"], &[1, 2, 3, 4, 6], rows.collect())
}

fn noticeable(diagnosis: &Diagnosis) -> String {
    let rows = diagnosis.noticeable.iter().map(|n| {
        let strength = &n.strength;
        vec![
            n.effect.clone(),
            n.place.clone(),
            strength.name.clone(),
            significant(strength.value, 3),
            strength.unit.clone(),
        ]
    });
    table(&["detectable effect", "place", "parameter", "at least", "unit"], &[3], rows.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::made_up;

    #[test]
    fn a_found_effect_stands_with_its_strength_and_the_errors_beside_the_noise() {
        insta::assert_snapshot!(text(&made_up::coulomb(), 4.2));
    }

    #[test]
    fn nothing_missing_says_from_where_on_it_would_have_been_noticed() {
        insta::assert_snapshot!(text(&made_up::nothing(), 4.2));
    }
}
