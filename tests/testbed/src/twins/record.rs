//! Record of the signals in front of delayed sensors.

use super::state::{SIZE, Twin};

/// Signals behind all sensor effects but delays, by time.
pub(super) struct Record {
    /// Signals just before time 0.
    before: [f64; SIZE],
    /// Times, not decreasing, and signals.
    rows: Vec<(f64, [f64; SIZE])>,
    /// Delay of each signal, s.
    delays: [f64; SIZE],
}

impl Record {
    /// Creates the record of a twin at its start.
    pub(super) fn new(twin: &Twin<'_>) -> Self {
        Self { before: twin.now().signals, rows: Vec::new(), delays: twin.sensor_delays() }
    }

    /// Appends the present signals, if one of them is delayed.
    pub(super) fn push(&mut self, twin: &Twin<'_>) {
        if self.delays.iter().any(|delay| *delay > 0.0) {
            self.rows.push((twin.t, twin.now().signals));
        }
    }

    /// Returns the measured signals now: linear between records.
    pub(super) fn signals(&self, twin: &Twin<'_>) -> Vec<f64> {
        let now = twin.now().signals;
        let signal = |i: usize| {
            let t = twin.t - self.delays[i];
            let next = self.rows.partition_point(|(time, _)| *time <= t);
            match self.delays[i] > 0.0 {
                false => now[i],
                true if t < 0.0 => self.before[i],
                true => {
                    let ((t0, a), (t1, b)) = (self.rows[next - 1], self.rows[next.min(self.rows.len() - 1)]);
                    if t1 > t0 { a[i] + (b[i] - a[i]) * (t - t0) / (t1 - t0) } else { a[i] }
                }
            }
        };
        (0..=twin.body.states.len()).map(signal).collect()
    }
}
