//! Tables of the diagnosis benchmark.

use std::fmt::Write;

use mops::terminal::table;
use mops_testbed::Setting;

use super::kinds::kinds;
use crate::diagnosis::{Bin, Kind, Rate, Results, Row, brier, deciles, reliability, uniformity};

/// Formats all tables.
pub(super) fn all(results: &Results) -> String {
    let mut text = String::new();
    for part in [
        effects(&results.rows),
        places(&results.rows),
        kinds(&results.rows),
        summary(results),
        probabilities(&results.rows),
        p_values(&results.rows),
        coverage(&results.rows),
        failures(&results.rows),
    ] {
        if !part.is_empty() {
            text += &format!("\n{part}");
        }
    }
    text
}

/// Returns pairs of stated probability and outcome, for verdicts and for effects.
pub(super) fn stated(rows: &[Row]) -> [(&'static str, Vec<(f64, bool)>); 2] {
    let answered = || rows.iter().filter_map(|row| row.answer.as_ref().ok().map(|answer| (row, answer)));
    let verdicts = answered().map(|(row, answer)| (answer.probability, row.judgement.verdict));
    // N.B.: either of two missing effects may be ranked first.
    let effects = answered().filter(|(_, answer)| answer.first().is_some());
    let effects = effects.map(|(row, answer)| (answer.found[0].1, row.judgement.first));
    [("verdicts", verdicts.filter(known).collect()), ("effects", effects.filter(known).collect())]
}

fn known(pair: &(f64, bool)) -> bool {
    pair.0.is_finite()
}

fn rate(facts: impl Iterator<Item = bool>) -> String {
    let rate = Rate::of(facts);
    if rate.of == 0 { String::new() } else { format!("{}/{}", rate.hits, rate.of) }
}

fn percent(rate: Rate) -> String {
    let [low, high] = rate.interval95();
    let digits = if rate.of >= 200 { 1 } else { 0 };
    let shown = |share: f64| format!("{:.digits$}", 100.0 * share);
    format!("{} % ({} to {}) of {}", shown(rate.share()), shown(low), shown(high), rate.of)
}

/// Formats the detection rates by effect and size: true effect ranked first, or in the reported set.
fn effects(rows: &[Row]) -> String {
    by(rows, "effect", |row| row.truth.first().map(|(effect, _)| effect.clone()))
}

/// Formats the detection rates by plant.
fn places(rows: &[Row]) -> String {
    by(rows, "plant", |row| Some(row.plant.clone()))
}

fn by(rows: &[Row], what: &str, key: impl Fn(&Row) -> Option<String>) -> String {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.kind == Kind::One).collect();
    let mut sizes: Vec<f64> = rows.iter().map(|row| row.size).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes.dedup();
    let mut keys: Vec<String> = rows.iter().filter_map(|row| key(row)).collect();
    keys.sort();
    keys.dedup();
    if keys.is_empty() {
        return String::new();
    }
    let line = |name: &str, of: &dyn Fn(&Row) -> bool| {
        let own: Vec<&Row> = rows.iter().copied().filter(|row| of(row)).collect();
        let first = |size: f64| rate(own.iter().filter(|row| row.size == size).map(|row| row.judgement.first));
        let mut cells = vec![name.to_owned()];
        cells.extend(sizes.iter().map(|&size| first(size)));
        let all = |fact: fn(&Row) -> bool| rate(own.iter().map(|row| fact(row)));
        cells.push(all(|row| row.judgement.first));
        cells.push(all(|row| row.judgement.in_set));
        cells.push(mean_set(&own));
        cells.push(all(|row| row.judgement.place));
        cells.push(all(|row| row.judgement.verdict));
        cells
    };
    let mut lines: Vec<Vec<String>> =
        keys.iter().map(|name| line(name, &|row| key(row).as_deref() == Some(name))).collect();
    lines.push(line("all", &|_| true));
    let sizes: Vec<String> = sizes.iter().map(|size| format!("first at {size}")).collect();
    let ends = ["first", "in set", "set size", "place", "verdict"];
    let header: Vec<&str> = [what].into_iter().chain(sizes.iter().map(String::as_str)).chain(ends).collect();
    let numeric: Vec<usize> = (1..header.len()).collect();
    table(&header, &numeric, lines)
}

/// Formats the mean number of effects in the reported sets.
#[allow(clippy::cast_precision_loss)]
fn mean_set(rows: &[&Row]) -> String {
    let answers = rows.iter().filter_map(|row| row.answer.as_ref().ok()).filter(|answer| answer.first().is_some());
    let sizes: Vec<f64> = answers.map(|answer| answer.set.len() as f64).collect();
    if sizes.is_empty() { String::new() } else { format!("{:.1}", sizes.iter().sum::<f64>() / sizes.len() as f64) }
}

