//! Uncertain parameters: what is known of them, and the study over them at a design.

use statrs::distribution::{ContinuousCDF, Normal};

use super::draft::Mistake;
use super::{JobPlan, Objective, ParameterSource, Study};
use crate::diagnostic::suggestion;
use crate::tuner::{Grid, Scale, Tuner};
use crate::unit::{Quantity, Unit};

/// An uncertain parameter as it is written down.
#[derive(Debug, Clone, Default)]
pub struct UncertainDraft {
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Of a tuner: the share of its value by which it may be off, either way, instead of `min` and `max`.
    pub tolerance: Option<f64>,
    /// How values are distributed between the bounds; uniformly where absent.
    pub distribution: Option<DistributionDraft>,
}

/// A distribution as it is written down.
#[derive(Debug, Clone)]
pub enum DistributionDraft {
    /// By mean and standard deviation.
    Normal {
        /// Mean.
        mean: Quantity,
        /// Standard deviation.
        deviation: Quantity,
    },
    /// By the interval that 95 % of the values lie in, as many below as above.
    NormalWithin([Quantity; 2]),
    /// By the median, and the standard deviation of the natural logarithm.
    LogNormal {
        /// Median.
        median: Quantity,
        /// Standard deviation of the natural logarithm.
        deviation: f64,
    },
    /// By the interval that 95 % of the values lie in, as many below as above.
    LogNormalWithin([Quantity; 2]),
    /// By its most probable value; `min` and `max` are its ends.
    Triangular {
        /// Most probable value.
        mode: Quantity,
    },
}

/// A parameter of models, or a tuner, that is not known exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Name of the parameter, or of the tuner.
    pub name: String,
    /// The tuner, by index, where it is one.
    pub tuner: Option<usize>,
    /// Unit of all numbers.
    pub unit: Unit,
    /// Smallest and largest value; infinite where there is none.
    pub bounds: [f64; 2],
    /// Of a tuner: the share of its value by which it is off at most; the bounds follow from the design.
    pub tolerance: Option<f64>,
    /// How values are distributed.
    pub distribution: Distribution,
}

/// How the values of an uncertain parameter are distributed; what lies outside its bounds is cut off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Evenly between the bounds.
    Uniform,
    /// `exp(-(x - mean)^2 / (2 deviation^2))`.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// The logarithm is normal.
    LogNormal {
        /// Median.
        median: f64,
        /// Standard deviation of the natural logarithm.
        deviation: f64,
    },
    /// Rises linearly from the lower bound to the mode, and falls to the upper one.
    Triangular {
        /// Most probable value.
        mode: f64,
    },
}

impl Distribution {
    /// Probability of a value up to `x`, nothing cut off but by `bounds` where the distribution needs them.
    fn below(self, x: f64, [min, max]: [f64; 2]) -> f64 {
        let standard = Normal::standard();
        match self {
            Self::Uniform => ((x - min) / (max - min)).clamp(0.0, 1.0),
            Self::Normal { mean, deviation } => standard.cdf((x - mean) / deviation),
            Self::LogNormal { .. } if x <= 0.0 => 0.0,
            Self::LogNormal { median, deviation } => standard.cdf((x / median).ln() / deviation),
            Self::Triangular { mode } if x <= mode => {
                if x <= min {
                    0.0
                } else {
                    (x - min).powi(2) / ((max - min) * (mode - min))
                }
            }
            Self::Triangular { mode } => {
                if x >= max {
                    1.0
                } else {
                    1.0 - (max - x).powi(2) / ((max - min) * (max - mode))
                }
            }
        }
    }

    /// The value that a share `p` of the values does not exceed.
    fn quantile(self, p: f64, [min, max]: [f64; 2]) -> f64 {
        let standard = |p: f64| Normal::standard().inverse_cdf(p);
        match self {
            Self::Uniform => min + p * (max - min),
            Self::Normal { mean, deviation } => mean + deviation * standard(p),
            Self::LogNormal { median, deviation } => median * (deviation * standard(p)).exp(),
            Self::Triangular { mode } => {
                let (span, rise) = (max - min, mode - min);
                if p * span <= rise {
                    min + (p * span * rise).sqrt()
                } else {
                    max - ((1.0 - p) * span * (max - mode)).sqrt()
                }
            }
        }
    }
}

