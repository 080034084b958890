//! A study with a constant moved.

use super::{ParameterSource, Study};

impl Study {
    /// Returns the study with a constant of its models mapped to another value; `None` if a model refuses it.
    pub fn with_model_constant(&self, name: &str, to: impl Fn(f64) -> f64) -> Option<Self> {
        let mut moved = self.clone();
        for (_, model) in &mut moved.models {
            if let Some((_, value)) = model.constants().iter().find(|(constant, _)| constant.name == name) {
                *model = model.with_constant(name, to(*value))?;
            }
        }
        Some(moved)
    }

    /// Returns the study with a parameter mapped to another value in all jobs that give it a constant one; `None`
    /// outside of its range.
    pub fn with_constant_parameter(&self, name: &str, to: impl Fn(f64) -> f64) -> Option<Self> {
        let mut moved = self.clone();
        for job in &mut moved.jobs {
            let parameters = &self.models[job.model].1.interface().parameters;
            for (source, parameter) in job.parameters.iter_mut().zip(parameters) {
                let ParameterSource::Constant(value) = source else { continue };
                if parameter.variable.name != name {
                    continue;
                }
                *value = to(*value);
                if !(parameter.range[0]..=parameter.range[1]).contains(value) {
                    return None;
                }
            }
        }
        Some(moved)
    }
}
