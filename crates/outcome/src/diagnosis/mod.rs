//! Result of a diagnosis: the block `diagnosis` of `result.json`, and the data of its report.

mod block;

use mops_math as math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use mops_core::case::{Hold, Role};

/// Verdict on the model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The model lacks effects of the catalogue, which were found.
    Effect,
    /// No missing effect detected.
    #[default]
    None,
    /// Something is missing that no effect of the catalogue explains.
    Unexplained,
}

/// Estimate of a parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StrengthValue {
    /// Name, such as `torque`.
    pub name: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// Unit; empty if the model's equations do not determine it.
    pub unit: String,
    /// Standard error, without the selection of the effect; null if the data do not determine it.
    pub std_error: Option<f64>,
    /// 95 % confidence interval. For a discrete shape parameter: the range of the values that the data allow, if there
    /// are several.
    pub interval95: Option<[f64; 2]>,
    /// True if the estimate stands at a bound of what physics or the records allow; it has no interval then.
    pub at_bound: bool,
}

/// Alternative effect that explains the data about as well, or better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rival {
    /// Effect.
    pub effect: String,
    /// Place, as `kind:name`.
    pub place: String,
    /// Probability.
    pub probability: f64,
    /// BIC minus that of the effect found, without the penalty of parameters that the data do not constrain. Between -2
    /// and 2 the data do not distinguish the two; below -2 they prefer the alternative.
    pub bic_behind: f64,
    /// Cosine similarity of the responses of the outputs to both effects, without the part that the parameters absorb;
    /// 1 if equal.
    pub cosine: f64,
}

/// Missing effect that was added to the model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Found {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Name in the augmented model, such as `phi-coulomb-friction`; its parameters are called `name.parameter`.
    pub name: String,
    /// Second place, as `kind:name`, for an effect that needs one, such as the source of cross-talk.
    pub companion: Option<String>,
    /// The only experiment in which the effect acts, for an effect that happens once.
    pub only: Option<String>,
    /// Class, such as `dissipative`.
    pub class: String,
    /// Formula, for readers.
    pub formula: String,
    /// Estimates of its parameters.
    pub strengths: Vec<StrengthValue>,
    /// Probability that this effect, rather than another, is missing; NaN if more is missing than it describes.
    pub probability: f64,
    /// Probability that an effect of this class is missing at this place; NaN for a given effect, or if most remains to
    /// be explained.
    pub class_probability: f64,
    /// Other classes and places that the data cannot distinguish from these, as `class at kind:name`:
    /// `class_probability` is that of one of them.
    pub alike: Vec<String>,
    /// True if class and place are claimed; otherwise the effect is a proposal, or given.
    pub claimed: bool,
    /// True if the study gives the effect (`with`).
    pub given: bool,
    /// Decrease of the BIC when the effect is added: twice the gain in log-evidence, which the BIC approximates.
    pub bic_gain: f64,
    /// Alternatives at the same place whose BIC is at most 6 higher.
    pub indistinguishable: Vec<Rival>,
    /// Errors on held-out data with and without the effect, initial states fitted. Empty for a single effect, whose
    /// errors before and after show the same, and if the model without the effect cannot be simulated over whole
    /// records.
    pub held_out: Vec<HeldOut>,
}

impl Found {
    /// Returns the place; for an effect between two places of a kind both, as `joint:a with joint:b`.
    pub fn places(&self) -> String {
        both_places(&self.place, self.companion.as_deref())
    }
}

impl Diagnosis {
    /// Returns true if the effects found explain at least half of the squared error on held-out data, or there are none
    /// of these.
    pub fn explains_most(&self) -> bool {
        self.explained_share.is_none_or(|share| share >= 0.5)
    }

    /// Returns true if the repaired study differs from the declared one by more than its initial guess.
    pub fn changes_study(&self) -> bool {
        !(self.found.is_empty() && self.removed.is_empty() && self.alignment.is_empty())
    }
}

