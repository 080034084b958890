//! The functions of a problem, for numbers of both kinds.

use mops_core::{Along, Scalar};

/// A function of a problem's variables, written once for every kind of number. For functions that carry data; those that
/// carry none are plain functions ([`Functions::of`]).
pub trait Formula: Send + Sync + 'static {
    /// What it gives at `x`, in the order that [`crate::Problem`] states.
    fn at<S: Scalar>(&self, x: &[S]) -> Vec<S>;
}

/// The same for a given kind of number.
pub trait Outputs: Send + Sync {
    /// Values.
    fn values(&self, x: &[f64]) -> Vec<f64>;
    /// Values with their derivatives along some directions.
    fn along(&self, x: &[Along]) -> Vec<Along>;
}

impl<F: Formula> Outputs for F {
    fn values(&self, x: &[f64]) -> Vec<f64> {
        self.at(x)
    }

    fn along(&self, x: &[Along]) -> Vec<Along> {
        self.at(x)
    }
}

/// A plain function, for numbers of both kinds.
#[derive(Clone, Copy)]
struct Plain {
    values: fn(&[f64]) -> Vec<f64>,
    along: fn(&[Along]) -> Vec<Along>,
}

impl Outputs for Plain {
    fn values(&self, x: &[f64]) -> Vec<f64> {
        (self.values)(x)
    }

    fn along(&self, x: &[Along]) -> Vec<Along> {
        (self.along)(x)
    }
}

/// The functions of a problem.
pub struct Functions(Box<dyn Outputs>);

impl Functions {
    /// A plain generic function, named twice: once for each kind of number.
    ///
    /// ```
    /// use mops_core::Scalar;
    /// fn circle<S: Scalar>(x: &[S]) -> Vec<S> {
    ///     vec![x[0] * x[0] + x[1] * x[1]]
    /// }
    /// let functions = mops_problems::Functions::of(circle, circle);
    /// assert_eq!(functions.values(&[3.0, 4.0]), [25.0]);
    /// ```
    pub fn of(values: fn(&[f64]) -> Vec<f64>, along: fn(&[Along]) -> Vec<Along>) -> Self {
        Self(Box::new(Plain { values, along }))
    }

    /// A function that carries data.
    pub fn with(formula: impl Formula) -> Self {
        Self(Box::new(formula))
    }

    /// Values at `x`.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.0.values(x)
    }

    /// The derivative of every output along every coordinate: `[output][coordinate]`.
    pub fn slopes(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        for first in (0..x.len()).step_by(Along::DIRECTIONS) {
            let end = (first + Along::DIRECTIONS).min(x.len());
            let mut seeded: Vec<Along> = x.iter().map(|&x| Along::from(x)).collect();
            for j in first..end {
                seeded[j].set_tangent(j - first, 1.0);
            }
            let outputs = self.0.along(&seeded);
            slopes.resize_with(outputs.len(), || Vec::with_capacity(x.len()));
            for (slope, output) in slopes.iter_mut().zip(&outputs) {
                slope.extend_from_slice(&output.tangents()[..end - first]);
            }
        }
        slopes
    }
}

impl std::fmt::Debug for Functions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Functions")
    }
}
