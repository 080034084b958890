//! PID controller in a loop with a linear plant.

use std::sync::Arc;

use mops_core::{
    Failure, Input, Instant, Interface, Model, ModelOptions, Parameter, Plant, StudyError, Variable,
    model::Cut,
    plant::{Breaks, EventInstant, Events, InputRates, LeftOut},
};
use mops_language::{Quantity, Scalar, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::kernel::{PlantModel, Simulated, Tolerance, cut_at};
use crate::rational::{PlantOptions, TransferFunction};

/// PID controller with filtered derivative, in a unity feedback loop with a linear plant `G`:
///
/// ```text
/// y = G (sat(v) + d),   v = k (wp r - y + 1/(Ti s) (r - y) + Td s/(Td/Nd s + 1) (wd r - y))
/// ```
///
/// All initial states are zero. `r` is the setpoint, a unit step at 0 s unless `setpoint` or a case gives it. `d` is a
/// load disturbance at the plant input, 0 unless `load` or a case gives it. With `limit` the actuator saturates, and
/// back-calculation with the tracking time `Tt` prevents integrator windup. With `sample-time` the controller runs at
/// that period (backward differences, integral updated after the output), and its output acts `delay` later.
///
/// Parameters: `k` gain, `Ti` integral time and `Td` derivative time (s; `Ti = inf` for no integral, `Td = 0` for no
/// derivative), `Nd` filter ratio of the derivative (default 10), `wp`, `wd` setpoint weights of proportional and
/// derivative part (default 1), `Tt` tracking time (s; default sqrt(Ti Td), or Ti if Td = 0), and every name given in
/// place of a number in the plant.
///
/// Signals: `r`, `y`, `e = r - y`, `u = sat(v)`, `d`. Inputs: `r`, `d`. With a continuous controller the loop can be
/// cut at `u`.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), sections 3.4 to 3.6; block form of the
/// derivative as in the Modelica Standard Library, Blocks.Continuous.PID.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PidLoopOptions {
    /// Plant: `{ poles = [...], zeros = [...], gain = 1.0 }`, or `{ numerator = [...], denominator = [...] }` with
    /// coefficients of descending powers of s, or `{ a = [[...], ...], b = [...], c = [...] }` with state-space
    /// matrices. A name instead of a number becomes a parameter. For a plant of the kind `equations`, see its key
    /// `pid`.
    plant: PlantOptions,
    /// End of the simulation.
    horizon: Quantity,
    /// Step of the setpoint: `{ time = "0 s", size = 1.0 }`.
    setpoint: Option<StepOptions>,
    /// Step of the load disturbance at the plant input: `{ time = "20 s", size = 0.5 }`.
    load: Option<StepOptions>,
    /// Lower and upper limit of the actuator.
    limit: Option<[f64; 2]>,
    /// Sampling period of a sampled controller.
    sample_time: Option<Quantity>,
    /// Delay from sampling to output, at most the sampling period.
    delay: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    #[serde(default)]
    tolerance: Tolerance,
}

/// Step of an input.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct StepOptions {
    /// Time of the step; default 0 s.
    time: Option<Quantity>,
    /// Value after the step; 0 before.
    size: f64,
}