/// Returns a place, with its companion if both are joints or both are processes, as `joint:a with joint:b`: the effect
/// then acts on both.
pub fn both_places(place: &str, companion: Option<&str>) -> String {
    let are = |kind: &str, other: &str| place.starts_with(kind) && other.starts_with(kind);
    match companion {
        Some(other) if are("joint:", other) || are("process:", other) => format!("{place} with {other}"),
        _ => place.to_owned(),
    }
}

/// Error on held-out data with and without an effect, all other parameters fitted to calibration data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldOut {
    /// Role of the data: selection or validation.
    pub role: Role,
    /// Error without the effect, in units of the noise.
    pub without: f64,
    /// Error with the effect, in units of the noise.
    pub with: f64,
}

/// Rule that a candidate effect failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// The evidence does not support the effect.
    Evidence,
    /// The model with the effect forecasts other data no better than without it.
    Forecast,
    /// The free curve shows that most remains unexplained.
    Curve,
    /// Another effect is more probable.
    Probability,
    /// Another effect leaves less of the error.
    Error,
    /// The effect describes the records best, but does not suffice for a claim: it is proposed.
    Claim,
}

/// Recorded input that acts at other times than its study says, or is interpolated otherwise between its samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Alignment {
    /// The input.
    pub input: String,
    /// Time that is added to its time stamps, s: below 0 it acts earlier.
    pub shift: f64,
    /// Interpolation between its samples.
    pub hold: Hold,
}

/// Coordinate on which a missing force or a change of an input depends, determined without a catalogue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Dependence {
    /// Coordinate: `position`, `speed`, `level`, `input`, ...
    pub coordinate: String,
    /// Place, as `kind:name`.
    pub place: String,
    /// Second place, as `kind:name`, for a force between two places.
    pub other: Option<String>,
    /// Gain in log-evidence, nats.
    pub gain: f64,
    /// Unit of the coordinate.
    pub unit: String,
    /// Unit of what is missing; empty if the model's equations do not determine it.
    pub signal_unit: String,
    /// Points of the curve: coordinate, most probable value of what is missing.
    pub curve: Vec<[f64; 2]>,
}

impl std::fmt::Display for Dependence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { coordinate, place, other, .. } = self;
        match other {
            Some(other) if coordinate == "level" => write!(f, "{coordinate}, flow from {place} to {other}"),
            Some(other) => write!(f, "{coordinate} between {place} and {other}"),
            None => write!(f, "{coordinate} at {place}"),
        }
    }
}

/// What names a set of effects.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NamedBy {
    /// Evidence: the mean over the error models.
    #[default]
    Evidence,
    /// Least squares, where evidence names nothing that leaves little of the error: a proposal.
    LeastSquares,
}

/// Data whose forecast decides which effects are claimed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ForecastOf {
    /// Selection records.
    #[default]
    Selection,
    /// Ends of the calibration records, from parameters fitted to their beginnings.
    EndOfRecords,
}

/// Term of the nominal model that the data contradict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Removed {
    /// Parameter of the term.
    pub term: String,
    /// Place, as `kind:name`, if known.
    pub place: String,
}

/// Candidate effect, fitted together with the effects already accepted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Class.
    pub class: String,
    /// Probability.
    pub probability: f64,
    /// Decrease of the BIC when the effect is added.
    pub bic_gain: f64,
    /// Estimates of its parameters.
    pub strengths: Vec<StrengthValue>,
    /// Share of the effect's output signature that parameters and initial states absorb.
    pub absorbed: f64,
    /// Error with the effect on calibration data, in units of the noise.
    pub normalised: f64,
    /// Rule that the effect failed; `None` for a claimed one.
    #[serde(default)]
    pub failed: Option<Rule>,
}

/// Ranges of declared parameters that end too early: what the model explains where they are wider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WiderRanges {
    /// Parameters that leave their ranges.
    pub ranges: Vec<WiderRange>,
    /// Error with them on calibration data, in units of the noise.
    pub error: f64,
}

