//! The box of a problem whose variables are not bounded.

/// Half the width of the box around the start where a variable has no bound of its own, in units of max(1, |start|). Wide
/// enough for every problem that says nothing else, and narrow enough that a tenth of it is a sensible first step.
pub(crate) const REACH: f64 = 10.0;

/// Bounds in place of the infinite ones: `reach` times max(1, |start|) away from the start.
///
/// N.B.: not symmetric, so that a start or an optimum of small whole numbers is not the middle of the box by accident.
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
