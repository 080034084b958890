//! `task = "excitation"`: order of persistent excitation of the inputs, without a simulation.

use mops_content::{
    figures::{Figure, Group},
    numbers::{known, number, percent, precise, share, significant},
    plot::{Curve, CurveStyle, Level, Plot},
    section::{Block, Part, Section, Tone, Verdict},
    table::{Cell, Table, numbers, text},
};
use mops_core::{Study, Watch};
use mops_outcome::{
    BlockKind, Outcome, finding,
    identification::{ExcitationReport, RegressionReport, excitations, regressions},
};
use schemars::JsonSchema;
use serde::Serialize;

use crate::room::{Judgement, Room, Solution};
use crate::search::{Options, SolveError, Solved, evaluate_start};

/// Order of persistent excitation of the inputs, and regressions on them.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ExcitationFindings {
    /// All inputs of all cases.
    pub inputs: Vec<ExcitationReport>,
    /// Estimated FIR and ARX models.
    pub regressions: Vec<RegressionReport>,
}

finding!(ExcitationFindings, "excitation", "Order of persistent excitation of the inputs.");

/// `task = "excitation"`.
pub struct Excitation;

impl Room for Excitation {
    fn title(&self) -> &'static str {
        "Excitation"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        let (inputs, regressions) = (excitations(&study), regressions(&study));
        // No criterion is evaluated, as nothing is simulated.
        let mut solved = evaluate_start(study.without_criteria(), options, watch);
        solved.outcome.calibration = None;
        solved.outcome.found.add(ExcitationFindings { inputs, regressions });
        Ok(solved)
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<ExcitationFindings>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let inputs = of.outcome.found.get::<ExcitationFindings>().into_iter().flat_map(|found| &found.inputs);
        let poor = inputs.clone().find(|input| !input.suffices);
        Judgement::Whole(match (inputs.clone().next(), poor) {
            (None, _) => Verdict::new(Tone::Mixed, "No input to analyse."),
            (Some(first), None) if inputs.count() == 1 => Verdict::new(Tone::Good, &first.words),
            (_, None) => Verdict::new(
                Tone::Good,
                "Every input is persistently exciting of sufficient order for a linear model with as many parameters as \
                 tuners in its case. The sensitivities show whether these tuners are determined.",
            ),
            (_, Some(worst)) => Verdict::new(Tone::Mixed, &worst.words),
        })
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        let Some(found) = of.outcome.found.get::<ExcitationFindings>() else { return Vec::new() };
        let words = |list: &mut dyn Iterator<Item = &String>| Block::Findings(list.cloned().collect());
        let mut blocks = vec![words(&mut found.inputs.iter().map(|input| &input.words))];
        blocks.extend(of_inputs(&found.inputs));
        if !found.regressions.is_empty() {
            blocks.push(Block::Heading("Regressions".to_owned()));
            blocks.push(words(&mut found.regressions.iter().map(|regression| &regression.words)));
            blocks.extend(found.regressions.iter().map(|regression| Block::Table(parameters(regression))));
        }
        if !found.inputs.is_empty() {
            blocks.push(Block::Plots(plots(&found.inputs)));
        }
        vec![Section::new("Excitation", blocks)]
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        let Some(found) = outcome.found.get::<ExcitationFindings>() else { return Vec::new() };
        let words = found.inputs.iter().map(|input| input.words.clone()).collect();
        let mut blocks = lines_of_inputs(&found.inputs, words);
        for regression in &found.regressions {
            blocks.extend([
                Block::Table(lines_of_regression(regression)),
                Block::Findings(vec![regression.words.clone()]),
            ]);
        }
        blocks
    }

    fn has_point(&self) -> bool {
        false
    }

    fn has_convergence(&self, _of: &Solution<'_>) -> bool {
        false
    }
}

