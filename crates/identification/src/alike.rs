//! Estimates with every sample weighted by its noise level only.

use crate::noise::Noise;

/// Ratio of sample counts from which on the weights of records are reported.
const UNLIKE: usize = 2;

/// Estimates with every sample weighted by its noise level only, to first order.
#[derive(Debug, Clone)]
pub struct Alike {
    /// Number of samples of the shortest and of the longest record.
    pub samples: [usize; 2],
    /// Change and standard error of the estimate of every active tuner, in its unit.
    pub tuners: Vec<(f64, f64)>,
}

/// Returns the estimates with equal sample weights, or `None` if the records have similar lengths.
pub(crate) fn alike(noise: &Noise) -> Option<Alike> {
    let counts = || noise.records().filter(|record| record.signal.is_some()).map(|record| record.len());
    let samples = [counts().min()?, counts().max()?];
    let tuners = noise.weighted().to_vec();
    let known = tuners.iter().all(|(step, error)| step.is_finite() && error.is_finite());
    (samples[1] > UNLIKE * samples[0] && known).then_some(Alike { samples, tuners })
}
