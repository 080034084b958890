//! Tools that search for missing effects, and their answers.

use std::sync::Arc;
use std::time::Instant;

use mops::{
    Catalogue, Study, Watch,
    core::{Effect, Role, run::Quiet, task::DiagnosisTask},
    diagnosis::{Options, Settings, brute_force, diagnose},
    file,
    language::files::Files,
    math,
    outcome::diagnosis::{Diagnosis, ExperimentError, Found, Verdict},
};

/// Common inputs of the tools.
#[derive(Clone, Copy)]
pub(crate) struct Tools<'a> {
    /// Models and candidate effects.
    pub catalogue: &'a Catalogue,
    /// Observer, which may request a stop.
    pub watch: &'a dyn Watch,
    /// Seed of the random numbers of the tools.
    pub seed: u64,
    /// Settings of the diagnosis.
    pub settings: &'a Settings,
}

/// Data files in memory.
pub(crate) struct InMemory<'a>(pub &'a [(String, String)]);

impl Files for InMemory<'_> {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        let file = self.0.iter().find(|(name, _)| name == path);
        file.map(|(_, content)| content.as_bytes().to_vec()).ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

impl Tools<'_> {
    /// Reads a study.
    ///
    /// # Errors
    /// If the study has a mistake; the error is the first one as a sentence.
    pub fn study(&self, name: &str, text: &str, files: &dyn Files) -> Result<Study, String> {
        let file = file::read(self.catalogue, name, text, &[], files);
        let mut study = file.map_err(|mistake| mistake.to_string())?.study;
        study.set_seed(self.seed);
        Ok(study)
    }

    /// Runs the diagnosis on one thread; returns it with its time in s.
    ///
    /// # Errors
    /// If the study cannot be diagnosed; the error is the reason.
    pub fn diagnose(&self, study: &Study) -> Result<(Diagnosis, f64), String> {
        let task = study.options::<DiagnosisTask>().cloned().unwrap_or_default();
        let tried = |effect: &&Arc<dyn Effect>| task.tries(effect.name());
        let effects: Vec<Arc<dyn Effect>> = self.catalogue.effects.iter().filter(tried).cloned().collect();
        let (max_effects, level) = (task.max_effects, task.level);
        let options = Options { max_effects, level, settings: self.settings.clone() };
        let started = Instant::now();
        let done = one_thread().install(|| diagnose(study, &effects, &options, &Quiet(self.watch)));
        Ok((done.map_err(|why| why.to_string())?, started.elapsed().as_secs_f64()))
    }

    /// Runs brute force on one thread: refits the model with each effect in turn and selects the smallest BIC.
    ///
    /// # Errors
    /// If the study cannot be handled; the error is the reason.
    pub fn brute_force(&self, study: &Study) -> Result<Answer, String> {
        let started = Instant::now();
        let done = one_thread().install(|| brute_force(study, &self.catalogue.effects)).map_err(|why| why.message)?;
        let found: Vec<(Named, f64)> = done.best.into_iter().map(|best| (best, f64::NAN)).collect();
        Ok(Answer {
            verdict: if found.is_empty() { Verdict::None } else { Verdict::Effect },
            probability: f64::NAN,
            p_value: f64::NAN,
            set: found.iter().map(|(named, _)| named.clone()).collect(),
            found,
            statements: Vec::new(),
            depends_on: None,
            remaining: None,
            records: Vec::new(),
            declared: Vec::new(),
            strengths: Vec::new(),
            unexplained_at: None,
            simulations: done.simulations,
            seconds: started.elapsed().as_secs_f64(),
        })
    }
}

/// Returns a pool of one thread, so that times are comparable.
fn one_thread() -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started")
}

/// Effect and its place.
pub(crate) type Named = (String, String);

/// Statement on class and place of an effect found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statement {
    /// Class and place of the effect, then those that the data cannot distinguish from these.
    pub entries: Vec<Named>,
    /// Probability that one of the entries is right.
    pub probability: f64,
    /// True if class and place are claimed.
    pub claimed: bool,
}

