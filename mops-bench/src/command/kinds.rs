//! Table of the diagnosis by kind of case, over cases with and without a model error in the background. Rates are
//! counts with their 95 % intervals in %.

use mops::{core::Role, outcome::diagnosis::Verdict, terminal::table};

use crate::diagnosis::{Answer, Kind, Rate, Row, Statement, brier};

/// Stated probability from which a statement counts as certain. Printed probabilities are at most 0.95.
const CERTAIN: f64 = 0.9;

/// Forecast error from which a claim counts as harmful, relative to that of the declared model.
const WORSE: f64 = 1.01;

/// Case with an answer.
#[derive(Clone, Copy)]
struct Case<'a> {
    row: &'a Row,
    answer: &'a Answer,
}

/// Measure of a kind: its name, its value over the cases of a kind, empty if it has none.
type Measure = (&'static str, fn(&[Case<'_>]) -> String);

const MEASURES: &[Measure] = &[
    ("an effect is named first, claimed or proposed", |all| rate(all, |case| Some(case.is_named()))),
    ("class and place claimed (verdict effect)", |all| rate(all, |case| Some(case.claims()))),
    ("true effect named first", |all| rate(all, |case| case.lacks_known().then_some(case.row.judgement.stated.name))),
    ("its class and place named first", |all| rate(all, |case| case.lacks_known().then(|| case.entry_right()))),
    ("true effect in the stated set", |all| {
        rate(all, |case| case.lacks_known().then_some(case.row.judgement.stated.in_set))
    }),
    ("true effect named first and claimed", |all| {
        rate(all, |case| case.lacks_known().then(|| case.first_claimed() && case.row.judgement.stated.name))
    }),
    ("its class and place named first and claimed", |all| {
        rate(all, |case| case.lacks_known().then(|| case.first_claimed() && case.entry_right()))
    }),
    ("missed: nothing named", |all| rate(all, |case| case.lacks_known().then_some(!case.is_named()))),
    ("wrong class and place claimed", |all| rate(all, |case| Some(case.claims_wrong_entry()))),
    ("certain and wrong, by class and place", |all| {
        rate(all, |case| Some(case.certain(|i| case.statements()[i].probability, &case.row.judgement.stated.entries)))
    }),
    ("certain and wrong, by name", |all| {
        rate(all, |case| Some(case.certain(|i| case.answer.found[i].1, &case.row.judgement.stated.names)))
    }),
    ("wrong class named", |all| rate(all, |case| case.lacks_effect().then(|| case.wrong_class(false)))),
    ("wrong class claimed", |all| rate(all, |case| case.lacks_effect().then(|| case.wrong_class(true)))),
    ("coordinate stated", |all| rate(all, |case| Some(case.answer.depends_on.is_some()))),
    ("coordinate right, of those stated", |all| rate(all, |case| case.row.judgement.stated.coordinate)),
    ("its place right, of those stated", |all| rate(all, |case| case.row.judgement.stated.coordinate_place)),
    ("coordinate and place right, of those stated", |all| {
        rate(all, |case| case.row.judgement.stated.coordinate_and_place)
    }),
    ("coordinate of what remains stated", |all| rate(all, |case| Some(case.answer.remaining.is_some()))),
    ("claims with a worse forecast of validation", |all| {
        rate(all, |case| case.claims().then(|| case.answer.change(Role::Validation).is_some_and(|c| c > WORSE)))
    }),
    ("verdict none, calibration error above 1.1 noises", |all| {
        rate(all, |case| Some(case.answer.verdict == Verdict::None && case.answer.exceeds_noise()))
    }),
    ("intervals of declared parameters, right answers", |all| intervals(all, |case| case.is_right())),
    ("intervals of declared parameters, all answers", |all| intervals(all, |_| true)),
    ("Brier score", |all| {
        let stated: Vec<(f64, bool)> = all.iter().filter_map(Case::stated).collect();
        if stated.is_empty() { String::new() } else { format!("{:.3}", brier(&stated)) }
    }),
    ("seconds on one thread: median, 90 %", |all| {
        let seconds = sorted_seconds(all);
        let Some(last) = seconds.len().checked_sub(1) else { return String::new() };
        format!("{:.1}, {:.1}", seconds[last / 2], seconds[last * 9 / 10])
    }),
    ("seconds on one thread: sum", |all| format!("{:.0}", sorted_seconds(all).iter().sum::<f64>())),
];

