//! Cases of a model, with what their plots share.

use mops_content::marks::bounds;
use mops_content::numbers::{counted, with_unit};
use mops_content::plot::{Bound, Color, Curve, CurveStyle, Plot};
use mops_content::sampling;
use mops_core::study::Row;
use mops_core::{Case, Variable};
use mops_outcome::CriterionReport;

use super::super::comparison::{over_time, trace};
use super::super::{Report, criteria};
use super::inputs;
use super::simulated::{Simulated, worst};

/// Cases of a model, with a colour for each.
pub(super) struct Cases<'a> {
    pub(super) report: &'a Report<'a>,
    pub(super) model: usize,
    pub(super) ones: &'a [&'a Simulated],
    pub(super) colors: Vec<Color>,
}

impl Cases<'_> {
    pub(super) fn case(&self, one: &Simulated) -> &Case {
        let study = self.report.solution.problem.study();
        &study.cases()[study.jobs()[one.job].case]
    }

    pub(super) fn name(&self, one: &Simulated) -> &str {
        &self.case(one).name
    }

    /// Returns the start of the names of plot files: the case if there is only one, and the model if there are several.
    pub(super) fn place(&self) -> String {
        let models = self.report.solution.problem.study().models();
        let case = if let [one] = self.ones { format!("{}-", self.name(one)) } else { String::new() };
        if models.len() > 1 { format!("{case}{}-", models[self.model].0) } else { case }
    }

    pub(super) fn title(&self, of: &str) -> String {
        if let [one] = self.ones { format!("{of} in case {}", self.name(one)) } else { of.to_owned() }
    }

    /// Returns a curve of a case at the initial guess or at the reported point.
    pub(super) fn curve(&self, index: usize, points: Vec<(f64, f64)>, at_start: bool) -> Curve {
        let one = self.ones[index];
        let variant = if at_start { "initial guess" } else { one.both.best_name };
        let style = if at_start { CurveStyle::Dashed } else { CurveStyle::Line };
        if self.ones.len() == 1 {
            let color = if at_start { Color::Start } else { Color::Result };
            return Curve { name: variant.into(), points, style, color, may_leave: at_start, ..Curve::default() };
        }
        Curve {
            name: self.name(one).to_owned(),
            points,
            style,
            color: self.colors[index],
            may_leave: at_start,
            hidden: at_start && self.ones.len() > MOST_AT_START,
            variant: variant.into(),
            ..Curve::default()
        }
    }

    /// Returns the plot of a signal in all cases, with the bounds of its criteria.
    pub(super) fn response(&self, signal: &Variable) -> Plot {
        let mut curves = Vec::new();
        for at_start in [true, false] {
            for (index, one) in self.ones.iter().enumerate() {
                let analysis = if at_start { &one.both.start } else { &one.both.best };
                if let Some(trace) = trace(analysis, &signal.name) {
                    curves.push(self.curve(index, sampling::points(trace), at_start));
                }
            }
        }
        // Cases without a colour lie behind the others.
        curves.sort_by_key(|curve| curve.color != Color::Start);
        Plot { title: self.title(&signal.name), curves, bounds: self.bounds(&signal.name), ..over_time(signal) }
    }

    /// Returns the bounds of a signal, each once, with the cases that it applies to.
    pub(super) fn bounds(&self, signal: &str) -> Vec<Bound> {
        let study = self.report.solution.problem.study();
        let mut drawn: Vec<Bound> = Vec::new();
        for one in self.ones {
            let rows: Vec<&Row> = study.rows().iter().filter(|row| row.job == one.job).collect();
            for bound in one.both.best.iter().flat_map(|analysis| bounds(signal, &rows, analysis)) {
                let same = |known: &&mut Bound| Bound { applies_to: Vec::new(), ..(**known).clone() } == bound;
                match drawn.iter_mut().find(same) {
                    Some(known) => known.applies_to.push(self.name(one).to_owned()),
                    None => drawn.push(Bound { applies_to: vec![self.name(one).to_owned()], ..bound }),
                }
            }
        }
        for bound in &mut drawn {
            bound.applies_to.dedup();
            if bound.applies_to.len() == self.ones.len() {
                bound.applies_to.clear();
            } else if let ([first], false) = (bound.applies_to.as_slice(), bound.name.is_empty()) {
                bound.name = format!("{} ({first})", bound.name);
            }
        }
        drawn
    }

    /// Returns the plot of an input in all cases.
    pub(super) fn input(&self, input: &Variable) -> Plot {
        let jobs = self.report.solution.problem.study().jobs();
        let curve = |(index, one): (usize, &&Simulated)| Curve {
            variant: String::new(),
            ..self.curve(index, inputs::points(self.case(one), &input.name, jobs[one.job].horizon), false)
        };
        let mut curves: Vec<Curve> = self.ones.iter().enumerate().map(curve).collect();
        if let [curve] = curves.as_mut_slice() {
            (curve.name, curve.color) = (input.name.clone(), Color::Faint);
        }
        Plot { title: self.title(&format!("input {}", input.name)), curves, supplement: true, ..over_time(input) }
    }

    /// Returns the values of the criteria that read a signal: the worst of all cases.
    pub(super) fn caption(&self, signal: &str) -> Vec<String> {
        let study = self.report.solution.problem.study();
        let here = |row: &Row| self.ones.iter().any(|one| one.job == row.job);
        let rows = study.rows().iter().zip(&self.report.solution.outcome.criteria).filter(|(row, _)| here(row));
        let rows: Vec<(&Row, &CriterionReport)> =
            rows.filter(|(row, _)| row.criterion.signals().iter().any(|s| s == signal)).collect();
        let mut names: Vec<&str> = Vec::new();
        rows.iter().for_each(|(row, _)| {
            if !names.contains(&row.name.as_str()) {
                names.push(&row.name)
            }
        });
        names
            .into_iter()
            .filter_map(|name| caption(rows.iter().filter(|(row, _)| row.name == name).map(|(_, c)| *c)))
            .collect()
    }
}