/// Coordinate on which what is missing depends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Dependence {
    /// Coordinate, such as `speed`.
    pub coordinate: String,
    /// One place, or both of a force between two places.
    pub places: Vec<String>,
}

/// Errors on an experiment, in units of the noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordError {
    /// Role of the experiment.
    pub role: Role,
    /// Error of the declared model.
    pub before: f64,
    /// Error with the effects found.
    pub after: f64,
    /// Number of samples of all channels.
    pub samples: usize,
}

/// Estimate of a declared parameter: name, value, 95 % confidence interval.
pub(crate) type Estimate = (String, f64, Option<[f64; 2]>);

/// Answer of a tool.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answer {
    /// Verdict.
    pub verdict: Verdict,
    /// Probability of the verdict.
    pub probability: f64,
    /// Probability of such a residual if nothing is missing.
    pub p_value: f64,
    /// Missing effects, with their probabilities.
    pub found: Vec<(Named, f64)>,
    /// Statements on class and place of these effects, in the same order; empty if the tool makes none.
    pub statements: Vec<Statement>,
    /// Coordinate on which what the declared model lacks depends.
    pub depends_on: Option<Dependence>,
    /// Coordinate on which what remains with the effects found depends.
    pub remaining: Option<Dependence>,
    /// Errors before and after, by experiment.
    pub records: Vec<RecordError>,
    /// Estimates of the declared parameters with the effects found.
    pub declared: Vec<Estimate>,
    /// Effects that the data cannot distinguish from the first one, itself included.
    pub set: Vec<Named>,
    /// Parameters of the effects: index of the effect, name, value, interval.
    pub strengths: Vec<(usize, String, f64, Option<[f64; 2]>)>,
    /// Place of an unexplained effect.
    pub unexplained_at: Option<String>,
    /// Number of simulations.
    pub simulations: usize,
    /// Time on one thread, in s.
    pub seconds: f64,
}

impl Statement {
    fn of(found: &Found) -> Self {
        let alike = found.alike.iter().filter_map(|entry| entry.split_once(" at "));
        let alike = alike.map(|(class, place)| (class.to_owned(), place.to_owned()));
        Self {
            entries: std::iter::once((found.class.clone(), found.place.clone())).chain(alike).collect(),
            probability: found.class_probability,
            claimed: found.claimed,
        }
    }
}

impl Dependence {
    fn of(found: &mops::outcome::diagnosis::Dependence) -> Self {
        let places = std::iter::once(&found.place).chain(&found.other).cloned().collect();
        Self { coordinate: found.coordinate.clone(), places }
    }
}

/// Returns the errors before and after, by experiment.
fn records(diagnosis: &Diagnosis) -> Vec<RecordError> {
    let of = |(before, after): (&ExperimentError, &ExperimentError)| {
        let own = diagnosis.predictions.iter().filter(|prediction| prediction.experiment == before.name);
        RecordError {
            role: before.role,
            before: before.normalised,
            after: after.normalised,
            samples: own.map(|prediction| prediction.measured.len()).sum(),
        }
    };
    diagnosis.before.iter().zip(&diagnosis.after).map(of).collect()
}

impl Answer {
    /// Extracts the answer of a diagnosis.
    pub fn of(diagnosis: &Diagnosis, seconds: f64) -> Self {
        let found = &diagnosis.found;
        let first = found.first();
        let rivals = first.iter().flat_map(|f| &f.indistinguishable).map(|r| (r.effect.clone(), r.place.clone()));
        let itself = first.iter().map(|f| (f.effect.clone(), f.place.clone()));
        let mut set: Vec<Named> = itself.chain(rivals).collect();
        set.sort();
        set.dedup();
        let strengths = found
            .iter()
            .enumerate()
            .flat_map(|(i, f)| f.strengths.iter().map(move |s| (i, s.name.clone(), s.value, s.interval95)));
        Self {
            verdict: diagnosis.verdict,
            probability: diagnosis.probability,
            p_value: diagnosis.p_value,
            found: found.iter().map(|f| ((f.effect.clone(), f.place.clone()), f.probability)).collect(),
            statements: found.iter().map(Statement::of).collect(),
            depends_on: diagnosis.depends_on.as_ref().map(Dependence::of),
            remaining: diagnosis.remaining.as_ref().map(Dependence::of),
            records: records(diagnosis),
            declared: diagnosis.parameters.iter().map(|p| (p.name.clone(), p.after, p.interval95)).collect(),
            set,
            strengths: strengths.collect(),
            unexplained_at: diagnosis.unexplained.as_ref().map(|u| u.place.clone()),
            simulations: diagnosis.simulations,
            seconds,
        }
    }