/// Declared parameter that leaves its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WiderRange {
    /// Tuner.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// End of the declared range.
    pub end: f64,
    /// Estimate beyond it.
    pub value: f64,
}

/// Residual that no effect explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// Most likely place, as `kind:name`.
    pub place: String,
    /// Coordinate that the missing signal depends on, such as `position`, `speed`, `level` or `input`.
    pub over: String,
    /// Lookup table of the missing signal, linear between its points.
    pub table: Vec<[f64; 2]>,
}

/// Error of a model on an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentError {
    /// Experiment.
    pub name: String,
    /// Role of the experiment.
    pub role: Role,
    /// Root mean square error per channel, in its unit.
    pub channels: Vec<(String, f64)>,
    /// Root mean square error over all channels and samples, in units of the noise; 1 is the noise level.
    pub normalised: f64,
    /// Errors in windows of a few periods; null if the record is too short for two.
    pub in_windows: Option<WindowErrors>,
}

/// Returns the root mean square of the errors over the experiments of a role, in units of the noise; `None` without
/// experiments.
#[allow(clippy::cast_precision_loss)]
pub fn together(errors: &[ExperimentError], role: Role) -> Option<f64> {
    let squares: Vec<f64> = errors.iter().filter(|e| e.role == role).map(|e| math::powi(e.normalised, 2)).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Errors over windows of a record, each with its own initial states and the parameters fixed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WindowErrors {
    /// Number of windows.
    pub count: usize,
    /// Length of a window, s.
    pub length: f64,
    /// Root mean square error per channel, in its unit.
    pub channels: Vec<(String, f64)>,
    /// Root mean square error over all channels and samples, in units of the noise.
    pub normalised: f64,
}

/// Shift of a parameter: the bias that the missing effect had caused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterMove {
    /// Tuner.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Estimate in the nominal model.
    pub before: f64,
    /// Estimate in the augmented model.
    pub after: f64,
    /// Standard error in the augmented model, under its likeliest error model.
    pub std_error: Option<f64>,
    /// 95 % confidence interval under the likeliest error model, widened by as much about `after`, which is estimated
    /// by least squares.
    pub interval95: Option<[f64; 2]>,
    /// True if `after` stands at a bound of its range; it has no interval then.
    pub at_bound: bool,
}

/// Detection limit: the smallest parameter of an effect that would have been detected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Noticeable {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Parameter at the detection limit.
    pub strength: StrengthValue,
}

/// Measured output and its predictions by the nominal and the augmented model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// The experiment.
    pub experiment: String,
    /// Role of the experiment.
    pub role: Role,
    /// Signal.
    pub signal: String,
    /// Unit of the signal.
    pub unit: String,
    /// Standard deviation of the noise, in the unit of the signal.
    pub noise: f64,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// Measured samples.
    pub measured: Vec<f64>,
    /// Prediction of the nominal model.
    pub before: Vec<f64>,
    /// Prediction of the augmented model; equal to `before` if no effect was found.
    pub after: Vec<f64>,
}

/// Signal over a variable, as points.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Curve {
    /// Abscissae.
    pub x: Vec<f64>,
    /// Estimated signal, without any formula.
    pub estimated: Vec<f64>,
    /// Signal of the effects found there, by their formulas; empty if none was found.
    pub found: Vec<f64>,
}

/// Course of what is missing at a place, without a catalogue: a smooth force at a balance, a smooth error at a sensor.
/// Where effects were added, their formulas plus what remains with them, and over a coordinate the free curve in their
/// place; else what the nominal model lacks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LatentInput {
    /// The place, as `kind:name`.
    pub place: String,
    /// Unit of the signal; empty if the model's equations do not determine it.
    pub unit: String,
    /// Signal over time, by experiment.
    pub over_time: Vec<(String, Curve)>,
    /// Signal over coordinates of the place (`position`, `speed`, `level`), with their units.
    pub over: Vec<(String, String, Curve)>,
}

