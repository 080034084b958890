//! Elements in small systems, compared with closed forms.

use mops_core::{
    Instant, Plant, Trace,
    plant::{Breaks, EventInstant, Events, InputRates, Memory, Past},
};
use mops_language::{Dual, Scalar};
use mops_math as math;
use mops_models::kernel::elements::delay::Restart;
use mops_models::kernel::elements::{
    Backlash, BearingFriction, DeadZone, Delay, Lag, PiecewiseLinear, Saturation, SpringDamper,
};
use mops_models::kernel::{Driven, Sink, Step, Tolerance, integrate};

const TIGHT: Tolerance = Tolerance { relative: 1e-10, absolute: Some(1e-12), max_steps: 100_000, ..Tolerance::DEFAULT };

/// Records signal 0 and the times of the events.
struct Record {
    trace: Trace,
    events: Vec<f64>,
}

impl<P: Plant<f64> + ?Sized> Sink<f64, P> for Record {
    fn step(&mut self, step: &Step<f64>, system: &Driven<'_, f64, P>) {
        let value = |s: f64| system.signal(0, step.start + s * step.taken, &step.state_at(s));
        self.trace.push(step.start + step.taken, Trace::NODES.map(value));
    }

    fn event(&mut self, t: f64, _: &str) {
        self.events.push(t);
    }
}

/// Returns the first state, or signal 0 of a plant that has signals, and the times of the events.
fn simulate(plant: impl Plant<f64>, start: &[f64], end: f64) -> (Trace, Vec<f64>) {
    let mut record = Record { trace: Trace::starting_at(0.0, 64), events: Vec::new() };
    integrate(&mut Driven::alone(plant), 0.0, end, start, &TIGHT, &mut record).expect("it simulates");
    (record.trace, record.events)
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

#[test]
fn a_table_is_straight_between_its_points_and_beyond_them() {
    // The table of the Modelica documentation of BearingFriction.
    let table = PiecewiseLinear::new(&[[0.0, 0.0], [1.0, 2.0], [2.0, 5.0], [3.0, 8.0]]).unwrap();
    for (x, y) in [(0.5, 1.0), (1.0, 2.0), (1.5, 3.5), (3.0, 8.0), (5.0, 14.0), (-1.0, -2.0)] {
        near(table.at(x), y, 1e-14);
    }
    assert_eq!(table.becomes_negative(0.0), None);
    let falling = PiecewiseLinear::new(&[[0.0, 3.0], [1.0, 4.0], [2.0, 2.0]]).unwrap();
    near(falling.becomes_negative(0.0).unwrap(), 3.0, 1e-14);
    assert!(PiecewiseLinear::new(&[[1.0, 0.0], [1.0, 2.0]]).is_err());
    assert!(PiecewiseLinear::<f64>::new(&[]).is_err());
}

#[test]
fn tangents_of_a_table_are_those_of_its_lines() {
    // y = y0 + (x - x0)(y1 - y0)/(x1 - x0) at x = 1.5 between (1, 2) and (2, 5), along y0, x1 and x.
    let fixed = Dual::<3>::from;
    let (y0, x1, x) = (Dual::variable(2.0, 0), Dual::variable(2.0, 1), Dual::variable(1.5, 2));
    let table = PiecewiseLinear::new(&[[fixed(0.0), fixed(0.0)], [fixed(1.0), y0], [x1, fixed(5.0)]]).unwrap();
    let y = table.at(x);
    for (tangent, expected) in y.tangent.into_iter().zip([0.5, -1.5, 3.0]) {
        near(tangent, expected, 1e-14);
    }
}

#[test]
fn invalid_bearing_friction_is_an_error() {
    assert!(BearingFriction::new(&[[0.0, 1.0], [1.0, 2.0]], 0.9).is_err(), "break-away below sliding");
    assert!(BearingFriction::new(&[[0.0, -1.0], [1.0, 2.0]], 1.0).is_err(), "driving at rest");
    assert!(BearingFriction::new(&[[0.5, 1.0], [1.0, 2.0]], 1.0).is_err(), "no value at rest");
    let falling = BearingFriction::new(&[[0.0, 0.001_67], [1.0, 0.001_443]], 1.228_72).unwrap();
    near(falling.drives_from().unwrap(), 7.357, 5e-4);
    near(falling.limit(), 1.228_72 * 0.001_67, 1e-15);
}

/// Mass on a spring and a damper.
struct Sprung(SpringDamper<f64>);
impl Plant<f64> for Sprung {
    fn start(&self) -> Vec<f64> {
        Vec::new()
    }
    fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
        dx.copy_from_slice(&[at.x[1], -self.0.torque(at.x[0], at.x[1])]);
    }
}

