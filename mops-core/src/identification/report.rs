//! What the tools of identification leave in `result.json`. Numbers that are not finite are written as null.

use serde::Serialize;

/// What the data tell of the tuners at a point.
#[derive(Debug, Clone, Serialize)]
pub struct SensitivityReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// Where the slopes come from: `tangents` or `differences`.
    pub slopes: &'static str,
    /// What is sensitive: `residuals` of measurements, or scaled `criteria`.
    pub of: &'static str,
    /// Number of directions that are determined.
    pub rank: usize,
    /// Singular values of the Jacobian with columns of unit length, falling.
    pub singular_values: Vec<f64>,
    /// Share of the largest below which one counts as zero.
    pub zero: f64,
    /// Every tuner.
    pub tuners: Vec<TunerSensitivity>,
    /// The sensitivity matrix `J' J` in the tuners' own units.
    pub matrix: Vec<Vec<f64>>,
    /// Its eigenvalues, falling.
    pub eigenvalues: Vec<f64>,
    /// An eigenvector of unit length for each, with one number per tuner.
    pub eigenvectors: Vec<Vec<f64>>,
    /// The same for relative changes.
    pub relative: RelativeReport,
    /// Directions along which nothing changes.
    pub directions: Vec<DirectionReport>,
    /// Correlation of the estimates; null where undetermined.
    pub correlations: Vec<Vec<f64>>,
}

/// Eigenvalues and eigenvectors for relative changes of the tuners.
#[derive(Debug, Clone, Serialize)]
pub struct RelativeReport {
    /// What one relative change is: the value, or the range of a tuner that is 0.
    pub scales: Vec<f64>,
    /// Eigenvalues, falling.
    pub eigenvalues: Vec<f64>,
    /// An eigenvector of unit length for each.
    pub eigenvectors: Vec<Vec<f64>>,
}

/// What the data tell of one tuner.
#[derive(Debug, Clone, Serialize)]
pub struct TunerSensitivity {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit of value and errors.
    pub unit: String,
    /// Root of the sum of squared slopes, per relative change of the tuner.
    pub effect: f64,
    /// Standard error; null where undetermined, or where nothing was measured.
    pub std_error: f64,
    /// The same, were all other tuners known.
    pub std_error_alone: f64,
    /// Standard error as a share of what `relative_to` says.
    pub relative_error: f64,
    /// `value`, or `range`: of a start value, which may well be near zero, and of a tuner that is 0.
    pub relative_to: &'static str,
    /// How much wider the error is because the others are not known: at least 1.
    pub inflation: f64,
    /// `determined`, `weak` (uncertain by more than a tenth), or `undetermined`.
    pub trust: &'static str,
}

/// A direction along which nothing changes.
#[derive(Debug, Clone, Serialize)]
pub struct DirectionReport {
    /// What can be estimated, and what cannot.
    pub words: String,
    /// Tuners that take part, with their change as a share of their scale; the largest is 1.
    pub changes: Vec<(String, f64)>,
    /// How much the residuals change when one goes a tenth along it, as a share of what its tuners change one by one.
    pub remaining: f64,
}

/// How rich an input is.
#[derive(Debug, Clone, Serialize)]
pub struct ExcitationReport {
    /// The finding in a sentence or two.
    pub words: String,
    /// The case or experiment, or the file.
    pub case: String,
    /// The input.
    pub input: String,
    /// Its unit.
    pub unit: String,
    /// Number of samples looked at.
    pub samples: usize,
    /// Time between two of them, s.
    pub sample_time: f64,
    /// Order of persistent excitation.
    pub order: usize,
    /// Whether it may be higher: nothing above was tested.
    pub at_least: bool,
    /// Mean square, in the unit squared.
    pub power: f64,
    /// Smallest eigenvalue of the covariances of that order, as a share of the power.
    pub eigenvalue: f64,
    /// The same of the next order, which counts as zero.
    pub next_eigenvalue: Option<f64>,
    /// The same over the whole record, with what happens only once.
    pub transient: Option<f64>,
    /// Share of the power that counts as zero.
    pub zero: f64,
    /// Number of parameters that are to be estimated, start values not counted; null where none are known.
    pub parameters: Option<usize>,
    /// Whether the order suffices for a linear model with as many parameters.
    pub suffices: bool,
    /// Order and smallest eigenvalue as a share of the power.
    pub spectrum: Vec<(usize, f64)>,
}

/// A FIR or ARX model by least squares.
#[derive(Debug, Clone, Serialize)]
pub struct RegressionReport {
    /// Name.
    pub name: String,
    /// The finding in a sentence or two.
    pub words: String,
    /// The experiment.
    pub experiment: String,
    /// The input.
    pub input: String,
    /// The output.
    pub output: String,
    /// Time between two samples, s.
    pub sample_time: f64,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
    /// Name, least-squares estimate, standard error, and recursive estimate of every parameter.
    pub parameters: Vec<(String, f64, f64, f64)>,
    /// Number of parameters that are determined.
    pub rank: usize,
    /// Standard deviation of the residuals, in the unit of the output.
    pub residual: f64,
    /// `100 (1 - |e| / |y - mean y|)` of the prediction one step ahead.
    pub fit_percent: f64,
}
