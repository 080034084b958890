//! Settings of the diagnosis: thresholds, sizes of searches and priors, each with its unit and its basis.
//!
//! "The studies" are the simulated data sets and recordings on which the method was tried first; an "assumption" has not been varied.
//! `mops-bench ablation` shows what an answer depends on.

use std::sync::OnceLock;

/// Value that an ablation multiplies.
trait Scale {
    fn scale(&mut self, factor: f64);
}

impl Scale for f64 {
    fn scale(&mut self, factor: f64) {
        *self *= factor;
    }
}

macro_rules! scale_counts {
    ($($kind:ty),*) => {
        $(impl Scale for $kind {
            #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            #[allow(clippy::cast_lossless)]
            fn scale(&mut self, factor: f64) {
                *self = (*self as f64 * factor).round().max(1.0) as Self;
            }
        })*
    };
}

scale_counts!(usize, u32, i32);

impl<T: Scale, const N: usize> Scale for [T; N] {
    fn scale(&mut self, factor: f64) {
        self.iter_mut().for_each(|value| value.scale(factor));
    }
}

macro_rules! settings {
    ($($(#[$doc:meta])* $name:ident: $kind:ty = $value:expr;)*) => {
        /// Settings of the diagnosis.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Settings {
            $($(#[$doc])* pub $name: $kind,)*
        }

        impl Default for Settings {
            fn default() -> Self {
                Self { $($name: $value,)* }
            }
        }

        impl Settings {
            /// Names of all settings.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];

            /// Returns the settings with one of them multiplied by a factor; `None` if there is none of this name.
            #[must_use]
            pub fn scaled(mut self, name: &str, factor: f64) -> Option<Self> {
                match name {
                    $(stringify!($name) => self.$name.scale(factor),)*
                    _ => return None,
                }
                Some(self)
            }
        }
    };
}

settings! {
    // Verdict.

    /// Gain of a free curve from which it fires, nats. Basis: the studies; no curve fired in 156 data sets without an effect.
    fires: f64 = 6.0;
    /// Share of the gain in log-likelihood of a set up to which a curve on top of it is small. Basis: the studies.
    small: f64 = 0.3;
    /// Share of the forecast error above noise that a set must remove where a curve on top of it fires, where it is not first by
    /// evidence, or where only the ends of the calibration records are forecast; there also its probability. Basis: the studies.
    most: f64 = 0.8;
    /// Share of the mean square error above noise of calibration records that a set must explain for other effects of its classes to
    /// be tried in it. Basis: the least share that is called most.
    explained: f64 = 0.5;
    /// Share of the forecast error without it that an effect must remove to be claimed. Basis: an assumption.
    least: f64 = 0.1;
    /// Posterior probability from which class and place are claimed, and the largest one stated of a set that is not first by
    /// evidence. Basis: the studies.
    claimed: f64 = 0.9;
    /// Probability that none of the candidates is right. Basis: of what was stated with 99 %, 93 to 96 % was right in the studies.
    other: f64 = 0.05;
    /// Root mean square error of a record from which a significant lack of fit matters, noises. Basis: an assumption.
    matters: f64 = 1.1;
    /// Share of a calibration record that parameters are fitted to where its end is forecast. Basis: the studies.
    beginning: f64 = 0.6;
    /// Twice a difference of log-evidence from which it is strong: of sets that differ less, the simplest is named. Also the squared
    /// distance of two predictions, in squared noises, from which data distinguish them. Source: R. E. Kass, A. E. Raftery, Bayes
    /// factors, Journal of the American Statistical Association 90 (1995) 773, section 3.2.
    strong: f64 = 6.0;
    /// Cosine of the changes of the outputs from which the records cannot tell two effects apart. Basis: an assumption.
    alike: f64 = 0.98;
    /// Gain in log-likelihood below which an effect under every error model does nothing, nats. Basis: an assumption.
    inert: f64 = 0.3;
    /// Standard errors by which an estimate differs clearly from another one. Basis: a normal error exceeds them in 0.3 %.
    clearly: f64 = 3.0;
    /// Standard errors up to which a declared term may be 0. Basis: a 95 % interval.
    uncertain: f64 = 2.0;
    /// Cosine of the responses from which a declared term acts at the place of an effect. Basis: an assumption.
    same_place: f64 = 0.999;

    // Search over sets.

    /// Candidates that are fitted after a screening, by gain under the correlated error models; also the effects of one class
    /// at one place that are fitted in place of another one. Basis: the truth was among the first eight in 98 to 100 % of the studies.
    singles: usize = 8;
    /// Further candidates by gain in white noise. Basis: the studies.
    by_squares: usize = 2;
    /// Pairs that are fitted. Basis: the studies.
    pairs: usize = 10;
    /// Single effects and pairs of an expansion that are fitted under all error models. Basis: an assumption.
    in_full: [usize; 2] = [4, 3];
    /// Sets that are fitted roughly before what they have reached decides which others are hopeless. Basis: an assumption.
    at_a_time: usize = 4;
    /// Gain that a pair must bring for each parameter beyond two to be fitted before another one, nats. Basis: an assumption.
    per_parameter: f64 = 3.0;
    /// Sets that are expanded at a time, and most probable sets whose effects are exchanged. Basis: an assumption.
    beam: usize = 3;
    /// Sets that are expanded in all. Basis: an assumption.
    expansions: usize = 5;
    /// Logarithm of the probability relative to a more probable set below which a set does not count. Basis: less than 1 %.
    negligible: f64 = 5.0;
    /// Distance below the best from which a fit is given up, nats. Basis: an assumption.
    hopeless: f64 = 15.0;
    /// Largest expected ratio of an actual gain to that predicted to first order. Basis: the studies.
    allowance: f64 = 1.5;
    /// Guesses of a candidate that are kept beside the best one. Basis: an assumption.
    other_guesses: usize = 2;
    /// Share of the best guess's gain that another guess must have to be kept. Basis: an assumption.
    near_guess: f64 = 0.3;

    // Records.

    /// Share of the differences of samples that must be multiples of the smallest one for a quantisation. Basis: the studies.
    quantised: f64 = 0.9;

    /// Largest number of samples by which a recorded input may act before its time stamps. Basis: the studies.
    earlier: i32 = 3;

    // Starts of a fit.

    /// Iterations of a first look at a start. Basis: an assumption.
    look: usize = 5;
    /// Starts that are fitted to the end; of more, the likeliest third is followed for an iteration, the best third of these for two
    /// more, and so on. Source: K. Jamieson, A. Talwalkar, Non-stochastic best arm identification and hyperparameter
    /// optimization, AISTATS (2016).
    followed: usize = 3;
    /// Distance of two optima from which each is a start for the other's error model, standard errors. Basis: an assumption.
    apart: f64 = 0.5;
    /// Decrease of log-likelihood from which a set fits worse than one that it contains, nats. Basis: an assumption.
    worse: f64 = 0.5;
    /// Distances from 0 at which an initial state of an effect is tried, scales. Basis: an assumption.
    distances: [f64; 6] = [-5.0, 5.0, -10.0, 10.0, -20.0, 20.0];
    /// Iterations in which the other unknowns follow one that is moved. Basis: an assumption.
    follow: usize = 2;
    /// Share of its strength with which an effect is added to the optimum of a set that lacks it. Basis: an assumption.
    faint: f64 = 0.05;
    /// Windows that each record is first cut into, initial states free in each; then half as many. Basis: an assumption.
    windows: usize = 8;
    /// Starts of the declared model in the box of its bounds, beside that of the study. Basis: the studies.
    spread: usize = 8;
    /// Starts of the declared model that are followed to the end. Basis: the studies.
    roots: usize = 2;
    /// Relative difference of two sums of squares up to which two starts have arrived at the same optimum. Basis: an assumption.
    same_optimum: f64 = 1e-3;

    // Fits.

    /// Error of a step of a simulation, noises. Basis: an error of a few hundredths of the noise is indistinguishable from it.
    step_error: f64 = 0.03;
    /// Loosest relative tolerance of a simulation. Basis: an assumption.
    loosest: f64 = 1e-5;
    /// Largest number of iterations of a fit; of a rough one half of it. Basis: an assumption.
    iterations: usize = 60;
    /// Rounds of parameters and hyperparameters. Basis: an assumption.
    rounds: usize = 8;
    /// Iterations of the parameters in a round, and of a start of the declared model. Basis: an assumption.
    round_iterations: usize = 10;
    /// Predicted decrease of the sum of squares, relative to its mean per residual, below which a fit has converged. Basis: the
    /// studies.
    converged: f64 = 0.01;
    /// Predicted decrease of log-likelihood where a rough fit ends, nats. Basis: an assumption.
    roughly: f64 = 0.1;
    /// Share of the sum of squares by which each of `look` iterations in a row must decrease it, or a rough fit ends. Basis: an
    /// assumption.
    stalls: f64 = 0.01;
    /// Gain in log-likelihood, or decrease of a penalty, below which rounds end, nats. Basis: the studies.
    settled: f64 = 0.05;
    /// Predicted gain below which the search of hyperparameters ends, nats. Basis: an assumption.
    fine: f64 = 1e-3;
    /// Longest step of the logarithm of a hyperparameter. Basis: an assumption.
    longest_step: f64 = 2.0;
    /// Iterations of a smoothed motion. Basis: the studies.
    smoothings: usize = 12;
    /// Trials of a step of a smoothed motion. Basis: an assumption.
    shortenings: usize = 6;
    /// Ratio of a trial to the one before. Basis: an assumption.
    shorter: f64 = 0.4;
    /// Trials for each parameter that no derivative moves. Basis: an assumption.
    trials: usize = 24;
    /// Halvings of their stride, from which the end of an interval is searched with twice as many doublings. Basis: an assumption.
    halvings: i32 = 8;
    /// Turns of all such parameters. Basis: an assumption.
    turns: usize = 3;
    /// Bisections in the search for the end of an interval. Basis: an assumption.
    bisections: usize = 6;
    /// Steps of a simulation of a candidate for each sample, beyond which it is too stiff. Basis: an assumption.
    steps_per_sample: f64 = 6.0;
    /// Steps of a simulation of a candidate beyond which it is too stiff, relative to those of the declared model. Basis: an assumption.
    times_declared: f64 = 3.0;
    /// Steps of a simulation of a candidate beside these. Basis: an assumption.
    few_steps: f64 = 1000.0;
    /// Multiple of all these for records that no parameter is fitted to. Basis: an assumption.
    other_records: f64 = 5.0;

    // Error models.

    /// Prior standard deviation of the logarithm of the deviation of an error model. Basis: the studies.
    deviation_prior: f64 = 1.5;
    /// Prior standard deviation of the logarithm of a noise level. Basis: the studies.
    noise_prior: f64 = 1.0;
    /// Smallest noise, as a share of that of the sensor. Basis: the studies.
    least_noise: f64 = 0.3;
    /// Smallest correlation length, samples. Basis: the studies.
    shortest: f64 = 0.3;
    /// Starts of the correlation length, samples. Basis: the studies.
    lengths: [f64; 2] = [1.0, 10.0];
    /// Largest correlation length of a rough error, as a share of the longest record. Basis: the studies.
    longest_rough: f64 = 0.25;
    /// Range of the deviation of forces, nominal forces. Basis: an assumption.
    forces: [f64; 2] = [1e-6, 50.0];
    /// Range of an output deviation: share of the sensor's noise, and multiple of the larger of residual and noise. Basis: an
    /// assumption.
    outputs: [f64; 2] = [0.02, 100.0];

    // Priors.

    /// Standard deviation of a declared parameter, in its logarithm or its scale. Basis: the studies.
    declared_prior: f64 = 1.5;
    /// Standard deviation of an initial state, scales. Basis: the studies.
    start_prior: f64 = 3.0;
    /// Standard deviation of a parameter with a null value, typical sizes at its place, and of the logarithm of the steepness of a
    /// contact or an edge, which data know from below only. Basis: the studies.
    strength_prior: f64 = 2.0;
    /// Standard deviation of the logarithm of a shape. Basis: the studies.
    shape_prior: f64 = 1.0;
    /// Standard deviation of a gain. Basis: the studies.
    gain_prior: f64 = 0.3;
    /// Standard deviation of an offset of a sensor, ranges. Basis: the studies.
    offset_prior: f64 = 0.1;

    // Free curves.

    /// Standard deviation of the gain of an input beside which curves over that input are judged: with a smaller gain and smaller
    /// parameters of the plant every unknown force is smaller, which looks like a dependence on the input. Basis: an assumption.
    input_gain: f64 = 1.0;
    /// Share of the visited values below the first and above the last centre. Basis: the studies.
    outside: f64 = 0.005;
    /// Standard deviations of the weights that are tried, nominal forces. Basis: the studies.
    weights: [f64; 4] = [0.005, 0.02, 0.06, 0.2];
    /// Logarithms by which the deviation of the error model is tried smaller. Basis: the studies.
    shrinks: [f64; 6] = [0.0, -0.5, -1.0, -1.6, -2.3, -3.2];
    /// Nats taken off every gain for the choice of the deviations. Basis: the logarithm of their number, about.
    choice: f64 = 2.3;

    // What the records must show of a candidate, and the values that are tried.

    /// Periods of what repeats along a position or in time; turns of an angle that is also a coordinate modulo one turn. Basis: the
    /// studies.
    periods_seen: f64 = 1.5;
    /// Samples that an event lasts, or that are at a limit. Basis: the studies.
    samples_seen: usize = 3;
    /// Share of a record that an event lasts at most. Basis: the studies.
    event_share: f64 = 0.25;
    /// Share of the range visited that is free of a stop or an overflow, as what always acts is a spring or a loss; share of the way that
    /// goes back where a hysteresis shows itself. Basis: an assumption.
    free_of_it: f64 = 0.25;
    /// Longest displacement over which a force builds up, as a share of the range visited: over a longer one it is a spring. Basis: an
    /// assumption.
    built_up: f64 = 0.5;
    /// Noises within which samples are at a limit, and from which steps of samples are visible. Basis: the studies.
    visible: f64 = 2.0;
    /// Share of the largest acceleration that a declared spring must have, and of the largest speed below which a motion is at rest.
    /// Basis: an assumption.
    slight: f64 = 1e-3;
    /// Shortest time constant, samples. Basis: after ten of them, at the next sample, 5e-5 of the change is left.
    fastest: f64 = 0.1;
    /// Multiple of the largest value tried that a shape may have, and widths beyond a range. Basis: an assumption.
    farthest: f64 = 10.0;
    /// Frequencies tried from one number of periods in the record to the next. Basis: an assumption.
    per_period: f64 = 1.5;
    /// Most periods in a record. Basis: an assumption.
    most_periods: f64 = 160.0;
    /// Steps of a quantised sensor up to the largest value of which all sizes are tried. Basis: an assumption.
    most_steps: u32 = 24;
    /// Finest steps that samples show, noises: the mean cosine is there `exp(-2 pi^2 / 5^2)`, 0.45. Basis: an assumption.
    noises_per_step: f64 = 5.0;
    /// Mean cosine from which values are multiples of a quantum. Basis: values that scatter about them by a fifth of it.
    quantum_cosine: f64 = 0.45;
    /// Share of the best mean cosine that a larger quantum must have to be taken. Basis: an assumption.
    quantum_share: f64 = 0.8;
    /// Noises within which samples show one value, the middle of a gap. Basis: 99 % of a normal error.
    gap_core: f64 = 2.5;
    /// Samples of one value beside which there are none, and next to none. Basis: an assumption.
    gap_samples: [usize; 2] = [5, 20];
    /// Distances from that value up to which there are next to none, and none, noises. Basis: a gap of seven noises, into which the
    /// noise of the samples beside it reaches.
    gap_edges: [f64; 2] = [4.5, 8.5];
    /// Share of the samples of one value that "next to none" are at most. Basis: about a motion in passing they are four fifths.
    gap_share: f64 = 0.15;

    // Report.

    /// Ratio from which the noise of a sensor is another than the study has. Basis: the studies.
    wrong_noise: f64 = 1.5;

    /// Periods in a window of a record. Source: H. G. Bock, Recent advances in parameter identification techniques for ODE, in
    /// Numerical Treatment of Inverse Problems (1983) 95, for windows; two to four periods keep the phase and still show slow changes.
    window_periods: f64 = 4.0;
    /// Largest number of windows of a record. Basis: an assumption.
    most_windows: f64 = 32.0;
    /// Factors by which inputs or start values are varied for the next experiment. Basis: an assumption.
    variations: [f64; 4] = [0.3, 0.5, 2.0, 3.0];
    /// Ratio to the distance of the predictions as they were from which a variation is worth an experiment. Basis: an assumption.
    worth: f64 = 1.5;
}

static SETTINGS: OnceLock<Settings> = OnceLock::new();

/// Returns the settings of this process.
pub fn settings() -> &'static Settings {
    SETTINGS.get_or_init(Settings::default)
}

/// Sets the settings of this process, for an ablation.
///
/// # Panics
/// If settings are in use already.
pub fn use_settings(settings: Settings) {
    assert!(SETTINGS.set(settings).is_ok(), "settings are in use already");
}
