//! Normalisation of the objectives: 0 at the ideal point, 1 at the axis intercept of the plane through the extreme
//! points.

use nalgebra::{DMatrix, DVector};

/// Ideal point and intercepts found so far.
///
/// Source: K. Deb, H. Jain, IEEE Transactions on Evolutionary Computation 18 (2014) 577-601, section IV C.
#[derive(Debug, Clone, Default)]
pub struct Normalisation {
    ideal: Vec<f64>,
    nadir: Vec<f64>,
    /// Largest value of every objective so far.
    worst: Vec<f64>,
    extremes: Vec<Vec<f64>>,
}

impl Normalisation {
    /// Creates the normalisation of `m` objectives, before any point.
    pub fn new(m: usize) -> Self {
        Self {
            ideal: vec![f64::INFINITY; m],
            nadir: vec![1.0; m],
            worst: vec![f64::NEG_INFINITY; m],
            extremes: Vec::new(),
        }
    }

    /// Updates ideal point and intercepts from the objectives of a generation and their ranks.
    pub fn update(&mut self, objectives: &[f64], ranks: &[u32]) {
        let m = self.ideal.len();
        let rows = || objectives.chunks_exact(m);
        for row in rows() {
            self.ideal.iter_mut().zip(row).for_each(|(ideal, f)| *ideal = ideal.min(*f));
            self.worst.iter_mut().zip(row).for_each(|(worst, f)| *worst = worst.max(*f));
        }
        let front: Vec<&[f64]> = rows().zip(ranks).filter(|(_, rank)| **rank == 0).map(|(row, _)| row).collect();
        // The extreme point of an axis minimises the achievement scalarising function of that axis.
        let extremes: Vec<Vec<f64>> = (0..m)
            .map(|axis| {
                let achievement = |row: &[f64]| {
                    let weight = |k: usize| if k == axis { 1.0 } else { 1e6 };
                    (0..m).map(|k| (row[k] - self.ideal[k]) * weight(k)).fold(0.0, f64::max)
                };
                let all = self.extremes.iter().map(Vec::as_slice).chain(front.iter().copied());
                all.min_by(|a, b| achievement(a).total_cmp(&achievement(b))).map(<[f64]>::to_vec).unwrap_or_default()
            })
            .collect();
        self.extremes = extremes;
        let worst = |k: usize| front.iter().map(|row| row[k]).fold(f64::NEG_INFINITY, f64::max);
        let worst_of_front: Vec<f64> = (0..m).map(worst).collect();
        let intercepts = self.intercepts();
        for k in 0..m {
            let all = rows().map(|row| row[k]).fold(f64::NEG_INFINITY, f64::max);
            let nadir = intercepts.as_ref().map_or(worst_of_front[k], |found| found[k].min(self.worst[k]));
            self.nadir[k] = if nadir - self.ideal[k] > 1e-6 { nadir } else { all };
        }
    }

    /// Computes the axis intercepts of the plane through the extreme points; `None` if there are none.
    fn intercepts(&self) -> Option<Vec<f64>> {
        let m = self.ideal.len();
        let plane = DMatrix::from_fn(m, m, |i, k| self.extremes[i][k] - self.ideal[k]);
        let normal = plane.lu().solve(&DVector::from_element(m, 1.0))?;
        let usable = |k: usize| normal[k].is_finite() && 1.0 / normal[k] > 1e-6;
        (0..m).all(usable).then(|| (0..m).map(|k| self.ideal[k] + 1.0 / normal[k]).collect())
    }

    /// Returns the normalised value of the `k`-th objective.
    pub fn normalised(&self, k: usize, value: f64) -> f64 {
        let range = self.nadir[k] - self.ideal[k];
        if range > 0.0 { (value - self.ideal[k]) / range } else { 0.0 }
    }
}