    /// Returns true if another answer has the same verdict and the same effects at the same places, in any order.
    pub fn agrees(&self, other: &Self) -> bool {
        let named = |answer: &Self| {
            let mut all: Vec<Named> = answer.found.iter().map(|(named, _)| named.clone()).collect();
            all.sort();
            all
        };
        self.verdict == other.verdict && named(self) == named(other)
    }

    /// Returns the ratio of the errors after and before on the experiments of a role; `None` without experiments or
    /// effects.
    pub fn change(&self, role: Role) -> Option<f64> {
        let own = || self.records.iter().filter(|record| record.role == role);
        let squares = |error: fn(&RecordError) -> f64| own().map(|record| math::powi(error(record), 2)).sum::<f64>();
        let is_known = own().next().is_some() && !self.found.is_empty();
        is_known.then(|| (squares(|record| record.after) / squares(|record| record.before)).sqrt())
    }

    /// Returns true if the declared model exceeds the noise level on a calibration record by more than a tenth, beyond
    /// chance: three standard deviations of the root mean square of as many independent normal numbers. N.B.: on other
    /// records, errors of the parameters alone may be larger than the noise.
    #[allow(clippy::cast_precision_loss)]
    pub fn exceeds_noise(&self) -> bool {
        let chance = |samples: usize| 3.0 / (2.0 * samples as f64).sqrt();
        let calibration = self.records.iter().filter(|record| record.role == Role::Calibration);
        calibration.map(|record| record.before - chance(record.samples)).any(|least| least > 1.1)
    }

    /// Returns the first effect; `None` if the verdict is not `effect`.
    pub fn first(&self) -> Option<&Named> {
        self.found.first().map(|(named, _)| named).filter(|_| self.verdict == Verdict::Effect)
    }
}

/// Returns the name of a verdict in results.
pub(crate) fn spelt(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Effect => "effect",
        Verdict::None => "none",
        Verdict::Unexplained => "unexplained",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::answers;

    #[test]
    fn errors_are_compared_by_role_and_with_the_noise_level() {
        let record = |role, before, after| RecordError { role, before, after, samples: 200 };
        let mut answer = answers::coulomb();
        let both = [record(Role::Validation, 3.0, 1.5), record(Role::Validation, 4.0, 2.0)];
        answer.records = [record(Role::Selection, 2.0, 3.0)].into_iter().chain(both).collect();
        assert_eq!(answer.change(Role::Validation), Some(0.5));
        assert_eq!((answer.change(Role::Selection), answer.change(Role::Calibration)), (Some(1.5), None));
        // Of 200 numbers the root mean square has a standard deviation of 0.05.
        for (before, exceeds) in [(1.24, false), (1.26, true)] {
            answer.records = vec![record(Role::Selection, 5.0, 5.0), record(Role::Calibration, before, before)];
            assert_eq!(answer.exceeds_noise(), exceeds);
        }
    }

    #[test]
    fn answers_agree_on_verdict_and_effects_whatever_their_order() {
        let mut both = answers::coulomb();
        both.found.push((("sensor-bias".to_owned(), "sensor:y".to_owned()), 1.0));
        let mut other = both.clone();
        other.found.reverse();
        assert!(both.agrees(&other) && !both.agrees(&answers::coulomb()));
        assert!(!answers::nothing().agrees(&both));
    }
}
