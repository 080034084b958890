//! A simulated case: what a tool is given, and the truth.

use std::fmt::Write;
use std::path::Path;

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Name, from the plant, what is missing, the size and the seed.
    pub name: String,
    /// Name of the plant.
    pub plant: String,
    /// The study file, `study.toml`.
    pub study: String,
    /// Names and contents of the data files.
    pub files: Vec<(String, String)>,
    /// What a tool is not told.
    pub truth: Truth,
}

/// What is missing in the base model.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The effects; none where nothing is missing.
    pub effects: Vec<TrueEffect>,
    /// `effect`, `none` or `unexplained`.
    pub verdict: &'static str,
    /// Error of the base model refitted to the calibration experiment, 1 = noise.
    pub size: f64,
    /// Root mean square of the noise that was drawn, quantisation included, by experiment; in units of what is declared.
    pub noise_floor: Vec<(String, f64)>,
    /// True parameters of the base model.
    pub base_parameters: Vec<(String, f64)>,
    /// Effects and places that no data of this plant could tell from the true one, where it is single.
    pub equivalents: Vec<(String, String)>,
}

/// An effect that is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueEffect {
    /// Class: its name, in kebab case; `unknown` for one outside of every catalogue.
    pub class: String,
    /// Name of the formula, which says more than the class where that is `unknown`.
    pub formula: String,
    /// Place, such as `joint:q`.
    pub place: String,
    /// Places that are right answers.
    pub accepted_places: Vec<String>,
    /// Names and values of the strengths.
    pub strengths: Vec<(String, f64)>,
}

impl Trial {
    /// Writes study.toml, the data files and truth.json into a folder, which is made where it does not exist.
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
    /// The truth as JSON.
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
        let mut line = |text: String| writeln!(s, "{text}").expect("a string takes everything");
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
