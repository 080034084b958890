//! Random streams: one seed, child streams by label.

use rand::SeedableRng;
pub use rand_xoshiro::Xoshiro256PlusPlus as Stream;

/// Returns the random stream of `label` under `seed`. The same pair always gives the same numbers. Streams of different
/// labels are independent, so that adding a consumer changes no other stream.
pub fn stream(seed: u64, label: &str) -> Stream {
    // FNV-1a over the label, folded into the seed; `seed_from_u64` spreads it by SplitMix64.
    // Source: G. Fowler, L. C. Noll, K.-P. Vo, The FNV non-cryptographic hash algorithm, IETF draft (2019).
    let hash = label.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    Stream::seed_from_u64(seed ^ hash)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn a_stream_depends_on_seed_and_label_alone() {
        let draw = |seed, label| stream(seed, label).random::<u64>();
        assert_eq!(draw(1, "a"), draw(1, "a"));
        assert_ne!(draw(1, "a"), draw(1, "b"));
        assert_ne!(draw(1, "a"), draw(2, "a"));
    }
}
