//! `task = "sweep"`: the objective over one or two tuners.

use mops_language::entries::Short;
use mops_language::{Quantity, suggestion};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Place, TaskOptions, TaskSpec};
use crate::case::Role;
use crate::study::{Grid, Study, StudyError};

/// Maximum number of values along an axis.
const MOST_POINTS: usize = 1000;

/// Settings of `task = "sweep"`: the objective over one tuner, or over two.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SweepTask {
    /// Tuner along x: its name, or a table with `tuner`, `min`, `max`, `points`.
    pub x: Short<AxisOptions>,
    /// Tuner along y; without it the sweep is a line.
    pub y: Option<Short<AxisOptions>>,
    /// Values of the other tuners: `optimum` (default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
}

/// A swept tuner.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct AxisOptions {
    /// Name of the tuner.
    pub tuner: String,
    /// Smallest value; default is the lower bound of the tuner.
    pub min: Option<Quantity>,
    /// Largest value; default is the upper bound of the tuner.
    pub max: Option<Quantity>,
    /// Number of values; default 41 on a surface and 201 on a line.
    pub points: Option<usize>,
}

impl From<String> for AxisOptions {
    fn from(tuner: String) -> Self {
        Self { tuner, min: None, max: None, points: None }
    }
}

/// A swept tuner of a study.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Tuner, as index into [`Study::tuners`].
    pub tuner: usize,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Number of values.
    pub points: usize,
}

impl SweepTask {
    /// Returns the axes, x first.
    ///
    /// # Errors
    /// If a tuner is unknown or cannot be swept, or for a range outside of its bounds.
    pub fn axes(&self, study: &Study) -> Result<Vec<Axis>, StudyError> {
        let points = if self.y.is_some() { 41 } else { 201 };
        let x = axis(&self.x.0, points, study).map_err(|m| m.within("x"))?;
        let Some(Short(y)) = &self.y else { return Ok(vec![x]) };
        let y = axis(y, points, study).map_err(|m| m.within("y"))?;
        if y.tuner == x.tuner {
            return Err(StudyError::new("y", format!("x and y are the same tuner `{}`", study.tuners()[x.tuner].name))
                .with_help("name another tuner, or omit `y` for a line"));
        }
        Ok(vec![x, y])
    }
}

fn axis(options: &AxisOptions, usual: usize, study: &Study) -> Result<Axis, StudyError> {
    let name = &options.tuner;
    let within = |m: StudyError| m.within("tuner");
    let index = study.tuners().iter().position(|t| t.name == *name).ok_or_else(|| {
        within(StudyError::here(format!("the study has no tuner `{name}`")))
            .with_help(suggestion(name, study.tuners().iter().map(|t| t.name.as_str())))
    })?;
    let tuner = &study.tuners()[index];
    if !tuner.active || tuner.tie.is_some() || tuner.grid != Grid::Continuous {
        return Err(within(StudyError::here(format!(
            "`{name}` cannot be swept: it is not an active, continuous tuner"
        )))
        .with_help("remove `active`, `tie`, `integer` or `values` from it"));
    }
    if tuner.case.is_some_and(|case| study.cases()[case].role() != Role::Calibration) {
        return Err(within(StudyError::here(format!(
            "`{name}` cannot be swept: its experiment is not used for calibration"
        )))
        .with_help("sweep a tuner of the study, or of a calibration experiment"));
    }
    let bound = |key: &str, given: &Option<Quantity>, default: f64| -> Result<f64, StudyError> {
        let Some(quantity) = given else { return Ok(default) };
        let value = quantity.to(&tuner.unit).map_err(|why| {
            StudyError::new(key, why).with_help(format!("a number without a unit is in `{}`", tuner.unit))
        })?;
        let [low, high] = tuner.bounds;
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        Err(StudyError::new(
            key,
            format!("{value} is outside the bounds of `{name}`, {low} to {}", tuner.unit.amount(high)),
        )
        .with_help("widen `min` and `max` of the tuner"))
    };
    let range = [bound("min", &options.min, tuner.bounds[0])?, bound("max", &options.max, tuner.bounds[1])?];
    if range[0] >= range[1] {
        return Err(StudyError::new(
            "max",
            format!("expected `max` of the sweep of `{name}` above its `min`, found {}", range[1]),
        )
        .with_help(format!("`min` is {}", tuner.unit.amount(range[0]))));
    }
    let points = options.points.unwrap_or(usual);
    if !(2..=MOST_POINTS).contains(&points) {
        return Err(StudyError::new("points", format!("expected 2 to {MOST_POINTS} points, found {points}"))
            .with_help("41 points along each of two tuners are 1681 evaluations"));
    }
    Ok(Axis { tuner: index, range, points })
}

impl TaskOptions for SweepTask {
    const NAME: &'static str = "sweep";
    const ABOUT: &'static str = "Compute the objective over one or two tuners.";
    const EXAMPLE: &'static str = "add [sweep] with x = \"tuner\" and, for a surface, y = \"tuner\"";

    fn absent() -> Option<Self> {
        None
    }
}

impl TaskSpec for SweepTask {
    fn at(&self) -> Option<Place> {
        Some(self.at)
    }

    fn ignores_uncertain(&self) -> Option<&'static str> {
        Some("this task ignores [uncertain]")
    }

    fn check(&self, study: &Study, _is_performed: bool) -> Result<(), StudyError> {
        self.axes(study).map(|_| ()).map_err(|mistake| mistake.within(Self::TABLE))
    }
}