impl Uncertain {
    /// The value that a share `p` in (0, 1) of the values does not exceed.
    pub fn quantile(&self, p: f64) -> f64 {
        let [low, high] = self.bounds.map(|bound| self.distribution.below(bound, self.bounds));
        let value = self.distribution.quantile(low + p * (high - low), self.bounds);
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// Whether both bounds are finite.
    pub fn is_bounded(&self) -> bool {
        self.tolerance.is_some() || self.bounds.iter().all(|bound| bound.is_finite())
    }

    /// The same for a design: a tolerance becomes bounds.
    fn at(&self, tuners: &[f64]) -> Self {
        let mut settled = self.clone();
        if let (Some(share), Some(tuner)) = (self.tolerance, self.tuner) {
            let half = share * tuners[tuner].abs();
            settled.bounds = [tuners[tuner] - half, tuners[tuner] + half];
        }
        settled
    }
}

/// Checks the uncertain parameters of a study.
pub(super) fn check(drafts: Vec<(String, UncertainDraft)>, study: &Study) -> Result<Vec<Uncertain>, Mistake> {
    let one = |(name, draft): (String, UncertainDraft)| {
        build(&name, draft, study).map_err(|m| m.within(&name).within("uncertain"))
    };
    drafts.into_iter().map(one).collect()
}

fn build(name: &str, draft: UncertainDraft, study: &Study) -> Result<Uncertain, Mistake> {
    let parameters: Vec<_> = study.models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
    let parameter = parameters.iter().find(|p| p.variable.name == name).ok_or_else(|| {
        Mistake::here(format!("no model has a parameter `{name}`"))
            .with_help(suggestion(name, parameters.iter().map(|p| p.variable.name.as_str())))
    })?;
    if study.tuners.iter().any(|t| t.parameter == name && t.case.is_some()) {
        return Err(Mistake::here(format!("`{name}` has a value of its own in every case"))
            .with_help("only parameters, and tuners of the whole study, can be uncertain"));
    }
    let tuner = study.tuners.iter().position(|t| t.parameter == name);
    let unit = tuner.map_or(&parameter.variable.unit, |t| &study.tuners[t].unit).clone();
    let number = |key: &str, quantity: &Quantity| -> Result<f64, Mistake> {
        let value = quantity
            .to(&unit)
            .map_err(|why| Mistake::new(key, why).with_help(format!("a number without a unit counts in `{unit}`")))?;
        if value.is_finite() { Ok(value) } else { Err(Mistake::new(key, format!("{value} is not a finite number"))) }
    };
    let bound = |key: &str, quantity: &Option<Quantity>| quantity.as_ref().map(|q| number(key, q)).transpose();
    let (min, max) = (bound("min", &draft.min)?, bound("max", &draft.max)?);
    let tolerance = tolerance(&draft, tuner.is_some(), name)?;
    let mut bounds = [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)];
    if bounds[1] <= bounds[0] {
        let [min, max] = bounds;
        return Err(Mistake::new("max", format!("the range is empty: min is {min}, max is {max}"))
            .with_help("swap the bounds, or widen the range"));
    }
    let distribution = distribution(&draft, bounds, number)?;
    if tolerance.is_none() && distribution == Distribution::Uniform && !bounds.iter().all(|b| b.is_finite()) {
        return Err(Mistake::here(format!("nothing says how far `{name}` may go"))
            .with_help("give `min` and `max`, or a distribution such as normal = { mean = 1.0, deviation = 0.1 }"));
    }
    // What the model does not take is cut off a distribution, but not off bounds that were asked for.
    let factor = unit.factor_to(&parameter.variable.unit).unwrap_or(1.0);
    let range = parameter.range.map(|end| end / factor);
    for (key, given) in [("min", min), ("max", max)] {
        if let Some(value) = given.filter(|value| !(range[0]..=range[1]).contains(value)) {
            return Err(Mistake::new(key, format!("the model does not take {} for `{name}`", unit.amount(value)))
                .with_help(format!("`{name}` is: {}", parameter.variable.about)));
        }
    }
    bounds = [bounds[0].max(range[0]), bounds[1].min(range[1])];
    Ok(Uncertain { name: name.to_owned(), tuner, unit, bounds, tolerance, distribution })
}

fn tolerance(draft: &UncertainDraft, of_tuner: bool, name: &str) -> Result<Option<f64>, Mistake> {
    let Some(share) = draft.tolerance else { return Ok(None) };
    let wrong = |fact: String, help: &str| Err(Mistake::new("tolerance", fact).with_help(help));
    if !of_tuner {
        return wrong(
            format!("`{name}` is no tuner, so that no design gives it a value"),
            "give `min` and `max` instead",
        );
    }
    if draft.min.is_some() || draft.max.is_some() || draft.distribution.is_some() {
        return wrong(
            "a tolerance is the whole range".into(),
            "remove `min`, `max` and the distribution, or the tolerance",
        );
    }
    if !(share > 0.0 && share < 1.0) {
        return wrong(format!("a tolerance is a share of the value, between 0 and 1, not {share}"), "0.05 is 5 %");
    }
    Ok(Some(share))
}

