//! Identification results in `result.json`. Non-finite numbers are written as null.

use schemars::JsonSchema;
use serde::Serialize;

/// Identifiability of the tuners at a point.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SensitivityReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Source of the derivatives: `tangents` or `differences`.
    pub slopes: &'static str,
    /// Sensitive quantities: `residuals` of measurements, or scaled `criteria`.
    pub of: &'static str,
    /// Number of determined directions.
    pub rank: usize,
    /// Singular values of the Jacobian with unit-length columns, descending.
    pub singular_values: Vec<f64>,
    /// Share of the largest singular value below which one counts as zero.
    pub zero: f64,
    /// Sensitivity of every tuner.
    pub tuners: Vec<TunerSensitivity>,
    /// Sensitivity matrix `J' J` in the tuners' own units.
    pub matrix: Vec<Vec<f64>>,
    /// Eigenvalues of the sensitivity matrix, descending.
    pub eigenvalues: Vec<f64>,
    /// Unit-length eigenvector of each eigenvalue, with one number per tuner.
    pub eigenvectors: Vec<Vec<f64>>,
    /// Eigenvalues and eigenvectors for relative changes.
    pub relative: RelativeReport,
    /// Directions that are not determined.
    pub directions: Vec<DirectionReport>,
    /// Correlations of the estimates; null where undetermined.
    pub correlations: Vec<Vec<f64>>,
}

/// Eigenvalues and eigenvectors for relative changes of the tuners.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RelativeReport {
    /// Scale of a relative change: the value, or the range of a tuner that is 0.
    pub scales: Vec<f64>,
    /// Eigenvalues, descending.
    pub eigenvalues: Vec<f64>,
    /// Unit-length eigenvector of each eigenvalue.
    pub eigenvectors: Vec<Vec<f64>>,
}

/// Sensitivity and accuracy of one tuner.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TunerSensitivity {
    /// Name of the tuner.
    pub name: String,
    /// Value of the tuner.
    pub value: f64,
    /// Unit of the value and the errors.
    pub unit: String,
    /// Root of the sum of squared derivatives, per relative change of the tuner.
    pub effect: f64,
    /// Standard error; null if undetermined or without measurements.
    pub std_error: f64,
    /// Standard error if all other tuners were known.
    pub std_error_alone: f64,
    /// Standard error relative to the quantity named in `relative_to`.
    pub relative_error: f64,
    /// Reference of the relative error: `value`, or `range` for an initial state, which may be near zero, for a tuner
    /// that is 0, and for a temperature in degC or degF.
    pub relative_to: &'static str,
    /// Factor by which the error grows because the other tuners are unknown: at least 1.
    pub inflation: f64,
    /// Class of the estimate: `determined`, `weak` (standard error above 10 %), or `undetermined`.
    pub trust: &'static str,
}

/// Direction that is not determined.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DirectionReport {
    /// Clause that states what can be estimated, and what cannot.
    pub words: String,
    /// Tuners that take part, with their change relative to their scale; the largest is 1.
    pub changes: Vec<(String, f64)>,
    /// Change of the residuals for a 10 % step along the direction, relative to steps of its single tuners.
    pub remaining: f64,
    /// True if a criterion changes for that step, although its derivatives along the direction are 0.
    pub has_effect: bool,
}

/// Persistent excitation of an input.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ExcitationReport {
    /// Finding in a sentence or two.
    pub words: String,
    /// Name of the case, experiment or file.
    pub case: String,
    /// Name of the input.
    pub input: String,
    /// Unit of the input.
    pub unit: String,
    /// Number of samples used.
    pub samples: usize,
    /// Sample time, s.
    pub sample_time: f64,
    /// Order of persistent excitation.
    pub order: usize,
    /// True if the order may be higher because no higher order was tested.
    pub at_least: bool,
    /// Mean square of the signal, in the unit squared.
    pub power: f64,
    /// Smallest eigenvalue of the covariance matrix of that order, relative to the power.
    pub eigenvalue: f64,
    /// Smallest eigenvalue of the next order, which counts as zero, relative to the power.
    pub next_eigenvalue: Option<f64>,
    /// Smallest eigenvalue of the next order over the whole record, transients included, relative to the power.
    pub transient: Option<f64>,
    /// Share of the power that counts as zero.
    pub zero: f64,
    /// Number of parameters to be estimated, initial states excluded; null if unknown.
    pub parameters: Option<usize>,
    /// True if the order suffices for a linear model with that many parameters.
    pub suffices: bool,
    /// Orders and smallest eigenvalues relative to the power.
    pub spectrum: Vec<(usize, f64)>,
}

/// FIR or ARX model estimated by least squares.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RegressionReport {
    /// Name of the model.
    pub name: String,
    /// Finding in a sentence or two.
    pub words: String,
    /// Name of the experiment.
    pub experiment: String,
    /// Name of the input.
    pub input: String,
    /// Name of the output.
    pub output: String,
    /// Sample time, s.
    pub sample_time: f64,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
    /// Name, least-squares estimate, standard error, and recursive estimate of every parameter.
    pub parameters: Vec<(String, f64, f64, f64)>,
    /// Number of determined parameters.
    pub rank: usize,
    /// Standard deviation of the residuals, in the unit of the output.
    pub residual: f64,
    /// Fit `100 (1 - |e| / |y - mean y|)` of the one-step-ahead prediction.
    pub fit_percent: f64,
}

crate::finding!(SensitivityReport, "sensitivity", "Identifiability of the tuners from the data or the criteria.");
