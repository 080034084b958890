//! Uncertain parameters as written in a study, and their checks.

use mops_language::{Quantity, suggestion};
use mops_math as math;

use super::Study;
use super::distribution::{Distribution, Uncertain};
use super::tuner::ratio_of_temperatures;
use crate::error::StudyError;

/// An uncertain parameter, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct UncertainBuilder {
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Largest relative deviation of a tuner from its value, in both directions, instead of `min` and `max`.
    pub tolerance: Option<f64>,
    /// Distribution between the bounds; `None` for uniform.
    pub distribution: Option<DistributionBuilder>,
}

/// A distribution, not yet checked.
#[derive(Debug, Clone)]
pub enum DistributionBuilder {
    /// Normal distribution, given by mean and standard deviation.
    Normal {
        /// Mean.
        mean: Quantity,
        /// Standard deviation.
        deviation: Quantity,
    },
    /// Normal distribution, given by the central interval that contains 95 % of the values.
    NormalWithin([Quantity; 2]),
    /// Log-normal distribution, given by the median and the standard deviation of the natural logarithm.
    LogNormal {
        /// Median.
        median: Quantity,
        /// Standard deviation of the natural logarithm.
        deviation: f64,
    },
    /// Log-normal distribution, given by the central interval that contains 95 % of the values.
    LogNormalWithin([Quantity; 2]),
    /// Triangular distribution between `min` and `max`, given by the most probable value.
    Triangular {
        /// Most probable value.
        mode: Quantity,
    },
}

/// Checks the uncertain parameters of a study.
pub(super) fn check(drafts: Vec<(String, UncertainBuilder)>, study: &Study) -> Result<Vec<Uncertain>, StudyError> {
    let one = |(name, draft): (String, UncertainBuilder)| {
        build(&name, draft, study).map_err(|m| m.within(&name).within("uncertain"))
    };
    drafts.into_iter().map(one).collect()
}

fn build(name: &str, draft: UncertainBuilder, study: &Study) -> Result<Uncertain, StudyError> {
    let parameters: Vec<_> = study.models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
    let parameter = parameters.iter().find(|p| p.variable.name == name).ok_or_else(|| {
        StudyError::here(format!("no model has a parameter `{name}`"))
            .with_help(suggestion(name, parameters.iter().map(|p| p.variable.name.as_str())))
    })?;
    if study.tuners.iter().any(|t| t.parameter == name && t.case.is_some()) {
        return Err(StudyError::here(format!("`{name}` has a separate value in every case"))
            .with_help("only parameters, and tuners of the whole study, can be uncertain"));
    }
    let tuner = study.tuners.iter().position(|t| t.parameter == name);
    let unit = tuner.map_or(&parameter.variable.unit, |t| &study.tuners[t].unit).clone();
    let number = |key: &str, quantity: &Quantity| -> Result<f64, StudyError> {
        let value = quantity
            .to(&if key == "deviation" { unit.difference() } else { unit.clone() })
            .map_err(|why| StudyError::new(key, why).with_help(format!("a number without a unit is in `{unit}`")))?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(StudyError::new(key, format!("expected a finite number, found {value}")))
        }
    };
    let bound = |key: &str, quantity: &Option<Quantity>| quantity.as_ref().map(|q| number(key, q)).transpose();
    let (min, max) = (bound("min", &draft.min)?, bound("max", &draft.max)?);
    let tolerance = tolerance(&draft, tuner.is_some(), name)?;
    let of_ratios = match &draft.distribution {
        _ if tolerance.is_some() => Some("tolerance"),
        Some(DistributionBuilder::LogNormal { .. } | DistributionBuilder::LogNormalWithin(_)) => Some("log-normal"),
        _ => None,
    };
    if let Some(key) = of_ratios.filter(|_| unit.zero() != 0.0) {
        return Err(StudyError::new(key, ratio_of_temperatures(name, &unit))
            .with_help("declare it in K, or as a difference from a fixed temperature"));
    }
    let mut bounds = [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)];
    if bounds[1] <= bounds[0] {
        let [min, max] = bounds;
        return Err(StudyError::new("max", format!("the range is empty: min is {min}, max is {max}"))
            .with_help("swap the bounds, or widen the range"));
    }
    let distribution = distribution(&draft, bounds, number)?;
    if tolerance.is_none() && distribution == Distribution::Uniform && !bounds.iter().all(|b| b.is_finite()) {
        return Err(StudyError::here(format!("the range of `{name}` is not bounded"))
            .with_help("give `min` and `max`, or a distribution such as normal = { mean = 1.0, deviation = 0.1 }"));
    }
    // The distribution is truncated at the range of the model parameter; explicit bounds outside that range are errors.
    let factor = unit.factor_to(&parameter.variable.unit).unwrap_or(1.0);
    let range = parameter.range.map(|end| end / factor);
    for (key, given) in [("min", min), ("max", max)] {
        if let Some(value) = given.filter(|value| !(range[0]..=range[1]).contains(value)) {
            return Err(StudyError::new(
                key,
                format!("{} is outside the range of `{name}` in the model", unit.amount(value)),
            )
            .with_help(format!("`{name}` is: {}", parameter.variable.about)));
        }
    }
    bounds = [bounds[0].max(range[0]), bounds[1].min(range[1])];
    Ok(Uncertain { name: name.to_owned(), tuner, unit, bounds, tolerance, distribution })
}