impl ModelOptions for PidLoopOptions {
    const KIND: &'static str = "pid-loop";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let seconds = |key: &str, q: &Quantity| q.to(&Unit::known("s")).map_err(|e| StudyError::new(key, e));
        let horizon = seconds("horizon", &self.horizon)?;
        if !(horizon > 0.0 && horizon.is_finite()) {
            return Err(StudyError::new(
                "horizon",
                format!("expected a positive and finite horizon, found {horizon} s"),
            ));
        }
        let step = |key: &str, options: &Option<StepOptions>| -> Result<Option<Input>, StudyError> {
            let Some(options) = options else { return Ok(None) };
            let time = options.time.as_ref().map_or(Ok(0.0), |q| seconds("time", q)).map_err(|m| m.within(key))?;
            if !(time >= 0.0 && time.is_finite()) {
                let fact = format!("expected a time from 0 s on, found {time} s");
                return Err(StudyError::new("time", fact).within(key));
            }
            if !options.size.is_finite() {
                let fact = format!("expected a finite size of the step, found {}", options.size);
                return Err(StudyError::new("size", fact).within(key));
            }
            Ok(Some(Input::Step { time, before: 0.0, after: options.size }))
        };
        let setpoint = step("setpoint", &self.setpoint)?.unwrap_or(Input::Step { time: 0.0, before: 0.0, after: 1.0 });
        let load = step("load", &self.load)?;
        let limit = match self.limit {
            Some([low, high]) if low < high => Some([low, high]),
            None => None,
            Some([low, high]) => {
                return Err(StudyError::new(
                    "limit",
                    format!("expected a lower limit below the upper limit, found {low} and {high}"),
                ));
            }
        };
        let sampling = match (&self.sample_time, &self.delay) {
            (None, None) => None,
            (None, Some(_)) => {
                return Err(
                    StudyError::new("delay", "a delay needs a sampled controller").with_help("give `sample-time`")
                );
            }
            (Some(period), delay) => {
                let period = seconds("sample-time", period)?;
                let delay = delay.as_ref().map_or(Ok(0.0), |q| seconds("delay", q))?;
                if !(period > 0.0 && period.is_finite()) {
                    return Err(StudyError::new(
                        "sample-time",
                        format!("expected a positive period, found {period} s"),
                    ));
                }
                if !(0.0..=period).contains(&delay) {
                    return Err(StudyError::new(
                        "delay",
                        format!("expected a delay between 0 and the period of {period} s, found {delay} s"),
                    ));
                }
                Some(Sampling { period, delay })
            }
        };
        let mut names = Vec::new();
        let plant = TransferFunction::new(&self.plant, &CONTROLLER, &mut names).map_err(|m| m.within("plant"))?;
        Ok(Box::new(Simulated::new(PidLoop {
            interface: interface(&names, horizon),
            plant,
            setpoint,
            load,
            limit,
            sampling,
            is_cut: false,
            tolerance: self.tolerance,
        })))
    }
}

/// Controller parameters; those named in the plant come after them.
const CONTROLLER: [&str; 7] = ["k", "Ti", "Td", "Nd", "wp", "wd", "Tt"];

fn interface(named: &[String], horizon: f64) -> Interface {
    let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
    let mut parameters = vec![
        Parameter::new("k", "1", "gain of the controller"),
        positive("Ti", "s", "integral time").or_infinite(),
        Parameter::new("Td", "s", "derivative time").within(0.0, f64::INFINITY),
        positive("Nd", "1", "filter ratio of the derivative").with_default(10.0),
        Parameter::new("wp", "1", "setpoint weight of the proportional part").with_default(1.0),
        Parameter::new("wd", "1", "setpoint weight of the derivative part").with_default(1.0),
        Parameter::new("Tt", "s", "tracking time of the anti-windup; 0 for its default")
            .within(0.0, f64::INFINITY)
            .with_default(0.0),
    ];
    parameters.extend(named.iter().map(|name| Parameter::new(name, "1", "parameter of the plant")));
    Interface {
        signals: vec![
            Variable::new("r", "1", "setpoint"),
            Variable::new("y", "1", "output of the plant"),
            Variable::new("e", "1", "control error r - y"),
            Variable::new("u", "1", "output of the actuator"),
            Variable::new("d", "1", "load disturbance at the plant input"),
        ],
        parameters,
        states: Vec::new(),
        inputs: vec![
            Variable::new("r", "1", "setpoint"),
            Variable::new("d", "1", "load disturbance at the plant input"),
        ],
        horizon: Some(horizon),
        ..Interface::default()
    }
}

#[derive(Debug, Clone, Copy)]
struct Sampling {
    period: f64,
    delay: f64,
}

/// Model of the kind `pid-loop`.
#[derive(Clone)]
struct PidLoop {
    interface: Interface,
    plant: TransferFunction,
    setpoint: Input,
    load: Option<Input>,
    limit: Option<[f64; 2]>,
    sampling: Option<Sampling>,
    /// True if an input replaces the limited output of the actuator.
    is_cut: bool,
    tolerance: Tolerance,
}

