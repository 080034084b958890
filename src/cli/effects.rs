//! The manual pages of effects.

use mops_core::{Dimension, Effect, Scope, Strength};

use super::tables::number;

/// The page of an effect: what it is, where it acts, its strengths.
pub(super) fn page(effect: &dyn Effect) -> String {
    let places: Vec<&str> = effect.ports().iter().map(|port| port.name()).collect();
    let companion =
        effect.companion().map_or_else(String::new, |other| format!(", with a {} as companion", other.name()));
    let mut text = format!(
        "{}\n\n{}\n\n    {}\n\nAn effect that a model may lack; {}. It acts at: {}{companion}.\n\nStrengths:\n",
        effect.name(),
        effect.about(),
        effect.formula(),
        effect.class().name(),
        places.join(", ")
    );
    for strength in effect.strengths() {
        text += &format!("  {} ({})\n      {}\n", strength.name, unit(strength.dimension), properties(strength));
    }
    text + &format!("\nSource: {}\n", effect.source())
}

/// What it is, where it lies, what it belongs to.
fn properties(strength: &Strength) -> String {
    let [low, high] = strength.bounds;
    let mut parts = vec![strength.about.to_owned()];
    match (low.is_finite(), high.is_finite()) {
        (true, true) => parts.push(format!("from {} to {}", number(low), number(high))),
        (true, false) => parts.push(format!("at least {}", number(low))),
        (false, true) => parts.push(format!("at most {}", number(high))),
        (false, false) => {}
    }
    parts.extend(strength.neutral.map(|neutral| format!("not there at {}", number(neutral))));
    if strength.scope == Scope::Experiment {
        parts.push("one for every experiment".to_owned());
    }
    if strength.fixed {
        parts.push("tried at some values, not fitted".to_owned());
    }
    parts.join("; ")
}

/// A unit by the quantities at the place: `output s/speed`.
fn unit(dimension: Dimension) -> String {
    let Dimension { output, position, speed, value, time } = dimension;
    let powers = [("output", output), ("position", position), ("speed", speed), ("value", value), ("s", time)];
    let side = |sign: i8| {
        let factors = powers.iter().filter(|(_, power)| power.signum() == sign);
        let factors = factors
            .map(|(name, power)| if power.abs() == 1 { (*name).to_owned() } else { format!("{name}{}", power.abs()) });
        factors.collect::<Vec<_>>().join(" ")
    };
    match (side(1), side(-1)) {
        (above, below) if below.is_empty() => {
            if above.is_empty() {
                "1".to_owned()
            } else {
                above
            }
        }
        (above, below) => format!("{}/{below}", if above.is_empty() { "1" } else { &above }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_told_by_what_is_at_the_place() {
        let cases = [
            (Dimension::ONE, "1"),
            (Dimension::OUTPUT.over(Dimension::SPEED.power(2)), "output/speed2"),
            (Dimension::PER_TIME, "1/s"),
            (Dimension::TIME, "s"),
        ];
        for (dimension, text) in cases {
            assert_eq!(unit(dimension), text);
        }
    }

    #[test]
    fn every_effect_has_a_page_with_its_strengths_and_a_source() {
        for effect in crate::catalogue().effects {
            let page = page(effect.as_ref());
            assert!(effect.strengths().iter().all(|s| page.contains(&format!("  {} (", s.name))), "{page}");
            assert!(page.contains("Source: ") && !page.contains(": .") && !effect.source().is_empty(), "{page}");
        }
    }
}
