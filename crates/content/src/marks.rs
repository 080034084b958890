//! Marks of criteria on a signal, as bounds of a plot.

use mops_core::Analysis;
use mops_core::criterion::Mark;
use mops_core::study::Row;

use crate::plot::Bound;

/// Returns the bounds of criteria on a signal: limits of demands, edges of bands.
pub fn bounds(signal: &str, rows: &[&Row], analysis: &Analysis) -> Vec<Bound> {
    let marks = rows.iter().flat_map(|row| row.criterion.marks(&row.demand, analysis));
    let of_signal = marks.filter(|mark| mark.signal == signal && mark.values.iter().all(|value| value.is_finite()));
    let bound = |Mark { label, times, values, excluded, .. }| Bound {
        name: label,
        x: times,
        y: values,
        excluded,
        applies_to: Vec::new(),
    };
    of_signal.map(bound).collect()
}
