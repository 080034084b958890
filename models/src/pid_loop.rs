//! A PID controller in a loop with a linear plant.

use mops_core::{
    AnalysisKind, Failure, Input, Interface, Job, Mistake, Model, ModelOptions, OperatingPoint, Parameter, Quantity,
    Scalar, Unit, Variable,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::kernel::drive::Drive;
use crate::kernel::{
    Dynamics, Equations, Kernel, Recording, Simulate, Tolerance, Written, rates_and_signals, record, wanted,
};
use crate::plant::{Plant, TransferFunction};

/// A PID controller with filtered derivative in a loop with unity feedback and a linear plant `G`:
///
/// ```text
/// y = G (sat(v) + d),   v = k (wp r - y + 1/(Ti s) (r - y) + Td s/(Td/Nd s + 1) (wd r - y))
/// ```
///
/// All states start at zero. `r` is the setpoint (a unit step at 0 s unless `setpoint` or a case says otherwise), `d` a
/// load at the plant's input (0 unless `load` or a case says otherwise). With `limit` the actuator saturates and the
/// integral is kept from winding up by back-calculation with the tracking time `Tt`. With `sample-time` the controller
/// runs at that period (backward differences, integral updated after the output) and its output acts `delay` later.
///
/// Parameters: `k` gain, `Ti`, `Td` times of integral and derivative (s; `Ti = inf` for no integral, `Td = 0` for no
/// derivative), `Nd` filter ratio of the derivative (default 10), `wp`, `wd` setpoint weights of proportional and
/// derivative part (default 1), `Tt` tracking time (s; default sqrt(Ti Td), or Ti where Td = 0), and every name that stands in the
/// plant for a number.
///
/// Signals: `r`, `y`, `e = r - y`, `u = sat(v)`, `d`. Inputs: `r`, `d`.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), sections 3.4 to 3.6; block form of the
/// derivative as in the Modelica Standard Library, Blocks.Continuous.PID.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PidLoopOptions {
    /// The plant: `{ poles = [...], zeros = [...], gain = 1.0 }`, or `{ numerator = [...], denominator = [...] }` with
    /// coefficients of falling powers of s. A name instead of a number makes a parameter of it.
    plant: Plant,
    /// End of the simulation.
    horizon: Quantity,
    /// The setpoint's step: `{ time = "0 s", size = 1.0 }`.
    setpoint: Option<StepOptions>,
    /// A step of the load at the plant's input: `{ time = "20 s", size = 0.5 }`.
    load: Option<StepOptions>,
    /// Smallest and largest output of the actuator.
    limit: Option<[f64; 2]>,
    /// Period of a sampled controller.
    sample_time: Option<Quantity>,
    /// Time from taking a sample to its output, at most the period.
    delay: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    #[serde(default)]
    tolerance: Tolerance,
}

/// A step of an input.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct StepOptions {
    /// When; 0 s where absent.
    time: Option<Quantity>,
    /// Value from then on; 0 before.
    size: f64,
}

