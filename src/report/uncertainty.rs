//! Uncertainty of the estimates in addition to standard errors: profiles, bootstrap, bands.

use maud::{Markup, html};
use mops_outcome::{BandReport, BootstrapReport, ProfileReport, UncertaintyReport};

use super::figures::{Figure, Group};
use super::page::scrolling;
use super::plot::{Color, Curve, CurveStyle, Plot};
use super::sensitivity::sentences;
use crate::numbers::{labelled, number, significant};

/// Title of the section.
pub(super) const TITLE: &str = "Uncertainty of the estimates";

/// Returns sentences and tables.
pub(super) fn section(found: &UncertaintyReport) -> Markup {
    html! {
        (sentences(&found.words))
        @if !found.profiles.is_empty() {
            h3 { "Likelihood profiles" }
            p {
                "One parameter is fixed at a time, and all others are re-estimated. The signed root of the likelihood ratio is a "
                "straight line if the model is linear; if it is curved, the first-order interval is inaccurate. The interval "
                "ends where the root reaches the t quantile. A parameter that is not identifiable has no first-order interval."
            }
            (scrolling("Profiles", profiles(&found.profiles)))
        }
        @if let Some(bootstrap) = &found.bootstrap {
            h3 { "Bootstrap" }
            p {
                "Residuals, scaled to the noise level of the standard errors, are resampled in blocks of " (blocks(bootstrap))
                " samples, and all estimates are repeated. This is valid if the correlation time of the residuals is shorter "
                "than a block. Intervals are percentiles of the replicates."
            }
            (scrolling("Bootstrap", replicates(bootstrap)))
        }
        @if !found.bands.is_empty() {
            p {
                "The plots of the responses show pointwise first-order bands: for the response, from the uncertainty of the "
                "parameters, and for a new measurement, with noise."
            }
        }
    }
}

fn blocks(found: &BootstrapReport) -> String {
    let mut lengths = found.blocks.clone();
    lengths.sort_unstable();
    lengths.dedup();
    lengths.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn end(value: f64, why: &str) -> Markup {
    html! {
        @if value.is_finite() { (number(value)) } @else { "open" }
        @if why == "bound" { small { "bound of the tuner" } }
    }
}

fn profiles(list: &[ProfileReport]) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th scope="col" class="number" { "estimate" }
                    th scope="col" class="number" { "from" }
                    th scope="col" class="number" { "to" }
                    th scope="col" class="number" { "first-order from" }
                    th scope="col" class="number" { "to" }
                    th scope="col" { "unit" }
                }
            }
            tbody {
                @for one in list {
                    tr {
                        th scope="row" { (one.parameter) }
                        td class="number" { (number(one.value)) }
                        td class="number" { (end(one.interval[0], one.ends[0])) }
                        td class="number" { (end(one.interval[1], one.ends[1])) }
                        @for end in one.linear_interval {
                            td class="number" { @if end.is_finite() { (number(end)) } }
                        }
                        td { (one.unit) }
                    }
                }
            }
        }
    }
}

fn replicates(found: &BootstrapReport) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th scope="col" class="number" { "estimate" }
                    th scope="col" class="number" { "standard error" }
                    th scope="col" class="number" { "bias" }
                    th scope="col" class="number" { "from" }
                    th scope="col" class="number" { "to" }
                    th scope="col" { "unit" }
                }
            }
            tbody {
                @for one in &found.parameters {
                    tr {
                        th scope="row" { (one.parameter) }
                        td class="number" { (number(one.value)) }
                        td class="number" { (significant(one.std_error, 3)) }
                        td class="number" { (significant(one.bias, 2)) }
                        td class="number" { (number(one.interval[0])) }
                        td class="number" { (number(one.interval[1])) }
                        td { (one.unit) }
                    }
                }
            }
        }
    }
}