/// Largest number of cases whose responses at the initial guess are shown without request.
pub(super) const MOST_AT_START: usize = 3;

/// Returns the colour of each case.
pub(super) fn colors(report: &Report<'_>, ones: &[&Simulated]) -> Vec<Color> {
    if ones.len() == 1 {
        return vec![Color::Result];
    }
    let mut order: Vec<usize> = (0..ones.len()).collect();
    let worst = worst(report);
    order.sort_by(|&a, &b| worst[ones[b].job].total_cmp(&worst[ones[a].job]));
    let mut coloured = order[..order.len().min(COLOURED)].to_vec();
    coloured.sort_unstable();
    let color = |i: usize| coloured.iter().position(|&c| c == i).map_or(Color::Start, Color::Series);
    (0..ones.len()).map(color).collect()
}

/// Returns the caption of a criterion: the value with the largest scaled value of all cases, and the demand; without a
/// demand, the range of its values.
pub(super) fn caption<'c>(of_cases: impl Iterator<Item = &'c CriterionReport> + Clone) -> Option<String> {
    let count = of_cases.clone().count();
    // A criterion without a value is the worst.
    let rank = |criterion: &CriterionReport| {
        if criterion.scaled.is_nan() && criterion.value.is_nan() { f64::INFINITY } else { criterion.scaled }
    };
    let worst = of_cases.clone().max_by(|a, b| rank(a).total_cmp(&rank(b)))?;
    if count > 1 && worst.met.is_none() {
        // Without a demand, no case is the worst.
        let values = || of_cases.clone().map(|criterion| criterion.value).filter(|value| value.is_finite());
        let [low, high] = [values().reduce(f64::min)?, values().reduce(f64::max)?];
        let [low, high] = [mops_content::numbers::number(low), with_unit(high, &worst.unit)];
        return Some(format!("`{}`: {low} to {high} in {}", worst.name, counted(count, "case")));
    }
    let mut text = format!("`{}`: {}", worst.name, with_unit(worst.value, &worst.unit));
    if count > 1 {
        text.push_str(&format!(" in `{}`, the worst of {}", worst.case, counted(count, "case")));
    }
    if let Some(demand) = criteria::demand(worst) {
        text.push_str(&format!(" (demand {demand})"));
    }
    Some(text)
}

/// Number of cases with a colour of their own: those with the largest scaled values.
pub(super) const COLOURED: usize = 6;
