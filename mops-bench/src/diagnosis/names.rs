//! Translation of names of the test bed to names of the catalogue.

use mops::{effects::effects, math};
use mops_testbed::TrueEffect;

/// Returns the effects of the catalogue that correspond to an effect of the test bed.
pub(crate) fn names<'n>(class: &'n str, strengths: &[(String, f64)]) -> Vec<&'n str> {
    match class {
        "input-quadratic" => vec!["quadratic-input"],
        "rate-limit" => vec!["input-rate-limit"],
        "dahl" => vec!["dahl-friction"],
        "cubic-damping" => vec!["cubic-drag"],
        "hidden-thermal-mass" => vec!["hidden-store"],
        "constant-heat-gain" => vec!["constant-force"],
        "sensor-dead-zone" if parameter(strengths, "shifts") == 0.0 => vec!["sensor-gap"],
        "overflow" if parameter(strengths, "share") > 0.0 => vec!["spill-over"],
        // For these effects the parameters determine the special case.
        "sensor-dead-zone" | "overflow" => vec![class],
        same => {
            let forms =
                effects().into_iter().filter(|effect| effect.form_of() == Some(same)).map(|effect| effect.name());
            std::iter::once(same).chain(forms).collect()
        }
    }
}

/// Returns the class of an effect of the catalogue.
pub(crate) fn class_of(name: &str) -> Option<&'static str> {
    effects().iter().find(|effect| effect.name() == name).map(|effect| effect.class().name())
}

/// Returns the coordinates on which the force of an effect of the test bed, or the change of its input, depends; empty
/// if there is none.
pub(crate) fn coordinates(class: &str) -> &'static [&'static str] {
    match class {
        "coulomb-friction"
        | "stribeck-friction"
        | "stiction"
        | "asymmetric-friction"
        | "dahl"
        | "viscous-friction"
        | "quadratic-drag"
        | "cubic-damping" => &["speed"],
        "position-dependent-friction" | "bouc-wen" => &["speed", "position", "position modulo one turn"],
        "linear-stiffness" | "quadratic-stiffness" | "cubic-stiffness" | "cogging" | "end-stop" => {
            &["position", "position modulo one turn"]
        }
        "backlash" => &["deflection", "position", "input"],
        "leak" | "overflow" | "linear-loss" | "radiation-loss" => &["level"],
        "input-saturation" | "input-dead-zone" | "input-asymmetry" | "input-quadratic" | "input-quantisation" => {
            &["input"]
        }
        "input-delay" | "actuator-lag" => &["delayed input"],
        _ => &[],
    }
}

/// Returns a parameter by its name in the test bed; NaN if it does not exist.
fn parameter(strengths: &[(String, f64)], wanted: &str) -> f64 {
    strengths.iter().find(|(name, _)| name == wanted).map_or(f64::NAN, |(_, value)| *value)
}

