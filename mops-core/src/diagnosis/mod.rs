//! What a diagnosis gives: the block `diagnosis` of `result.json`, and what its report shows.

mod block;

use mops_math as math;
use serde::{Deserialize, Serialize};

pub(crate) use block::serialize;

use crate::experiment::Role;

/// Whether the model lacks something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It lacks effects of the catalogue, and they were found.
    Effect,
    /// Nothing that the data could show is missing.
    None,
    /// Something is missing that no effect of the catalogue explains.
    Unexplained,
}

/// A strength of an effect with what the data say of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StrengthValue {
    /// Name, such as `torque`.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// Unit; empty where the model's equations do not tell.
    pub unit: String,
    /// Standard error of the value, selection of the effect not included; `None` where it cannot be told.
    pub std_error: Option<f64>,
    /// An interval that holds the value with probability 0.95, other values of shapes that no fit moves included where the data
    /// allow them; of such a shape the range of these values, if there are several.
    pub interval95: Option<[f64; 2]>,
}

/// Another effect that explains the data about as well, or better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Its probability.
    pub probability: f64,
    /// How far its BIC, without the price of strengths that the data tell nothing of, lies above that of the effect found: within
    /// 2 the data cannot tell them apart, below -2 they prefer it.
    pub bic_behind: f64,
    /// Cosine between the traces of the two in the outputs, what the parameters absorb taken out; 1: the same.
    pub likeness: f64,
}

/// An effect that the model lacked and that was added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Its name in the repaired model, such as `phi-coulomb-friction`: its strengths are the parameters `name.strength`.
    pub name: String,
    /// The second place of an effect that needs one, such as where cross-talk comes from, as `kind:name`.
    pub companion: Option<String>,
    /// The only experiment in which it acts, of what happens once.
    pub only: Option<String>,
    /// Its class, such as `dissipative`.
    pub class: String,
    /// Its formula, for people.
    pub formula: String,
    /// Its strengths.
    pub strengths: Vec<StrengthValue>,
    /// Probability that it is this effect, rather than another.
    pub probability: f64,
    /// How much the BIC falls by adding it.
    pub bic_gain: f64,
    /// Other effects in its place whose BIC is less than 6 above its own, or below it.
    pub indistinguishable: Vec<Rival>,
    /// How its choice holds where the data change; `None` where nothing was tried beside it.
    pub stability: Option<Stability>,
    /// What it does for data that no parameter was fitted to, only start values. Empty where it is the only effect, as the errors
    /// before and after tell that, and where the model without it cannot be followed over whole records.
    pub held_back: Vec<HeldBack>,
}

/// Error on data that were held back from the fit, with an effect and without it: all else is fitted anew to calibration data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldBack {
    /// Whose data: selection or validation.
    pub role: Role,
    /// Without the effect, in units of the noise.
    pub without: f64,
    /// With it.
    pub with: f64,
}

/// How the choice of an effect holds where the data change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// Share of data sets, drawn anew in blocks from the data, in which the same effect does best.
    ///
    /// The fits are not repeated, their residuals are drawn. Source: H. Kishino, T. Miyata, M. Hasegawa, Maximum likelihood
    /// inference of protein phylogeny, Journal of Molecular Evolution 31 (1990) 151, for estimated likelihoods; E. Carlstein, The
    /// use of subseries values for estimating the variance of a general statistic, Annals of Statistics 14 (1986) 1171, for blocks.
    pub share: f64,
    /// Experiments without which another effect would do best, fitted again without them.
    pub hangs_on: Vec<HangsOn>,
}

/// An experiment that an effect's choice hangs on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HangsOn {
    /// The experiment.
    pub experiment: String,
    /// The effect that would do best without it.
    pub effect: String,
    /// The place of that, as `kind:name`.
    pub place: String,
}

/// A declared term that was found to be the wrong one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Removed {
    /// The parameter that is its strength.
    pub term: String,
    /// The place, as `kind:name`, where it is known.
    pub place: String,
}

/// An effect that was tried, beside those that were in by then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// Its class.
    pub class: String,
    /// Its probability.
    pub probability: f64,
    /// How much the BIC falls by adding it.
    pub bic_gain: f64,
    /// Its strengths.
    pub strengths: Vec<StrengthValue>,
    /// Share of its trace in the outputs that the parameters and start values absorb.
    pub absorbed: f64,
    /// Normalised error with it, on calibration and selection data together.
    pub normalised: f64,
}

/// What no effect explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Where it acts best, as `kind:name`.
    pub place: String,
    /// Share of the residual above the noise that a free signal there explains.
    pub share: f64,
    /// What it depends on: `position`, `speed`, `input` or `time`.
    pub over: String,
    /// The stopgap: a table, linear between its points.
    pub table: Vec<[f64; 2]>,
}

/// Error of a model on an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentError {
    /// The experiment.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Root mean square error per channel, in its unit.
    pub channels: Vec<(String, f64)>,
    /// Over all channels and samples, in units of the noise: 1 is the noise itself.
    pub normalised: f64,
    /// The same in windows of a few periods; `None` where the record is too short for two.
    pub in_windows: Option<WindowErrors>,
}