#[test]
fn a_mass_on_a_spring_and_a_damper_is_a_damped_oscillation() {
    // x'' + 2 D w x' + w^2 (x - 1) = 0 with w = 3, D = 0.2, starting at rest from x = 2.
    let (w, d): (f64, f64) = (3.0, 0.2);
    let element = SpringDamper { spring: w * w, damper: 2.0 * d * w, rest: 1.0 };
    let (x, _) = simulate(Sprung(element), &[2.0, 0.0], 4.0);
    let wd = w * (1.0 - d * d).sqrt();
    for t in [0.3_f64, 1.0, 2.7, 4.0] {
        let exact = 1.0 + math::exp(-d * w * t) * (math::cos(wd * t) + d * w / wd * math::sin(wd * t));
        near(x.at(t), exact, 1e-9);
    }
    near(element.energy(2.0), 4.5, 1e-15);
}

/// System `x' = y`, where `y` is the response of an element with modes to `2 sin t`.
struct Through<E>(E, Shown);

/// Signal 0: the integral, or the output of the element.
#[derive(PartialEq)]
enum Shown {
    Integral,
    Output,
}

trait Element {
    fn output(&self, u: f64) -> f64;
    fn guard(&self, u: f64, rate: f64) -> f64;
    fn switch(&mut self, u: f64);
}

impl Element for Saturation<f64> {
    fn output(&self, u: f64) -> f64 {
        Saturation::output(self, u)
    }
    fn guard(&self, u: f64, _: f64) -> f64 {
        Saturation::guard(self, u)
    }
    fn switch(&mut self, u: f64) {
        Saturation::switch(self, u);
    }
}

impl Element for DeadZone<f64> {
    fn output(&self, u: f64) -> f64 {
        DeadZone::output(self, u)
    }
    fn guard(&self, u: f64, _: f64) -> f64 {
        DeadZone::guard(self, u)
    }
    fn switch(&mut self, u: f64) {
        DeadZone::switch(self, u);
    }
}

impl Element for Backlash<f64> {
    fn output(&self, u: f64) -> f64 {
        Backlash::output(self, u)
    }
    fn guard(&self, u: f64, rate: f64) -> f64 {
        Backlash::guard(self, u, rate)
    }
    fn switch(&mut self, u: f64) {
        Backlash::switch(self, u);
    }
}

impl<E: Element> Plant<f64> for Through<E> {
    fn start(&self) -> Vec<f64> {
        Vec::new()
    }
    fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
        dx[0] = self.0.output(2.0 * math::sin(at.t));
    }
    fn signal(&self, _: usize, at: &Instant<'_, f64>) -> f64 {
        if self.1 == Shown::Integral { at.x[0] } else { self.0.output(2.0 * math::sin(at.t)) }
    }
    fn longest_step(&self) -> f64 {
        0.4
    }
    fn events(&self) -> Option<&dyn Events<f64>> {
        Some(self)
    }
    fn events_mut(&mut self) -> Option<&mut dyn Events<f64>> {
        Some(self)
    }
}

impl<E: Element> Events<f64> for Through<E> {
    fn guards(&self) -> usize {
        1
    }
    fn guard(&self, _: usize, at: &Instant<'_, f64>, _: InputRates<'_>) -> f64 {
        self.0.guard(2.0 * math::sin(at.t), 2.0 * math::cos(at.t))
    }
    fn switch(&mut self, _: usize, event: &EventInstant<'_, f64>, _: &mut [f64]) -> &str {
        self.0.switch(2.0 * math::sin(event.at.t));
        ""
    }
}

use std::f64::consts::{FRAC_PI_6, PI, TAU};

