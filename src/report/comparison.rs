//! Start and reported point beside each other: a signal in both, and measurements with them.

use mops_core::{Analysis, Channel, Failure, Row, Trace, Variable};

use super::plot::{Band, Color, Curve, CurveStyle, Level, Plot};
use super::sampling;
use crate::numbers::{labelled, with_unit};

/// The two analyses that are compared.
pub(super) struct Both {
    pub(super) start: Result<Analysis, Failure>,
    pub(super) best: Result<Analysis, Failure>,
    pub(super) best_name: &'static str,
}

impl Both {
    /// Sentences for the simulations that failed.
    pub(super) fn failures(&self) -> Vec<String> {
        let told = |at: &str, analysis: &Result<Analysis, Failure>| {
            analysis
                .as_ref()
                .err()
                .map(|failure| format!("No response at the {at}: the simulation failed ({failure})."))
        };
        told("start values", &self.start).into_iter().chain(told(self.best_name, &self.best)).collect()
    }

    fn curves(&self, signal: &str) -> Vec<Curve> {
        let curve = |name: &str, analysis: &Result<Analysis, Failure>, style, color| {
            let points = sampling::points(trace(analysis, signal)?);
            Some(Curve {
                name: name.to_owned(),
                points,
                style,
                color,
                may_leave: color == Color::Start,
                ..Curve::default()
            })
        };
        let start = curve("start", &self.start, CurveStyle::Dashed, Color::Start);
        start.into_iter().chain(curve(self.best_name, &self.best, CurveStyle::Line, Color::Result)).collect()
    }

    /// A signal at both points.
    pub(super) fn response(&self, signal: &Variable, case: &str, rows: &[&Row]) -> Plot {
        Plot {
            title: format!("{} in case {case}", signal.name),
            curves: self.curves(&signal.name),
            levels: self.levels(&signal.name, rows),
            ..over_time(signal)
        }
    }

    /// The levels that criteria look at: limits of demands, edges of bands.
    fn levels(&self, signal: &str, rows: &[&Row]) -> Vec<Level> {
        let Ok(analysis) = &self.best else { return Vec::new() };
        let marks = rows.iter().flat_map(|row| row.criterion.marks(row.demand.limit(), analysis));
        let of_signal = marks.filter(|mark| mark.signal == signal && mark.level.is_finite());
        of_signal.map(|mark| Level { name: mark.label, value: mark.level }).collect()
    }

    /// A measured signal at both points, and the measurement.
    pub(super) fn fit(&self, channel: &Channel, signal: &Variable, case: &str) -> Plot {
        let points = channel.times.iter().copied().zip(channel.values.iter().copied()).collect();
        let mut curves = vec![Curve {
            name: "measured".to_owned(),
            points,
            style: CurveStyle::Dots,
            color: Color::Measured,
            ..Curve::default()
        }];
        curves.extend(self.curves(&signal.name));
        Plot { title: format!("{} in experiment {case}", signal.name), curves, ..over_time(signal) }
    }

    /// Measured - simulated at the reported point; `None` where that failed.
    pub(super) fn residual(&self, channel: &Channel, signal: &Variable, case: &str) -> Option<Plot> {
        let trace = trace(&self.best, &signal.name)?;
        let simulated = trace.sample(&channel.times);
        let residuals = channel.values.iter().zip(simulated).map(|(measured, simulated)| measured - simulated);
        let curve = Curve {
            name: format!("measured - simulated, {}", self.best_name),
            points: channel.times.iter().copied().zip(residuals).collect(),
            style: CurveStyle::Dots,
            ..Curve::default()
        };
        let ends = [trace.start(), trace.end()];
        let zero = Curve { points: ends.map(|t| (t, 0.0)).to_vec(), color: Color::Faint, ..Curve::default() };
        let band = |noise: f64| Band {
            name: format!("\u{b1}2 noise, {}", with_unit(2.0 * noise, &signal.unit.to_string())),
            range: [-2.0 * noise, 2.0 * noise],
        };
        Some(Plot {
            title: format!("residual of {} in experiment {case}", signal.name),
            curves: vec![zero, curve],
            // Over the whole simulation, as the plot above.
            x_range: Some(ends),
            bands: channel.noise.map(band).into_iter().collect(),
            ..over_time(signal)
        })
    }
}

fn trace<'a>(analysis: &'a Result<Analysis, Failure>, signal: &str) -> Option<&'a Trace> {
    analysis.as_ref().ok()?.response()?.trace(signal)
}

fn over_time(signal: &Variable) -> Plot {
    Plot { x_label: "time (s)".into(), y_label: labelled(&signal.name, &signal.unit.to_string()), ..Plot::default() }
}
