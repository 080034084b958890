//! Settings of the diagnosis: what a statistician would argue about, each with its unit and its basis. Iterations and
//! tolerances are constants of their methods.
//!
//! "The studies" are the simulated data sets and recordings on which the method was tried first. `mops-bench ablation`
//! shows which answers a setting changes.

use serde::{Deserialize, Serialize};

/// Settings of the diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    // Verdict.
    /// Gain of a free curve from which it fires, nats. Basis: the studies; no curve fired in 156 data sets without an
    /// effect.
    pub fires: f64,
    /// Share of the gain in log-likelihood of a set up to which a curve on top of it is small. Basis: the studies.
    pub small: f64,
    /// Share of the forecast error above noise that a set must remove where a curve on top of it fires, where it is not
    /// first by evidence, or where only the ends of the calibration records are forecast; there also its probability.
    /// Basis: the studies.
    pub most: f64,
    /// Share of the mean square error above noise of calibration records that a set must explain for other effects of
    /// its classes to be tried in it. Basis: the least share that is called most.
    pub explained: f64,
    /// Share of the root mean square error above noise of the declared model of which an effect alone leaves little, on
    /// calibration and on selection records. Basis: falls of balls, a rack; from 0.17 to 0.33 the answers are the same.
    pub little: f64,
    /// Share of the forecast error without it that an effect must remove to be claimed. Basis: an assumption.
    pub least: f64,
    /// Posterior probability from which class and place are claimed, and the largest one stated of a set that is not
    /// first by evidence. Basis: the studies.
    pub claimed: f64,
    /// Probability that none of the candidates is right. Basis: of what was stated with 99 %, 93 to 96 % was right in
    /// the studies.
    pub other: f64,
    /// Root mean square error of a record from which a significant lack of fit matters, noises. Basis: an assumption.
    pub matters: f64,
    /// Share of a calibration record that parameters are fitted to where its end is forecast; what is left of one is
    /// the share of another record that initial states of effects are fitted to. Basis: the studies.
    pub beginning: f64,
    /// Cosine of the changes of the outputs from which the records cannot distinguish two effects. Basis: an
    /// assumption.
    pub alike: f64,
    /// Gain in log-likelihood below which an effect under every error model does nothing, nats. Basis: an assumption.
    pub inert: f64,

    // Search over sets.
    /// Candidates that are fitted after a screening, by gain under the correlated error models; also the effects of one
    /// class at one place that are fitted in place of another one. Basis: the truth was among the first eight in 98 to
    /// 100 % of the studies.
    pub singles: usize,
    /// Further candidates by gain in white noise. Basis: the studies.
    pub by_squares: usize,
    /// Pairs that are fitted. Basis: the studies.
    pub pairs: usize,
    /// Sets that are expanded at a time, and most probable sets whose effects are exchanged. Basis: an assumption.
    pub beam: usize,
    /// Sets that are expanded in all. Basis: an assumption.
    pub expansions: usize,
    /// Largest number of samples by which a recorded input may act before its time stamps. Basis: the studies.
    pub earlier: i32,

    // Priors.
    /// Prior standard deviation of the logarithm of the deviation of an error model. Basis: the studies.
    pub deviation_prior: f64,
    /// Prior standard deviation of the logarithm of a noise level. Basis: the studies.
    pub noise_prior: f64,
    /// Standard deviation of a declared parameter, in its logarithm or its scale. Basis: the studies.
    pub declared_prior: f64,
    /// Standard deviation of an initial state, scales. Basis: the studies.
    pub start_prior: f64,
    /// Standard deviation of a parameter with a null value, typical sizes at its place, and of the logarithm of the
    /// steepness of a contact or an edge, which data know from below only. Basis: the studies.
    pub strength_prior: f64,
    /// Standard deviation of the logarithm of a shape. Basis: the studies.
    pub shape_prior: f64,
    /// Standard deviation of a gain. Basis: the studies.
    pub gain_prior: f64,
    /// Standard deviation of an offset of a sensor, ranges. Basis: the studies.
    pub offset_prior: f64,
    /// Standard deviation of the gain of an input beside which curves over that input are judged: with a smaller gain
    /// and smaller parameters of the plant every unknown force is smaller, which looks like a dependence on the input.
    /// Basis: an assumption.
    pub input_gain: f64,

    /// What the records must show of a candidate.
    pub coverage: Coverage,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            fires: 6.0,
            small: 0.3,
            most: 0.8,
            explained: 0.5,
            little: 0.2,
            least: 0.1,
            claimed: 0.9,
            other: 0.05,
            matters: 1.1,
            beginning: 0.6,
            alike: 0.98,
            inert: 0.3,
            singles: 8,
            by_squares: 2,
            pairs: 10,
            beam: 3,
            expansions: 5,
            earlier: 3,
            deviation_prior: 1.5,
            noise_prior: 1.0,
            declared_prior: 1.5,
            start_prior: 3.0,
            strength_prior: 2.0,
            shape_prior: 1.0,
            gain_prior: 0.3,
            offset_prior: 0.1,
            input_gain: 1.0,
            coverage: Coverage::DEFAULT,
        }
    }
}

/// What the records must show of a candidate to be one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Periods of what repeats along a position or in time; turns of an angle that is also a coordinate modulo one
    /// turn. Basis: the studies.
    pub periods: f64,
    /// Samples that an event lasts, or that are at a limit. Basis: the studies.
    pub samples: usize,
    /// Share of a record that an event lasts at most. Basis: the studies.
    pub event: f64,
    /// Share of the range visited that is free of a stop or an overflow, as what always acts is a spring or a loss;
    /// share of the way that goes back where a hysteresis shows itself. Basis: an assumption.
    pub free: f64,
    /// Longest displacement over which a force builds up, as a share of the range visited: over a longer one it is a
    /// spring. Basis: an assumption.
    pub build_up: f64,
    /// Noises within which samples are at a limit, and from which steps of samples are visible. Basis: the studies.
    pub visible: f64,
}

impl Coverage {
    /// The values as they are without an ablation.
    pub const DEFAULT: Self = Self { periods: 1.5, samples: 3, event: 0.25, free: 0.25, build_up: 0.5, visible: 2.0 };
}