/// Normal quantile of 97.5 %.
const HALF95: f64 = 1.959_963_984_540_054;

fn distribution(
    draft: &UncertainDraft,
    [min, max]: [f64; 2],
    number: impl Fn(&str, &Quantity) -> Result<f64, Mistake>,
) -> Result<Distribution, Mistake> {
    let positive = |key: &str, value: f64, what: &str| {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(Mistake::new(key, format!("{what} must be positive, not {value}"))
                .with_help("it tells how wide values spread"))
        }
    };
    let ends = |interval: &[Quantity; 2]| -> Result<[f64; 2], Mistake> {
        let [from, to] = [number("interval", &interval[0])?, number("interval", &interval[1])?];
        if from < to {
            return Ok([from, to]);
        }
        Err(Mistake::new("interval", format!("the interval is empty: from {from} to {to}"))
            .with_help("95 % of the values lie between its ends"))
    };
    let (kind, found) = match &draft.distribution {
        None => return Ok(Distribution::Uniform),
        Some(DistributionDraft::Normal { mean, deviation }) => ("normal", {
            let (mean, deviation) = (number("mean", mean), number("deviation", deviation));
            mean.and_then(|mean| {
                let deviation = positive("deviation", deviation?, "a standard deviation")?;
                Ok(Distribution::Normal { mean, deviation })
            })
        }),
        Some(DistributionDraft::NormalWithin(interval)) => (
            "normal",
            ends(interval)
                .map(|[a, b]| Distribution::Normal { mean: 0.5 * (a + b), deviation: 0.5 * (b - a) / HALF95 }),
        ),
        Some(DistributionDraft::LogNormal { median, deviation }) => (
            "log-normal",
            number("median", median).and_then(|median| {
                let median = positive("median", median, "the median of a log-normal distribution")?;
                let deviation = positive("deviation", *deviation, "the standard deviation of the logarithm")?;
                Ok(Distribution::LogNormal { median, deviation })
            }),
        ),
        Some(DistributionDraft::LogNormalWithin(interval)) => (
            "log-normal",
            ends(interval).and_then(|[a, b]| {
                positive("interval", a, "the lower end of a log-normal interval")?;
                Ok(Distribution::LogNormal { median: (a * b).sqrt(), deviation: 0.5 * (b / a).ln() / HALF95 })
            }),
        ),
        Some(DistributionDraft::Triangular { mode }) => (
            "triangular",
            number("mode", mode).and_then(|mode| {
                if (min..=max).contains(&mode) && min.is_finite() && max.is_finite() {
                    return Ok(Distribution::Triangular { mode });
                }
                let fact = format!(
                    "the mode {mode} of a triangular distribution lies between `min` and `max`, which it needs"
                );
                Err(Mistake::new("mode", fact).with_help("give `min` and `max` beside `triangular`, around the mode"))
            }),
        ),
    };
    let found = found.map_err(|m| m.within(kind))?;
    let mass = found.below(max, [min, max]) - found.below(min, [min, max]);
    if mass < 1e-6 {
        return Err(Mistake::here(format!("next to nothing of the {kind} distribution lies between {min} and {max}"))
            .with_help("widen `min` and `max`, or correct the distribution"));
    }
    Ok(found)
}