/// Returns the plots of profiles and of bootstrap distributions.
pub(super) fn group(found: &UncertaintyReport) -> Group {
    let figures = found.profiles.iter().map(profile);
    let replicates = found.bootstrap.iter().flat_map(|b| &b.parameters).map(|one| {
        let mut sorted = one.draws.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let steps =
            sorted.iter().enumerate().flat_map(|(i, &v)| [(v, i as f64 / n), (v, (i + 1) as f64 / n)]).collect();
        let vertical = |name: &str, x: f64, color, style| Curve {
            name: name.into(),
            points: vec![(x, 0.0), (x, 1.0)],
            color,
            style,
            ..Curve::default()
        };
        let mut curves =
            vec![Curve { name: "empirical distribution function".into(), points: steps, ..Curve::default() }];
        curves.push(vertical("estimate", one.value, Color::Start, CurveStyle::Dashed));
        curves.push(vertical("interval", one.interval[0], Color::Demand, CurveStyle::Line));
        curves.push(vertical("", one.interval[1], Color::Demand, CurveStyle::Line));
        let plot = Plot {
            title: format!("Bootstrap of {}", one.parameter),
            x_label: labelled(&one.parameter, &one.unit),
            y_label: "share of replicates".into(),
            curves,
            ..Plot::default()
        };
        Figure { plots: vec![(format!("bootstrap-{}", one.parameter), plot)], ..Figure::default() }
    });
    Group { figures: figures.chain(replicates).collect(), ..Group::default() }
}

fn profile(one: &ProfileReport) -> Figure {
    let line = |name: &str, points: Vec<(f64, f64)>, color, style| Curve {
        name: name.into(),
        points,
        color,
        style,
        ..Curve::default()
    };
    let half = (one.linear_interval[1] - one.value) / one.limit;
    let ends = [one.points.first(), one.points.last()].map(|p| p.map_or(one.value, |p| p.0));
    let first_order = ends.map(|x| (x, (x - one.value) / half)).to_vec();
    let first_order = line("first order", first_order, Color::Start, CurveStyle::Dashed);
    let ends = |y: f64| ends.map(|x| (x, y)).to_vec();
    let mut curves: Vec<Curve> = half.is_finite().then_some(first_order).into_iter().collect();
    curves.extend([
        line("signed root of the likelihood ratio", one.points.clone(), Color::Result, CurveStyle::Line),
        line("", one.points.clone(), Color::Result, CurveStyle::Dots),
        line("t quantile", ends(one.limit), Color::Demand, CurveStyle::Line),
        line("", ends(-one.limit), Color::Demand, CurveStyle::Line),
    ]);
    let plot = Plot {
        title: format!("Profile of {}", one.parameter),
        x_label: labelled(&one.parameter, &one.unit),
        y_label: "signed root of the likelihood ratio".into(),
        curves,
        ..Plot::default()
    };
    Figure { plots: vec![(format!("profile-{}", one.parameter), plot)], ..Figure::default() }
}

/// Centre of a band.
#[derive(Clone, Copy)]
pub(super) enum Around {
    /// Prediction.
    Prediction,
    /// Zero, for residuals.
    Zero,
}

/// Returns the curves of the bands of a channel, for its plot.
pub(super) fn bands(found: &UncertaintyReport, experiment: &str, channel: &str, around: Around) -> Vec<Curve> {
    let Some(band) = found.bands.iter().find(|b| b.experiment == experiment && b.channel == channel) else {
        return Vec::new();
    };
    let percent = significant(100.0 * found.level, 4);
    let curve = |name: String, half: &[f64], sign: f64, color: Color| Curve {
        name,
        points: points(band, half, sign, around),
        color,
        style: CurveStyle::Dashed,
        may_leave: true,
        ..Curve::default()
    };
    let (response, measurement) = (Color::Series(2), Color::Series(3));
    vec![
        curve(format!("{percent} % band of the response"), &band.response, 1.0, response),
        curve(String::new(), &band.response, -1.0, response),
        curve(format!("{percent} % band of measurements"), &band.measurement, 1.0, measurement),
        curve(String::new(), &band.measurement, -1.0, measurement),
    ]
}

fn points(band: &BandReport, half: &[f64], sign: f64, around: Around) -> Vec<(f64, f64)> {
    let middle = |value: f64| match around {
        Around::Prediction => value,
        Around::Zero => 0.0,
    };
    band.times.iter().zip(&band.value).zip(half).map(|((&t, &value), half)| (t, middle(value) + sign * half)).collect()
}
