//! The two tiers of the tests: the quick one runs a tenth of the cases of a property, the full one all of them.
//!
//! `cargo test --workspace` is the quick tier, `cargo test --workspace --features full-tests` the full one. A property test
//! states its number of cases once, for the full tier.

use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;

/// The number of cases to run of a property that has `full` of them in the full tier: all there, a tenth (rounded up) in
/// the quick tier.
#[must_use]
pub const fn cases(full: u32) -> u32 {
    if is_full() { full } else { full.div_ceil(10) }
}

/// Whether the tests run in the full tier.
#[must_use]
pub const fn is_full() -> bool {
    cfg!(feature = "full-tests")
}

/// The configuration of a property with `full` cases in the full tier: the same cases in every run, and no files of
/// failures.
#[must_use]
pub fn property(full: u32) -> ProptestConfig {
    ProptestConfig {
        cases: cases(full),
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_tier_runs_a_tenth_rounded_up() {
        assert_eq!(cases(10_000), if is_full() { 10_000 } else { 1_000 });
        assert_eq!(cases(11), if is_full() { 11 } else { 2 });
        assert_eq!(property(2_560).cases, cases(2_560));
    }
}
