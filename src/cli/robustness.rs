//! Text of the findings over uncertain parameters: worst cases, distributions and sensitivities.

use mops_core::study::SensitivityMethod;
use mops_outcome::{
    Findings, UncertaintyReport,
    robustness::{
        Estimated, GlobalSensitivityReport, MonteCarloReport, RobustReport, Subject, UncertainReport, WorstCaseReport,
        WorstReport,
    },
};

use super::findings::{known, sentences, share};
use crate::numbers::significant;
use crate::terminal::{number, table};

/// Formats the findings over uncertain parameters; empty if there are none.
pub(super) fn text(found: &Findings) -> String {
    let mut text = String::new();
    if let Some(found) = &found.uncertainty {
        text += &uncertainty(found);
    }
    if let Some(found) = &found.robust {
        text += &robust(found);
    }
    if let Some(found) = &found.worst_case {
        text += &worst_case(found);
    }
    if let Some(found) = &found.monte_carlo {
        text += &monte_carlo(found);
    }
    if let Some(found) = &found.global_sensitivity {
        text += &global_sensitivity(found);
    }
    text
}

/// Formats the table of uncertain parameters.
pub(super) fn parameters(list: &[UncertainReport]) -> String {
    let rows = list.iter().map(|p| {
        let [low, high] = p.bounds.map(known);
        vec![p.name.clone(), number(p.nominal), low, high, p.unit.clone(), p.distribution.clone()]
    });
    format!("\n{}", table(&["uncertain", "nominal", "min", "max", "unit", "distribution"], &[1, 2, 3], rows.collect()))
}

/// Returns case and name of a criterion.
fn subject(of: &Subject) -> [String; 2] {
    [of.case.clone(), of.criterion.clone()]
}

fn worst_table(list: &[WorstReport], names: &[UncertainReport]) -> String {
    let rows = list.iter().map(|worst| {
        let of = &worst.of;
        let met = match (of.demand, worst.met) {
            (None, _) => "",
            (_, true) => "yes",
            (_, false) => "no",
        };
        let mut row = subject(of).to_vec();
        row.extend([known(of.nominal), known(worst.value), of.unit.clone(), known(worst.scaled), met.to_owned()]);
        row.extend((0..names.len()).map(|i| worst.at.get(i).map_or_else(String::new, |at| number(at.value))));
        row.push(format!("{} of {}", worst.ended_here, worst.starts));
        row.push(if worst.failed > 0 { worst.failed.to_string() } else { String::new() });
        row
    });
    let of_names: Vec<String> = names
        .iter()
        .map(|p| if p.unit == "1" { format!("at {}", p.name) } else { format!("at {} [{}]", p.name, p.unit) })
        .collect();
    let mut header = vec!["case", "criterion", "nominal", "worst", "unit", "scaled", "met"];
    header.extend(of_names.iter().map(String::as_str));
    header.extend(["searches", if list.iter().any(|worst| worst.failed > 0) { "failed" } else { "" }]);
    let numeric: Vec<usize> = [2, 3, 5].into_iter().chain(7..7 + names.len()).collect();
    format!("\n{}", table(&header, &numeric, rows.collect()))
}

fn worst_case(found: &WorstCaseReport) -> String {
    let tables = parameters(&found.parameters) + &worst_table(&found.criteria, &found.parameters);
    format!("{tables}\n{}", sentences(&found.words))
}

fn robust(found: &RobustReport) -> String {
    let rows = found.rounds.iter().enumerate().map(|(i, round)| {
        let added: Vec<&str> = round.added.iter().map(|added| added.name.as_str()).collect();
        vec![
            format!("{}{}", i + 1, if i == found.chosen { " *" } else { "" }),
            round.cases.to_string(),
            known(round.for_cases),
            known(round.found),
            if round.violation_found > 0.0 { number(round.violation_found) } else { String::new() },
            round.evaluations.to_string(),
            added.join(", "),
        ]
    });
    let header = ["round", "cases", "worst of cases", "worst found", "violation found", "evaluations", "added"];
    let rounds = table(&header, &[1, 2, 3, 4, 5], rows.collect());
    let tables =
        format!("{}\n{rounds}{}", parameters(&found.parameters), worst_table(&found.criteria, &found.parameters));
    format!("{tables}\n{}", sentences(&found.words))
}