#[test]
fn a_saturated_sine_is_clipped_at_the_limit() {
    let (integral, events) = simulate(Through(Saturation::new(-1.0, 1.0), Shown::Integral), &[0.0], TAU);
    for (event, exact) in events.iter().zip([1.0, 5.0, 7.0, 11.0].map(|k| k * FRAC_PI_6)) {
        near(*event, exact, 1e-9);
    }
    assert_eq!(events.len(), 4);
    // Half a period: twice 2 (1 - cos(pi/6)), plus 1 times 2 pi/3.
    near(integral.at(PI), 4.0 * (1.0 - math::cos(FRAC_PI_6)) + 2.0 * PI / 3.0, 1e-9);
    near(integral.at(TAU), 0.0, 1e-9);
}

#[test]
fn a_dead_zone_responds_only_outside_its_limits() {
    let (integral, events) = simulate(Through(DeadZone::new(-1.0, 1.0), Shown::Integral), &[0.0], TAU);
    for (event, exact) in events.iter().zip([1.0, 5.0, 7.0, 11.0].map(|k| k * FRAC_PI_6)) {
        near(*event, exact, 1e-9);
    }
    // Complement of a saturation: 4 minus its integral over half a period.
    near(integral.at(PI), 4.0 - 4.0 * (1.0 - math::cos(FRAC_PI_6)) - 2.0 * PI / 3.0, 1e-9);
}

#[test]
fn play_is_crossed_at_every_reversal() {
    let (y, events) = simulate(Through(Backlash::new(1.0, 0.0), Shown::Output), &[0.0], TAU);
    // Contact at sin = 1/4, reversal at pi/2, contact below at 2 sin t = 1.5 - 0.5, reversal at 3 pi/2, and contact
    // above.
    let exact = [math::asin(0.25), 0.5 * PI, 5.0 * FRAC_PI_6, 1.5 * PI, 11.0 * FRAC_PI_6];
    assert_eq!(events.len(), exact.len(), "{events:?}");
    for (event, exact) in events.iter().zip(exact) {
        near(*event, exact, 1e-7);
    }
    for (t, exact) in
        [(0.1, 0.0), (1.0, 2.0 * math::sin(1.0) - 0.5), (2.0, 1.5), (4.0, 2.0 * math::sin(4.0) + 0.5), (5.5, -1.5)]
    {
        near(y.at(t), exact, 1e-6);
    }
}

#[test]
fn a_backlash_that_is_moved_by_a_jump_is_pushed_along() {
    let mut play = Backlash::new(1.0, 0.0);
    play.settle(0.0, 3.0, 0.0);
    near(play.output(3.0), 2.5, 0.0);
    play.settle(3.0, 2.4, -1.0);
    near(play.output(2.4), 2.5, 0.0);
}

/// First-order lag `T y' = 1 - y`.
struct Lagging<S>(Lag<S>);
impl<S: Scalar> Plant<S> for Lagging<S> {
    fn start(&self) -> Vec<S> {
        Vec::new()
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx[0] = self.0.derivative(S::from(1.0), at.x[0]);
    }
}

#[test]
fn a_lag_approaches_a_step_exponentially() {
    let start = [Dual::<1>::from(0.0)];
    let mut lag = Driven::alone(Lagging(Lag { time: Dual::variable(0.5, 0) }));
    let (y, _) = integrate(&mut lag, 0.0, 2.0, &start, &TIGHT, &mut ()).unwrap();
    // y = 1 - exp(-t/T), dy/dT = -t/T^2 exp(-t/T).
    near(y[0].value, 1.0 - math::exp(-4.0), 1e-10);
    near(y[0].tangent[0], -8.0 * math::exp(-4.0), 1e-8);
}

/// Delayed feedback `y' = -y(t - T)`, with `y = 1` up to time 0.
struct Delayed<S>(Delay<S>);
impl<S: Scalar> Plant<S> for Delayed<S> {
    fn start(&self) -> Vec<S> {
        Vec::new()
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        dx[0] = -self.0.at(at.t);
    }
    fn longest_step(&self) -> f64 {
        self.0.longest_step()
    }
    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        Some(self)
    }
    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        Some(self)
    }
    fn memory(&self) -> Option<&dyn Memory<S>> {
        Some(self)
    }
    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        Some(self)
    }
}

impl<S: Scalar> Breaks<S> for Delayed<S> {
    fn next(&self, t: f64) -> f64 {
        self.0.next_break(t)
    }
    fn pass(&mut self, at: &Instant<'_, S>, _: &mut [S]) -> S {
        let derivative = self.0.pass_break(at.t).map(|arrival| arrival.derivative + 1);
        self.0.restart(Restart { derivative, moves: S::from(0.0), jumps: true });
        S::from(0.0)
    }
}