impl PlantModel for PidLoop {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn states(&self) -> Vec<Variable> {
        let of_plant = (1..=self.plant.order()).map(|i| Variable::new(format!("x{i}"), "1", "state of the plant"));
        let integral = Variable::new("integral", "1", "integral part of the controller");
        let filtered = Variable::new("filtered", "1", "filter of the derivative");
        of_plant.chain([integral, filtered]).collect()
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn input(&self, index: usize) -> Option<&Input> {
        match index {
            0 => Some(&self.setpoint),
            1 => self.load.as_ref(),
            _ => None,
        }
    }

    fn not_linear(&self) -> Option<&'static str> {
        self.sampling.map(|_| "a `pid-loop` with a sampled controller cannot be linearised")
    }

    fn cut(&self, variables: &[String]) -> Option<Result<Cut, StudyError>> {
        Some(cut_at("u", &self.interface, variables).map(|(interface, ends)| {
            let model = Self { interface, is_cut: true, ..self.clone() };
            Cut { model: Arc::new(Simulated::new(model)), ends }
        }))
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let (controller, named) = parameters.split_at(CONTROLLER.len());
        let (numerator, denominator) = self.plant.polynomials(named)?;
        Ok(Loop {
            numerator,
            denominator,
            controller: Controller::new(controller),
            limit: self.limit.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            saturated: 0.0,
            sampled: self.sampling.map(Sampled::new),
            is_cut: self.is_cut,
        })
    }
}

/// Parameters of the controller, in the order of [`CONTROLLER`].
#[derive(Debug, Clone, Copy)]
struct Controller<S> {
    k: S,
    td: S,
    nd: S,
    wp: S,
    wd: S,
    tracking: S,
    /// Integral gain `k / Ti`.
    integral_gain: S,
    /// Filter rate `Nd / Td`; 0 without derivative.
    filter_rate: S,
}

impl<S: Scalar> Controller<S> {
    fn new(parameters: &[S]) -> Self {
        let [k, ti, td, nd, wp, wd, tt] = parameters.try_into().expect("the study gives every parameter");
        // Source: Astrom, Hagglund, PID Controllers (1995), section 3.5.
        let tracking = if tt.value() > 0.0 {
            tt
        } else if td.value() > 0.0 && ti.value().is_finite() {
            (ti * td).sqrt()
        } else {
            ti
        };
        let filter_rate = if td.value() > 0.0 { nd / td } else { S::from(0.0) };
        Self { k, td, nd, wp, wd, tracking, integral_gain: k / ti, filter_rate }
    }

    fn has_derivative(&self) -> bool {
        self.td.value() > 0.0
    }

    fn winds_back(&self) -> bool {
        self.tracking.value().is_finite()
    }
}

/// State of a sampled controller.
#[derive(Debug, Clone)]
struct Sampled<S> {
    sampling: Sampling,
    /// Index of the next sample, and of the next output.
    next_sample: f64,
    next_output: f64,
    integral: S,
    derivative: S,
    last: S,
    /// Output that is computed but not active yet, and active output.
    computed: S,
    acting: S,
}

impl<S: Scalar> Sampled<S> {
    fn new(sampling: Sampling) -> Self {
        let zero = S::from(0.0);
        Self {
            sampling,
            next_sample: 0.0,
            next_output: 0.0,
            integral: zero,
            derivative: zero,
            last: zero,
            computed: zero,
            acting: zero,
        }
    }

    fn next_break(&self) -> f64 {
        let Sampling { period, delay } = self.sampling;
        (self.next_sample * period).min(self.next_output * period + delay)
    }

