//! A gap in measured values: many samples at one value, and next to none on either side of it, as where a potentiometer
//! is open.

/// Noises within which samples show one value, the middle of a gap. Basis: 99 % of a normal error.
const GAP_CORE: f64 = 2.5;

/// Samples of one value beside which there are none, and next to none. Basis: an assumption.
const GAP_SAMPLES: [usize; 2] = [5, 20];

/// Distances from that value up to which there are next to none, and none, noises. Basis: a gap of seven noises, into
/// which the noise of the samples beside it reaches.
const GAP_EDGES: [f64; 2] = [4.5, 8.5];

/// Share of the samples of one value that "next to none" are at most. Basis: about a motion in passing they are four
/// fifths.
const GAP_SHARE: f64 = 0.15;

/// A gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The value that is shown within it.
    pub middle: f64,
    /// How far from that the next values are.
    pub half_width: f64,
}

/// The widest gap; `None` where there is none. A rest that is passed quickly at other times looks like a narrow one.
#[allow(clippy::cast_precision_loss)]
pub fn gap(values: &[f64], noise: f64) -> Option<Gap> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let mut sums = vec![0.0];
    sums.extend(sorted.iter().scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    }));
    let around =
        |value: f64, apart: f64| [-apart, apart].map(|apart| sorted.partition_point(|v| *v < value + apart * noise));
    let alone = sorted.iter().filter_map(|value| {
        let [first, end] = around(*value, GAP_CORE);
        let core = end - first;
        if core < GAP_SAMPLES[0] {
            return None;
        }
        let middle = (sums[end] - sums[first]) / core as f64;
        let [[low, high], [lowest, highest]] = GAP_EDGES.map(|apart| around(middle, apart));
        let is_alone = core >= GAP_SAMPLES[1] && (high - low).saturating_sub(core) as f64 <= GAP_SHARE * core as f64
            || highest - lowest == core;
        let (next_below, next_above) = (sorted.get(low.checked_sub(1)?)?, sorted.get(high)?);
        let half_width = (middle - next_below).min(next_above - middle);
        is_alone.then_some(Gap { middle, half_width })
    });
    alone.max_by(|a, b| a.half_width.total_cmp(&b.half_width))
}

#[cfg(test)]
mod tests;