/// Formats the measures by kind; empty without cases of these kinds.
pub(super) fn kinds(rows: &[Row]) -> String {
    let rows: Vec<&Row> = rows.iter().filter(|row| matches!(row.kind, Kind::Setting(_))).collect();
    let title = |row: &Row| {
        let struck_out = if row.is_struck_out { " struck out" } else { "" };
        format!("{}{struck_out}", row.kind.name())
    };
    let mut titles: Vec<String> = rows.iter().map(|row| title(row)).collect();
    titles.sort();
    titles.dedup();
    if titles.is_empty() {
        return String::new();
    }
    let of_kind = |name: &String| -> Vec<&Row> { rows.iter().copied().filter(|row| title(row) == *name).collect() };
    let columns: Vec<Vec<&Row>> = titles.iter().map(of_kind).collect();
    let answered: Vec<Vec<Case<'_>>> =
        columns.iter().map(|rows| rows.iter().copied().filter_map(Case::new).collect()).collect();
    let line = |name: &str, cells: Vec<String>| [vec![name.to_owned()], cells].concat();
    let failed = |rows: &Vec<&Row>| rows.iter().filter(|row| row.answer.is_err()).count();
    let mut lines = vec![
        line("cases", columns.iter().map(|rows| rows.len().to_string()).collect()),
        line("failed", columns.iter().map(|rows| failed(rows).to_string()).collect()),
    ];
    lines.extend(
        MEASURES.iter().map(|(name, measure)| line(name, answered.iter().map(|cases| measure(cases)).collect())),
    );
    let header: Vec<&str> =
        ["counts (95 % intervals, %)"].into_iter().chain(titles.iter().map(String::as_str)).collect();
    table(&header, &[], lines)
}

impl<'a> Case<'a> {
    fn new(row: &'a Row) -> Option<Self> {
        row.answer.as_ref().ok().map(|answer| Self { row, answer })
    }

    fn statements(&self) -> &'a [Statement] {
        &self.answer.statements
    }

    fn is_named(&self) -> bool {
        !self.answer.found.is_empty()
    }

    fn claims(&self) -> bool {
        self.answer.verdict == Verdict::Effect
    }

    /// Returns whether an effect is missing.
    fn lacks_effect(&self) -> bool {
        !self.row.truth.is_empty()
    }

    /// Returns whether an effect of the catalogue is missing.
    fn lacks_known(&self) -> bool {
        self.lacks_effect() && !self.row.is_struck_out
    }

    fn first_claimed(&self) -> bool {
        self.statements().first().is_some_and(|statement| statement.claimed)
    }

    fn entry_right(&self) -> bool {
        self.row.judgement.stated.entries.first() == Some(&true)
    }

    /// Returns true if an effect is stated with certainty and wrong.
    fn certain(&self, probability: impl Fn(usize) -> f64, right: &[bool]) -> bool {
        right.iter().enumerate().any(|(i, right)| !right && probability(i) >= CERTAIN)
    }

    /// Returns true if an effect of a wrong class is found, or claimed.
    fn wrong_class(&self, only_claimed: bool) -> bool {
        let classes = self.row.judgement.stated.classes.iter();
        classes.zip(self.statements()).any(|(right, statement)| !right && (statement.claimed || !only_claimed))
    }

    /// Returns true if a class and place are claimed that are not those of a missing effect.
    fn claims_wrong_entry(&self) -> bool {
        let entries = self.row.judgement.stated.entries.iter();
        entries.zip(self.statements()).any(|(right, statement)| !right && statement.claimed)
    }

    /// Returns true if the true class and place are named first or, without a missing effect, nothing is claimed.
    fn is_right(&self) -> bool {
        if self.row.truth.is_empty() { !self.claims() } else { self.entry_right() }
    }

    /// Returns the stated probability and whether the statement is right: class and place of the first effect found,
    /// else the verdict.
    fn stated(&self) -> Option<(f64, bool)> {
        let stated = match self.statements().first() {
            Some(statement) => (statement.probability, self.entry_right()),
            None => (self.answer.probability, self.row.judgement.verdict),
        };
        stated.0.is_finite().then_some(stated)
    }
}

