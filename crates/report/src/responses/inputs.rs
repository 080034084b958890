//! Plots of the inputs that drive a simulation.

use mops_core::{Case, Input, Variable};

use mops_content::sampling::thinned;

/// Number of points of a smooth input.
const GRID: u32 = 1000;
/// Largest number of breaks.
const MOST_BREAKS: usize = 100_000;

/// Returns the inputs that change over time in one of the cases, in the order of the model.
pub(super) fn driven<'m>(inputs: &'m [Variable], cases: &[&Case]) -> Vec<&'m Variable> {
    let changes = |input: &&Input| !matches!(input, Input::Constant(_));
    inputs.iter().filter(|one| cases.iter().any(|case| case.input(&one.name).filter(changes).is_some())).collect()
}

/// Returns the points of an input up to a time, with both values at every jump; zero if the case does not drive it.
pub(super) fn points(case: &Case, name: &str, end: f64) -> Vec<(f64, f64)> {
    let Some(input) = case.input(name) else { return vec![(0.0, 0.0), (end, 0.0)] };
    let mut points = vec![(0.0, input.at(0.0))];
    let mut next = 1;
    let mut grid = |points: &mut Vec<(f64, f64)>, until: f64| {
        while next < GRID && f64::from(next) * end / f64::from(GRID) < until {
            let t = f64::from(next) * end / f64::from(GRID);
            points.push((t, input.at(t)));
            next += 1;
        }
    };
    let mut t = 0.0;
    for _ in 0..MOST_BREAKS {
        t = input.next_break(t);
        if t >= end {
            break;
        }
        grid(&mut points, t);
        // Values before and after a jump.
        points.extend([(t, input.at(t.next_down())), (t, input.at(t))]);
    }
    grid(&mut points, end);
    points.push((end, input.at(end)));
    thinned(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_has_two_values_and_an_undriven_input_is_zero() {
        let step = Input::Step { time: 1.0, before: 0.5, after: 2.0 };
        let case = Case { inputs: vec![("u".into(), step)], ..Case::default() };
        let drawn = points(&case, "u", 4.0);
        let at_jump: Vec<f64> = drawn.iter().filter(|p| p.0 == 1.0).map(|p| p.1).collect();
        assert_eq!(at_jump, [0.5, 2.0, 2.0]);
        assert!(drawn.is_sorted_by(|a, b| a.0 <= b.0) && drawn.last() == Some(&(4.0, 2.0)));
        assert_eq!(points(&case, "d", 4.0), [(0.0, 0.0), (4.0, 0.0)]);
        let inputs = ["u", "d"].map(|name| Variable::new(name, "1", ""));
        assert_eq!(driven(&inputs, &[&case]).iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["u"]);
    }
}
