//! Quantiles of Student's t distribution.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Degrees of freedom from which on the quantiles are those of the normal distribution, to the digits that `inverse_cdf` has.
const NORMAL: f64 = 1e7;

/// The value that a share `p` of Student's t distribution with `freedom` degrees of freedom does not exceed; with infinitely
/// many, of the normal distribution.
///
/// # Panics
/// If `freedom` is not positive.
pub fn t_quantile(p: f64, freedom: f64) -> f64 {
    if freedom > NORMAL {
        return Normal::standard().inverse_cdf(p);
    }
    StudentsT::new(0.0, 1.0, freedom).expect("there is a degree of freedom").inverse_cdf(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published: 2.228139 with 10, 12.706205 with 1, 1.983972 with 100 degrees of freedom, 1.959964 of the normal
    /// distribution.
    #[test]
    fn quantiles_are_the_published_ones() {
        for (freedom, published) in
            [(10.0, 2.228_139), (1.0, 12.706_205), (100.0, 1.983_972), (f64::INFINITY, 1.959_964)]
        {
            assert!((t_quantile(0.975, freedom) - published).abs() < 1e-6, "{freedom}");
        }
    }
}
