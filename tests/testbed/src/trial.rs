//! Simulated case: the input of a tool, and the truth.

use std::fmt::Write;
use std::path::Path;

/// Simulated case.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Name, from the plant, the missing effects, the size and the seed.
    pub name: String,
    /// Name of the plant.
    pub plant: String,
    /// Study file, `study.toml`.
    pub study: String,
    /// Names and contents of the data files.
    pub files: Vec<(String, String)>,
    /// Truth, hidden from the tool.
    pub truth: Truth,
}

/// Missing part of the baseline model.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Missing effects; empty if nothing is missing.
    pub effects: Vec<TrueEffect>,
    /// `effect`, `none` or `unexplained`; `none or unexplained` if the only model error is in the background.
    pub verdict: &'static str,
    /// Error of the baseline model refitted to the calibration experiment; 1 is the noise level.
    pub size: f64,
    /// Root mean square of the noise realisation, quantisation included, by experiment, relative to the declared noise
    /// level.
    pub noise_floor: Vec<(String, f64)>,
    /// True parameters of the baseline model.
    pub base_parameters: Vec<(String, f64)>,
    /// Model error in the background, if there is one.
    pub background: Option<Disturbance>,
    /// Effects and places that no data of this plant could distinguish from the true effect, if it is a single one.
    pub equivalents: Vec<(String, String)>,
}

/// Model error in the background of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// Source: `force`, `drift`, `coloured` or `state`.
    pub source: &'static str,
    /// Place of a force that depends on the state, or drifting parameter; empty otherwise.
    pub at: String,
    /// Deviation of the outputs that it causes, relative to that of an effect.
    pub share: f64,
    /// Deviation of the outputs that it causes, relative to the white noise.
    pub ratio: f64,
    /// Correlation time, s; `None` if it is a function of the state.
    pub time: Option<f64>,
}

/// Missing effect.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueEffect {
    /// Class: name of the effect, in kebab case; `unknown` for an effect outside every catalogue.
    pub class: String,
    /// Name of the formula, more specific than the class if that is `unknown`.
    pub formula: String,
    /// Place, such as `joint:q`.
    pub place: String,
    /// Places accepted as correct.
    pub accepted_places: Vec<String>,
    /// Names and values of the effect's parameters.
    pub strengths: Vec<(String, f64)>,
}

impl Trial {
    /// Returns the case with its records of selection as records of validation.
    #[must_use]
    pub fn without_selection(mut self) -> Self {
        self.study = self.study.replace("role     = \"selection\"", "role     = \"validation\"");
        self
    }

    /// Writes study.toml, the data files and truth.json into a folder, which is created if necessary.
    ///
    /// # Errors
    /// When the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join("study.toml"), &self.study)?;
        std::fs::write(folder.join("truth.json"), self.truth.json(&self.name, &self.plant))?;
        self.files.iter().try_for_each(|(name, content)| std::fs::write(folder.join(name), content))
    }
}

impl Truth {
    /// Returns the truth as JSON.
    pub fn json(&self, name: &str, plant: &str) -> String {
        let texts = |texts: &[String]| {
            let quoted: Vec<String> = texts.iter().map(|t| format!("\"{t}\"")).collect();
            format!("[{}]", quoted.join(", "))
        };
        let numbers = |pairs: &[(String, f64)]| {
            let entries: Vec<String> = pairs.iter().map(|(name, value)| format!("\"{name}\": {value:e}")).collect();
            format!("{{ {} }}", entries.join(", "))
        };
        let mut s = String::new();
        let mut line = |text: String| writeln!(s, "{text}").expect("writing to a string cannot fail");
        line(format!("{{ \"case\": \"{name}\", \"plant\": \"{plant}\", \"verdict\": \"{}\",", self.verdict));
        line("  \"effects\": [".to_owned());
        for (i, effect) in self.effects.iter().enumerate() {
            let TrueEffect { class, formula, place, accepted_places, strengths } = effect;
            let comma = if i + 1 < self.effects.len() { "," } else { "" };
            line(format!("    {{ \"class\": \"{class}\", \"formula\": \"{formula}\", \"place\": \"{place}\","));
            let (accepted, strengths) = (texts(accepted_places), numbers(strengths));
            line(format!("      \"accepted_places\": {accepted}, \"strengths\": {strengths} }}{comma}"));
        }
        let pairs: Vec<String> =
            self.equivalents.iter().map(|(class, place)| format!("[\"{class}\", \"{place}\"]")).collect();
        line(format!("  ],\n  \"size\": {:.4},", self.size));
        line(format!("  \"noise_floor\": {},", numbers(&self.noise_floor)));
        line(format!("  \"base_parameters\": {},", numbers(&self.base_parameters)));
        line(format!("  \"equivalents\": [{}] }}", pairs.join(", ")));
        s
    }
}
