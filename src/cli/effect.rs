//! Manual page of an effect.

use crate::terminal::number;
use mops_core::{Dimension, Effect, EffectParameter, PortKind, Scope};

/// Formats the page of an effect: definition, formula, places, parameters and source.
pub(super) fn page(effect: &dyn Effect) -> String {
    let places: Vec<&str> = effect.ports().iter().copied().map(place).collect();
    let mut page = format!("{}\n\n{}\n\n    {}\n\n", effect.name(), effect.about(), effect.formula());
    page += &format!("Class: {}. Acts at: {}", effect.class().name(), places.join("; "));
    if let Some(companion) = effect.companion() {
        page += &format!(". Second port: {}", place(companion));
    }
    page += ".\n";
    if let Some(wider) = effect.form_of() {
        page += &format!("Special case of: {wider}.\n");
    }
    if effect.states() > 0 {
        let free = if effect.free_starts().is_empty() { "" } else { ", with a free initial state in each experiment" };
        page += &format!("Additional states: {}{free}.\n", effect.states());
    }
    if effect.memory() > 0 && !effect.free_starts().is_empty() {
        page += "Its initial output is free in each experiment.\n";
    }
    page += "\nParameters:\n";
    for strength in effect.strengths() {
        page += &format!("  {} ({})\n      {}\n", strength.name, facts(strength), strength.about);
    }
    page + &format!("\nSource: {}.\n", effect.source())
}

fn place(kind: PortKind) -> &'static str {
    match kind {
        PortKind::Joint => "a joint (position q, speed v; added to its equation, positive forward)",
        PortKind::Process => "a first-order state (x; added to its equation)",
        PortKind::Actuator => "an actuator (command u)",
        PortKind::Sensor => "a sensor (signal y)",
    }
}

fn facts(strength: &EffectParameter) -> String {
    let mut facts = vec![unit(strength.dimension)];
    match strength.bounds {
        [low, high] if low.is_finite() && high.is_finite() => {
            facts.push(format!("from {} to {}", number(low), number(high)));
        }
        [low, _] if low.is_finite() => facts.push(format!("at least {}", number(low))),
        _ => facts.push("of either sign".into()),
    }
    match strength.neutral {
        Some(neutral) if neutral.is_finite() => facts.push(format!("null value {}", number(neutral))),
        Some(_) => facts.push("null value infinity".into()),
        None => {}
    }
    if strength.fixed {
        facts.push("fixed at its grid value".into());
    }
    if strength.scope == Scope::Experiment {
        facts.push("one per experiment".into());
    }
    facts.join(", ")
}

/// Formats the unit of a parameter as powers of the units at the place.
fn unit(dimension: Dimension) -> String {
    let powers = [
        ("added term", dimension.output),
        ("position", dimension.position),
        ("speed", dimension.speed),
        ("value", dimension.value),
        ("s", dimension.time),
    ];
    let text = |sign: i8| {
        let of = powers.iter().filter(|(_, power)| power.signum() == sign);
        let of =
            of.map(|(name, power)| if power.abs() > 1 { format!("{name}^{}", power.abs()) } else { (*name).into() });
        of.collect::<Vec<String>>()
    };
    let (above, below) = (text(1), text(-1));
    let above = if above.is_empty() { "1".into() } else { above.join(" ") };
    if below.is_empty() {
        return format!("unit: {above}");
    }
    format!("unit: {above} per {}", if below.len() > 1 { format!("({})", below.join(" ")) } else { below[0].clone() })
}

#[cfg(test)]
mod tests {
    use super::unit;
    use mops_core::Dimension;

    #[test]
    fn a_unit_is_spelt_out_as_powers() {
        assert_eq!(unit(Dimension::ONE), "unit: 1");
        assert_eq!(unit(Dimension::OUTPUT.over(Dimension::SPEED.power(2))), "unit: added term per speed^2");
        let mass = Dimension::OUTPUT.over(Dimension::SPEED).over(Dimension::PER_TIME);
        assert_eq!(unit(mass), "unit: added term s per speed");
    }
}