impl Study {
    /// The study over its uncertain parameters at a design: these are the active tuners, at the end of the list, in their
    /// order; the tuners of the study keep the values given. Cases that differ in nothing but uncertain parameters become
    /// one.
    pub fn over_uncertain(&self, tuners: &[f64]) -> Self {
        let mut study = self.clone();
        for (tuner, &value) in study.tuners.iter_mut().zip(tuners) {
            (tuner.start, tuner.active, tuner.tie) = (value, false, None);
        }
        let first = study.tuners.len();
        for uncertain in &self.tasks.uncertain {
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
            });
        }
        study.tasks.uncertain = self.tasks.uncertain.iter().map(|uncertain| uncertain.at(tuners)).collect();
        for job in &mut study.jobs {
            for (index, uncertain, factor) in self.touched(job) {
                job.parameters[index] = ParameterSource::Tuner { tuner: first + uncertain, factor };
            }
        }
        study.objective = Objective::Max;
        study.keep_distinct();
        study
    }

    /// Parameters of a job that are uncertain: index of the parameter, index of the uncertain one, factor of the unit.
    fn touched(&self, job: &JobPlan) -> Vec<(usize, usize, f64)> {
        let parameters = &self.models[job.model].1.interface().parameters;
        let found = |(index, p): (usize, &crate::model::Parameter)| {
            let uncertain = self.tasks.uncertain.iter().position(|u| u.name == p.variable.name)?;
            let factor = self.tasks.uncertain[uncertain].unit.factor_to(&p.variable.unit).unwrap_or(1.0);
            Some((index, uncertain, factor))
        };
        parameters.iter().enumerate().filter_map(found).collect()
    }

    /// The value that the first simulation has, within the bounds.
    fn nominal(&self, uncertain: &Uncertain, tuners: &[f64]) -> f64 {
        let first = self.jobs.iter().find_map(|job| {
            let (index, _, factor) =
                self.touched(job).into_iter().find(|t| self.tasks.uncertain[t.1].name == uncertain.name)?;
            Some(self.parameters(job, tuners)[index] / factor)
        });
        first.unwrap_or_else(|| uncertain.quantile(0.5)).clamp(uncertain.bounds[0], uncertain.bounds[1])
    }

    /// Leaves out simulations that are the same as an earlier one, with their criteria.
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
            // N.B.: a criterion may be read in the later case alone.
            first[row.job] == row.job || !known.contains(&(first[row.job], row.name.clone()))
        });
        // What nobody reads is not simulated.
        let read: Vec<usize> = (0..self.jobs.len()).filter(|&j| self.rows.iter().any(|row| row.job == j)).collect();
        self.jobs = read.iter().map(|&j| self.jobs[j].clone()).collect();
        for row in &mut self.rows {
            row.job = read.iter().position(|&j| j == row.job).expect("it is read");
        }
    }

    /// The study with these cases besides its own: values of the uncertain parameters, in their units, in a case.
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
                    plan.parameters[parameter] = ParameterSource::Constant(scenario.values[uncertain] * factor);
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

/// Values of the uncertain parameters, as a case of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Name of the case.
    pub name: String,
    /// The case that it is otherwise like, by index.
    pub case: usize,
    /// Values of the uncertain parameters, in their units.
    pub values: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uncertain(distribution: Distribution, bounds: [f64; 2]) -> Uncertain {
        Uncertain { name: "a".into(), tuner: None, unit: Unit::one(), bounds, tolerance: None, distribution }
    }

    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Published quantiles of the normal distribution: 0.8413447, 0.9772499 at one and two deviations.
    #[test]
    fn quantiles_are_those_of_closed_forms() {
        let normal = uncertain(Distribution::Normal { mean: 2.0, deviation: 0.5 }, FREE);
        let log = uncertain(Distribution::LogNormal { median: 3.0, deviation: 0.2 }, [0.0, f64::INFINITY]);
        let triangle = uncertain(Distribution::Triangular { mode: 1.0 }, [0.0, 4.0]);
        let uniform = uncertain(Distribution::Uniform, [-1.0, 3.0]);
        for (found, exact) in [
            (normal.quantile(0.841_344_746_068_542_9), 2.5),
            (normal.quantile(0.022_750_131_948_179_21), 1.0),
            (log.quantile(0.841_344_746_068_542_9), 3.0 * 0.2_f64.exp()),
            (log.quantile(0.5), 3.0),
            (triangle.quantile(0.25), 1.0),
            (triangle.quantile(0.0625), 0.5),
            (triangle.quantile(1.0 - 1.0 / 12.0), 3.0),
            (uniform.quantile(0.25), 0.0),
        ] {
            assert!((found - exact).abs() < 1e-9, "{found} {exact}");
        }
    }

    #[test]
    fn what_lies_outside_the_bounds_is_cut_off() {
        // Half a normal distribution: its median is the upper quartile of the whole.
        let half = uncertain(Distribution::Normal { mean: 0.0, deviation: 1.0 }, [0.0, f64::INFINITY]);
        assert!((half.quantile(0.5) - 0.674_489_750_196_081_7).abs() < 1e-9);
        let narrow = uncertain(Distribution::Normal { mean: 0.0, deviation: 1.0 }, [-0.1, 0.3]);
        assert!((0..=100).all(|i| (-0.1..=0.3).contains(&narrow.quantile(f64::from(i) / 100.0))));
    }
}
