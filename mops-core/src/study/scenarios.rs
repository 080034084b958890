//! Studies derived from uncertain parameters: over their box at a design, and with some of their values as cases.

use super::distribution::Uncertain;
use super::{JobPlan, ParameterSource, Study};
use crate::criterion::Usage;
use crate::evaluation::Objective;
use crate::study::{Grid, Scale, Tuner};

impl Study {
    /// Returns the study over its uncertain parameters at a design. The uncertain parameters become the active tuners,
    /// in their order, at the end of the list. The tuners of the study keep the given values. Cases that differ only in
    /// uncertain parameters are merged.
    pub fn over_uncertain(&self, tuners: &[f64]) -> Self {
        let mut study = self.clone();
        for (tuner, &value) in study.tuners.iter_mut().zip(tuners) {
            (tuner.start, tuner.active, tuner.tie) = (value, false, None);
        }
        let first = study.tuners.len();
        for uncertain in &self.uncertain {
            let settled = uncertain.at(tuners);
            study.tuners.push(Tuner {
                name: settled.name.clone(),
                parameter: settled.name.clone(),
                start: self.nominal(&settled, tuners),
                bounds: settled.bounds,
                scale: Scale::Linear,
                grid: Grid::Continuous,
                unit: settled.unit.clone(),
                case: None,
                active: true,
                tie: None,
                guessed: [false; 2],
            });
        }
        study.uncertain = self.uncertain.iter().map(|uncertain| uncertain.at(tuners)).collect();
        for job in &mut study.jobs {
            for (index, uncertain, factor) in self.touched(job) {
                job.parameters[index] = ParameterSource::Tuner { tuner: first + uncertain, factor };
            }
        }
        study.objective = Objective::Max;
        study.keep_distinct();
        study
    }

    /// Returns the uncertain parameters of a job: index of the parameter, index of the uncertain one, unit conversion
    /// factor.
    fn touched(&self, job: &JobPlan) -> Vec<(usize, usize, f64)> {
        let parameters = &self.models[job.model].1.interface().parameters;
        let found = |(index, p): (usize, &crate::model::Parameter)| {
            let uncertain = self.uncertain.iter().position(|u| u.name == p.variable.name)?;
            let factor = self.uncertain[uncertain].unit.factor_to(&p.variable.unit).unwrap_or(1.0);
            Some((index, uncertain, factor))
        };
        parameters.iter().enumerate().filter_map(found).collect()
    }

    /// Returns the nominal value, as used by the first simulation, clamped to the bounds.
    fn nominal(&self, uncertain: &Uncertain, tuners: &[f64]) -> f64 {
        let first = self.jobs.iter().find_map(|job| {
            let (index, _, factor) =
                self.touched(job).into_iter().find(|t| self.uncertain[t.1].name == uncertain.name)?;
            Some(self.parameters(job, tuners)[index] / factor)
        });
        first.unwrap_or_else(|| uncertain.quantile(0.5)).clamp(uncertain.bounds[0], uncertain.bounds[1])
    }

    /// Removes simulations identical to an earlier one, with their criteria.
    fn keep_distinct(&mut self) {
        let same = |a: &JobPlan, b: &JobPlan| {
            let (of_a, of_b) = (&self.cases[a.case], &self.cases[b.case]);
            let settings = (a.model, a.horizon, &a.parameters) == (b.model, b.horizon, &b.parameters);
            settings && of_a.inputs == of_b.inputs && of_a.experiment.is_none() && of_b.experiment.is_none()
        };
        let first: Vec<usize> =
            (0..self.jobs.len()).map(|j| (0..j).find(|&i| same(&self.jobs[i], &self.jobs[j])).unwrap_or(j)).collect();
        let known: Vec<(usize, String)> = self.rows.iter().map(|row| (row.job, row.name.clone())).collect();
        self.rows.retain(|row| {
            // N.B.: some criteria apply to the later case only.
            first[row.job] == row.job || !known.contains(&(first[row.job], row.name.clone()))
        });
        // Jobs without a criterion are not simulated.
        let read: Vec<usize> = (0..self.jobs.len()).filter(|&j| self.rows.iter().any(|row| row.job == j)).collect();
        self.jobs = read.iter().map(|&j| self.jobs[j].clone()).collect();
        for row in &mut self.rows {
            row.job = read.iter().position(|&j| j == row.job).expect("it is read");
        }
    }

    /// Returns the study that minimises only some of the minimised rows, by index; the others are monitored.
    pub fn minimising(&self, rows: &[usize]) -> Self {
        let mut study = self.clone();
        study.objective = Objective::Max;
        for (_, row) in study.rows.iter_mut().enumerate().filter(|(i, _)| !rows.contains(i)) {
            if row.usage == Usage::Minimise {
                row.usage = Usage::Monitor;
            }
        }
        study
    }

    /// Returns the study with additional cases: values of the uncertain parameters in a case, see [`Scenario::values`].
    pub fn with_scenarios(&self, scenarios: &[Scenario]) -> Self {
        let mut study = self.clone();
        for scenario in scenarios {
            let case = study.cases.len();
            let mut copy = self.cases[scenario.case].clone();
            copy.name.clone_from(&scenario.name);
            study.cases.push(copy);
            for (index, job) in self.jobs.iter().enumerate().filter(|(_, job)| job.case == scenario.case) {
                let mut plan = JobPlan { case, ..job.clone() };
                for (parameter, uncertain, factor) in self.touched(job) {
                    let value = scenario.values[uncertain] * factor;
                    plan.parameters[parameter] = match self.uncertain[uncertain].tuner {
                        Some(tuner) => ParameterSource::Tuner { tuner, factor: value },
                        None => ParameterSource::Constant(value),
                    };
                }
                let moved = study.jobs.len();
                study.jobs.push(plan);
                let rows: Vec<_> = self.rows.iter().filter(|row| row.job == index).cloned().collect();
                study.rows.extend(rows.into_iter().map(|row| super::Row { job: moved, ..row }));
            }
        }
        study
    }
}

/// Values of the uncertain parameters, as a separate case.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Name of the case.
    pub name: String,
    /// Index of the case from which all other settings are copied.
    pub case: usize,
    /// Values of the uncertain parameters, in their units; of a tuner with a tolerance, its ratio to the design value.
    pub values: Vec<f64>,
}
