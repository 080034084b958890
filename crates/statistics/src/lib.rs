//! Statistics of samples: sampling, distributions, confidence intervals and sensitivity indices. Pure computation on
//! numbers.

mod blocks;
mod distributions;
mod elementary;
mod sampling;
mod share;
mod sobol_sequence;
mod student;
mod summary;
mod variance;

pub use blocks::moving_blocks;
pub use distributions::{chi_squared_sf, f_cdf, normal_cdf, normal_quantile};
pub use elementary::{ElementaryEffect, elementary_effects, trajectories};
pub use sampling::{Sampling, draw};
pub use share::share_interval;
pub use sobol_sequence::{MOST_DIMENSIONS, sobol_sequence};
pub use student::t_quantile;
pub use summary::{Summary, quantile, quantile_interval};
pub use variance::{VarianceShares, radial, variance_shares};
