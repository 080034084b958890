//! Axes: ticks at round values, and their labels.

use mops_math as math;

use super::range::drawable;

/// Axis of a plot, with its ticks.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    /// Range; for a logarithmic axis, of the decimal logarithms.
    range: [f64; 2],
    log: bool,
    /// Positions from 0 to 1, with labels.
    pub(super) ticks: Vec<(f64, String)>,
    /// Common factor of all labels, such as `x 10^-6`.
    pub(super) factor: Option<String>,
}

/// Steps between ticks of angles in degrees: parts of a turn from 15 on, and from 45 on for ranges of 90 or more.
pub(super) const DEGREES: [f64; 23] = [
    0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0,
    720.0, 1440.0, 3600.0, 7200.0,
];

impl Axis {
    /// Creates an axis with about `count` ticks. If `log`, `range` is the range of the decimal logarithms.
    pub(super) fn new(range: [f64; 2], log: bool, count: f64) -> Self {
        if log {
            return Self { range, log, ticks: decades(range), factor: None };
        }
        Self::linear(range, round_step((range[1] - range[0]) / count), count)
    }

    /// Creates an axis of angles in degrees, with ticks at [`DEGREES`].
    pub(super) fn degrees(range: [f64; 2], count: f64) -> Self {
        let room = range[1] - range[0];
        let least = if room >= 90.0 { 45.0 } else { 0.0 };
        match DEGREES.into_iter().find(|step| *step >= least && room <= step * count) {
            Some(step) if room >= 1.0 => Self::linear(range, step, count),
            _ => Self::new(range, false, count),
        }
    }

    fn linear(range: [f64; 2], step: f64, count: f64) -> Self {
        let [low, high] = range;
        let power = math::log10(low.abs().max(high.abs())).floor();
        // Powers with an SI prefix, and only if the plain number is hard to read.
        let power = if (-3.0..5.0).contains(&power) { 0.0 } else { (power / 3.0).floor() * 3.0 };
        let factor = math::powf(10.0, power);
        let decimals = (-math::log10(step / factor).floor()).clamp(0.0, 12.0) as usize;
        let ticks = (0..=(2.0 * count) as usize)
            .map(|i| ((low / step - 1e-9).ceil() + i as f64) * step)
            .filter(|&value| value <= high + 1e-9 * step)
            // Adding zero turns -0 into 0.
            .map(|value| ((value - low) / (high - low), format!("{:.decimals$}", value / factor + 0.0)))
            .collect();
        let factor = (power != 0.0).then(|| format!("\u{d7}\u{2009}10{}", superscript(power as i32)));
        Self { range, log: false, ticks, factor }
    }

    /// Returns the position of a value, 0 at the start and 1 at the end of the axis; `None` if it cannot be drawn.
    pub(super) fn position(&self, value: f64) -> Option<f64> {
        let value = drawable(value, self.log)?;
        Some((value - self.range[0]) / (self.range[1] - self.range[0]))
    }
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = math::powf(10.0, math::log10(step).floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| step <= f * power * (1.0 + 1e-9)).unwrap_or(10.0);
    factor * power
}

/// Returns the ticks of a logarithmic axis: powers of ten, with 2 and 5 between them for at most 2.5 decades.
fn decades([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let every = ((high - low) / 7.0).ceil().max(1.0) as i32;
    let steps: &[f64] = if high - low <= 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    if high - low < 0.7 {
        return close(low, high);
    }
    let mut ticks = Vec::new();
    for power in low.floor() as i32..=high.ceil() as i32 {
        if power.rem_euclid(every) != 0 {
            continue;
        }
        for step in steps {
            let at = f64::from(power) + math::log10(*step);
            if at >= low - 1e-9 && at <= high + 1e-9 {
                let label = match power {
                    -3..=3 => mops_content::numbers::significant(step * math::powi(10.0, power), 1),
                    _ if *step == 1.0 => format!("10{}", superscript(power)),
                    _ => format!("{step}\u{b7}10{}", superscript(power)),
                };
                ticks.push(((at - low) / (high - low), label));
            }
        }
    }
    ticks
}

/// Returns the ticks of a logarithmic axis of less than 0.7 decades: round values.
fn close(low: f64, high: f64) -> Vec<(f64, String)> {
    let [from, to] = [low, high].map(|end| math::powf(10.0, end));
    let step = round_step((to - from) / 5.0);
    (0..=12)
        .map(|i| ((from / step - 1e-9).ceil() + f64::from(i)) * step)
        .filter(|&value| value <= to * (1.0 + 1e-9))
        .map(|value| ((math::log10(value) - low) / (high - low), mops_content::numbers::significant(value, 4)))
        .collect()
}

fn superscript(number: i32) -> String {
    let raised = |c| match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        c => char::from_u32(0x2070 + c as u32 - '0' as u32).unwrap_or(c),
    };
    number.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::super::range::range_of;
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_labelled_alike() {
        assert_eq!(labels(&Axis::new([0.0, 1.1], false, 6.0)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        let small = Axis::new([-2e-6, 2e-6], false, 5.0);
        assert_eq!(
            (labels(&small), small.factor.as_deref()),
            (vec!["-2", "-1", "0", "1", "2"], Some("\u{d7}\u{2009}10\u{207b}\u{2076}"))
        );
        assert_eq!(labels(&Axis::new([-1.0, 2.0], true, 5.0)), ["0.1", "1", "10", "100"]);
    }

    #[test]
    fn ticks_of_angles_are_parts_of_a_turn() {
        assert_eq!(labels(&Axis::degrees([-189.0, 9.0], 7.0)), ["-180", "-135", "-90", "-45", "0"]);
        assert_eq!(labels(&Axis::degrees([-400.0, 100.0], 7.0)), ["-360", "-270", "-180", "-90", "0", "90"]);
        assert_eq!(labels(&Axis::degrees([-4.5, 0.5], 7.0)), ["-4", "-3", "-2", "-1", "0"]);
    }

    #[test]
    fn ticks_of_a_constant_are_finite() {
        for value in [0.0, 1.0, -3e-200, 1e16, 1e149, 1e-99] {
            let axis = Axis::new(range_of([value, value].into_iter()).unwrap(), false, 6.0);
            assert!(
                axis.ticks.len() >= 2 && axis.ticks.iter().all(|(at, _)| (-0.01..=1.01).contains(at)),
                "{value} {axis:?}"
            );
        }
        assert_eq!(range_of(std::iter::empty()), None);
    }

    #[test]
    fn values_that_cannot_be_drawn_have_no_position() {
        let (linear, log) = (Axis::new([0.0, 1.0], false, 5.0), Axis::new([0.0, 1.0], true, 5.0));
        assert_eq!(
            (linear.position(f64::NAN), linear.position(f64::INFINITY), linear.position(0.5)),
            (None, None, Some(0.5))
        );
        assert_eq!((log.position(0.0), log.position(-1.0), log.position(10.0)), (None, None, Some(1.0)));
    }
}
