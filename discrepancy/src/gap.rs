//! A gap in measured values: one value alone, and none on either side of it, as where a potentiometer is open.

/// How many standard deviations of the noise apart values are that do not belong together.
const APART: f64 = 6.0;

/// Fewest samples within a gap: fewer may be a motion in passing.
const FEWEST: usize = 5;

/// A gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The value that is shown within it.
    pub middle: f64,
    /// How far from that the next values are.
    pub half_width: f64,
}

/// The gap in which most samples are; `None` where there is none.
#[allow(clippy::cast_precision_loss)]
pub fn gap(values: &[f64], noise: f64) -> Option<Gap> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let together: Vec<&[f64]> = sorted.chunk_by(|a, b| b - a <= APART * noise).collect();
    let alone = together.windows(3).filter_map(|three| {
        let [below, group, above] = three else { return None };
        let middle = group.iter().sum::<f64>() / group.len() as f64;
        let one_value = group.len() >= FEWEST && group[group.len() - 1] - group[0] <= 2.0 * APART * noise;
        let half_width = (middle - below[below.len() - 1]).min(above[0] - middle);
        one_value.then_some((group.len(), Gap { middle, half_width }))
    });
    alone.max_by_key(|(count, _)| *count).map(|(_, gap)| gap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::white;

    const NOISE: f64 = 1e-3;

    /// A wave through a sensor with a gap about 0.2, sampled evenly over its phase: by the golden angle.
    fn wave(half_width: f64) -> Vec<f64> {
        let shown = |y: f64| if (y - 0.2).abs() < half_width { 0.2 } else { y };
        let of = |(k, e): (usize, f64)| shown((3.883222 * k as f64).sin()) + e;
        white("gap", NOISE, 5000).into_iter().enumerate().map(of).collect()
    }

    #[test]
    fn a_value_alone_tells_a_gap() {
        let gap = gap(&wave(0.05), NOISE).expect("there is one");
        assert!((gap.middle - 0.2).abs() < NOISE, "{gap:?}");
        assert!(gap.half_width > 0.05 - 3.0 * NOISE && gap.half_width < 0.075, "{gap:?}");
    }

    #[test]
    fn a_motion_without_a_gap_shows_none() {
        assert_eq!(gap(&wave(0.0), NOISE), None);
        // Samples far apart, each alone; and many between two of them that are not one value.
        let sparse: Vec<f64> = (0..20).map(|k| 0.05 * f64::from(k)).collect();
        assert_eq!(gap(&sparse, NOISE), None);
        let spread: Vec<f64> = (0..40).map(|k| 0.3 + 1e-3 * f64::from(k)).chain([0.0, 1.0]).collect();
        assert_eq!(gap(&spread, NOISE), None);
    }
}
