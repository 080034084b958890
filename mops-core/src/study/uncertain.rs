//! Uncertain parameters: as they are written down, and checked.

use super::Study;
use super::distribution::{Distribution, Uncertain};
use crate::diagnostic::suggestion;
use crate::math;
use crate::mistake::Mistake;
use crate::unit::Quantity;

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
            .to(&if key == "deviation" { unit.difference() } else { unit.clone() })
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
                Ok(Distribution::LogNormal { median: (a * b).sqrt(), deviation: 0.5 * math::ln(b / a) / HALF95 })
            }),
        ),
        Some(DistributionDraft::Triangular { mode }) => (
            "triangular",
            number("mode", mode).and_then(|mode| {
                if (min..=max).contains(&mode) && min.is_finite() && max.is_finite() {
                    return Ok(Distribution::Triangular { mode });
                }
                let fact =
                    format!("a triangular distribution needs `min` and `max`, and a mode between them; {mode} is none");
                Err(Mistake::new("mode", fact).with_help("give `min` and `max` beside `triangular`, around the mode"))
            }),
        ),
    };
    let found = found.map_err(|m| m.within(kind))?;
    let mass = found.below(max, [min, max]) - found.below(min, [min, max]);
    if mass < 1e-6 {
        return Err(Mistake::here(format!("next to nothing of the {kind} distribution lies within its bounds"))
            .with_help("widen `min` and `max`, or correct the distribution"));
    }
    Ok(found)
}
