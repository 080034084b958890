//! Plots of a signal at the initial guess and at the reported point, with measurements if there are any.

use mops_content::marks::bounds;
use mops_core::{Analysis, Failure, Trace, Variable, case::Channel, study::Row};

use mops_content::{
    numbers::{labelled, with_unit},
    plot::{Band, Color, Curve, CurveStyle, Plot},
    sampling,
};

/// Analyses at the initial guess and at the reported point.
pub(super) struct Comparison {
    pub(super) start: Result<Analysis, Failure>,
    pub(super) best: Result<Analysis, Failure>,
    pub(super) best_name: &'static str,
}

impl Comparison {
    /// Returns a sentence for each failed simulation.
    pub(super) fn failures(&self) -> Vec<String> {
        let sentence = |at: &str, analysis: &Result<Analysis, Failure>| {
            analysis
                .as_ref()
                .err()
                .map(|failure| format!("No response at the {at}: the simulation failed ({failure})."))
        };
        let start = sentence("initial guess", &self.start);
        let mut all: Vec<String> = start.into_iter().chain(sentence(self.best_name, &self.best)).collect();
        // Without a solver, both points are the initial guess.
        all.dedup();
        all
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
        let start = curve("initial guess", &self.start, CurveStyle::Dashed, Color::Start);
        start.into_iter().chain(curve(self.best_name, &self.best, CurveStyle::Line, Color::Result)).collect()
    }

    /// Returns the plot of a signal at both points.
    pub(super) fn response(&self, signal: &Variable, case: &str, rows: &[&Row]) -> Plot {
        Plot {
            title: format!("{} in case {case}", signal.name),
            curves: self.curves(&signal.name),
            bounds: self.best.iter().flat_map(|analysis| bounds(&signal.name, rows, analysis)).collect(),
            ..over_time(signal)
        }
    }

    /// Returns the plot of a measured signal: the measurement, and the simulation at both points.
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

    /// Returns the plot of measured - simulated at the reported point; `None` if the simulation failed.
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
            // The range of the plot above.
            x_range: Some(ends),
            bands: channel.noise.map(band).into_iter().collect(),
            supplement: true,
            ..over_time(signal)
        })
    }
}

pub(super) fn trace<'a>(analysis: &'a Result<Analysis, Failure>, signal: &str) -> Option<&'a Trace> {
    analysis.as_ref().ok()?.response()?.trace(signal)
}

pub(super) fn over_time(signal: &Variable) -> Plot {
    Plot { x_label: "time (s)".into(), y_label: labelled(&signal.name, &signal.unit.to_string()), ..Plot::default() }
}
