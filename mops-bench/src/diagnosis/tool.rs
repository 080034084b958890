//! What is asked of a tool that looks for missing effects, and what it answers.

use std::time::Instant;

use mops::core::Quiet;
use mops::core::file::{self, Files};
use mops::discrepancy::{Diagnosis, Verdict, brute_force};
use mops::{Catalogue, Study, Watch};

use mops::{Options, solve};

/// Where the tools find what they need.
#[derive(Clone, Copy)]
pub(crate) struct Tools<'a> {
    /// Models, and the effects that are tried.
    pub catalogue: &'a Catalogue,
    /// Who may end it.
    pub watch: &'a dyn Watch,
    /// Seed of the tools' own random numbers.
    pub seed: u64,
}

/// Data files that are already read.
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
    /// A study, read as every study is.
    ///
    /// # Errors
    /// The first mistake in it, as a sentence.
    pub fn study(&self, name: &str, text: &str, files: &dyn Files) -> Result<Study, String> {
        let file = file::read(self.catalogue, name, text, &[], files);
        let mut study = file.map_err(|mistake| mistake.to_string())?.study;
        study.set_seed(self.seed);
        Ok(study)
    }

    /// The diagnosis on one thread, and the seconds it took.
    ///
    /// # Errors
    /// The study cannot be diagnosed: why.
    pub fn diagnose(&self, study: Study) -> Result<(Diagnosis, f64), String> {
        let options = Options { effects: self.catalogue.effects.clone(), jobs: Some(1), ..Options::default() };
        let begun = Instant::now();
        let solved = solve(study, &options, &Quiet(self.watch)).map_err(|why| why.to_string())?;
        Ok((solved.diagnosis.expect("that was the task"), begun.elapsed().as_secs_f64()))
    }
}

impl Tools<'_> {
    /// What brute force says, on one thread: the model refitted with every effect in turn, and the least BIC believed.
    ///
    /// # Errors
    /// The study cannot be treated: why.
    pub fn brute_force(&self, study: &Study) -> Result<Answer, String> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
        let begun = Instant::now();
        let done = threads.install(|| brute_force(study, &self.catalogue.effects)).map_err(|why| why.message)?;
        let found: Vec<(Named, f64)> = done.best.into_iter().map(|best| (best, f64::NAN)).collect();
        Ok(Answer {
            verdict: if found.is_empty() { Verdict::None } else { Verdict::Effect },
            probability: f64::NAN,
            p_value: f64::NAN,
            set: found.iter().map(|(named, _)| named.clone()).collect(),
            found,
            strengths: Vec::new(),
            unexplained_at: None,
            simulations: done.simulations,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }
}

/// An effect or what counts as one, and its place.
pub(crate) type Named = (String, String);

/// What a tool says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answer {
    /// Verdict.
    pub verdict: Verdict,
    /// Probability of the verdict.
    pub probability: f64,
    /// Probability of such a residual where nothing is missing.
    pub p_value: f64,
    /// Effects that are missing, with their probabilities.
    pub found: Vec<(Named, f64)>,
    /// All that the data cannot tell from the first, itself included.
    pub set: Vec<Named>,
    /// Strengths: which of the effects, name, value, interval.
    pub strengths: Vec<(usize, String, f64, Option<[f64; 2]>)>,
    /// Place of what nothing explains.
    pub unexplained_at: Option<String>,
    /// Simulations.
    pub simulations: usize,
    /// Seconds on one thread.
    pub seconds: f64,
}

impl Answer {
    /// What a diagnosis says.
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
            set,
            strengths: strengths.collect(),
            unexplained_at: diagnosis.unexplained.as_ref().map(|u| u.place.clone()),
            simulations: diagnosis.simulations,
            seconds,
        }
    }

    /// Whether another answer has the same verdict and the same effects at the same places, in any order.
    pub fn agrees(&self, other: &Self) -> bool {
        let named = |answer: &Self| {
            let mut all: Vec<Named> = answer.found.iter().map(|(named, _)| named.clone()).collect();
            all.sort();
            all
        };
        self.verdict == other.verdict && named(self) == named(other)
    }

    /// The effect named first; none where the verdict is another.
    pub fn first(&self) -> Option<&Named> {
        self.found.first().map(|(named, _)| named).filter(|_| self.verdict == Verdict::Effect)
    }
}

/// A verdict as results spell it.
pub(crate) fn spelt(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Effect => "effect",
        Verdict::None => "none",
        Verdict::Unexplained => "unexplained",
    }
}

#[cfg(test)]
mod tests {
    use crate::diagnosis::answers;

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