/// Formats the decisions by kind of case, with those of brute force if it was run.
fn summary(results: &Results) -> String {
    let kinds = [
        (Kind::One, "one effect missing: correct decisions"),
        (Kind::Two, "two effects missing: both found"),
        (Kind::Nothing, "nothing missing: false alarms"),
        (Kind::Outside, "effect not in the catalogue: verdict unexplained"),
    ];
    let rate_of_kind = |rows: &[Row], kind: Kind| {
        // A failed diagnosis counts as a wrong decision, but not as a false alarm.
        let own = rows.iter().filter(|row| row.kind == kind && (row.answer.is_ok() || kind != Kind::Nothing));
        let rate = Rate::of(own.map(|row| match kind {
            Kind::Two => row.judgement.both == Some(true),
            Kind::Nothing => !row.judgement.verdict,
            _ => row.judgement.decision,
        }));
        if rate.of == 0 { String::new() } else { percent(rate) }
    };
    let against = !results.brute.is_empty();
    let line = |name: &str, of: &dyn Fn(&[Row]) -> String| {
        let mut cells = vec![name.to_owned(), of(&results.rows)];
        cells.extend(against.then(|| of(&results.brute)));
        cells
    };
    let mut lines: Vec<Vec<String>> =
        kinds.iter().map(|(kind, name)| line(name, &|rows| rate_of_kind(rows, *kind))).collect();
    lines.retain(|line| !line[1].is_empty());
    if lines.is_empty() {
        // Only kinds with settings, which have their own table.
        return unmade(results);
    }
    let decided = |rows: &[Row]| {
        let rate = Rate::of(rows.iter().map(|row| row.judgement.decision));
        if rate.of == 0 { String::new() } else { percent(rate) }
    };
    lines.push(line("all: correct decisions", &decided));
    let again = Rate::of(results.rows.iter().flat_map(|row| row.agreeing.iter().copied()));
    if again.of > 0 {
        let mut cells = vec!["other catalogue orders and seeds: same findings".to_owned(), percent(again)];
        cells.extend(against.then(String::new));
        lines.push(cells);
    }
    lines.push(line("seconds per case on one thread", &|rows| spread(rows, |answer| answer.0, 2)));
    lines.push(line("simulations per case", &|rows| spread(rows, |answer| answer.1, 0)));
    let mut header = vec!["", "diagnosis"];
    header.extend(against.then_some("brute force"));
    table(&header, &[], lines) + &unmade(results)
}

/// Formats the number of requested cases that could not be generated.
fn unmade(results: &Results) -> String {
    match results.unmade {
        0 => String::new(),
        number => format!("{number} requested cases could not be generated: their size cannot be reached\n"),
    }
}

/// Formats the median and the 90 % quantile.
#[allow(clippy::cast_precision_loss)]
fn spread(rows: &[Row], of: impl Fn((f64, f64)) -> f64, digits: usize) -> String {
    let answers = rows.iter().filter_map(|row| row.answer.as_ref().ok());
    let mut values: Vec<f64> = answers.map(|answer| of((answer.seconds, answer.simulations as f64))).collect();
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return String::new() };
    format!("median {:.digits$}, 90 % below {:.digits$}", values[last / 2], values[last * 9 / 10])
}

fn probabilities(rows: &[Row]) -> String {
    let mut text = String::new();
    for (of, pairs) in stated(rows).iter().filter(|(_, pairs)| !pairs.is_empty()) {
        let lines = reliability(pairs).iter().map(line_of).collect();
        let header = ["stated", "mean stated", "observed"];
        writeln!(text, "probabilities of {of}: Brier score {:.4} over {}", brier(pairs), pairs.len())
            .expect("a text takes everything");
        text += &table(&header, &[1], lines);
    }
    text
}

fn line_of(bin: &Bin) -> Vec<String> {
    let [from, to] = bin.edges;
    vec![format!("{from} to {to}"), format!("{:.3}", bin.stated), percent(bin.observed)]
}

