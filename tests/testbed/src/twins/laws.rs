//! Laws of all effects, by name.

use super::law::Law;
use super::{actuators, friction, joints, processes, sensors};

/// Returns the law of an effect; `None` for an unknown name or number of parameters.
pub(super) fn law(name: &str, parameters: &[f64]) -> Option<Law> {
    let kinds = [friction::law, joints::law, processes::law, actuators::law, sensors::law];
    kinds.iter().find_map(|law| law(name, parameters))
}
