//! Derivatives by differences, and their comparison with the reported ones.

/// Distances of the points on both sides, as fractions of the parameter. Central differences use the first and the
/// third, one-sided ones the first two and the last two.
pub const STEPS: [f64; 4] = [2.5e-4, 5e-4, 1e-3, 2e-3];

/// Result of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The slope is that of the differences, or of one side of a kink.
    Right,
    /// The slope is another one.
    Off { reported: f64, sides: [f64; 2] },
    /// Differences of two step sizes disagree.
    Undecided,
}

/// Permitted deviation of a slope, relative to its size and to the value.
const TOLERANCE: f64 = 1e-4;

/// Deviation of differences with two step sizes up to which they are a derivative.
const AGREE: f64 = 3e-5;

/// Compares a slope with the values `[low, high]` at [`STEPS`] around `here`.
pub fn judge(reported: f64, here: f64, values: &[[f64; 2]; 4]) -> Verdict {
    let central = |k: usize| (values[k][1] - values[k][0]) / (2.0 * STEPS[k]);
    let one_sided = |k: usize, side: usize| {
        let sign = if side == 0 { -1.0 } else { 1.0 };
        sign * (4.0 * values[k][side] - 3.0 * here - values[k + 1][side]) / (2.0 * STEPS[k])
    };
    let size = here.abs().max(1e-3);
    let scale = |slope: f64| slope.abs().max(size);
    let agree = |a: f64, b: f64| (a - b).abs() <= AGREE * scale(a.abs().max(b.abs()));
    let close = |slope: f64| (reported - slope).abs() <= TOLERANCE * scale(slope);
    let [fine, coarse] = [central(0), central(2)];
    let sides = [0, 1].map(|side| one_sided(0, side));
    // One-sided differences are less accurate than central ones; a kink exceeds that.
    let is_side = [0, 1].map(|side| (sides[side] - one_sided(2, side)).abs() <= 10.0 * AGREE * scale(sides[side]));
    let is_kink = (sides[0] - sides[1]).abs() > 30.0 * AGREE * scale(sides[0].abs().max(sides[1].abs()));
    if is_kink {
        let near = |side: usize| (reported - sides[side]).abs() <= 10.0 * TOLERANCE * scale(sides[side]);
        return match is_side {
            _ if near(0) || near(1) => Verdict::Right,
            [true, true] => Verdict::Off { reported, sides },
            _ => Verdict::Undecided,
        };
    }
    if !agree(fine, coarse) {
        return Verdict::Undecided;
    }
    if close(fine) { Verdict::Right } else { Verdict::Off { reported, sides: [fine; 2] } }
}
