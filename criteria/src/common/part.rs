//! Part of a trace, with knots at given times.

use mops_core::Trace;

/// Returns `map(t, y(t))` from the first to the last of `knots` (increasing), with a knot at each of them.
///
/// The result is exact if `map` is linear in `t` and `y`.
pub fn part(trace: &Trace, knots: &[f64], map: impl Fn(f64, f64) -> f64) -> Trace {
    let (start, end) = (knots[0], knots[knots.len() - 1]);
    let mut part = Trace::starting_at(start, knots.len());
    let mut next = 1;
    for piece in trace.pieces().iter().filter(|piece| piece.time[1] > start && piece.time[0] < end) {
        let [low, high] = if piece.value[0] < piece.value[1] { [0, 1] } else { [1, 0] }.map(|end| piece.value[end]);
        let value = |t: f64| match piece.time.iter().position(|end| *end == t) {
            Some(end) => piece.value[end],
            // Rounding could place a node on the next piece, across a jump; the range of this piece prevents that.
            None => trace.at(t).max(low).min(high),
        };
        let mut from = piece.time[0].max(start);
        while from < piece.time[1] && next < knots.len() {
            let to = knots[next].min(piece.time[1]);
            let nodes = Trace::NODES.map(|s| if s == 1.0 { to } else { from + s * (to - from) });
            part.push(to, nodes.map(|t| map(t, value(t))));
            from = to;
            if to == knots[next] {
                next += 1;
            }
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, sampled};
    use mops_math as math;

    #[test]
    fn a_part_has_the_values_and_the_extrema_of_the_whole() {
        let whole = sampled(10.0, 40, math::sin);
        let part = part(&whole, &[1.0, 1.3, 8.0], |_, y| y);
        assert_eq!((part.start(), part.end()), (1.0, 8.0));
        for i in 0..=70 {
            let t = 1.0 + 0.1 * f64::from(i);
            assert_near(part.at(t), whole.at(t), 1e-14);
        }
        assert_near(part.maximum().0, whole.maximum().0, 1e-14);
    }

    #[test]
    fn a_jump_stays_a_jump_and_the_cut_has_the_later_value() {
        let mut step = Trace::starting_at(0.0, 2);
        step.push(1.0, [0.0; 5]);
        step.push(2.0, [3.0; 5]);
        let both = part(&step, &[0.5, 2.0], |t, y| y + t);
        assert_eq!((both.largest_jump(), both.first(), both.last()), (3.0, 0.5, 5.0));
        assert_eq!(part(&step, &[1.0, 2.0], |_, y| y).first(), 3.0);
    }
}