impl ModelOptions for PidLoopOptions {
    const KIND: &'static str = "pid-loop";

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        self.tolerance.check()?;
        let seconds = |key: &str, q: &Quantity| q.to(&Unit::known("s")).map_err(|e| Mistake::new(key, e));
        let horizon = seconds("horizon", &self.horizon)?;
        if !(horizon > 0.0 && horizon.is_finite()) {
            return Err(Mistake::new("horizon", format!("a simulation must end after its start, not at {horizon} s")));
        }
        let step = |key: &str, options: &Option<StepOptions>| -> Result<Option<Input>, Mistake> {
            let Some(options) = options else { return Ok(None) };
            let time = options.time.as_ref().map_or(Ok(0.0), |q| seconds("time", q)).map_err(|m| m.within(key))?;
            Ok(Some(Input::Step { time, before: 0.0, after: options.size }))
        };
        let setpoint = step("setpoint", &self.setpoint)?.unwrap_or(Input::Step { time: 0.0, before: 0.0, after: 1.0 });
        let load = step("load", &self.load)?;
        let limit = match self.limit {
            Some([low, high]) if low < high => Some([low, high]),
            None => None,
            Some([low, high]) => return Err(Mistake::new("limit", format!("the range is empty: {low} to {high}"))),
        };
        let sampling = match (&self.sample_time, &self.delay) {
            (None, None) => None,
            (None, Some(_)) => {
                return Err(
                    Mistake::new("delay", "only a sampled controller has a delay").with_help("give `sample-time`")
                );
            }
            (Some(period), delay) => {
                let period = seconds("sample-time", period)?;
                let delay = delay.as_ref().map_or(Ok(0.0), |q| seconds("delay", q))?;
                if !(period > 0.0 && period.is_finite()) {
                    return Err(Mistake::new("sample-time", format!("a period must be positive, not {period} s")));
                }
                if !(0.0..=period).contains(&delay) {
                    return Err(Mistake::new(
                        "delay",
                        format!("the delay must lie between 0 and the period of {period} s"),
                    ));
                }
                Some(Sampling { period, delay })
            }
        };
        let mut names = Vec::new();
        let plant = TransferFunction::new(&self.plant, &CONTROLLER, &mut names).map_err(|m| m.within("plant"))?;
        Ok(Box::new(Kernel(PidLoop {
            interface: interface(&names, horizon),
            plant,
            setpoint,
            load,
            limit,
            sampling,
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
        positive("Ti", "s", "time of the integral").or_infinite(),
        Parameter::new("Td", "s", "time of the derivative").within(0.0, f64::INFINITY),
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
            Variable::new("d", "1", "load at the plant's input"),
        ],
        parameters,
        states: Vec::new(),
        inputs: vec![Variable::new("r", "1", "setpoint"), Variable::new("d", "1", "load at the plant's input")],
        horizon: Some(horizon),
        ports: Vec::new(),
        analysis: AnalysisKind::Time,
    }
}

#[derive(Debug, Clone, Copy)]
struct Sampling {
    period: f64,
    delay: f64,
}

/// The model of the kind `pid-loop`.
struct PidLoop {
    interface: Interface,
    plant: TransferFunction,
    setpoint: Input,
    load: Option<Input>,
    limit: Option<[f64; 2]>,
    sampling: Option<Sampling>,
    tolerance: Tolerance,
}

impl Written for PidLoop {
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
}

impl Simulate for PidLoop {
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        let (controller, named) = parameters.split_at(CONTROLLER.len());
        let (numerator, denominator) = self.plant.polynomials(named)?;
        let plant = (numerator.as_slice(), denominator.as_slice());
        let controller = Controller::new(controller);
        let zero = S::from(0.0);
        // The plant's states, then integral and derivative filter; common sizes as arrays.
        match denominator.len() + 2 {
            3 => self.simulate_with(job, plant, controller, [zero; 3]),
            4 => self.simulate_with(job, plant, controller, [zero; 4]),
            5 => self.simulate_with(job, plant, controller, [zero; 5]),
            6 => self.simulate_with(job, plant, controller, [zero; 6]),
            states => self.simulate_with(job, plant, controller, vec![zero; states]),
        }
    }
}

impl PidLoop {
    fn simulate_with<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone>(
        &self,
        job: &Job<'_>,
        plant: (&[S], &[S]),
        controller: Controller<S>,
        start: X,
    ) -> Result<Recording, Failure> {
        let setpoint = Drive::new(Some(job.case.input("r").unwrap_or(&self.setpoint)));
        let load = Drive::new(job.case.input("d").or(self.load.as_ref()));
        let mut dynamics = self.dynamics(plant, controller, &start, [setpoint, load]);
        record(&mut dynamics, start, job.horizon, &self.tolerance, &wanted(job, &self.interface.signals), &Loop::signal)
    }