fn p_values(rows: &[Row]) -> String {
    let of_nothing = rows.iter().filter(|row| matches!(row.kind, Kind::Nothing | Kind::Setting(Setting::Exact)));
    let values: Vec<f64> = of_nothing.filter_map(|row| row.answer.as_ref().ok()).map(|a| a.p_value).collect();
    if values.is_empty() {
        return String::new();
    }
    let (distance, limit) = uniformity(&values);
    let tenths: Vec<String> = deciles(&values).iter().map(usize::to_string).collect();
    format!(
        "p-values without a missing effect: distance from uniform {distance:.3} (5 % critical value {limit:.3}); counts by \
         decile {}\n",
        tenths.join(" ")
    )
}

fn coverage(rows: &[Row]) -> String {
    let covered = || rows.iter().flat_map(|row| &row.judgement.covered);
    let rate = Rate::of(covered().map(|c| c.covers()));
    if rate.of == 0 {
        return String::new();
    }
    let mut names: Vec<&str> = covered().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let lines = names.iter().map(|name| {
        let own: Vec<_> = covered().filter(|c| c.name == *name).collect();
        let mut off: Vec<f64> = own.iter().map(|c| (c.value / c.truth - 1.0).abs()).collect();
        off.sort_by(f64::total_cmp);
        let median = format!("{:.1} %", 100.0 * off[off.len() / 2]);
        vec![(*name).to_owned(), rate_of(&own.iter().map(|c| c.covers()).collect::<Vec<_>>()), median]
    });
    let mut sizes: Vec<f64> = rows.iter().filter(|row| row.kind == Kind::One).map(|row| row.size).collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes.dedup();
    let by_size = sizes.iter().filter_map(|&size| {
        let covered = rows.iter().filter(|row| row.size == size).flat_map(|row| &row.judgement.covered);
        let rate = Rate::of(covered.map(|c| c.covers()));
        (rate.of > 0).then(|| format!(" size {size}: {}\n", percent(rate)))
    });
    let by_size: String = by_size.collect();
    let header = ["parameter", "truth inside", "median error"];
    format!(
        "coverage of the 95 % intervals of effect parameters: {}\n{by_size}{}",
        percent(rate),
        table(&header, &[1, 2], lines.collect())
    )
}

fn rate_of(facts: &[bool]) -> String {
    rate(facts.iter().copied())
}

fn failures(rows: &[Row]) -> String {
    let failed = rows.iter().filter_map(|row| row.answer.as_ref().err().map(|why| (row, why)));
    let lines: Vec<String> = failed.map(|(row, why)| format!("{} failed: {why}\n", row.name)).collect();
    lines.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::answers;
    use crate::diagnosis::{Answer, Judgement, Stated};

    fn row(kind: Kind, right: bool, answer: Result<Answer, String>) -> Row {
        let judgement = Judgement {
            verdict: right,
            decision: right,
            first: right && kind == Kind::One,
            in_set: kind == Kind::One,
            place: right,
            both: None,
            covered: Vec::new(),
            stated: Stated::default(),
        };
        let truth = vec![("coulomb-friction".to_owned(), "joint:phi".to_owned())];
        let (size, truth) = if kind == Kind::One { (5.0, truth) } else { (0.0, Vec::new()) };
        Row {
            name: "case".into(),
            plant: "servo".into(),
            kind,
            size,
            background: None,
            is_struck_out: false,
            truth,
            answer,
            judgement,
            agreeing: Vec::new(),
        }
    }

    #[test]
    fn the_tables_give_rates_per_effect_false_alarms_and_failures() {
        let coulomb = || Ok(answers::coulomb());
        let nothing = || Ok(answers::nothing());
        let mut steady = row(Kind::One, true, coulomb());
        steady.agreeing = vec![true, true, true, false];
        let rows = vec![
            steady,
            row(Kind::One, false, coulomb()),
            row(Kind::Nothing, true, nothing()),
            row(Kind::Nothing, false, coulomb()),
            row(Kind::One, false, Err("it diverges".into())),
        ];
        let text = all(&Results { rows, brute: Vec::new(), unmade: 1 });
        let line =
            |of: &str| text.lines().find(|line| line.trim().starts_with(of)).unwrap_or_else(|| panic!("{of}: {text}"));
        let cells: Vec<&str> = line("coulomb-friction").split_whitespace().collect();
        assert_eq!(cells[1..], ["1/3", "1/3", "3/3", "3.0", "1/3", "1/3"]);
        assert!(line("nothing missing").contains("50 % (1 to 99) of 2"), "{}", line("nothing missing"));
        assert!(line("other catalogue orders").contains("75 %") && line("other catalogue orders").ends_with("of 4"));
        assert!(text.contains("1 requested cases could not be generated") && text.contains("case failed: it diverges"));
        assert!(text.contains("probabilities of verdicts: Brier score") && text.contains("distance from uniform"));
    }
}
