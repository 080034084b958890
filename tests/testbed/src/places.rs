//! Names of places, and the places accepted as correct answers.

use crate::law::Spot;
use crate::plant::{Place, Plant};
use crate::trial::TrueEffect;

/// Returns the name of a place, as in results.
pub fn place(plant: &Plant, spot: Spot) -> String {
    match spot {
        Spot::Place(j) => {
            let kind = if matches!(plant.places[j], Place::Joint { .. }) { "joint" } else { "process" };
            format!("{kind}:{}", plant.states[plant.places[j].state()].0)
        }
        Spot::Actuator(i) => format!("actuator:{}", plant.inputs[i].0),
        Spot::Sensor(o) => format!("sensor:{}", plant.states[plant.outputs[o].state].0),
    }
}

/// Returns the places accepted as correct: the equation under any of its names, and both sides of a coupling.
pub fn accepted(plant: &Plant, effect: &str, spot: Spot) -> Vec<String> {
    let equation = |j: usize| {
        let name = plant.states[plant.places[j].state()].0;
        ["process", "joint", "extra_state"].map(|kind| format!("{kind}:{name}"))
    };
    match spot {
        Spot::Place(j) if effect == "backlash" && plant.traits.coupling.is_some() => {
            [equation(j), equation(1 - j)].concat()
        }
        Spot::Place(j) => equation(j).to_vec(),
        Spot::Actuator(i) => ["actuator", "extra_state"].map(|kind| format!("{kind}:{}", plant.inputs[i].0)).to_vec(),
        Spot::Sensor(_) => vec![place(plant, spot)],
    }
}

/// Returns the effects that equal the true one up to parameters and initial states of the baseline model, by its
/// equations.
pub fn equivalents(plant: &Plant, effects: &[TrueEffect]) -> Vec<(String, String)> {
    let [effect] = effects else { return Vec::new() };
    let groups: &[&[(&str, &str)]] = match plant.name {
        // A shift of x equals a force k x; with one input and one output, a delay of either is the same.
        "spring" => &[
            &[("sensor-bias", "sensor:x"), ("constant-force", "joint:x"), ("input-bias", "actuator:u")],
            &[("input-delay", "actuator:u"), ("sensor-delay", "sensor:x")],
            &[("actuator-lag", "actuator:u"), ("sensor-lag", "sensor:x")],
        ],
        "torsion" => &[&[("sensor-bias", "sensor:q"), ("constant-force", "joint:q")]],
        // For a drifting sensor, viscous friction appears as a constant force.
        "axis" => &[
            &[("constant-force", "joint:x"), ("input-bias", "actuator:u"), ("sensor-drift", "sensor:x")],
            &[("input-delay", "actuator:u"), ("sensor-delay", "sensor:x")],
            &[("actuator-lag", "actuator:u"), ("sensor-lag", "sensor:x")],
        ],
        "servo" => &[
            &[("constant-force", "joint:q"), ("input-bias", "actuator:i"), ("sensor-drift", "sensor:q")],
            &[("input-delay", "actuator:i"), ("sensor-delay", "sensor:q")],
            &[("actuator-lag", "actuator:i"), ("sensor-lag", "sensor:q")],
        ],
        "crane" => &[&[("constant-force", "joint:x"), ("input-bias", "actuator:u"), ("sensor-drift", "sensor:x")]],
        // A wrong sensor gain appears as a wrong gravity.
        "ball" => &[&[("constant-force", "joint:y"), ("sensor-drift", "sensor:y"), ("sensor-gain", "sensor:y")]],
        "drive" => &[&[("constant-force", "joint:q1"), ("input-bias", "actuator:u")]],
        "driven-pendulum" => &[
            &[("constant-force", "joint:q"), ("input-bias", "actuator:u")],
            &[("input-delay", "actuator:u"), ("sensor-delay", "sensor:q")],
        ],
        "two-masses" => &[&[("constant-force", "joint:q1"), ("input-bias", "actuator:u")]],
        "cascade" => &[
            &[("constant-force", "process:h1"), ("input-bias", "actuator:u")],
            &[("input-delay", "actuator:u"), ("sensor-delay", "sensor:h2")],
        ],
        "furuta-driven" => &[&[("constant-force", "joint:ph"), ("input-bias", "actuator:u")]],
        "tanks" => &[&[("constant-force", "process:h1"), ("input-bias", "actuator:u")]],
        "room" => &[&[
            ("constant-heat-gain", "process:T"),
            ("input-bias", "actuator:P"),
            ("input-bias", "actuator:To"),
            ("sensor-bias", "sensor:T"),
        ]],
        "jacket" => &[
            &[("constant-heat-gain", "process:Tj"), ("input-bias", "actuator:P")],
            &[("constant-heat-gain", "process:T"), ("input-bias", "actuator:Ti")],
        ],
        "circuit" => &[&[("constant-force", "process:V1"), ("input-bias", "actuator:u")]],
        _ => &[],
    };
    let same = |(class, place): &(&str, &str)| *class == effect.class && *place == effect.place;
    let group = groups.iter().find(|group| group.iter().any(same));
    let others = group.into_iter().flat_map(|group| group.iter()).filter(|pair| !same(pair));
    others.map(|(class, place)| ((*class).to_owned(), (*place).to_owned())).collect()
}
