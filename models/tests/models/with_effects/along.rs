//! Linearisations along a simulation: delays as states, and the instants of clocks.

use nalgebra::DMatrix;

use super::*;

/// Input that is shown 1 s later.
const DELAYED: &str = r#"
states  = { x = "m", v = "m/s" }
inputs  = { u = "N" }
der     = { x = "v", v = "-1 [1/s2]*x - 1 [1/s]*v" }
outputs = { late = "delay(u, 1 [s])" }
"#;

#[test]
fn a_delay_line_delays_as_its_laplace_transform_says() {
    let model = with(&equations(DELAYED), &[]);
    let late = model.interface().signals.iter().position(|signal| signal.name == "late").expect("it is a signal");
    let job = Job { case: &Case::default(), parameters: &[0.1, 0.0], signals: &[late], horizon: 2.0 };
    let moment = &model.along(&job, &[1.5]).expect("it simulates").moments[0];
    let n = moment.a.nrows();
    assert_eq!((n, moment.d[(0, 0)]), (2 + 8, 0.0));
    // G(jw) = C (jw - A)^-1 B against exp(-jw), by real arithmetic over [-A, -w; w, -A].
    for w in [0.5, 2.0, 5.0, 8.0] {
        let mut system = DMatrix::zeros(2 * n, 2 * n);
        for first in [0, n] {
            system.view_mut((first, first), (n, n)).copy_from(&-&moment.a);
        }
        for i in 0..n {
            system[(i, n + i)] = -w;
            system[(n + i, i)] = w;
        }
        let mut right = DMatrix::zeros(2 * n, 1);
        right.view_mut((0, 0), (n, 1)).copy_from(&moment.b.column(0));
        let found = system.lu().solve(&right).expect("it is regular");
        let [real, imaginary] = [0, n].map(|first| (&moment.c * found.rows(first, n))[0]);
        let off = math::hypot(real - math::cos(w), imaginary + math::sin(w));
        assert!(off < 0.01, "{w}: {real} {imaginary}");
    }
}

/// Clocks of 0.1 s, whose values arrive after `delay`, and of 0.3 s from 0.1 s on.
fn clocks(delay: &str) -> WithEffects {
    let text = format!(
        r#"
        states      = {{ x = "m", v = "m/s" }}
        der         = {{ x = "v", v = "-1 [1/s2]*x" }}
        clocks.fast = {{ every = "0.1 s", delay = "{delay}", memory = {{ p = "m" }}, next = {{ p = "x" }} }}
        clocks.slow = {{ every = "0.3 s", offset = "0.1 s", memory = {{ q = "m" }}, next = {{ q = "x" }} }}
        "#
    );
    with(&equations(&text), &[])
}

#[test]
fn instants_of_clocks_are_in_order_and_at_one_time_once() {
    let model = clocks("0.02 s");
    let parameters = vec![0.0; model.interface().parameters.len()];
    let job = Job { case: &Case::default(), parameters: &parameters, signals: &[], horizon: 0.4 };
    let times = model.instants(&job).expect("it is defined");
    let expected = [0.02, 0.1, 0.12, 0.2, 0.22, 0.3, 0.32, 0.4];
    assert!(times.len() == 8 && times.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{times:?}");
    // States that an instant changes: those of the clocks whose values arrive, and those of the clocks that sample.
    let ticks = model.along(&job, &[]).expect("it simulates").ticks;
    assert_eq!(ticks.iter().map(|tick| tick.t).collect::<Vec<_>>(), times);
    let changed = |i: usize| {
        let change = &ticks[i].states - DMatrix::identity(ticks[i].states.nrows(), ticks[i].states.ncols());
        change.row_iter().filter(|row| row.iter().any(|entry| *entry != 0.0)).count()
    };
    assert_eq!((changed(0), changed(1), changed(7)), (1, 2, 2));
    // In the middle of a record, what is on its way arrives first.
    let alone = clocks("0.05 s");
    let case = Case { begins: 1.01, ..Case::default() };
    let times = alone.instants(&Job { case: &case, horizon: 0.1, ..job }).expect("it is defined");
    assert!(times.len() == 2 && (times[0] - 0.04).abs() < 1e-9 && (times[1] - 0.09).abs() < 1e-9, "{times:?}");
}