    /// Takes the sample and activates the output that are due at `t`.
    fn pass(&mut self, t: f64, controller: &Controller<S>, limit: [f64; 2], r: S, y: S) {
        let Sampling { period, delay } = self.sampling;
        let due = |time: f64| time <= t + 1e-12 * period;
        // With a delay, the output of an earlier sample is due before the new sample.
        if delay > 0.0 && due(self.next_output * period + delay) {
            self.act();
        }
        if due(self.next_sample * period) {
            self.next_sample += 1.0;
            let Controller { k, td, nd, wp, wd, tracking, integral_gain, .. } = *controller;
            let weighted = wd * r - y;
            if controller.has_derivative() {
                let filter = td / (td + nd * period);
                self.derivative = filter * (self.derivative + k * nd * (weighted - self.last));
            }
            self.last = weighted;
            let wanted = k * (wp * r - y) + self.integral + self.derivative;
            self.computed = saturate(wanted, limit);
            self.integral += integral_gain * (-y + r) * period;
            if controller.winds_back() {
                self.integral += (self.computed - wanted) / tracking * period;
            }
        }
        if delay == 0.0 {
            self.act();
        }
    }

    fn act(&mut self) {
        self.next_output += 1.0;
        self.acting = self.computed;
    }
}

fn saturate<S: Scalar>(value: S, [low, high]: [f64; 2]) -> S {
    if value.value() < low {
        S::from(low)
    } else if value.value() > high {
        S::from(high)
    } else {
        value
    }
}

/// Closed loop: plant in controllable canonical form, integral and derivative filter of the controller. The inputs are
/// setpoint and load.
struct Loop<S> {
    numerator: Vec<S>,
    denominator: Vec<S>,
    controller: Controller<S>,
    limit: [f64; 2],
    /// Active limit: -1 for the lower, 1 for the upper, 0 for none.
    saturated: f64,
    sampled: Option<Sampled<S>>,
    /// True if the last input replaces the limited output of the actuator.
    is_cut: bool,
}

/// Returns the sum of products of the coefficients and as many states.
#[inline(always)]
fn dot<S: Scalar>(coefficients: &[S], x: &[S]) -> S {
    match (coefficients, x) {
        ([a], [x, ..]) => *a * *x,
        ([a, b], [x, y, ..]) => *a * *x + *b * *y,
        ([a, b, c], [x, y, z, ..]) => *a * *x + *b * *y + *c * *z,
        _ => (1..coefficients.len()).fold(coefficients[0] * x[0], |sum, i| sum + coefficients[i] * x[i]),
    }
}

impl<S: Scalar> Loop<S> {
    /// Returns the output of the plant.
    #[inline(always)]
    fn output(&self, x: &[S]) -> S {
        dot(&self.numerator, x)
    }

    /// Returns the output that the continuous controller requests.
    #[inline(always)]
    fn wanted(&self, r: S, y: S, x: &[S]) -> S {
        let Controller { k, nd, wp, wd, .. } = self.controller;
        let [.., integral, filtered] = *x else { unreachable!("the controller has two states") };
        let mut error = wp * r - y;
        if self.controller.has_derivative() {
            error += nd * (wd * r - y - filtered);
        }
        k * error + integral
    }

    /// Returns the output of the actuator.
    #[inline(always)]
    fn actuator(&self, r: S, y: S, x: &[S]) -> S {
        match &self.sampled {
            Some(sampled) => sampled.acting,
            None if self.saturated < 0.0 => S::from(self.limit[0]),
            None if self.saturated > 0.0 => S::from(self.limit[1]),
            None => self.wanted(r, y, x),
        }
    }
}

impl<S: Scalar> Plant<S> for Loop<S> {
    fn start(&self) -> Vec<S> {
        vec![S::from(0.0); self.denominator.len() + 2]
    }