    /// The loop with states like `start`.
    fn dynamics<'a, S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone>(
        &self,
        (numerator, denominator): (&[S], &[S]),
        controller: Controller<S>,
        start: &X,
        [setpoint, load]: [Drive<'a, S>; 2],
    ) -> Loop<'a, S, X> {
        let padded = |coefficients: &[S]| {
            let mut padded = start.clone();
            padded.as_mut()[..coefficients.len()].copy_from_slice(coefficients);
            padded
        };
        Loop {
            numerator: padded(numerator),
            denominator: padded(denominator),
            controller,
            limit: self.limit.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            setpoint,
            load,
            saturated: 0.0,
            sampled: self.sampling.map(Sampled::new),
        }
    }
}

impl Equations for PidLoop {
    /// Within the limits of the actuator.
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure> {
        if self.sampling.is_some() {
            return Err(Failure::Undefined("a loop with a sampled controller cannot be linearised".into()));
        }
        let (controller, named) = at.parameters.split_at(CONTROLLER.len());
        let (numerator, denominator) = self.plant.polynomials(named)?;
        let drives = [Drive::held(at.inputs[0]), Drive::held(at.inputs[1])];
        let x = at.states.to_vec();
        let dynamics = self.dynamics((&numerator, &denominator), Controller::new(controller), &x, drives);
        Ok(rates_and_signals(&dynamics, &x, self.interface.signals.len(), &Loop::signal))
    }
}

/// The controller's parameters, in the order of [`CONTROLLER`].
#[derive(Debug, Clone, Copy)]
struct Controller<S> {
    k: S,
    td: S,
    nd: S,
    wp: S,
    wd: S,
    tracking: S,
    /// `k / Ti`.
    integral_gain: S,
    /// `Nd / Td`; 0 without derivative.
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

/// A sampled controller's memory.
#[derive(Debug, Clone)]
struct Sampled<S> {
    sampling: Sampling,
    /// Number of the next sample, and of the next output.
    next_sample: f64,
    next_output: f64,
    integral: S,
    derivative: S,
    last: S,
    /// Output computed but not yet acting, and output acting.
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

    /// Takes the sample and moves the output that are due at `t`.
    fn pass(&mut self, t: f64, controller: &Controller<S>, limit: [f64; 2], r: S, y: S) {
        let Sampling { period, delay } = self.sampling;
        let due = |time: f64| time <= t + 1e-12 * period;
        // With a delay the output of an earlier sample is due before this one is taken.
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

/// The closed loop: the plant in controllable canonical form, integral and derivative filter of the controller. `X` is
/// its state; the coefficients of the plant are kept in the same form, and end before the states of the controller.
struct Loop<'a, S, X> {
    numerator: X,
    denominator: X,
    controller: Controller<S>,
    limit: [f64; 2],
    setpoint: Drive<'a, S>,
    load: Drive<'a, S>,
    /// -1 at the lower limit, 1 at the upper, 0 between.
    saturated: f64,
    sampled: Option<Sampled<S>>,
}

impl<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone> Loop<'_, S, X> {
    /// The sum of products over the states of the plant.
    #[inline]
    fn dot(coefficients: &X, x: &X) -> S {
        let (coefficients, x) = (coefficients.as_ref(), x.as_ref());
        (1..x.len() - 2).fold(coefficients[0] * x[0], |sum, i| sum + coefficients[i] * x[i])
    }

    /// Setpoint and output of the plant.
    #[inline]
    fn compared(&self, t: f64, x: &X) -> (S, S) {
        (self.setpoint.at(t), Self::dot(&self.numerator, x))
    }

    /// The value of a signal.
    fn signal(&self, signal: usize, t: f64, x: &X) -> S {
        let (r, y) = self.compared(t, x);
        match signal {
            0 => r,
            1 => y,
            2 => -y + r,
            3 => self.actuator(r, y, x),
            _ => self.load.at(t),
        }
    }