/// Returns the true parameters by their names in the catalogue, for those with the same meaning.
pub(crate) fn strengths(effect: &TrueEffect) -> Vec<(&'static str, f64)> {
    let of = |name: &str| parameter(&effect.strengths, name);
    match effect.class.as_str() {
        "coulomb-friction" => vec![("c", of("torque"))],
        "stribeck-friction" => {
            vec![("c", of("coulomb")), ("rise", of("static") / of("coulomb") - 1.0), ("vs", of("speed"))]
        }
        "stiction" => vec![("c", of("coulomb")), ("rise", of("static") / of("coulomb") - 1.0)],
        "asymmetric-friction" => {
            let (forward, backward) = (of("forward"), of("backward"));
            vec![("c", 0.5 * (forward + backward)), ("skew", (forward - backward) / (forward + backward))]
        }
        "position-dependent-friction" => vec![("c", of("torque")), ("a", of("depth")), ("n", of("waves"))],
        "dahl" => vec![("c", of("torque")), ("y", of("torque") / of("stiffness"))],
        "viscous-friction" => vec![("d", of("damping"))],
        "quadratic-drag" | "cubic-damping" => vec![("k", of("drag"))],
        "linear-stiffness" => vec![("k", of("stiffness")), ("rest", of("rest"))],
        "cubic-stiffness" | "quadratic-stiffness" => vec![("k", of("stiffness"))],
        "cogging" => vec![("a", of("torque")), ("n", of("waves"))],
        "flexible-mode" => vec![("m", of("mass")), ("w", of("frequency")), ("d", of("damping"))],
        "bouc-wen" => {
            // Saturation value of z: (1/(beta + gamma))^(1/n).
            let (sum, n) = (of("beta") + of("gamma"), of("power"));
            let end = math::powf(sum, -1.0 / n);
            vec![("c", of("stiffness") * end), ("y", end), ("n", n)]
        }
        "constant-force" => vec![("f", of("force"))],
        "constant-heat-gain" => vec![("f", of("power"))],
        "periodic-disturbance" => vec![("a", of("amplitude")), ("w", of("frequency"))],
        "wind-gust" => vec![("a", of("amplitude")), ("from", of("from")), ("length", of("length"))],
        "mass-loss" | "damping-drift" | "input-gain-drift" => vec![("r", of("rate"))],
        "damping-step" => vec![("d", of("damping")), ("from", of("from"))],
        "input-gain-step" => vec![("g", of("gain")), ("from", of("from"))],
        "leak" => vec![("k", of("flow")), ("hole", of("height"))],
        "overflow" if of("share") > 0.0 => vec![("level", of("level")), ("share", of("share"))],
        "overflow" => vec![("level", of("level"))],
        "linear-loss" => vec![("k", of("flow"))],
        "radiation-loss" => vec![("k", of("coefficient"))],
        "hidden-thermal-mass" => vec![("k", of("coupling")), ("tau", of("time"))],
        "input-delay" | "sensor-delay" => vec![("delay", of("delay"))],
        "actuator-lag" | "sensor-lag" => vec![("tau", of("time"))],
        "input-saturation" => vec![("limit", of("limit"))],
        "input-dead-zone" => vec![("width", of("width"))],
        "input-bias" | "sensor-bias" => vec![("b", of("bias"))],
        "input-quadratic" => vec![("a", of("curvature"))],
        "input-quantisation" | "sensor-quantisation" => vec![("step", of("step"))],
        "torque-ripple" => vec![("a", of("share")), ("n", of("waves"))],
        "rate-limit" => vec![("rate", of("rate"))],
        "backlash" => vec![("gap", 2.0 * of("gap"))],
        "sensor-gain" => vec![("g", of("gain") - 1.0)],
        "sensor-drift" => vec![("r", of("rate"))],
        "sensor-dead-zone" => vec![("width", of("width")), ("centre", of("middle"))],
        "eccentricity" => vec![("a", of("amplitude"))],
        "cross-talk" => vec![("k", of("share"))],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parameter with a name that is not in the catalogue would never be compared.
    #[test]
    fn every_effect_and_every_parameter_of_the_test_bed_is_in_the_catalogue() {
        let catalogue = effects();
        for effect in mops_testbed::effects() {
            for value in [0.0, 1.0] {
                let parameters = ["shifts", "share"].map(|name| (name.to_owned(), value));
                for name in names(effect.name, &parameters) {
                    let known = catalogue.iter().find(|e| e.name() == name);
                    let known = known.unwrap_or_else(|| panic!("no effect `{name}`"));
                    let truth = TrueEffect {
                        class: effect.name.into(),
                        formula: String::new(),
                        place: "actuator:u".into(),
                        accepted_places: Vec::new(),
                        strengths: parameters.to_vec(),
                    };
                    for (strength, _) in strengths(&truth) {
                        assert!(known.parameters().iter().any(|s| s.name == strength), "{name} has no `{strength}`");
                    }
                }
            }
        }
    }
}