fn tolerance(draft: &UncertainBuilder, of_tuner: bool, name: &str) -> Result<Option<f64>, StudyError> {
    let Some(share) = draft.tolerance else { return Ok(None) };
    let wrong = |fact: String, help: &str| Err(StudyError::new("tolerance", fact).with_help(help));
    if !of_tuner {
        return wrong(
            format!("`{name}` is not a tuner, so that a tolerance has no reference value"),
            "give `min` and `max` instead",
        );
    }
    if draft.min.is_some() || draft.max.is_some() || draft.distribution.is_some() {
        return wrong(
            "`tolerance` already defines the range".into(),
            "remove `min`, `max` and the distribution, or `tolerance`",
        );
    }
    if !(share > 0.0 && share < 1.0) {
        return wrong(
            format!("expected a tolerance between 0 and 1, as a share of the value, found {share}"),
            "0.05 is 5 %",
        );
    }
    Ok(Some(share))
}

/// Normal quantile of 97.5 %.
const HALF95: f64 = 1.959_963_984_540_054;

fn distribution(
    draft: &UncertainBuilder,
    [min, max]: [f64; 2],
    number: impl Fn(&str, &Quantity) -> Result<f64, StudyError>,
) -> Result<Distribution, StudyError> {
    let positive = |key: &str, value: f64, what: &str| {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(StudyError::new(key, format!("{what} must be positive, not {value}"))
                .with_help("write a positive number"))
        }
    };
    let ends = |interval: &[Quantity; 2]| -> Result<[f64; 2], StudyError> {
        let [from, to] = [number("interval", &interval[0])?, number("interval", &interval[1])?];
        if from < to {
            return Ok([from, to]);
        }
        Err(StudyError::new("interval", format!("the interval is empty: from {from} to {to}"))
            .with_help("95 % of the values lie between its ends"))
    };
    let (kind, found) = match &draft.distribution {
        None => return Ok(Distribution::Uniform),
        Some(DistributionBuilder::Normal { mean, deviation }) => ("normal", {
            let (mean, deviation) = (number("mean", mean), number("deviation", deviation));
            mean.and_then(|mean| {
                let deviation = positive("deviation", deviation?, "a standard deviation")?;
                Ok(Distribution::Normal { mean, deviation })
            })
        }),
        Some(DistributionBuilder::NormalWithin(interval)) => (
            "normal",
            ends(interval)
                .map(|[a, b]| Distribution::Normal { mean: 0.5 * (a + b), deviation: 0.5 * (b - a) / HALF95 }),
        ),
        Some(DistributionBuilder::LogNormal { median, deviation }) => (
            "log-normal",
            number("median", median).and_then(|median| {
                let median = positive("median", median, "the median of a log-normal distribution")?;
                let deviation = positive("deviation", *deviation, "the standard deviation of the logarithm")?;
                Ok(Distribution::LogNormal { median, deviation })
            }),
        ),
        Some(DistributionBuilder::LogNormalWithin(interval)) => (
            "log-normal",
            ends(interval).and_then(|[a, b]| {
                positive("interval", a, "the lower end of a log-normal interval")?;
                Ok(Distribution::LogNormal { median: (a * b).sqrt(), deviation: 0.5 * math::ln(b / a) / HALF95 })
            }),
        ),
        Some(DistributionBuilder::Triangular { mode }) => (
            "triangular",
            number("mode", mode).and_then(|mode| {
                if (min..=max).contains(&mode) && min.is_finite() && max.is_finite() {
                    return Ok(Distribution::Triangular { mode });
                }
                let fact = format!("a triangular distribution needs a mode between `min` and `max`, found {mode}");
                Err(StudyError::new("mode", fact)
                    .with_help("set `min` and `max` next to `triangular`, around the mode"))
            }),
        ),
    };
    let found = found.map_err(|m| m.within(kind))?;
    let mass = found.below(max, [min, max]) - found.below(min, [min, max]);
    if mass < 1e-6 {
        return Err(StudyError::here(format!("less than 1e-6 of the {kind} distribution lies within its bounds"))
            .with_help("widen `min` and `max`, or correct the distribution"));
    }
    Ok(found)
}
