//! Records: the measured samples behind the entries of a residual vector.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::DMatrix;

use mops_core::{
    criterion::{Loss, Samples},
    problem::Problem,
};

/// Samples of one channel in one experiment, with the residuals that they enter.
///
/// Noise in sample `s` changes all residuals of that sample, for every criterion and model.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Index of the experiment's case.
    pub case: usize,
    /// Measured signal; `None` for a criterion that names no samples.
    pub signal: Option<String>,
    /// Declared noise level of one sample, in the unit of the signal.
    pub noise: Option<f64>,
    /// Samples of the record among those of its channel.
    samples: Range<usize>,
    /// Blocks of consecutive residuals, one residual per sample.
    blocks: Vec<Block>,
    /// Large deviations, if the loss is robust and the residuals were replaced.
    pub tail: Option<Tail>,
}

/// Deviations of a record beyond [`FAR`] standard deviations of its noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tail {
    /// Samples of the record with such a deviation.
    pub samples: BTreeSet<usize>,
    /// Number of them with a measured value above the simulated one.
    pub above: usize,
}

/// Deviation beyond which a sample may be an outlier, in standard deviations: 0.3 % of normal noise is farther.
pub const FAR: f64 = 3.0;

/// Residuals of one row of the study.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// Index of the first residual in the residual vector.
    first: usize,
    /// Index of its sample among those of the channel.
    sample: usize,
    /// Residual divided by (simulated - measured), per sample.
    weights: Vec<f64>,
    /// Loss of the deviations, and its unit.
    loss: Loss,
    unit: f64,
}

impl Record {
    /// Creates a record of one block of residuals that starts at index `first`.
    pub fn new(case: usize, signal: Option<String>, noise: Option<f64>, first: usize, weights: Vec<f64>) -> Self {
        let samples = 0..weights.len();
        let block = Block { first, sample: 0, weights, loss: Loss::Squares, unit: 1.0 };
        Self { case, signal, noise, samples, blocks: vec![block], tail: None }
    }

    /// Creates the record of the samples of a criterion whose residuals start at index `first`; `factor` is that of its
    /// residuals.
    fn of(case: usize, samples: Samples, first: usize, factor: f64) -> Self {
        let Samples { signal, first: sample, weights, noise, loss } = samples;
        let weights = weights.iter().map(|weight| factor * weight).collect();
        let mut record = Self::new(case, Some(signal), noise, first, weights);
        record.samples = sample..sample + record.len();
        let block = &mut record.blocks[0];
        (block.sample, block.loss, block.unit) = (sample, loss, noise.unwrap_or(1.0));
        record
    }

    /// Returns the loss of the deviations, and its unit.
    pub fn loss(&self) -> (Loss, f64) {
        (self.blocks[0].loss, self.blocks[0].unit)
    }

    /// Replaces the residuals of a robust loss, and the rows of their Jacobian, by those of the least-squares problem
    /// with the same normal equations: the theory of M-estimates becomes that of least squares.
    ///
    /// With the score `psi` and the deviation `e`, in the unit of the loss, the deviation becomes `psi(e)/mean(psi')`
    /// and the weight of its square `mean(psi')`. White residuals then give the covariance
    /// `s^2 mean(psi^2)/mean(psi')^2 (J'J)^-1`, and the ratio of likelihoods becomes
    /// `(S - S_min) mean(psi')/mean(psi^2)`. Their size shows the noise, so that none is declared. Returns false if
    /// `mean(psi')` is not positive: most samples are outliers, and the theory does not hold; the numbers are then of
    /// no use.
    ///
    /// Source: P. J. Huber, E. M. Ronchetti, Robust Statistics (2nd ed., 2009), sections 6.3, 7.6; F. R. Hampel et al.,
    /// Robust Statistics (1986), section 7.2 (tests).
    #[allow(clippy::cast_precision_loss)]
    pub fn as_squares(&mut self, residuals: &mut [f64], jacobian: &mut DMatrix<f64>) -> bool {
        for block in self.blocks.iter_mut().filter(|block| block.loss != Loss::Squares) {
            let (loss, count) = (block.loss, block.weights.len());
            let deviations = block.deviations(residuals);
            let scores: Vec<[f64; 2]> = deviations.iter().map(|&e| loss.score(e)).collect();
            let mean = scores.iter().map(|[_, change]| change).sum::<f64>() / count as f64;
            if mean <= 0.0 {
                return false;
            }
            let tail = self.tail.get_or_insert_default();
            for (i, (e, [score, _])) in deviations.iter().zip(&scores).enumerate() {
                let weight = mean.sqrt() * block.weights[i];
                residuals[block.first + i] = weight * block.unit * score / mean;
                jacobian.row_mut(block.first + i).apply(|x| *x *= mean.sqrt() / loss.residual(*e)[1]);
                block.weights[i] = weight;
                let sample = block.sample + i - self.samples.start;
                if e.abs() > FAR && tail.samples.insert(sample) {
                    tail.above += usize::from(*e < 0.0);
                }
            }
            self.noise = None;
        }
        true
    }