    // Called at each of the six stages of a step, with a number of states known to the compiler.
    #[inline(always)]
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let n = at.x.len() - 2;
        let (numerator, denominator) = (&self.numerator[..n], &self.denominator[..n]);
        let (x, dx, r) = (&at.x[..n + 2], &mut dx[..n + 2], at.u[0]);
        let y = dot(numerator, x);
        let u = if self.is_cut { at.u[2] } else { self.actuator(r, y, x) };
        let input = u + at.u[1] - dot(denominator, x);
        let unbounded = if self.saturated == 0.0 { u } else { self.wanted(r, y, x) };
        let (of_plant, of_controller) = dx.split_at_mut(n);
        of_plant[..n - 1].copy_from_slice(&x[1..n]);
        of_plant[n - 1] = input;
        of_controller.fill(S::from(0.0));
        if self.sampled.is_some() {
            return;
        }
        let Controller { wd, tracking, integral_gain, filter_rate, .. } = self.controller;
        of_controller[0] = integral_gain * (-y + r);
        if self.saturated != 0.0 && self.controller.winds_back() {
            of_controller[0] += (u - unbounded) / tracking;
        }
        if self.controller.has_derivative() {
            of_controller[1] = (wd * r - y - x[n + 1]) * filter_rate;
        }
        // An absent part has a state that stays 0. In the cut loop it must not be a mode at the stability limit.
        if self.is_cut && integral_gain.value() == 0.0 {
            of_controller[0] = -x[n];
        }
        if self.is_cut && !self.controller.has_derivative() {
            of_controller[1] = -x[n + 1];
        }
    }

    #[inline(always)]
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        let (r, y) = (at.u[0], self.output(at.x));
        match signal {
            0 => r,
            1 => y,
            2 => -y + r,
            3 => self.actuator(r, y, at.x),
            4 => at.u[1],
            _ => -self.actuator(r, y, at.x),
        }
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        if self.sampled.is_some() {
            return;
        }
        let (r, y) = (at.u[0], self.output(at.x));
        let wanted = self.wanted(r, y, at.x).value();
        self.saturated = if wanted < self.limit[0] {
            -1.0
        } else if wanted > self.limit[1] {
            1.0
        } else {
            0.0
        };
    }

    /// Linearises within the limits of the actuator: the default would enter the saturated mode.
    fn linearise(&mut self, at: &Instant<'_, S>, _: bool) -> Result<LeftOut<S>, Failure> {
        let wanted = self.wanted(at.u[0], self.output(at.x), at.x).value();
        let is_within = wanted >= self.limit[0] && wanted <= self.limit[1];
        let exceeded = (!is_within).then_some("the output of the controller exceeds its `limit`");
        Ok(LeftOut { exceeded, ..LeftOut::default() })
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }

    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        self.sampled.is_some().then_some(self as _)
    }

    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        self.sampled.is_some().then_some(self as _)
    }
}

impl<S: Scalar> Breaks<S> for Loop<S> {
    fn next(&self, _: f64) -> f64 {
        self.sampled.as_ref().map_or(f64::INFINITY, Sampled::next_break)
    }

    fn pass(&mut self, at: &Instant<'_, S>, _: &mut [S]) -> S {
        let (r, y) = (at.u[0], self.output(at.x));
        if let Some(sampled) = &mut self.sampled {
            sampled.pass(at.t, &self.controller, self.limit, r, y);
        }
        S::from(0.0)
    }
}

impl<S: Scalar> Events<S> for Loop<S> {
    fn guards(&self) -> usize {
        let limited = self.limit[0] > f64::NEG_INFINITY || self.limit[1] < f64::INFINITY;
        if self.sampled.is_none() && limited { 2 } else { 0 }
    }

    /// Returns the guard of the lower limit (0) or of the upper limit (1).
    fn guard(&self, index: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        let side = if index == 0 { -1.0 } else { 1.0 };
        let inside = (-self.wanted(at.u[0], self.output(at.x), at.x) + self.limit[index]) * side;
        match self.saturated {
            s if s == side => -inside,
            0.0 => inside,
            _ => S::from(1.0),
        }
    }

    fn switch(&mut self, index: usize, _: &EventInstant<'_, S>, _: &mut [S]) -> &str {
        let side = if index == 0 { -1.0 } else { 1.0 };
        self.saturated = if self.saturated == side { 0.0 } else { side };
        match (index, self.saturated == 0.0) {
            (_, true) => "actuator leaves its limit",
            (0, false) => "actuator at its lower limit",
            _ => "actuator at its upper limit",
        }
    }
}
