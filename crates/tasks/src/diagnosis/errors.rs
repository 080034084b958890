//! Errors of the nominal and the recalibrated model, one line per channel, for the terminal and the report.

use mops_outcome::diagnosis::{Diagnosis, ExperimentError, WindowErrors};

use mops_content::numbers::significant;

/// Error of a channel or of a whole experiment: of the nominal model, then of the recalibrated one.
pub struct Line<'a> {
    /// Experiment, with the errors of the nominal model.
    pub experiment: &'a ExperimentError,
    /// Name of the channel; `None` for all channels together.
    pub channel: Option<&'a str>,
    /// Windows of the error; `None` for the whole record.
    pub windows: Option<&'a WindowErrors>,
    /// Errors in units of the noise level.
    pub scaled: [f64; 2],
    /// Errors in the unit of the channel.
    pub raw: [f64; 2],
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Unit of the channel.
    pub unit: &'a str,
}

impl Line<'_> {
    /// Returns the label: `theta`, `theta in 3 windows of 3.05 s`, `all channels`.
    pub fn label(&self) -> String {
        let channel = self.channel.unwrap_or("all channels");
        match self.windows {
            Some(w) => format!("{channel} in {} windows of {} s", w.count, significant(w.length, 3)),
            None => channel.to_owned(),
        }
    }
}

/// Returns the lines of every experiment: each channel, then all together; over the whole record, then in windows.
pub fn lines(diagnosis: &Diagnosis) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    for before in &diagnosis.before {
        let after = diagnosis.after.iter().find(|after| after.name == before.name).unwrap_or(before);
        let mut push = |windows, [now, then]: [&'_ [(String, f64)]; 2], together: [f64; 2]| {
            for (channel, error) in channels_of(before, windows) {
                let later = then.iter().find(|(name, _)| name == channel).map_or(*error, |(_, error)| *error);
                let prediction =
                    diagnosis.predictions.iter().find(|p| p.experiment == before.name && p.signal == *channel);
                let (noise, unit) = prediction.map_or((f64::NAN, ""), |p| (p.noise, p.unit.as_str()));
                let (raw, channel) = ([*error, later], Some(channel.as_str()));
                let scaled = raw.map(|error| error / noise);
                lines.push(Line { experiment: before, channel, windows, scaled, raw, noise, unit });
            }
            if now.len() > 1 {
                let (noise, unit, channel) = (f64::NAN, "", None);
                lines.push(Line { experiment: before, channel, windows, scaled: together, raw: together, noise, unit });
            }
        };
        push(None, [&before.channels, &after.channels], [before.normalised, after.normalised]);
        if let (Some(first), Some(second)) = (&before.in_windows, &after.in_windows) {
            push(Some(first), [&first.channels, &second.channels], [first.normalised, second.normalised]);
        }
    }
    lines
}

fn channels_of<'a>(error: &'a ExperimentError, windows: Option<&'a WindowErrors>) -> &'a [(String, f64)] {
    windows.map_or(&error.channels, |w| &w.channels)
}
