//! Box of a problem with unbounded variables.

/// Half-width of the box around the initial guess for unbounded variables, in units of max(1, |initial guess|). Wide
/// enough for every problem without a width of its own; a tenth of it is a sensible first step.
pub(crate) const REACH: f64 = 10.0;

/// Replaces infinite bounds by finite ones: `reach` times max(1, |initial guess|) away from the initial guess.
///
/// N.B.: the box is not symmetric, so that initial guesses or optima with small integers do not lie at its centre by
/// accident.
pub(crate) fn finite(start: &[f64], bounds: &[[f64; 2]], reach: f64) -> Vec<[f64; 2]> {
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    let of = |j: usize| {
        let [low, high] = bounds.get(j).copied().unwrap_or(free);
        let away = reach * start[j].abs().max(1.0);
        [
            if low.is_finite() { low } else { start[j].min(high) - 1.07 * away },
            if high.is_finite() { high } else { start[j].max(low) + away },
        ]
    };
    (0..start.len()).map(of).collect()
}