/// Change of one model of the search into the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[non_exhaustive]
pub enum Change {
    /// An effect was added.
    #[serde(rename = "added")]
    Added,
    /// An effect was swapped for another.
    #[serde(rename = "exchanged")]
    Swapped,
    /// The search was restarted with another first effect.
    #[serde(rename = "restarted")]
    Restarted,
    /// An effect was eliminated.
    #[serde(rename = "left out")]
    Eliminated,
    /// One effect was substituted for two.
    #[serde(rename = "one for two")]
    Substituted,
}

impl Change {
    /// Returns the name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "effect added",
            Self::Swapped => "effect swapped",
            Self::Restarted => "restarted with another effect",
            Self::Eliminated => "effect eliminated",
            Self::Substituted => "one effect substituted for two",
        }
    }
}

/// Model visited by the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Step {
    /// Change from the model before.
    pub did: Change,
    /// Effects, each as `effect at kind:name`.
    pub effects: Vec<String>,
    /// Error on calibration data, in units of the noise.
    pub normalised: f64,
}

/// Result of a diagnosis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Diagnosis {
    /// Verdict.
    pub verdict: Verdict,
    /// Probability of the verdict; NaN if it cannot be stated.
    pub probability: f64,
    /// p-value of the residual's structure without a missing effect.
    pub p_value: f64,
    /// Recorded inputs that act at other times than the study says. Effects are found with these.
    pub alignment: Vec<Alignment>,
    /// Effects added.
    pub found: Vec<Found>,
    /// Share of the squared error of the declared model, in noises, that the effects found remove from validation data,
    /// else selection data; `None` without effects or without such data.
    pub explained_share: Option<f64>,
    /// Coordinate on which what the declared model lacks depends.
    pub depends_on: Option<Dependence>,
    /// Coordinate on which what remains with the effects found depends.
    pub remaining: Option<Dependence>,
    /// Data whose forecast decided.
    pub forecast_of: ForecastOf,
    /// What names the effects found.
    pub named_by: NamedBy,
    /// Wider ranges of declared parameters that explain as much as any effect; `None` if there are none.
    pub wider: Option<WiderRanges>,
    /// True if the effects found are those of highest evidence.
    pub is_first: bool,
    /// True if the search was stopped before its end.
    pub is_stopped: bool,
    /// True if all fits that the verdict rests on converged.
    pub converged: bool,
    /// True if the verdict is sure: nothing is missing, or every effect found is claimed, by highest evidence and a
    /// better forecast of held-out data; the search was not stopped, all fits converged, and no parameter is at a
    /// bound.
    pub is_sure: bool,
    /// Terms of the nominal model that the data contradict.
    pub removed: Vec<Removed>,
    /// Models visited by the search, in order.
    pub steps: Vec<Step>,
    /// Candidate effects, best first.
    pub ranked: Vec<Ranked>,
    /// Residual that no effect explains.
    pub unexplained: Option<Unexplained>,
    /// Experiment that would distinguish the alternatives.
    pub next_experiment: Option<String>,
    /// Errors of the nominal model.
    pub before: Vec<ExperimentError>,
    /// Errors of the augmented model.
    pub after: Vec<ExperimentError>,
    /// Shifts of the parameters.
    pub parameters: Vec<ParameterMove>,
    /// Detection limits, for the verdict `none`.
    pub noticeable: Vec<Noticeable>,
    /// Free curve with the largest gain of each place, the largest first: where the missing input acts, whatever its
    /// form.
    pub places: Vec<Dependence>,
    /// Course of what is missing at the places of the effects found; without any, but with a lack of fit, at the first
    /// place.
    pub latent: Vec<LatentInput>,
    /// Measured outputs and their predictions.
    pub predictions: Vec<Prediction>,
    /// Remarks on data and fit.
    pub notes: Vec<String>,
    /// Initial states of every experiment in the augmented model: experiment, parameter, value.
    pub starts: Vec<(String, String, f64)>,
    /// Number of simulations.
    pub simulations: usize,
}
