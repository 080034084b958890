//! Part of the time in which a response moves.

use mops_content::figures::Group;

/// Share of the range of a curve within which the curve counts as at rest.
const AT_REST: f64 = 0.02;

/// Margin on both sides, as a share of the part.
const MARGIN: f64 = 0.15;

/// Largest share of the whole time for which a part is shown; a larger part differs too little from the whole.
const LARGEST: f64 = 0.6;

/// Sets the window of all plots over time of a group to the part in which a response or an input moves.
pub(super) fn narrow(group: &mut Group) {
    // The first plot of a figure has the signal, others have residuals.
    let shown = || group.figures.iter().filter(|figure| figure.on_request.is_none());
    let plots = || shown().flat_map(|figure| figure.plots.first()).map(|(_, plot)| plot).filter(|plot| !plot.log_x);
    let curves = plots().flat_map(|plot| plot.shown()).filter(|curve| !curve.may_leave);
    let bounds = plots().flat_map(|plot| &plot.bounds).flat_map(|bound| bound.x);
    let window = part(curves.map(|curve| curve.points.as_slice()), bounds);
    let all = group.figures.iter_mut().flat_map(|figure| &mut figure.plots).map(|(_, plot)| plot);
    all.filter(|plot| !plot.log_x).for_each(|plot| plot.window = window);
}

/// Returns the part of the time in which a curve is away from its first or last value, with a margin; `None` if that is
/// nearly the whole time. `also` are times that the part contains.
fn part<'p>(curves: impl Iterator<Item = &'p [(f64, f64)]>, also: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut whole = [f64::INFINITY, f64::NEG_INFINITY];
    let mut part = whole;
    let widen = |range: &mut [f64; 2], x: f64| *range = [range[0].min(x), range[1].max(x)];
    for points in curves {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
        widen(&mut whole, first.0);
        widen(&mut whole, last.0);
        let values = || points.iter().map(|p| p.1).filter(|y| y.is_finite());
        let range = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        let moves = |from: f64| move |p: &&(f64, f64)| (p.1 - from).abs() > AT_REST * range;
        if let (Some(begin), Some(end)) = (points.iter().find(moves(first.1)), points.iter().rfind(moves(last.1))) {
            widen(&mut part, begin.0);
            widen(&mut part, end.0);
        }
    }
    also.filter(|t| (whole[0]..=whole[1]).contains(t)).for_each(|t| widen(&mut part, t));
    let margin = MARGIN * (part[1] - part[0]);
    let part = [(part[0] - margin).max(whole[0]), (part[1] + margin).min(whole[1])];
    // A start shortly before the part is included.
    let part = [if part[0] - whole[0] < part[1] - part[0] { whole[0] } else { part[0] }, part[1]];
    let is_part = part[1] > part[0] && part[1] - part[0] <= LARGEST * (whole[1] - whole[0]);
    is_part.then_some(part)
}

#[cfg(test)]
mod tests {
    use mops_math as math;

    use super::part;

    fn curve(value: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        (0..=10_000).map(|i| 0.01 * f64::from(i)).map(|t| (t, value(t))).collect()
    }

    #[test]
    fn a_step_in_the_middle_is_shown_with_a_margin_and_an_early_one_from_the_start() {
        let lag = |at: f64| curve(move |t| if t < at { 0.0 } else { 1.0 - math::exp(at - t) });
        // The lag is within 2 % of its end value after ln(50) = 3.9 s.
        let (late, early) = (lag(50.0), lag(0.0));
        let [from, to] = part([late.as_slice()].into_iter(), std::iter::empty()).unwrap();
        assert!((from - 49.43).abs() < 0.02 && (to - 54.49).abs() < 0.02, "{from} {to}");
        let [from, to] = part([early.as_slice()].into_iter(), [10.0].into_iter()).unwrap();
        assert!(from == 0.0 && (to - 11.5).abs() < 0.01, "{from} {to}");
        let both = [early.as_slice(), lag(30.0).as_slice()].map(<[(f64, f64)]>::to_vec);
        let [from, to] = part(both.iter().map(Vec::as_slice), std::iter::empty()).unwrap();
        assert!(from == 0.0 && (to - 39.0).abs() < 0.05, "{from} {to}");
    }

    #[test]
    fn an_oscillation_and_a_constant_are_shown_as_a_whole() {
        assert_eq!(part([curve(math::sin).as_slice()].into_iter(), std::iter::empty()), None);
        assert_eq!(part([curve(|_| 1.0).as_slice()].into_iter(), std::iter::empty()), None);
        assert_eq!(part(std::iter::empty(), std::iter::empty()), None);
    }
}
