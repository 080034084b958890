//! A quadratic model of every row through the points around the best one.

use nalgebra::{DMatrix, DVector};

use crate::active_set::dot;

/// A quadratic `c + g y + y'H y / 2` of a row.
#[derive(Debug, Clone)]
struct Quadratic {
    constant: f64,
    slope: DVector<f64>,
    curvature: DMatrix<f64>,
}

/// `y'H y`, with room for `H y`.
fn form(h: &DMatrix<f64>, y: &DVector<f64>, room: &mut DVector<f64>) -> f64 {
    room.gemv(1.0, h, y, 0.0);
    y.dot(room)
}

/// What a unit of squared misfit costs, in units of squared curvature over the trust region.
const MISS: f64 = 1e-4;

/// Models of all rows in the steps `y = (x - centre) / radius`.
#[derive(Debug, Clone)]
pub struct Models {
    rows: Vec<Quadratic>,
}

impl Models {
    /// The models through given values at given steps whose curvatures differ least (in the Frobenius norm) from earlier ones,
    /// which are per unit of the box; `None` where the steps do not determine them. `values[i]` has the rows at `steps[i]`.
    ///
    /// With `A_ij = (y_i y_j)^2 / 2` and `X = [1 y]`: `[A + mu I, X; X', 0] [l; c, g] = [f - y'H_0 y / 2; 0]`, and
    /// `H = H_0 + sum l_i y_i y_i'`. The small `mu` lets the models miss values by as little as the curvature would have to
    /// change much for: points that nearly coincide would bend them beyond reason.
    ///
    /// Source: A. R. Conn, K. Scheinberg, L. N. Vicente, Introduction to Derivative-Free Optimization (SIAM 2009), section
    /// 5.3; least change: M. J. D. Powell, Mathematical Programming 100 (2004) 183-215.
    pub fn through(steps: &[Vec<f64>], values: &[&[f64]], earlier: &[DMatrix<f64>], radius: f64) -> Option<Self> {
        let (count, n) = (steps.len(), steps.first()?.len());
        let size = count + n + 1;
        let mut system = DMatrix::zeros(size, size);
        for i in 0..count {
            for j in 0..=i {
                let product = 0.5 * dot(&steps[i], &steps[j]).powi(2);
                system[(i, j)] = product;
                system[(j, i)] = product;
            }
            system[(i, i)] += MISS;
            system[(i, count)] = 1.0;
            system[(count, i)] = 1.0;
            for k in 0..n {
                system[(i, count + 1 + k)] = steps[i][k];
                system[(count + 1 + k, i)] = steps[i][k];
            }
        }
        let columns: Vec<DVector<f64>> = steps.iter().map(|step| DVector::from_column_slice(step)).collect();
        let earlier: Vec<DMatrix<f64>> = earlier.iter().map(|h| h * (radius * radius)).collect();
        let mut room = DVector::zeros(n);
        let right = DMatrix::from_fn(size, earlier.len(), |i, row| {
            if i >= count {
                return 0.0;
            }
            values[i][row] - 0.5 * form(&earlier[row], &columns[i], &mut room)
        });
        let found = system.lu().solve(&right)?;
        if !found.iter().all(|v| v.is_finite()) {
            return None;
        }
        let quadratic = |(row, earlier): (usize, DMatrix<f64>)| {
            let mut curvature = earlier;
            for (i, y) in columns.iter().enumerate() {
                curvature.ger(found[(i, row)], y, y, 1.0);
            }
            let slope = DVector::from_fn(n, |k, _| found[(count + 1 + k, row)]);
            Quadratic { constant: found[(count, row)], slope, curvature }
        };
        Some(Self { rows: earlier.into_iter().enumerate().map(quadratic).collect() })
    }

    /// The curvatures, per unit of the box.
    pub fn curvatures(&self, radius: f64) -> Vec<DMatrix<f64>> {
        self.rows.iter().map(|q| &q.curvature / (radius * radius)).collect()
    }

    /// Values of all rows after a step.
    pub fn values(&self, y: &DVector<f64>) -> Vec<f64> {
        let mut room = DVector::zeros(y.len());
        let value = |q: &Quadratic| q.constant + q.slope.dot(y) + 0.5 * form(&q.curvature, y, &mut room);
        self.rows.iter().map(value).collect()
    }

    /// Slopes of all rows after a step.
    pub fn slopes(&self, y: &DVector<f64>) -> Vec<Vec<f64>> {
        self.rows.iter().map(|q| (&q.slope + &q.curvature * y).iter().copied().collect()).collect()
    }

    /// The sum of the curvatures with given weights.
    pub fn curvature(&self, weights: impl Iterator<Item = f64>) -> DMatrix<f64> {
        let n = self.rows.first().map_or(0, |q| q.slope.len());
        let mut sum = DMatrix::zeros(n, n);
        for (q, weight) in self.rows.iter().zip(weights) {
            if weight != 0.0 {
                sum += &q.curvature * weight;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_points_give_a_quadratic_back() {
        let f = |y: &[f64]| 1.0 + 2.0 * y[0] - y[1] + 3.0 * y[0] * y[0] + y[0] * y[1] - 0.5 * y[1] * y[1];
        let steps: Vec<Vec<f64>> =
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]].map(|y| y.to_vec()).into();
        let values: Vec<Vec<f64>> = steps.iter().map(|y| vec![f(y)]).collect();
        let rows: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let models = Models::through(&steps, &rows, &[DMatrix::zeros(2, 2)], 1.0).unwrap();
        let y = DVector::from_vec(vec![0.3, -0.8]);
        assert!((models.values(&y)[0] - f(&[0.3, -0.8])).abs() < 1e-3);
        assert!((models.slopes(&y)[0][0] - (2.0 + 6.0 * 0.3 - 0.8)).abs() < 1e-3);
    }

    #[test]
    fn few_points_give_a_plane() {
        let steps = vec![vec![0.0, 0.0], vec![1.0, 0.0], vec![0.0, 1.0]];
        let values = [[1.0], [3.0], [0.0]];
        let rows: Vec<&[f64]> = values.iter().map(|v| &v[..]).collect();
        let models = Models::through(&steps, &rows, &[DMatrix::zeros(2, 2)], 1.0).unwrap();
        assert!((models.values(&DVector::from_vec(vec![2.0, 2.0]))[0] - 3.0).abs() < 1e-3);
    }
}