fn monte_carlo(found: &MonteCarloReport) -> String {
    let shares: Vec<f64> =
        found.criteria.first().map_or_else(Vec::new, |c| c.quantiles.iter().map(|q| q.share).collect());
    let rows = found.criteria.iter().map(|c| {
        let mut row = subject(&c.of).to_vec();
        row.extend([known(c.of.nominal), known(c.mean), known(c.deviation)]);
        row.extend(c.quantiles.iter().map(|q| {
            let [low, high] = q.interval.map(|end| if end.is_finite() { significant(end, 4) } else { "?".into() });
            format!("{} [{low}, {high}]", significant(q.value, 4))
        }));
        row.push(c.of.unit.clone());
        row.push(c.met.as_ref().map_or_else(String::new, |met| {
            format!("{} [{}, {}]", share(met.share), share(met.interval[0]), share(met.interval[1]))
        }));
        row.push(if c.failed > 0 { c.failed.to_string() } else { String::new() });
        row
    });
    let of_shares: Vec<String> = shares.iter().map(|p| format!("{} %", significant(100.0 * p, 4))).collect();
    let mut header = vec!["case", "criterion", "nominal", "mean", "std. dev."];
    header.extend(of_shares.iter().map(String::as_str));
    header.extend(["unit", "demand met", if found.failed > 0 { "failed" } else { "" }]);
    let tables = format!("{}\n{}", parameters(&found.parameters), table(&header, &[2, 3, 4], rows.collect()));
    format!("{tables}\n{}", sentences(&found.words))
}

fn global_sensitivity(found: &GlobalSensitivityReport) -> String {
    let morris = found.method == SensitivityMethod::Morris;
    let rows = found.criteria.iter().flat_map(|c| {
        c.effects.iter().map(move |effect| {
            let mut row = subject(&c.of).to_vec();
            row.push(effect.parameter.clone());
            let bare = |value: Option<f64>| value.map_or_else(String::new, |v| significant(v, 4));
            let estimate = |share: Option<Estimated>| {
                share.map_or_else(String::new, |Estimated { value, interval: [low, high] }| {
                    format!("{} [{}, {}]", significant(value, 3), significant(low, 3), significant(high, 3))
                })
            };
            if morris {
                row.extend([bare(effect.magnitude), bare(effect.mean), bare(effect.deviation), c.of.unit.clone()]);
            } else {
                row.extend([estimate(effect.first), estimate(effect.total)]);
            }
            row
        })
    });
    let effects = if morris {
        table(
            &["case", "criterion", "parameter", "mean |effect|", "mean", "std. dev.", "unit"],
            &[3, 4, 5],
            rows.collect(),
        )
    } else {
        table(&["case", "criterion", "parameter", "first-order index", "total index"], &[], rows.collect())
    };
    format!("{}\n{effects}\n{}", parameters(&found.parameters), sentences(&found.words))
}

fn uncertainty(found: &UncertaintyReport) -> String {
    let mut text = String::new();
    if !found.profiles.is_empty() {
        let rows = found.profiles.iter().map(|p| {
            let [low, high] = [0, 1].map(|i| match p.ends[i] {
                "open" => "not found".to_owned(),
                "bound" => format!("{} (bound)", number(p.interval[i])),
                _ => number(p.interval[i]),
            });
            let [from, to] = p.linear_interval.map(number);
            vec![p.parameter.clone(), number(p.value), low, high, from, to, p.unit.clone()]
        });
        let header = ["profile", "estimate", "from", "to", "linear from", "to", "unit"];
        text += &format!("\n{}", table(&header, &[1, 2, 3, 4, 5], rows.collect()));
    }
    if let Some(bootstrap) = &found.bootstrap {
        let rows = bootstrap.parameters.iter().map(|p| {
            let [low, high] = p.interval.map(number);
            vec![
                p.parameter.clone(),
                number(p.value),
                significant(p.std_error, 3),
                significant(p.bias, 2),
                low,
                high,
                p.unit.clone(),
            ]
        });
        let header = ["bootstrap", "estimate", "std. error", "bias", "from", "to", "unit"];
        text += &format!("\n{}", table(&header, &[1, 2, 3, 4, 5], rows.collect()));
    }
    format!("{text}\n{}", sentences(&found.words))
}