/// Error on the experiments of a role together, the root of their mean square, in units of the noise; `None` where there are none.
#[allow(clippy::cast_precision_loss)]
pub fn together(errors: &[ExperimentError], role: Role) -> Option<f64> {
    let squares: Vec<f64> = errors.iter().filter(|e| e.role == role).map(|e| math::powi(e.normalised, 2)).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Errors over windows of a record, each with start values of its own and the parameters held.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WindowErrors {
    /// Number of windows.
    pub count: usize,
    /// Length of a window, s.
    pub length: f64,
    /// Root mean square error per channel, in its unit.
    pub channels: Vec<(String, f64)>,
    /// Over all channels and samples, in units of the noise.
    pub normalised: f64,
}

/// How a parameter moved: what it had absorbed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterMove {
    /// The tuner.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value in the model as declared.
    pub before: f64,
    /// Its value in the repaired model.
    pub after: f64,
    /// Its standard error in the repaired model.
    pub std_error: Option<f64>,
}

/// The smallest strength of an effect that would have been noticed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Noticeable {
    /// The effect.
    pub effect: String,
    /// The place, as `kind:name`.
    pub place: String,
    /// The strength.
    pub strength: StrengthValue,
}

/// A measured output beside what the models predict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// The experiment.
    pub experiment: String,
    /// Its role.
    pub role: Role,
    /// The signal, and its unit.
    pub signal: String,
    /// Unit of the signal.
    pub unit: String,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// The samples.
    pub measured: Vec<f64>,
    /// The model as declared.
    pub before: Vec<f64>,
    /// The repaired model; as `before` where nothing was found.
    pub after: Vec<f64>,
}

/// A signal over something, as points.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Curve {
    /// Abscissae.
    pub x: Vec<f64>,
    /// The signal as it is estimated, without any formula.
    pub estimated: Vec<f64>,
    /// What the effects found there make of it by their formulas; empty where none was found.
    pub found: Vec<f64>,
}

/// The unknown signal at a place that would explain the residual: how likely of the declared model; over what it is drawn, where
/// effects were found there whose formula can be drawn, of the repaired one without them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The place, as `kind:name`.
    pub place: String,
    /// Unit of the signal; empty where the model's equations do not tell.
    pub unit: String,
    /// Logarithm of the marginal likelihood over that of the model without it.
    pub evidence: f64,
    /// Share of the residual above the noise that it explains.
    pub share: f64,
    /// Effective degrees of freedom it takes.
    pub freedom: f64,
    /// The signal over time: samples one after the other, per experiment.
    pub over_time: Vec<(String, Curve)>,
    /// The signal over what it may depend on (`position`, `speed`, `input`), with the unit of that.
    pub over: Vec<(String, String, Curve)>,
}

/// Change of one model of the search into the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Change {
    /// An effect was added.
    #[serde(rename = "added")]
    Added,
    /// An effect was swapped for another.
    #[serde(rename = "exchanged")]
    Swapped,
    /// The search was restarted with another first effect.
    #[serde(rename = "begun otherwise")]
    Restarted,
    /// An effect was eliminated.
    #[serde(rename = "left out")]
    Eliminated,
    /// One effect was substituted for two.
    #[serde(rename = "one for two")]
    Substituted,
    /// A discrete shape of an effect was changed.
    #[serde(rename = "reshaped")]
    Reshaped,
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
            Self::Reshaped => "shape changed",
        }
    }
}

/// A model that the search passed through.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Change from the model before.
    pub did: Change,
    /// Its effects, each as `effect at kind:name`.
    pub effects: Vec<String>,
    /// Windows that records were cut into; 1: none.
    pub windows: usize,
    /// Its error on calibration and selection data, in units of the noise.
    pub normalised: f64,
}

/// A diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Whether something is missing.
    pub verdict: Verdict,
    /// Probability of the verdict.
    pub probability: f64,
    /// Probability of a residual as structured as this one if nothing were missing, the search over the catalogue included.
    pub p_value: f64,
    /// The effects added.
    pub found: Vec<Found>,
    /// Declared terms found to be wrong.
    pub removed: Vec<Removed>,
    /// The way of the search.
    pub steps: Vec<Step>,
    /// Effects that were tried, best first.
    pub ranked: Vec<Ranked>,
    /// What no effect explains.
    pub unexplained: Option<Unexplained>,
    /// The experiment that would separate what the data cannot tell apart.
    pub next_experiment: Option<String>,
    /// Errors of the model as declared.
    pub before: Vec<ExperimentError>,
    /// Errors of the repaired model.
    pub after: Vec<ExperimentError>,
    /// How the parameters moved.
    pub parameters: Vec<ParameterMove>,
    /// What would have been noticed, where nothing is missing.
    pub noticeable: Vec<Noticeable>,
    /// Where the residual comes from, best place first.
    pub evidence: Vec<Evidence>,
    /// Measured outputs beside what the models predict.
    pub predictions: Vec<Prediction>,
    /// Facts about data and fit that a reader should know.
    pub notes: Vec<String>,
    /// Start values of every experiment in the repaired model: experiment, parameter, value.
    pub starts: Vec<(String, String, f64)>,
    /// Simulations that it took.
    pub simulations: usize,
}
