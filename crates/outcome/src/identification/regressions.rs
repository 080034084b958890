//! FIR and ARX models of a study's experiments, by least squares and recursively.

use mops_core::{
    study::Study,
    task::{self, ExcitationTask},
};
use mops_identification::{Recursive, Regression, RegressionTooShort, excitation, least_squares, whiteness};
use nalgebra::DVector;

use super::excitations::spacing;
use super::report::RegressionReport;
use super::words::{coefficient, counted, percent};

/// Initial covariance of the recursion, relative to the mean square of the regressors: practically no prior knowledge.
const UNKNOWN: f64 = 1e8;

/// Returns the regression models of a study, each on its experiment.
pub fn regressions(study: &Study) -> Vec<RegressionReport> {
    let Some(task) = study.options::<ExcitationTask>() else { return Vec::new() };
    let models = task.models(study).expect("checked when the study was built");
    models.iter().map(|model| fitted(study, model)).collect()
}

fn fitted(study: &Study, task: &task::Regression) -> RegressionReport {
    let case = &study.cases()[task.case];
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
        report.words = format!(
            "`{}` is not equally spaced in time: a discrete-time model needs a constant sample time.",
            task.output
        );
        return report;
    };
    report.sample_time = step;
    let (rows, y) = match model.rows(&u, &channel.values) {
        Ok(rows) => rows,
        Err(RegressionTooShort(least)) => {
            report.words =
                format!("{} are too few: the model needs more than {least}.", counted(channel.values.len(), "sample"));
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
            "`{}`: the experiment determines all {}; fit of the one-step-ahead prediction {} for `{}`.{}",
            task.name,
            counted(n, "parameter"),
            percent(0.01 * report.fit_percent),
            task.output,
            if task.a > 0 { bias(error.as_slice(), report.residual, spread) } else { String::new() }
        )
    };
    report
}

/// Returns the warning on the bias of ARX estimates.
///
/// Least squares is consistent only for white equation errors, and output noise makes them coloured. Source: L. Ljung,
/// System Identification, 2nd edition (1999), section 7.3.
fn bias(errors: &[f64], deviation: f64, spread: f64) -> String {
    const WHY: &str = " Least squares is consistent only for white equation errors; noise on the measured output \
                       makes them coloured and biases ARX (Ljung, System Identification, 2nd ed. 1999, section 7.3).";
    // The residuals of an exact fit are rounding errors without information.
    let found = if deviation > 1e-9 * spread { whiteness(errors) } else { None };
    let verdict = match found {
        Some(found) if found.is_white() => " Here they are consistent with white noise".to_owned(),
        Some(found) => format!(" Here they are not white (lag-1 autocorrelation {})", coefficient(found.lag1)),
        None => return WHY.to_owned(),
    };
    let rest = match found {
        Some(found) if found.is_white() => ".",
        _ => ": the estimates and their standard errors are unreliable.",
    };
    format!("{WHY}{verdict}{rest}")
}