/// Formats the rate of a fact over the cases in which it is defined, with its 95 % interval.
fn rate(all: &[Case<'_>], fact: impl Fn(&Case<'_>) -> Option<bool>) -> String {
    shown(Rate::of(all.iter().filter_map(fact)))
}

fn shown(rate: Rate) -> String {
    let [low, high] = rate.interval95();
    if rate.of == 0 {
        return String::new();
    }
    format!("{}/{} ({:.0}-{:.0})", rate.hits, rate.of, 100.0 * low, 100.0 * high)
}

/// Formats the share of 95 % intervals that hold the true value.
fn intervals(all: &[Case<'_>], counts: impl Fn(&Case<'_>) -> bool) -> String {
    let cases = all.iter().filter(|case| counts(case));
    shown(Rate::of(cases.flat_map(|case| &case.row.judgement.stated.declared).map(|covered| covered.covers())))
}

fn sorted_seconds(all: &[Case<'_>]) -> Vec<f64> {
    let mut seconds: Vec<f64> = all.iter().map(|case| case.answer.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    seconds
}

#[cfg(test)]
mod tests {
    use mops_testbed::Setting;

    use super::*;
    use crate::diagnosis::{Judgement, Stated, answers};

    fn row(setting: Setting, answer: Result<Answer, String>, stated: Stated) -> Row {
        let truth = vec![("coulomb-friction".to_owned(), "joint:phi".to_owned())];
        Row {
            name: "case".into(),
            plant: "two-masses".into(),
            kind: Kind::Setting(setting),
            size: 10.0,
            background: None,
            is_struck_out: false,
            truth: if setting.lacks_effect() { truth } else { Vec::new() },
            judgement: Judgement {
                verdict: answer.as_ref().is_ok_and(|answer| answer.found.is_empty() != setting.lacks_effect()),
                stated,
                ..Judgement::default()
            },
            answer,
            agreeing: Vec::new(),
        }
    }

    fn judged(right: bool) -> Stated {
        Stated { name: right, entries: vec![right], classes: vec![right], names: vec![right], ..Stated::default() }
    }

    #[test]
    fn rates_are_counted_by_kind_over_the_cases_that_they_concern() {
        let coulomb = || Ok(answers::coulomb());
        let nothing = || Ok(answers::nothing());
        let rows = [
            row(Setting::Exact, nothing(), Stated::default()),
            row(Setting::Exact, coulomb(), judged(false)),
            row(Setting::Effect, coulomb(), judged(true)),
            row(Setting::Effect, nothing(), Stated::default()),
            row(Setting::Effect, Err("it diverges".into()), Stated::default()),
            Row { is_struck_out: true, ..row(Setting::Effect, coulomb(), judged(false)) },
        ];
        let text = kinds(&rows);
        let cells = |of: &str| -> Vec<String> {
            let line = text.lines().find(|line| line.trim().starts_with(of)).unwrap_or_else(|| panic!("{of}: {text}"));
            let rest = line.trim()[of.len()..].split("  ").map(str::trim);
            rest.filter(|cell| !cell.is_empty()).map(str::to_owned).collect()
        };
        assert_eq!(cells("cases"), ["2", "3", "1"]);
        assert_eq!(cells("failed"), ["0", "1", "0"]);
        assert_eq!(cells("class and place claimed (verdict effect)"), ["1/2 (1-99)", "1/2 (1-99)", "1/1 (2-100)"]);
        assert_eq!(cells("true effect named first and claimed"), ["1/2 (1-99)"]);
        assert_eq!(cells("missed: nothing named"), ["1/2 (1-99)"]);
        assert_eq!(cells("wrong class claimed"), ["0/2 (0-84)", "1/1 (2-100)"]);
        assert_eq!(cells("certain and wrong, by class and place"), ["1/2 (1-99)", "0/2 (0-84)", "1/1 (2-100)"]);
        // 0.93 that nothing is missing, right; 0.95 for friction, wrong.
        assert_eq!(cells("Brier score")[0], "0.454");
        assert!(kinds(&[]).is_empty());
    }
}
