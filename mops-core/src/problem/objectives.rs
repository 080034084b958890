//! Objectives of a Pareto front: every criterion in its worst case, or in every case.

use crate::criterion::Usage;
use crate::evaluation::{Evaluation, Reading};
use crate::study::Study;
use crate::study::task::ParetoTask;

/// Objective of a Pareto front.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrontObjective {
    /// Name of the criterion; `case/criterion` if the criterion is an objective in more than one case.
    pub label: String,
    /// Rows of the study, as indices. The value of the objective is that of the row with the largest weighted scaled
    /// value.
    pub rows: Vec<usize>,
}

impl FrontObjective {
    /// Returns the objectives of a study whose rows have the given usages.
    pub(crate) fn of_study(study: &Study, usages: &[(Usage, f64)]) -> Vec<Self> {
        let minimised: Vec<usize> = (0..usages.len()).filter(|&row| usages[row].0 == Usage::Minimise).collect();
        let name = |row: usize| study.rows[row].name.as_str();
        let is_per_case = study.options::<ParetoTask>().is_some_and(|pareto| pareto.per_case);
        let mut objectives: Vec<Self> = Vec::new();
        for &row in &minimised {
            if is_per_case {
                let is_unique = minimised.iter().filter(|&&other| name(other) == name(row)).count() == 1;
                let label = if is_unique { name(row).to_owned() } else { study.key(&study.rows[row]) };
                objectives.push(Self { label, rows: vec![row] });
            } else if let Some(known) = objectives.iter_mut().find(|objective| objective.label == name(row)) {
                known.rows.push(row);
            } else {
                objectives.push(Self { label: name(row).to_owned(), rows: vec![row] });
            }
        }
        objectives
    }

    /// Returns the row with the largest weighted scaled value, with its reading; `None` if a row has no value.
    pub fn worst(&self, study: &Study, at: &Evaluation) -> Option<(usize, Reading)> {
        let weighted = |(row, reading): &(usize, Reading)| study.rows[*row].weight * reading.scaled;
        let readings: Vec<(usize, Reading)> =
            self.rows.iter().map(|&row| Some((row, at.readings[row]?))).collect::<Option<_>>()?;
        readings.into_iter().max_by(|a, b| weighted(a).total_cmp(&weighted(b)).then(b.0.cmp(&a.0)))
    }
}