impl<S: Scalar> Memory<S> for Delayed<S> {
    fn begin(&mut self, _: &Instant<'_, S>, _: &mut [S]) {}
    fn delays(&self) -> Vec<f64> {
        vec![self.0.time().value()]
    }
    fn past(&self, at: &Instant<'_, S>) -> Vec<S> {
        at.x.to_vec()
    }
    fn remember(&mut self, over: &Past<'_, S>) -> bool {
        self.0.push(over.time, over.values.each_ref().map(|values| values[0]), 1e-10);
        true
    }
    fn delayed(&self, t: f64) -> Vec<S> {
        vec![self.0.at(t)]
    }
    fn hold(&mut self, _: &[S]) {}
}

#[test]
fn a_delayed_feedback_is_its_polynomials() {
    // Method of steps: sum over k of (-1)^k (t - (k - 1) T)^k / k! for t > (k - 1) T; here T = 1.
    let exact = |t: f64| {
        1.0 - t + math::powi((t - 1.0).max(0.0), 2) / 2.0 - math::powi((t - 2.0).max(0.0), 3) / 6.0
            + math::powi((t - 3.0).max(0.0), 4) / 24.0
    };
    let (y, _) = simulate(Delayed(Delay::new(1.0, 1.0)), &[1.0], 4.0);
    for t in [0.5, 1.0, 1.3, 2.2, 3.0, 4.0] {
        near(y.at(t), exact(t), 1e-9);
    }
    // dy/dT at t = 2.5: -(t - T) + (t - 2T)^2 at T = 1.
    let mut delayed = Driven::alone(Delayed(Delay::new(Dual::<1>::variable(1.0, 0), Dual::from(1.0))));
    let (y, _) = integrate(&mut delayed, 0.0, 2.5, &[Dual::from(1.0)], &TIGHT, &mut ()).unwrap();
    near(y[0].tangent[0], -1.5 + 0.25, 1e-8);
}

/// Integral of a step from 0 to 1 at 0.3 s, delayed by half a second.
struct DelayedStep(Delay<f64>, f64);
impl Plant<f64> for DelayedStep {
    fn start(&self) -> Vec<f64> {
        Vec::new()
    }
    fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
        dx[0] = self.0.at(at.t);
    }
    fn longest_step(&self) -> f64 {
        self.0.longest_step()
    }
    fn breaks(&self) -> Option<&dyn Breaks<f64>> {
        Some(self)
    }
    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<f64>> {
        Some(self)
    }
    fn memory(&self) -> Option<&dyn Memory<f64>> {
        Some(self)
    }
    fn memory_mut(&mut self) -> Option<&mut dyn Memory<f64>> {
        Some(self)
    }
}

impl Breaks<f64> for DelayedStep {
    fn next(&self, t: f64) -> f64 {
        self.0.next_break(t).min(if t < 0.3 { 0.3 } else { f64::INFINITY })
    }
    fn pass(&mut self, at: &Instant<'_, f64>, _: &mut [f64]) -> f64 {
        self.0.pass_break(at.t);
        self.0.restart(Restart::fixed());
        self.1 = f64::from(u8::from(at.t >= 0.3));
        0.0
    }
}

impl Memory<f64> for DelayedStep {
    fn begin(&mut self, _: &Instant<'_, f64>, _: &mut [f64]) {}
    fn delays(&self) -> Vec<f64> {
        vec![self.0.time().value()]
    }
    fn past(&self, _: &Instant<'_, f64>) -> Vec<f64> {
        vec![self.1]
    }
    fn remember(&mut self, over: &Past<'_, f64>) -> bool {
        self.0.push(over.time, over.values.each_ref().map(|values| values[0]), 1e-10);
        true
    }
    fn delayed(&self, t: f64) -> Vec<f64> {
        vec![self.0.at(t)]
    }
    fn hold(&mut self, _: &[f64]) {}
}

#[test]
fn a_jump_comes_out_of_a_delay_as_a_jump() {
    let (y, _) = simulate(DelayedStep(Delay::new(0.5, 0.0), 0.0), &[0.0], 2.0);
    near(y.at(0.8), 0.0, 1e-14);
    near(y.at(2.0), 1.2, 1e-12);
}
