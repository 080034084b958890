//! Records: the measured samples behind the entries of a residual vector.

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
    /// Index of the first sample among those of the channel.
    first: usize,
    /// Blocks of consecutive residuals, one residual per sample.
    blocks: Vec<Block>,
}

/// Residuals of one row of the study.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// Index of the first residual in the residual vector.
    first: usize,
    /// Residual divided by (simulated - measured), per sample.
    weights: Vec<f64>,
}

impl Record {
    /// Creates a record of one block of residuals that starts at index `first`.
    pub fn new(case: usize, signal: Option<String>, noise: Option<f64>, first: usize, weights: Vec<f64>) -> Self {
        Self { case, signal, noise, first: 0, blocks: vec![Block { first, weights }] }
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.blocks[0].weights.len()
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
        let share = 1.0 / self.blocks.len() as f64;
        self.summed(rows, |weight| if weight > 0.0 { share / weight } else { 0.0 })
    }

    /// Returns rows of the residual vector times their weights, summed over the residuals of every sample.
    ///
    /// The result is the effect of a sample's noise on `rows' * residuals`. Shape: samples x columns.
    pub fn collected(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        self.summed(rows, |weight| weight)
    }

    fn summed(&self, rows: &DMatrix<f64>, factor: impl Fn(f64) -> f64) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), rows.ncols(), |s, k| {
            self.blocks.iter().map(|block| factor(block.weights[s]) * rows[(block.first + s, k)]).sum()
        })
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
                let record = Record::new(case, Some(samples.signal), samples.noise, first, weights);
                Record { first: samples.first, ..record }
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
        let same = |other: &&mut Record| {
            let samples = |of: &Record| (of.case, of.signal.clone(), of.first, of.len());
            record.signal.is_some() && samples(other) == samples(&record)
        };
        match records.iter_mut().find(same) {
            Some(known) => {
                known.noise = known.noise.or(record.noise);
                known.blocks.extend(record.blocks);
            }
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
        record.blocks.push(Block { first: 2, weights: vec![1.0, 3.0] });
        let residuals = [2.0, -4.0, 1.0, -6.0];
        assert_eq!(record.deviations(&residuals), [1.0, -2.0]);
        let rows = DMatrix::from_column_slice(4, 1, &[1.0, 1.0, 10.0, 10.0]);
        assert_eq!(record.collected(&rows).as_slice(), [12.0, 32.0]);
    }
}