    /// What the continuous controller asks for.
    #[inline]
    fn wanted(&self, r: S, y: S, x: &X) -> S {
        let Controller { k, nd, wp, wd, .. } = self.controller;
        let [.., integral, filtered] = *x.as_ref() else { unreachable!("the controller has two states") };
        let mut error = wp * r - y;
        if self.controller.has_derivative() {
            error += nd * (wd * r - y - filtered);
        }
        k * error + integral
    }

    /// What the actuator gives.
    #[inline]
    fn actuator(&self, r: S, y: S, x: &X) -> S {
        match &self.sampled {
            Some(sampled) => sampled.acting,
            None if self.saturated < 0.0 => S::from(self.limit[0]),
            None if self.saturated > 0.0 => S::from(self.limit[1]),
            None => self.wanted(r, y, x),
        }
    }
}

impl<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone> Dynamics<S> for Loop<'_, S, X> {
    type State = X;

    #[inline(always)]
    fn derivative(&self, t: f64, x: &X, dx: &mut X) {
        let (r, y) = self.compared(t, x);
        let u = self.actuator(r, y, x);
        let input = u + self.load.at(t) - Self::dot(&self.denominator, x);
        let unbounded = if self.saturated == 0.0 { u } else { self.wanted(r, y, x) };
        let (x, dx) = (x.as_ref(), dx.as_mut());
        let n = x.len() - 2;
        dx[..n - 1].copy_from_slice(&x[1..n]);
        dx[n - 1] = input;
        dx[n] = S::from(0.0);
        dx[n + 1] = S::from(0.0);
        if self.sampled.is_some() {
            return;
        }
        let Controller { wd, tracking, integral_gain, filter_rate, .. } = self.controller;
        dx[n] = integral_gain * (-y + r);
        if self.saturated != 0.0 && self.controller.winds_back() {
            dx[n] += (u - unbounded) / tracking;
        }
        if self.controller.has_derivative() {
            dx[n + 1] = (wd * r - y - x[n + 1]) * filter_rate;
        }
    }

    fn guards(&self) -> usize {
        let limited = self.limit[0] > f64::NEG_INFINITY || self.limit[1] < f64::INFINITY;
        if self.sampled.is_none() && limited { 2 } else { 0 }
    }

    /// Guard 0 watches the lower limit, guard 1 the upper.
    fn guard(&self, index: usize, t: f64, x: &X) -> S {
        let side = if index == 0 { -1.0 } else { 1.0 };
        let (r, y) = self.compared(t, x);
        let inside = (-self.wanted(r, y, x) + self.limit[index]) * side;
        match self.saturated {
            s if s == side => -inside,
            0.0 => inside,
            _ => S::from(1.0),
        }
    }

    fn switch(&mut self, index: usize, _: f64, _: &mut X) -> &str {
        let side = if index == 0 { -1.0 } else { 1.0 };
        self.saturated = if self.saturated == side { 0.0 } else { side };
        match (index, self.saturated == 0.0) {
            (_, true) => "actuator leaves its limit",
            (0, false) => "actuator at its lower limit",
            _ => "actuator at its upper limit",
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        let next = self.setpoint.next_break(t).min(self.load.next_break(t));
        self.sampled.as_ref().map_or(next, |sampled| next.min(sampled.next_break()))
    }

    fn longest_step(&self) -> f64 {
        self.setpoint.longest_step().min(self.load.longest_step())
    }

    fn pass_break(&mut self, t: f64, x: &mut X) {
        self.setpoint.pass_break(t);
        self.load.pass_break(t);
        let (r, y) = self.compared(t, x);
        if let Some(sampled) = &mut self.sampled {
            sampled.pass(t, &self.controller, self.limit, r, y);
            return;
        }
        let wanted = self.wanted(r, y, x).value();
        self.saturated = if wanted < self.limit[0] {
            -1.0
        } else if wanted > self.limit[1] {
            1.0
        } else {
            0.0
        };
    }
}
