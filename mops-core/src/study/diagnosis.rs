//! What `task = "diagnosis"` is asked: as it is written down, and checked.

use super::{Study, Task};
use crate::experiment::Role;
use crate::mistake::Mistake;
use crate::model::AnalysisKind;

/// More effects than this are never added at once.
const MOST_EFFECTS: usize = 6;

/// How the search for what a model lacks goes.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnosisTask {
    /// Largest number of effects that are added, from 1 up.
    pub max_effects: usize,
    /// Probability with which something counts as missing where nothing is.
    pub level: f64,
    /// Kinds of effect that are tried; all of the catalogue where absent.
    pub effects: Option<Vec<String>>,
    /// Kinds of effect that are not tried.
    pub without: Vec<String>,
}

impl Default for DiagnosisTask {
    fn default() -> Self {
        Self { max_effects: 3, level: 0.01, effects: None, without: Vec::new() }
    }
}

impl DiagnosisTask {
    /// Whether a kind of effect is tried.
    pub fn tries(&self, effect: &str) -> bool {
        let named = |list: &[String]| list.iter().any(|name| name == effect);
        self.effects.as_deref().is_none_or(named) && !named(&self.without)
    }
}

/// Checks the numbers; that the names are those of effects is checked where the catalogue is known.
pub(super) fn check(task: DiagnosisTask, study: &Study) -> Result<DiagnosisTask, Mistake> {
    let within = |mistake: Mistake| mistake.within("diagnosis");
    if !(1..=MOST_EFFECTS).contains(&task.max_effects) {
        let fact = format!("a diagnosis adds 1 to {MOST_EFFECTS} effects, not {}", task.max_effects);
        let help = "3, the default, is more than most data can tell apart";
        return Err(within(Mistake::new("max-effects", fact).with_help(help)));
    }
    if !(task.level > 0.0 && task.level <= 0.2) {
        let fact = format!("the probability of a false alarm lies between 0 and 0.2, not at {}", task.level);
        let help = "0.01, the default, lets one sound model in a hundred count as lacking something";
        return Err(within(Mistake::new("level", fact).with_help(help)));
    }
    if task.effects.as_ref().is_some_and(Vec::is_empty) {
        return Err(within(
            Mistake::new("effects", "no effect is left to try").with_help("leave `effects` out to try them all"),
        ));
    }
    if let Some(name) = task.without.iter().find(|name| task.effects.iter().flatten().any(|e| e == *name)) {
        let fact = format!("`{name}` is both named and left out");
        let help = "remove it from `effects` or from `without`";
        return Err(within(Mistake::new(name, fact).with_help(help).within("without")));
    }
    if study.task == Task::Diagnosis {
        let measured = study.cases.iter().filter_map(|case| case.experiment.as_ref());
        if !measured.clone().any(|experiment| !experiment.channels.is_empty()) {
            let help = "add one under [experiments], with a `file` and the measured signals as `channels`";
            return Err(Mistake::new("experiments", "nothing was measured over time: there is no residual to look at")
                .with_help(help));
        }
        if !measured.clone().any(|e| e.role == Role::Calibration && !e.channels.is_empty()) {
            return Err(Mistake::new("experiments", "no experiment is there to estimate parameters from")
                .with_help("leave `role` out of at least one of them, or say role = \"calibration\""));
        }
    }
    Ok(task)
}

/// What experiments measure of models that are simulated: model, case, signals.
pub(super) fn measured(study: &Study) -> Vec<(usize, usize, Vec<String>)> {
    let mut jobs = Vec::new();
    for (case, experiment) in study.cases.iter().enumerate().filter_map(|(i, c)| Some((i, c.experiment.as_ref()?))) {
        for (model, (_, simulated)) in study.models.iter().enumerate() {
            let interface = simulated.interface();
            let offered = |signal: &String| interface.signals.iter().any(|s| s.name == *signal);
            let signals: Vec<String> =
                experiment.channels.iter().map(|channel| channel.signal.clone()).filter(offered).collect();
            if interface.analysis == AnalysisKind::Time && !signals.is_empty() {
                jobs.push((model, case, signals));
            }
        }
    }
    jobs
}
