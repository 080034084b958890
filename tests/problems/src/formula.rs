//! Functions of a problem, for plain and dual numbers.

use mops_language::{Dual7, Scalar};

/// Function of a problem's variables, written once for every kind of number. For functions that carry data; functions
/// without data are plain functions ([`Functions::of`]).
pub trait Formula: Send + Sync + 'static {
    /// Returns the outputs at `x`, in the order defined by [`crate::Problem`].
    fn at<S: Scalar>(&self, x: &[S]) -> Vec<S>;
}

/// Function of a problem's variables, for plain and dual numbers.
pub trait Outputs: Send + Sync {
    /// Returns the outputs.
    fn values(&self, x: &[f64]) -> Vec<f64>;
    /// Returns the outputs with their derivatives along some directions.
    fn along(&self, x: &[Dual7]) -> Vec<Dual7>;
}

impl<F: Formula> Outputs for F {
    fn values(&self, x: &[f64]) -> Vec<f64> {
        self.at(x)
    }

    fn along(&self, x: &[Dual7]) -> Vec<Dual7> {
        self.at(x)
    }
}

/// Plain function, for both kinds of number.
#[derive(Clone, Copy)]
struct Plain {
    values: fn(&[f64]) -> Vec<f64>,
    along: fn(&[Dual7]) -> Vec<Dual7>,
}

impl Outputs for Plain {
    fn values(&self, x: &[f64]) -> Vec<f64> {
        (self.values)(x)
    }

    fn along(&self, x: &[Dual7]) -> Vec<Dual7> {
        (self.along)(x)
    }
}

/// Functions of a problem.
pub struct Functions(Box<dyn Outputs>);

impl Functions {
    /// Creates the functions from a plain generic function, named twice: once for each kind of number.
    ///
    /// ```
    /// use mops_language::Scalar;
    /// fn circle<S: Scalar>(x: &[S]) -> Vec<S> {
    ///     vec![x[0] * x[0] + x[1] * x[1]]
    /// }
    /// let functions = mops_problems::Functions::of(circle, circle);
    /// assert_eq!(functions.values(&[3.0, 4.0]), [25.0]);
    /// ```
    pub fn of(values: fn(&[f64]) -> Vec<f64>, along: fn(&[Dual7]) -> Vec<Dual7>) -> Self {
        Self(Box::new(Plain { values, along }))
    }

    /// Creates the functions from a function that carries data.
    pub fn with(formula: impl Formula) -> Self {
        Self(Box::new(formula))
    }

    /// Returns the outputs at `x`.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.0.values(x)
    }

    /// Returns the derivative of every output along every coordinate: `[output][coordinate]`.
    pub fn slopes(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        for first in (0..x.len()).step_by(Dual7::DIRECTIONS) {
            let end = (first + Dual7::DIRECTIONS).min(x.len());
            let mut seeded: Vec<Dual7> = x.iter().map(|&x| Dual7::from(x)).collect();
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
