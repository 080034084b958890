//! Tiers of property tests: the quick tier runs a tenth of the cases of a property, the full tier all of them.
//!
//! `cargo test --workspace` runs the quick tier, `MOPS_TESTS=full cargo test --workspace -- --include-ignored` the full
//! tier. A property test states the number of cases of the full tier.

use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;

/// Returns the number of cases of a property: `full` in the full tier, a tenth of it, rounded up, in the quick tier.
#[must_use]
pub fn cases(full: u32) -> u32 {
    if is_full() { full } else { full.div_ceil(10) }
}

/// Returns true if the tests run in the full tier: the environment has `MOPS_TESTS=full`.
#[must_use]
pub fn is_full() -> bool {
    std::env::var_os("MOPS_TESTS").is_some_and(|tier| tier == "full")
}

/// Returns the configuration of a property with `full` cases in the full tier. Every run has the same cases, and
/// failures are not written to files.
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
