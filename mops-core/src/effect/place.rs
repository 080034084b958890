//! Places of a model by their names.

use mops_language::suggestion;

use crate::effect::Port;
use crate::error::StudyError;

impl Port {
    /// Returns the port with this name among the ports of a model, such as `joint:phi`, `speed:v`, `process:level`,
    /// `actuator:u`, `sensor:theta`.
    ///
    /// # Errors
    /// Returns an error if there is no such port.
    pub fn named(text: &str, ports: &[Self]) -> Result<Self, StudyError> {
        let mut places = ports.iter().filter(|port| port.kind(ports).is_some());
        if let Some(port) = places.find(|port| port.to_string() == text) {
            return Ok(port.clone());
        }
        if ports.is_empty() {
            return Err(StudyError::here("this model has no places for effects: its equations are not accessible")
                .with_help("remove `effects`, or write the model as equations (`mops describe equations`)"));
        }
        let names: Vec<String> =
            ports.iter().filter(|port| port.kind(ports).is_some()).map(ToString::to_string).collect();
        // A kind alone, a name alone, or a name with another kind, is a near match.
        let name = text.split_once(':').map_or(text, |(_, name)| name);
        let meant: Vec<&str> = names.iter().filter(|n| n.split(':').any(|part| part == name)).map(|n| &**n).collect();
        let help = if meant.is_empty() {
            suggestion(text, names.iter().map(String::as_str))
        } else {
            format!("such as {}", meant.join(", "))
        };
        Err(StudyError::here(format!("the model has no place `{text}`")).with_help(help))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_by_its_kind_and_name() {
        let port = Port::Actuator { input: "u".into() };
        let ports = [port.clone(), Port::Sensor { output: "theta".into() }];
        assert_eq!(Port::named("actuator:u", &ports), Ok(port));
        let wrong = |text: &str| Port::named(text, &ports).unwrap_err().help.unwrap();
        assert_eq!(wrong("sensor:thta"), "did you mean `sensor:theta`?");
        assert_eq!(wrong("theta"), "such as sensor:theta");
        assert_eq!(wrong("joint:theta"), "such as sensor:theta");
        // The equation of a speed is no place of its own.
        let speed = Port::Speed { state: "v".into(), unit: None };
        let ports = [Port::Process { name: "v".into(), state: "v".into(), unit: None }, speed.clone()];
        assert_eq!(Port::named("speed:v", &ports), Ok(speed));
        assert_eq!(Port::named("process:v", &ports).unwrap_err().help.unwrap(), "such as speed:v");
        assert!(Port::named("joint:phi", &[]).unwrap_err().message.contains("no places"));
    }
}
