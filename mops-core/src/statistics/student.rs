//! Quantiles of Student's t distribution.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// The value that a share `p` of Student's t distribution with `freedom` degrees of freedom does not exceed.
///
/// # Panics
/// Without a degree of freedom.
#[allow(clippy::cast_precision_loss)]
pub fn t_quantile(p: f64, freedom: usize) -> f64 {
    let t = StudentsT::new(0.0, 1.0, freedom as f64).expect("there is a degree of freedom");
    t.inverse_cdf(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published: 2.228139 with 10, 12.706205 with 1, 1.983972 with 100 degrees of freedom.
    #[test]
    fn quantiles_are_the_published_ones() {
        for (freedom, published) in [(10, 2.228_139), (1, 12.706_205), (100, 1.983_972)] {
            assert!((t_quantile(0.975, freedom) - published).abs() < 1e-6, "{freedom}");
        }
    }
}
