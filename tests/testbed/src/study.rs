//! Study file of a trial.

use std::fmt::Write;

use crate::plant::Plant;

/// Task of the study files.
pub const TASK: &str = "diagnosis";

/// Entries of a study besides the plant.
pub struct Declared<'a> {
    /// Name of the study.
    pub name: &'a str,
    /// Task.
    pub task: &'a str,
    /// Initial guess, lower and upper bound of each parameter.
    pub tuners: &'a [(f64, f64, f64)],
    /// Standard deviation of each output's noise, quantisation included.
    pub noise: &'a [f64],
    /// Names and roles of the experiments; the files have the same names.
    pub experiments: &'a [(&'a str, &'a str)],
}

/// Returns the study file.
pub fn text(plant: &Plant, declared: &Declared<'_>) -> String {
    let mut s = String::new();
    let table = |pairs: &[(&str, &str)]| {
        let entries: Vec<String> = pairs.iter().map(|(name, unit)| format!("{name} = \"{unit}\"")).collect();
        format!("{{ {} }}", entries.join(", "))
    };
    let mut line = |text: String| writeln!(s, "{text}").expect("writing to a string cannot fail");
    line(format!("[study]\nname = \"{}\"\ntask = \"{}\"\n", declared.name, declared.task));
    line("[models.plant.equations]".to_owned());
    line(format!("states     = {}", table(&plant.states[..plant.continuous()])));
    if !plant.inputs.is_empty() {
        line(format!("inputs     = {}", table(plant.inputs)));
    }
    let parameters: Vec<(&str, &str)> = plant.parameters.iter().map(|p| (p.name, p.unit)).collect();
    line(format!("parameters = {}", table(&parameters)));
    if !plant.constants.is_empty() {
        let values: Vec<(&str, String)> =
            plant.constants.iter().map(|(name, value, unit)| (*name, format!("{value} {unit}"))).collect();
        let pairs: Vec<(&str, &str)> = values.iter().map(|(name, value)| (*name, value.as_str())).collect();
        line(format!("constants  = {}", table(&pairs)));
    }
    line(plant.equations.trim_end().to_owned());
    line("\n[tuners]".to_owned());
    for (parameter, (start, min, max)) in plant.parameters.iter().zip(declared.tuners) {
        let (name, unit) = (parameter.name, parameter.unit);
        line(format!(
            "{name} = {{ start = {start:e}, min = {min:e}, max = {max:e}, unit = \"{unit}\", scale = \"log\" }}"
        ));
    }
    for (experiment, role) in declared.experiments {
        line(format!("\n[experiments.{experiment}]\nfile     = \"{experiment}.csv\"\ntime     = \"t\""));
        if !plant.inputs.is_empty() {
            let fixed: Vec<String> = plant
                .inputs
                .iter()
                .map(|(name, _)| format!("{name} = {{ column = \"{name}\", hold = \"zero\" }}"))
                .collect();
            line(format!("inputs   = {{ {} }}", fixed.join(", ")));
        }
        let channels: Vec<String> = plant
            .outputs
            .iter()
            .zip(declared.noise)
            .map(|(output, noise)| {
                let name = plant.states[output.state].0;
                format!("{name} = {{ column = \"{name}_m\", noise = {noise:e} }}")
            })
            .collect();
        line(format!("channels = {{ {} }}", channels.join(", ")));
        line(format!("free     = {}\nrole     = \"{role}\"", free(plant)));
    }
    line("\n[criteria]".to_owned());
    for output in plant.outputs {
        let name = plant.states[output.state].0;
        line(format!("{name} = {{ normalised-error = {{ signal = \"{name}\" }}, demand = 1.0 }}"));
    }
    s
}

/// Returns the free initial states of an experiment: a list, or a table if a state is not determined by a measurement.
fn free(plant: &Plant) -> String {
    let unmeasured = plant.traits.unmeasured;
    let one = |(i, (name, _)): (usize, &(&str, &str))| {
        let guess = unmeasured.iter().find(|(state, _)| *state == i);
        match guess {
            Some((_, [start, min, max])) => format!("{name} = {{ start = {start}, min = {min}, max = {max} }}"),
            None if unmeasured.is_empty() => format!("\"{name}\""),
            None => format!("{name} = {{}}"),
        }
    };
    let all: Vec<String> = plant.states[..plant.continuous()].iter().enumerate().map(one).collect();
    if unmeasured.is_empty() { format!("[{}]", all.join(", ")) } else { format!("{{ {} }}", all.join(", ")) }
}
