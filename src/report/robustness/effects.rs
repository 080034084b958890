//! Global sensitivity to the uncertain parameters: Morris and Sobol.

use maud::{Markup, html};
use mops_core::study::SensitivityMethod;
use mops_outcome::robustness::{EffectReport, EffectsReport, Estimated, GlobalSensitivityReport};

use super::super::figures::{Figure, Group};
use super::super::page::scrolling;
use super::super::plot::{Color, Curve, CurveStyle, Plot};
use super::super::sensitivity::sentences;
use super::{Section, parameters};
use crate::numbers::{labelled, significant};

pub(super) fn section(found: &GlobalSensitivityReport) -> Section {
    let morris = found.method == SensitivityMethod::Morris;
    let content = html! {
        (sentences(&found.words))
        (parameters(&found.parameters))
        p {
            @if morris {
                "Elementary effects over " (found.samples) " trajectories, each of which moves every parameter once by two "
                "thirds of its range. The magnitude is the mean absolute effect per range; in the mean, effects of opposite "
                "sign cancel. A standard deviation as large as the magnitude indicates nonlinearity or interactions. "
            } @else {
                "Sobol indices: first-order share of the variance, and total share with interactions. Brackets contain "
                (significant(100.0 * found.level, 3)) " % bootstrap intervals over " (found.samples) " samples. Estimates may be "
                "slightly negative. "
            }
        }
        @for criterion in found.criteria.iter().filter(|c| !c.effects.is_empty()) {
            h3 { (criterion.of.criterion) " in case " (criterion.of.case) }
            (scrolling(&criterion.of.criterion, table(criterion, morris)))
        }
    };
    let of = |criterion: &EffectsReport| if morris { plane(criterion) } else { shares(criterion) };
    let figures = found.criteria.iter().filter(|c| !c.effects.is_empty()).map(of).collect();
    Section { title: "Effects of uncertain parameters", content, group: Group { figures, ..Group::default() } }
}

fn table(criterion: &EffectsReport, morris: bool) -> Markup {
    let bare = |value: Option<f64>| value.map_or_else(String::new, |v| significant(v, 4));
    let with_interval = |share: Option<Estimated>| {
        html! {
            @if let Some(Estimated { value, interval: [low, high] }) = share {
                (significant(value, 3)) small { "[" (significant(low, 3)) ", " (significant(high, 3)) "]" }
            }
        }
    };
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    @if morris {
                        th scope="col" class="number" { (labelled("magnitude", &criterion.of.unit)) }
                        th scope="col" class="number" { (labelled("mean", &criterion.of.unit)) }
                        th scope="col" class="number" { (labelled("standard deviation", &criterion.of.unit)) }
                    } @else {
                        th scope="col" class="number" { "first-order" }
                        th scope="col" class="number" { "total" }
                    }
                }
            }
            tbody {
                @for effect in &criterion.effects {
                    tr {
                        th scope="row" { (effect.parameter) }
                        @if morris {
                            td class="number" { (bare(effect.magnitude)) }
                            td class="number" { (bare(effect.mean)) }
                            td class="number" { (bare(effect.deviation)) }
                        } @else {
                            td class="number" { (with_interval(effect.first)) }
                            td class="number" { (with_interval(effect.total)) }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the plot of standard deviation over magnitude, with a dot for every parameter.
fn plane(criterion: &EffectsReport) -> Figure {
    let dot = |(i, effect): (usize, &EffectReport)| Curve {
        name: effect.parameter.clone(),
        points: vec![(effect.magnitude.unwrap_or(f64::NAN), effect.deviation.unwrap_or(f64::NAN))],
        style: CurveStyle::Dots,
        color: Color::Series(i),
        ..Curve::default()
    };
    let longest = criterion.effects.iter().filter_map(|e| e.magnitude).fold(0.0, f64::max);
    let equal = Curve {
        name: "deviation = magnitude".into(),
        points: vec![(0.0, 0.0), (longest, longest)],
        style: CurveStyle::Dashed,
        color: Color::Faint,
        ..Curve::default()
    };
    let plot = Plot {
        title: format!("Elementary effects on {}", criterion.of.criterion),
        x_label: labelled("magnitude", &criterion.of.unit),
        y_label: labelled("standard deviation", &criterion.of.unit),
        curves: std::iter::once(equal).chain(criterion.effects.iter().enumerate().map(dot)).collect(),
        ..Plot::default()
    };
    Figure {
        plots: vec![(format!("morris-{}-{}", criterion.of.case, criterion.of.criterion), plot)],
        ..Figure::default()
    }
}

/// Returns the plot of Sobol indices with their intervals, parameters numbered along x.
#[allow(clippy::cast_precision_loss)]
fn shares(criterion: &EffectsReport) -> Figure {
    let of = |name: &str, color: Color, aside: f64, pick: fn(&EffectReport) -> Option<Estimated>| {
        let known: Vec<(f64, Estimated)> = criterion
            .effects
            .iter()
            .enumerate()
            .filter_map(|(i, e)| Some(((i + 1) as f64 + aside, pick(e)?)))
            .collect();
        let bar = |(x, share): &(f64, Estimated)| [share.interval[0], share.interval[1], f64::NAN].map(|end| (*x, end));
        let bars = known.iter().flat_map(bar).collect();
        let dots = known.iter().map(|(x, share)| (*x, share.value)).collect();
        [
            Curve { points: bars, color, ..Curve::default() },
            Curve { name: name.into(), points: dots, style: CurveStyle::Dots, color, ..Curve::default() },
        ]
    };
    let mut curves = Vec::new();
    curves.extend(of("first-order", Color::Result, -0.08, |e| e.first));
    curves.extend(of("total", Color::Measured, 0.08, |e| e.total));
    let names: Vec<String> =
        criterion.effects.iter().enumerate().map(|(i, e)| format!("{} {}", i + 1, e.parameter)).collect();
    let plot = Plot {
        title: format!("Sobol indices of {}", criterion.of.criterion),
        x_label: format!("parameter: {}", names.join(", ")),
        y_label: "share of the variance".into(),
        curves,
        x_range: Some([0.5, criterion.effects.len() as f64 + 0.5]),
        ..Plot::default()
    };
    Figure {
        plots: vec![(format!("sobol-{}-{}", criterion.of.case, criterion.of.criterion), plot)],
        ..Figure::default()
    }
}