/// Returns an explanation and the table of inputs.
pub(crate) fn of_inputs(inputs: &[ExcitationReport]) -> [Block; 2] {
    let columns = [
        text("case"),
        text("input"),
        numbers("order"),
        numbers("parameters"),
        text("sufficient for a linear model"),
        numbers("smallest eigenvalue"),
        numbers("next order"),
        numbers("next order with transients"),
        numbers("samples"),
        numbers("sample time"),
    ];
    let row = |input: &ExcitationReport| -> Vec<Cell> {
        let order = Part::Strong(input.order.to_string());
        vec![
            input.case.clone().into(),
            input.input.clone().into(),
            Cell::new(input.at_least.then(|| Part::text("at least ")).into_iter().chain([order])),
            input.parameters.map_or_else(String::new, |n| n.to_string()).into(),
            if input.suffices { Cell::toned(Tone::Good, "yes") } else { Cell::toned(Tone::Mixed, "no") },
            percent(input.eigenvalue).into(),
            input.next_eigenvalue.map_or_else(String::new, percent).into(),
            input.transient.map_or_else(String::new, percent).into(),
            input.samples.to_string().into(),
            format!("{} s", number(input.sample_time)).into(),
        ]
    };
    let about = "An input that is persistently exciting of order n permits consistent estimates of n parameters of a linear model \
                 (impulse response, transfer function): the covariance matrix of n neighbouring samples is positive definite in \
                 the limit. For this model, the sensitivities show which tuners are determined. Initial states are not counted \
                 as parameters, as no input excites them. Transients are not counted as excitation. They may suffice in a short \
                 experiment; the standard errors show it.";
    [Block::text(about), Block::Table(Table::new("Inputs", columns).rows(inputs.iter().map(row)))]
}

/// Returns the coefficients of a regression.
fn parameters(regression: &RegressionReport) -> Table {
    let recursive = format!("recursive, forgetting {}", number(regression.forgetting));
    let columns = [text(&regression.name), numbers("least squares"), numbers("standard error"), numbers(recursive)];
    let rows = regression.parameters.iter().map(|(name, value, error, recursive)| {
        let error = match error.is_finite() {
            true => significant(*error, 3).into(),
            false => Cell::toned(Tone::Bad, "not determined"),
        };
        vec![name.clone().into(), Cell::strong(number(*value)), error, number(*recursive).into()]
    });
    Table::new(&regression.name, columns).rows(rows)
}

/// Returns a line for every input, and sentences.
pub fn lines_of_inputs(inputs: &[ExcitationReport], words: Vec<String>) -> Vec<Block> {
    let mut columns = vec![
        text("case"),
        text("input"),
        numbers("order"),
        numbers("parameters"),
        text("sufficient, if linear"),
        numbers("weakest direction"),
        numbers("next order"),
        numbers("with transients"),
        numbers("samples"),
        numbers("sample time"),
    ];
    let row = |input: &ExcitationReport| -> Vec<Cell> {
        let least = if input.at_least { "at least " } else { "" };
        vec![
            input.case.clone().into(),
            input.input.clone().into(),
            format!("{least}{}", input.order).into(),
            input.parameters.map_or_else(String::new, |n| n.to_string()).into(),
            if input.suffices { "yes" } else { "no, asymptotically" }.into(),
            share(input.eigenvalue).into(),
            input.next_eigenvalue.map_or_else(String::new, share).into(),
            input.transient.map_or_else(String::new, share).into(),
            input.samples.to_string().into(),
            format!("{} s", precise(input.sample_time)).into(),
        ]
    };
    let mut rows: Vec<Vec<Cell>> = inputs.iter().map(row).collect();
    // For a data file alone the number of parameters is unknown.
    if inputs.iter().all(|input| input.parameters.is_none()) {
        columns.drain(3..5);
        rows.iter_mut().for_each(|row| drop(row.drain(3..5)));
    }
    vec![Block::Table(Table::new("Inputs", columns).rows(rows)), Block::Findings(words)]
}

fn lines_of_regression(found: &RegressionReport) -> Table {
    let recursive = format!("recursive, forgetting {}", precise(found.forgetting));
    let columns = [text(&found.name), numbers("least squares"), numbers("std. error"), numbers(recursive)];
    let rows = found.parameters.iter().map(|(name, value, error, recursive)| {
        vec![name.clone().into(), precise(*value).into(), known(*error).into(), precise(*recursive).into()]
    });
    Table::new(&found.name, columns).rows(rows)
}

/// Returns a plot for every input: smallest eigenvalue over the order.
pub(crate) fn plots(inputs: &[ExcitationReport]) -> Group {
    let figure = |input: &ExcitationReport| {
        let points = input.spectrum.iter().map(|&(n, share)| (n as f64, share.max(1e-16))).collect();
        let plot = Plot {
            title: format!("Excitation by {} in {}", input.input, input.case),
            x_label: "order".into(),
            y_label: "smallest eigenvalue / power".into(),
            log_y: true,
            curves: vec![Curve { name: "persistent".into(), points, style: CurveStyle::Dots, ..Curve::default() }],
            levels: vec![Level { name: "counts as zero".into(), value: input.zero }],
            ..Plot::default()
        };
        Figure { plots: vec![(format!("excitation-{}-{}", input.case, input.input), plot)], ..Figure::default() }
    };
    Group { figures: inputs.iter().map(figure).collect(), ..Group::default() }
}
