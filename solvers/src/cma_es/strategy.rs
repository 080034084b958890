//! Weights and learning rates of CMA-ES.

use mops_math as math;

/// Constants that follow from the dimension `n` and the population size.
///
/// Source: N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, equations 49 to 58 and Table 1.
#[derive(Debug, Clone)]
pub struct Strategy {
    /// Population size.
    pub population: usize,
    /// Number of parents, which determine the mean.
    pub parents: usize,
    /// Recombination weight per rank: positive with sum 1 for the parents, at most 0 for the rest.
    pub weights: Vec<f64>,
    /// Variance-effective number of parents, `1 / sum w^2`.
    pub effective: f64,
    /// Learning rate of the evolution path of the step size.
    pub c_sigma: f64,
    /// Damping of the step size.
    pub d_sigma: f64,
    /// Learning rate of the evolution path of the covariance.
    pub c_c: f64,
    /// Learning rate of the rank-one update.
    pub c_1: f64,
    /// Learning rate of the rank-mu update.
    pub c_mu: f64,
    /// Expected norm of a standard normal vector.
    pub chi: f64,
}

impl Strategy {
    /// Minimum population size.
    pub const MIN_POPULATION: usize = 4;

    /// Returns the default population size, `4 + 3 ln n`.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn default_population(n: usize) -> usize {
        4 + (3.0 * math::ln(n.max(1) as f64)) as usize
    }

    /// Computes the constants.
    #[allow(clippy::cast_precision_loss)]
    pub fn new(n: usize, population: usize) -> Self {
        let population = population.max(Self::MIN_POPULATION);
        let parents = population / 2;
        let nf = n as f64;
        let raw: Vec<f64> =
            (1..=population).map(|i| math::ln(population as f64 / 2.0 + 0.5) - math::ln(i as f64)).collect();
        let effective_of = |w: &[f64]| math::powi(w.iter().sum::<f64>(), 2) / w.iter().map(|w| w * w).sum::<f64>();
        let (effective, effective_negative) = (effective_of(&raw[..parents]), effective_of(&raw[parents..]));
        let c_1 = 2.0 / (math::powi(nf + 1.3, 2) + effective);
        let c_mu =
            (1.0 - c_1).min(2.0 * (0.25 + effective + 1.0 / effective - 2.0) / (math::powi(nf + 2.0, 2) + effective));
        let negative = (1.0 + c_1 / c_mu)
            .min(1.0 + 2.0 * effective_negative / (effective + 2.0))
            .min((1.0 - c_1 - c_mu) / (nf * c_mu));
        let (plus, minus): (f64, f64) =
            (raw[..parents].iter().sum(), -raw[parents..].iter().filter(|w| **w < 0.0).sum::<f64>());
        let weights = raw.iter().map(|w| if *w >= 0.0 { w / plus } else { negative * w / minus }).collect();
        let c_sigma = (effective + 2.0) / (nf + effective + 5.0);
        Self {
            population,
            parents,
            weights,
            effective,
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((effective - 1.0) / (nf + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + effective / nf) / (nf + 4.0 + 2.0 * effective / nf),
            c_1,
            c_mu,
            chi: nf.sqrt() * (1.0 - 1.0 / (4.0 * nf) + 1.0 / (21.0 * nf * nf)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_the_parents_sum_to_one_and_fall() {
        for (n, population) in [(1, 4), (2, 6), (5, 8), (20, 12), (5, 512)] {
            let s = Strategy::new(n, population);
            assert!((s.weights[..s.parents].iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(s.weights.windows(2).all(|w| w[0] >= w[1]) && s.weights.last().unwrap() <= &0.0);
            let remaining = 1.0 - s.c_1 - s.c_mu * s.weights.iter().sum::<f64>();
            assert!(remaining >= -1e-12 && s.c_1 + s.c_mu <= 1.0 + 1e-12, "{n} {population} {remaining}");
        }
    }

    /// Defaults of the reference implementation for n = 10: population 10, effective number of parents 3.167.
    #[test]
    fn ten_dimensions_have_the_published_constants() {
        let s = Strategy::new(10, Strategy::default_population(10));
        assert_eq!((s.population, s.parents), (10, 5));
        assert!((s.effective - 3.1673).abs() < 1e-4, "{}", s.effective);
        assert!((s.chi - 3.0847).abs() < 1e-4, "{}", s.chi);
    }
}
