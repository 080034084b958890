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
