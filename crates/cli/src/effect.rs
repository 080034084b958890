//! Manual page of an effect.

use mops_core::{
    Effect,
    effect::{Dimension, EffectParameter, PortKind, Scope},
};

use crate::terminal::number;

/// Formats the page of an effect: definition, formula, places, parameters and source.
pub(super) fn page(effect: &dyn Effect) -> String {
    let mut page = format!("{}\n\n{}\n\n    {}\n\n", effect.name(), effect.about(), effect.formula());
    for fact in facts(effect) {
        page += &format!("{fact}.\n");
    }
    page += "\nParameters:\n";
    for parameter in effect.parameters() {
        page += &format!("  {} ({})\n      {}\n", parameter.name, parameter_facts(parameter), parameter.about);
    }
    page + &format!("\nSource: {}.\n", effect.source())
}

/// Returns the class of an effect, its places, and its states.
pub(super) fn facts(effect: &dyn Effect) -> Vec<String> {
    let places: Vec<&str> = effect.ports().iter().copied().map(place).collect();
    let second = match effect.second_port() {
        Some(kind) => format!(". Second port: {}", place(kind)),
        None if effect.acts_between() => {
            "; with a joint as `companion`, between two joints (relative position and speed, with the reaction)"
                .to_owned()
        }
        None => String::new(),
    };
    let mut facts = vec![format!("Class: {}. Acts at: {}{second}", effect.class().name(), places.join("; "))];
    if let Some(wider) = effect.form_of() {
        facts.push(format!("Special case of: {wider}"));
    }
    if effect.states() > 0 {
        let free = if effect.free_starts().is_empty() { "" } else { ", with a free initial state in each experiment" };
        facts.push(format!("Additional states: {}{free}", effect.states()));
    }
    if effect.hysteresis_states() > 0 && !effect.free_starts().is_empty() {
        facts.push("Its initial output is free in each experiment".to_owned());
    }
    facts
}

fn place(kind: PortKind) -> &'static str {
    match kind {
        PortKind::Joint => "a joint (position q, speed v; added to its equation, positive forward)",
        PortKind::Speed => "a speed whose position is no state (v; added to its equation)",
        PortKind::Process => "a first-order state (x; added to its equation)",
        PortKind::Actuator => "an actuator (command u)",
        PortKind::Sensor => "a sensor (signal y)",
    }
}

/// Returns the unit, range and null value of a parameter.
pub(super) fn parameter_facts(parameter: &EffectParameter) -> String {
    let mut facts = vec![unit(parameter.dimension)];
    match parameter.bounds {
        [low, high] if low.is_finite() && high.is_finite() => {
            facts.push(format!("from {} to {}", number(low), number(high)));
        }
        [low, _] if low.is_finite() => facts.push(format!("at least {}", number(low))),
        _ => facts.push("of either sign".into()),
    }
    match parameter.null_value {
        Some(neutral) if neutral.is_finite() => facts.push(format!("null value {}", number(neutral))),
        Some(_) => facts.push("null value infinity".into()),
        None => {}
    }
    if parameter.fixed {
        facts.push("fixed at its grid value".into());
    }
    if parameter.scope == Scope::Experiment {
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
    use mops_core::effect::Dimension;

    #[test]
    fn a_unit_is_spelt_out_as_powers() {
        assert_eq!(unit(Dimension::ONE), "unit: 1");
        assert_eq!(unit(Dimension::OUTPUT.over(Dimension::SPEED.power(2))), "unit: added term per speed^2");
        let mass = Dimension::OUTPUT.over(Dimension::SPEED).over(Dimension::PER_TIME);
        assert_eq!(unit(mass), "unit: added term s per speed");
    }
}
