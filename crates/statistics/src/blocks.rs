//! Moving-block resampling, which preserves the correlation of neighbouring samples.

use rand::Rng;

use mops_math::Stream;

/// Returns `count` indices below `count`, in runs of `block` with random starts.
///
/// Source: H. R. Kuensch, Annals of Statistics 17 (1989) 1217-1241.
///
/// # Panics
/// If a block is empty, or longer than all samples.
pub fn moving_blocks(count: usize, block: usize, random: &mut Stream) -> Vec<usize> {
    assert!((1..=count).contains(&block), "a block has 1 to `count` samples");
    let mut order = Vec::with_capacity(count + block);
    while order.len() < count {
        let begin = random.random_range(0..=count - block);
        order.extend(begin..begin + block);
    }
    order.truncate(count);
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math::stream;

    #[test]
    fn blocks_are_runs_and_their_beginnings_are_spread_evenly() {
        let mut random = stream(1, "test");
        let mut begins = vec![0u32; 9];
        for _ in 0..900 {
            let order = moving_blocks(12, 4, &mut random);
            assert!(order.len() == 12 && order.chunks(4).all(|run| run.windows(2).all(|two| two[1] == two[0] + 1)));
            order.chunks(4).for_each(|run| begins[run[0]] += 1);
        }
        // 2700 blocks over nine starts: 300 each, with a standard deviation of 16.
        assert!(begins.iter().all(|&n| n.abs_diff(300) < 80), "{begins:?}");
        assert_eq!(moving_blocks(7, 7, &mut random), (0..7).collect::<Vec<_>>());
    }
}
