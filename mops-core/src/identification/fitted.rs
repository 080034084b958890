//! FIR and ARX models of a study's experiments, by least squares and recursively.

use nalgebra::DVector;

use super::insight::spacing;
use super::report::RegressionReport;
use super::words::{counted, percent};
use super::{Recursive, Regression, RegressionTooShort, excitation, least_squares};
use crate::study::{RegressionTask, Study};

/// Initial covariance of the recursion by the mean squares of output and regressors: as good as nothing known.
const UNKNOWN: f64 = 1e8;

/// The models that a study asks for, each on its experiment.
pub fn regressions(study: &Study) -> Vec<RegressionReport> {
    study.tasks.excitation.regressions.iter().map(|task| fitted(study, task)).collect()
}

fn fitted(study: &Study, task: &RegressionTask) -> RegressionReport {
    let case = &study.cases[task.case];
    let channel = case.experiment.as_ref().and_then(|e| e.channel(&task.output)).expect("checked when it was built");
    let input = case.input(&task.input).expect("checked when it was built");
    let u: Vec<f64> = channel.times.iter().map(|&t| input.at(t)).collect();
    let mut report = RegressionReport {
        name: task.name.clone(),
        words: String::new(),
        experiment: case.name.clone(),
        input: task.input.clone(),
        output: task.output.clone(),
        sample_time: f64::NAN,
        forgetting: task.forgetting,
        parameters: Vec::new(),
        rank: 0,
        residual: f64::NAN,
        fit_percent: f64::NAN,
    };
    let model = Regression { a: task.a, b: task.b, delay: task.delay };
    let Some(step) = spacing(&channel.times) else {
        report.words = format!("`{}` is not equally spaced in time: there is no sampled model of it.", task.output);
        return report;
    };
    report.sample_time = step;
    let (rows, y) = match model.rows(&u, &channel.values) {
        Ok(rows) => rows,
        Err(RegressionTooShort(least)) => {
            report.words =
                format!("{} are too few: the model takes more than {least}.", counted(channel.values.len(), "sample"));
            return report;
        }
    };
    let found = least_squares(&rows, &y);
    #[allow(clippy::cast_precision_loss)]
    let power = rows.norm_squared() / rows.len() as f64;
    let certainty = if power > 0.0 { UNKNOWN / power } else { UNKNOWN };
    let mut recursive = Recursive::new(rows.ncols(), task.forgetting, certainty);
    for (phi, y) in rows.row_iter().zip(y.iter()) {
        recursive.update(&phi.transpose(), *y);
    }
    let error = &y - &rows * DVector::from_column_slice(&found.parameters);
    let spread = y.add_scalar(-y.mean()).norm();
    report.parameters = (model.names().into_iter().enumerate())
        .map(|(k, name)| (name, found.parameters[k], found.std_errors[k], recursive.parameters()[k]))
        .collect();
    (report.rank, report.residual) = (found.rank, found.residual);
    report.fit_percent = 100.0 * (1.0 - error.norm() / spread);
    let n = report.parameters.len();
    let order = excitation(&u, None).order;
    report.words = if found.rank < n {
        format!(
            "`{}`: the experiment determines only {} of {n} parameters; `{}` is persistently exciting of order {order}.",
            task.name, found.rank, task.input
        )
    } else {
        format!(
            "`{}`: all {} are determined; one step ahead they predict {} of `{}`.",
            task.name,
            counted(n, "parameter"),
            percent(0.01 * report.fit_percent),
            task.output
        )
    };
    report
}