    /// Replaces the residuals of a robust loss, and the rows of their Jacobian, by those of squares: where they are
    /// mostly misfit, the declared noise alone counts.
    pub fn without_loss(&self, jacobian: &mut DMatrix<f64>, residuals: &[f64]) {
        for block in self.blocks.iter().filter(|block| block.loss != Loss::Squares) {
            for (i, e) in block.deviations(residuals).into_iter().enumerate() {
                jacobian.row_mut(block.first + i).apply(|x| *x /= block.loss.residual(e)[1]);
            }
        }
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Returns the weights of the residuals that a sample enters, with their indices in the residual vector.
    fn of_sample(&self, sample: usize) -> impl Iterator<Item = (usize, f64)> {
        let sample = self.samples.start + sample;
        self.blocks.iter().filter_map(move |block| {
            let index = sample.checked_sub(block.sample)?;
            block.weights.get(index).map(|&weight| (block.first + index, weight))
        })
    }

    /// Returns the mean weight of squared deviations in the sum of squared residuals.
    #[allow(clippy::cast_precision_loss)]
    pub fn weight(&self) -> f64 {
        self.blocks.iter().flat_map(|block| &block.weights).map(|w| w * w).sum::<f64>() / self.len() as f64
    }

    /// Returns simulated minus measured values per sample, averaged over the models that simulate the signal.
    pub fn deviations(&self, residuals: &[f64]) -> Vec<f64> {
        let column = DMatrix::from_column_slice(residuals.len(), 1, residuals);
        self.per_deviation(&column).as_slice().to_vec()
    }

    /// Returns rows of the residual vector divided by their weights; for the Jacobian, the derivatives of the simulated
    /// signal. Shape: samples x columns.
    #[allow(clippy::cast_precision_loss)]
    pub fn per_deviation(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), rows.ncols(), |s, k| {
            let share = 1.0 / self.of_sample(s).count().max(1) as f64;
            let deviation =
                |(index, weight): (usize, f64)| if weight > 0.0 { share / weight * rows[(index, k)] } else { 0.0 };
            self.of_sample(s).map(deviation).sum()
        })
    }

    /// Returns rows of the residual vector times their weights, summed over the residuals of every sample.
    ///
    /// The result is the effect of a sample's noise on `rows' * residuals`. Shape: samples x columns.
    pub fn collected(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), rows.ncols(), |s, k| {
            self.of_sample(s).map(|(index, weight)| weight * rows[(index, k)]).sum()
        })
    }

    /// Returns the weights of the squared deviations of a sample in the sum of squared residuals, summed.
    pub fn weight_of(&self, sample: usize) -> f64 {
        self.of_sample(sample).map(|(_, weight)| weight * weight).sum()
    }

    /// Adds the residuals of another criterion of the channel; samples that both read are one.
    fn add(&mut self, other: Self) {
        self.noise = self.noise.or(other.noise);
        self.samples = self.samples.start.min(other.samples.start)..self.samples.end.max(other.samples.end);
        self.blocks.extend(other.blocks);
    }
}

impl Block {
    /// Returns the deviations in units of the loss.
    fn deviations(&self, residuals: &[f64]) -> Vec<f64> {
        let residuals = &residuals[self.first..self.first + self.weights.len()];
        residuals.iter().zip(&self.weights).map(|(r, weight)| self.loss.deviation(r / (weight * self.unit))).collect()
    }
}

/// Returns the records of a calibration at given values of all tuners; together they contain every residual once.
///
/// Returns `None` if the objective is not a sum of squares, or if a simulation fails.
pub fn records(problem: &Problem, tuners: &[f64]) -> Option<Vec<Record>> {
    let study = problem.study();
    let (mut records, mut first): (Vec<Record>, usize) = (Vec::new(), 0);
    for (index, row) in study.rows().iter().enumerate().filter(|(index, _)| problem.is_minimised(*index)) {
        let case = study.jobs()[row.job].case;
        let factor = problem.residual_factor(index)?;
        let record = match row.criterion.samples(&study.cases()[case]) {
            Some(samples) => Record::of(case, samples, first, factor),
            None => {
                let analysis = problem.analyse_all(row.job, tuners, None).ok()?;
                let count = row
                    .value(&study.cases()[case], &analysis, &study.parameters(&study.jobs()[row.job], tuners))
                    .ok()?
                    .residuals
                    .len();
                Record::new(case, None, None, first, vec![factor; count])
            }
        };
        first += record.len();
        // Samples without a gap between them are one record.
        let meets = |other: &&mut Record| {
            let [a, b] = [&other.samples, &record.samples];
            record.signal.is_some()
                && (other.case, &other.signal) == (case, &record.signal)
                && a.start < b.end
                && b.start < a.end
        };
        match records.iter_mut().find(meets) {
            Some(known) => known.add(record),
            None => records.push(record),
        }
    }
    (first == problem.shape().residuals).then_some(records)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_criteria_on_one_channel_share_the_noise_of_its_samples() {
        let mut record = Record::new(0, Some("y".into()), None, 0, vec![2.0, 2.0]);
        let other = Record::new(0, Some("y".into()), None, 2, vec![1.0, 3.0]);
        record.add(other);
        let residuals = [2.0, -4.0, 1.0, -6.0];
        assert_eq!(record.deviations(&residuals), [1.0, -2.0]);
        let rows = DMatrix::from_column_slice(4, 1, &[1.0, 1.0, 10.0, 10.0]);
        assert_eq!(record.collected(&rows).as_slice(), [12.0, 32.0]);
    }

    #[test]
    fn windows_that_overlap_share_the_samples_in_both() {
        // Samples 0..3 in the first criterion, 2..5 in the second.
        let mut record = Record::new(0, Some("y".into()), None, 0, vec![1.0; 3]);
        let mut other = Record::new(0, Some("y".into()), None, 3, vec![2.0; 3]);
        (other.samples, other.blocks[0].sample) = (2..5, 2);
        record.add(other);
        assert_eq!(record.len(), 5);
        let residuals = [1.0, 2.0, 3.0, 10.0, 8.0, 6.0];
        assert_eq!(record.deviations(&residuals), [1.0, 2.0, 4.0, 4.0, 3.0]);
    }
}
