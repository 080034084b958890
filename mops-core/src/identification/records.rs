//! Records: the measured samples behind the entries of a residual vector.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::problem::Problem;

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
}

/// Residuals of one row of the study.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// Index of the first residual in the residual vector.
    first: usize,
    /// Index of its sample among those of the channel.
    sample: usize,
    /// Residual divided by (simulated - measured), per sample.
    weights: Vec<f64>,
}

impl Record {
    /// Creates a record of one block of residuals that starts at index `first`.
    pub fn new(case: usize, signal: Option<String>, noise: Option<f64>, first: usize, weights: Vec<f64>) -> Self {
        let samples = 0..weights.len();
        Self { case, signal, noise, samples, blocks: vec![Block { first, sample: 0, weights }] }
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

    /// Adds the residuals of another criterion of the channel; samples that both read are one.
    fn add(&mut self, other: Self) {
        self.noise = self.noise.or(other.noise);
        self.samples = self.samples.start.min(other.samples.start)..self.samples.end.max(other.samples.end);
        self.blocks.extend(other.blocks);
    }
}

/// Returns the records of a calibration at given values of all tuners; together they contain every residual once.
///
/// Returns `None` if the objective is not a sum of squares, or if a simulation fails.
pub fn records(problem: &Problem, tuners: &[f64]) -> Option<Vec<Record>> {
    let study = problem.study();
    let (mut records, mut first): (Vec<Record>, usize) = (Vec::new(), 0);
    for (index, row) in study.rows.iter().enumerate().filter(|(index, _)| problem.is_minimised(*index)) {
        let case = study.jobs[row.job].case;
        let factor = problem.residual_factor(index)?;
        let record = match row.criterion.samples(&study.cases[case]) {
            Some(samples) => {
                let weights = samples.weights.iter().map(|weight| factor * weight).collect();
                let mut record = Record::new(case, Some(samples.signal), samples.noise, first, weights);
                record.samples = samples.first..samples.first + record.len();
                record.blocks[0].sample = samples.first;
                record
            }
            None => {
                let analysis = problem.analyse_all(row.job, tuners, None).ok()?;
                let count = row
                    .value(&study.cases[case], &analysis, &study.parameters(&study.jobs[row.job], tuners))
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
        record.blocks.push(Block { first: 2, sample: 0, weights: vec![1.0, 3.0] });
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
