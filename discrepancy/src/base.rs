//! The fit of the model as declared: by windows that grow to the whole record, from several starts.

use mops_core::math;
use mops_core::{Role, Stream, stream};
use rand::Rng;

use crate::fit::{Fit, Fitted, Global, Piece, Point, Sets};
use crate::least_squares::sum_of_squares;
use crate::meter::Meter;
use crate::subject::Subject;
use crate::windows::{cut, whole};

/// The unknowns of the study as globals of a fit.
pub fn globals(subject: &Subject) -> Vec<Global> {
    let global = |(k, &index): (usize, &usize)| {
        let tuner = &subject.study.tuners()[index];
        let log = subject.is_log(k);
        let scale = (tuner.bounds[1] - tuner.bounds[0])
            .abs()
            .min(tuner.start.abs().max(1e-3 * (tuner.bounds[1] - tuner.bounds[0])));
        Global { sets: Sets::Tuner(k), bounds: tuner.bounds, open: false, log, scale, steps: false }
    };
    subject.globals.iter().enumerate().map(global).collect()
}

/// The experiments with a role that is asked for, whole.
pub fn pieces(subject: &Subject, wanted: impl Fn(Role) -> bool) -> Vec<Piece> {
    let all = subject.measurements.iter().enumerate().filter(|(_, m)| wanted(m.role));
    all.map(|(index, m)| whole(index, m)).collect()
}

/// The first guesses of all locals.
pub fn first_locals(pieces: &[Piece]) -> Vec<Vec<f64>> {
    pieces.iter().map(|piece| piece.locals.iter().map(|local| local.start).collect()).collect()
}

/// Fits the declared model to the calibration experiments: windows (8, 4, 2 of each record), then whole records; from the
/// start values of the study, and from random points around them where that ends badly.
pub fn fit(subject: &Subject, seed: u64, simulations: &Meter<'_>) -> Option<Fitted> {
    let problem = |pieces: Vec<Piece>| Fit {
        subject,
        model: subject.model.clone(),
        globals: globals(subject),
        pieces,
        expected: Vec::new(),
        simulations,
    };
    let whole = problem(pieces(subject, |role| role == Role::Calibration));
    let in_windows = |count: usize| {
        let windows =
            |p: &Piece| cut(p.measurement, &subject.measurements[p.measurement], subject.model.as_ref(), count);
        problem(whole.pieces.iter().flat_map(windows).collect())
    };
    let begin =
        |windows: &Fit<'_>, values: &[f64]| Point { globals: values.to_vec(), locals: first_locals(&windows.pieces) };
    let from = |start: Vec<f64>| -> Option<Fitted> {
        let mut values = start;
        let mut locals = first_locals(&whole.pieces);
        for count in [8, 4, 2] {
            let windows = in_windows(count);
            let point = begin(&windows, &values);
            let Some(fitted) = windows.solve(point, 30) else { continue };
            values.clone_from(&fitted.point.globals);
            // The first window of a record says where the record starts.
            for (piece, locals) in whole.pieces.iter().zip(&mut locals) {
                let first = windows.pieces.iter().position(|w| w.measurement == piece.measurement);
                let first = first.expect("every record has windows");
                for (local, value) in piece.locals.iter().zip(locals) {
                    let same = windows.pieces[first].locals.iter().position(|l| l.parameter == local.parameter);
                    if let Some(same) = same {
                        *value = fitted.point.locals[first][same].clamp(local.bounds[0], local.bounds[1]);
                    }
                }
            }
        }
        whole.solve(Point { globals: values, locals }, 60)
    };
    let direct = |start: Vec<f64>| whole.solve(Point { globals: start, locals: first_locals(&whole.pieces) }, 60);
    let start = subject.start();
    let better = |a: Option<Fitted>, b: Option<Fitted>| match (a, b) {
        (Some(a), Some(b)) => Some(if b.chi2 < a.chi2 { b } else { a }),
        (a, b) => a.or(b),
    };
    let mut best = from(start.clone());
    if best.as_ref().is_none_or(|best| best.normalised() > 1.5) {
        best = better(best, direct(start.clone()));
    }
    // A model that lacks something cannot reach the noise: agreement of several starts is what tells.
    let mut random = stream(seed, "base fit");
    let mut agreeing = 0;
    // The start values may lie where the model is not defined: then so may what is drawn around them, and of many the likeliest
    // goes on.
    let windows = in_windows(8);
    let in_short = |values: &[f64]| windows.all(&begin(&windows, values)).map(|all| sum_of_squares(&all));
    let draws = if in_short(&start).is_some() { 1 } else { 50 };
    for attempt in 0..40 {
        if simulations.is_over() || attempt >= 4 && best.is_some() {
            break;
        }
        if agreeing >= 2 || best.as_ref().is_some_and(|best| best.normalised() < 1.2) {
            break;
        }
        let drawn = (0..draws).map(|_| around(&start, &whole.globals, &mut random));
        let drawn = drawn.map(|values| (in_short(&values).unwrap_or(f64::INFINITY), values));
        let likeliest = drawn.min_by(|a, b| a.0.total_cmp(&b.0)).expect("there is one");
        let Some(trial) = from(likeliest.1) else { continue };
        match &best {
            Some(known) if trial.chi2 > 0.999 * known.chi2 => {
                agreeing += usize::from(trial.chi2 < 1.001 * known.chi2);
            }
            _ => {
                agreeing = 0;
                best = Some(trial);
            }
        }
    }
    best
}

/// A random point around a start.
fn around(start: &[f64], globals: &[Global], random: &mut Stream) -> Vec<f64> {
    let one = |(global, &value): (&Global, &f64)| {
        let by: f64 = random.random_range(-0.7..0.7);
        let moved = if global.log { value * math::exp(by) } else { value + by * global.scale };
        moved.clamp(global.bounds[0], global.bounds[1])
    };
    globals.iter().zip(start).map(one).collect()
}
