//! Clauses on directions that are not determined. Names are between backticks.

use mops_identification::{
    Coordinate,
    blind::{BlindDirection, Invariant, Limit},
};

use super::words::{coefficient, listed, percent};

/// Share of the largest change below which a change is not listed by name.
const NAMED: f64 = 0.05;

/// Returns a clause that states what can be estimated along a direction, and what cannot.
pub(super) fn clause(direction: &BlindDirection, coordinates: &[Coordinate]) -> String {
    let name = |k: usize| format!("`{}`", coordinates[k].name);
    match direction.invariant {
        Invariant::Everything(one) => format!("{} has no effect", name(one)),
        Invariant::Ratio(a, b) => {
            format!("only the ratio {}/{} can be estimated: a common factor of both has no effect", name(a), name(b))
        }
        Invariant::Product(a, b) => format!("only the product {} {} can be estimated", name(a), name(b)),
        Invariant::Power { base, exponent, other, divided } => {
            let joint = if divided { "/" } else { " " };
            format!("only {}^{exponent}{joint}{} can be estimated", name(base), name(other))
        }
        Invariant::Sum(..) => sum(direction, coordinates).unwrap_or_default(),
        Invariant::Ratios => {
            let names: Vec<String> = direction.changes.iter().map(|&(k, _)| name(k)).collect();
            format!("a common factor of {} has no effect: only their ratios can be estimated", listed(&names))
        }
        Invariant::Unnamed if direction.changes.is_empty() => "this direction is not determined".to_owned(),
        Invariant::Unnamed => changes(&direction.changes, coordinates),
    }
}

/// Returns the clause for a direction along which a weighted sum of two tuners is constant; `None` for other numbers of
/// tuners.
pub(super) fn sum(direction: &BlindDirection, coordinates: &[Coordinate]) -> Option<String> {
    let [(a, _), (b, _)] = *direction.changes else { return None };
    let weight = direction.weight(coordinates)?;
    let sign = if weight < 0.0 { "-" } else { "+" };
    let [a, b] = [a, b].map(|k| &coordinates[k].name);
    Some(format!("only `{a}` {sign} {} `{b}` can be estimated", coefficient(weight.abs())))
}

/// Returns the clause that lists the changes of the tuners along a direction.
fn changes(changes: &[(usize, f64)], coordinates: &[Coordinate]) -> String {
    let change = |&(k, share): &(usize, f64)| {
        let verb = if share < 0.0 { "decreases" } else { "increases" };
        let Coordinate { name, value, unit, .. } = &coordinates[k];
        let by = match *value {
            0.0 => format!("{} {unit}", coefficient(0.01 * share.abs() * coordinates[k].scale())),
            _ => percent(0.01 * share.abs()),
        };
        format!("`{name}` {verb} by {by}")
    };
    let main: Vec<String> = changes.iter().filter(|(_, share)| share.abs() >= NAMED).map(change).collect();
    let less = match changes.len() - main.len() {
        0 => String::new(),
        1 => ", with a smaller change of another tuner".to_owned(),
        count => format!(", with smaller changes of {count} other tuners"),
    };
    format!("no effect if {}{less}", listed(&main))
}

/// Returns a clause on a direction that has no effect to first order only.
pub(super) fn at_point(direction: &BlindDirection, coordinates: &[Coordinate]) -> String {
    let names: Vec<String> = direction.changes.iter().map(|&(k, _)| format!("`{}`", coordinates[k].name)).collect();
    let along = if names.len() == 1 { names.concat() } else { format!("a direction of {}", listed(&names)) };
    format!(
        "along {along} the derivatives are 0 at this point, but a step of 10 % has an effect: the point is stationary or at a kink"
    )
}

/// Returns the reason why a direction is not determined, as the end of a clause.
pub(super) fn suffix(limit: Limit) -> &'static str {
    match limit {
        Limit::Nothing => "",
        Limit::Noise => ", within the noise",
        Limit::Slopes => ", within the accuracy of the derivatives",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the clause for changes relative to the values of tuners.
    fn of(invariant: Invariant, tuners: &[(&str, f64, f64)]) -> String {
        let coordinate = |(name, value, _): &(&str, f64, f64)| Coordinate {
            name: (*name).into(),
            value: *value,
            range: 1.0,
            span: 1.0,
            unit: "m".into(),
            counts_from_any_zero: false,
        };
        let coordinates: Vec<Coordinate> = tuners.iter().map(coordinate).collect();
        let changes = tuners.iter().enumerate().map(|(k, &(_, _, change))| (k, change)).collect();
        clause(&BlindDirection { limit: Limit::Nothing, changes, invariant }, &coordinates)
    }

    #[test]
    fn pairs_are_named_as_sum_difference_product_and_ratio() {
        // Along a change of a by x a and of b by y b, the sum a - (x a)/(y b) b is constant.
        let pair = |invariant, y| of(invariant, &[("a", 3.0, 1.0), ("b", 0.2, y)]);
        assert_eq!(pair(Invariant::Sum(0, 1), -3.75), "only `a` + 4.00 `b` can be estimated");
        assert_eq!(pair(Invariant::Sum(0, 1), 120.0), "only `a` - 0.125 `b` can be estimated");
        assert_eq!(pair(Invariant::Product(0, 1), -1.0), "only the product `a` `b` can be estimated");
        assert_eq!(
            pair(Invariant::Ratio(0, 1), 1.0),
            "only the ratio `a`/`b` can be estimated: a common factor of both has no effect"
        );
        let power = |base, divided| Invariant::Power { base, exponent: 2, other: 1 - base, divided };
        assert_eq!(pair(power(0, false), -2.0), "only `a`^2 `b` can be estimated");
        assert_eq!(pair(power(1, true), 0.5), "only `b`^2/`a` can be estimated");
    }

    #[test]
    fn directions_of_many_tuners_name_their_ratios_or_changes() {
        assert_eq!(
            of(Invariant::Ratios, &[("a", 2.0, 1.0), ("b", 0.5, 1.0), ("c", 1e-3, 1.0)]),
            "a common factor of `a`, `b` and `c` has no effect: only their ratios can be estimated"
        );
        assert_eq!(
            of(Invariant::Unnamed, &[("a", 2.0, 0.5), ("b", 4.0, -1.0), ("c", 0.0, 0.01)]),
            "no effect if `a` increases by 0.5 % and `b` decreases by 1 %, with a smaller change of another tuner"
        );
    }
}
