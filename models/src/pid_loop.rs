//! A PID controller in a loop with a linear plant.

use mops_core::{
    Analysis, AnalysisKind, Failure, Input, Interface, Job, Mistake, Model, ModelOptions, Parameter, Quantity, Scalar,
    Unit, Variable, WithTangents,
};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

use crate::kernel::drive::Drive;
use crate::kernel::{self, Dynamics, Recording, Simulate, Tolerance, record, wanted};

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

/// A transfer function, by poles and zeros or by coefficients.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
struct Plant {
    /// Real poles, 1/s.
    poles: Option<Vec<Coefficient>>,
    /// Real zeros, 1/s.
    zeros: Vec<Coefficient>,
    /// `gain (s - z1)(s - z2)... / ((s - p1)(s - p2)...)`.
    gain: Option<Coefficient>,
    /// Coefficients of the numerator, falling powers of s.
    numerator: Option<Vec<Coefficient>>,
    /// Coefficients of the denominator, falling powers of s.
    denominator: Option<Vec<Coefficient>>,
}

/// A number, or the name of a parameter.
#[derive(Debug, Clone, PartialEq)]
enum Coefficient {
    Number(f64),
    Name(String),
}

impl<'de> Deserialize<'de> for Coefficient {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrName;
        impl Visitor<'_> for NumberOrName {
            type Value = Coefficient;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, or the name of a parameter")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Coefficient, E> {
                if number.is_finite() {
                    Ok(Coefficient::Number(number))
                } else {
                    Err(E::custom("a coefficient must be finite"))
                }
            }
            #[allow(clippy::cast_precision_loss)]
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Coefficient, E> {
                Ok(Coefficient::Number(number as f64))
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Coefficient, E> {
                Ok(Coefficient::Name(name.to_owned()))
            }
        }
        deserializer.deserialize_any(NumberOrName)
    }
}

impl JsonSchema for Coefficient {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Coefficient".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "description": "a number, or the name of a parameter" })
    }
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
        let plant = TransferFunction::new(&self.plant, &mut names).map_err(|m| m.within("plant"))?;
        Ok(Box::new(PidLoop {
            interface: interface(&names, horizon),
            plant,
            setpoint,
            load,
            limit,
            sampling,
            tolerance: self.tolerance,
        }))
    }
}

/// Controller parameters; those named in the plant come after them.
const CONTROLLER: [&str; 7] = ["k", "Ti", "Td", "Nd", "wp", "wd", "Tt"];

fn interface(named: &[String], horizon: f64) -> Interface {
    let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
    let mut parameters = vec![
        Parameter::new("k", "1", "gain of the controller"),
        positive("Ti", "s", "time of the integral"),
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

/// A strictly proper transfer function whose coefficients may be parameters.
#[derive(Debug, Clone)]
struct TransferFunction {
    form: Form,
}

#[derive(Debug, Clone)]
enum Form {
    Roots { poles: Vec<Slot>, zeros: Vec<Slot>, gain: Slot },
    Coefficients { numerator: Vec<Slot>, denominator: Vec<Slot> },
}

/// A number, or an index into the parameters named in the plant.
#[derive(Debug, Clone, Copy)]
enum Slot {
    Number(f64),
    Named(usize),
}

impl Slot {
    fn value<S: Scalar>(self, named: &[S]) -> S {
        match self {
            Self::Number(number) => S::from(number),
            Self::Named(index) => named[index],
        }
    }
}

impl TransferFunction {
    fn new(plant: &Plant, names: &mut Vec<String>) -> Result<Self, Mistake> {
        let mut slots = |key: &str, list: &[Coefficient]| -> Result<Vec<Slot>, Mistake> {
            list.iter().map(|c| slot(c, names).map_err(|m| m.within(key))).collect()
        };
        let form = match (&plant.poles, &plant.numerator, &plant.denominator) {
            (Some(poles), None, None) => {
                let gain = plant.gain.clone().unwrap_or(Coefficient::Number(1.0));
                Form::Roots {
                    poles: slots("poles", poles)?,
                    zeros: slots("zeros", &plant.zeros)?,
                    gain: slots("gain", &[gain])?[0],
                }
            }
            (None, Some(numerator), Some(denominator)) => {
                if plant.gain.is_some() || !plant.zeros.is_empty() {
                    return Err(Mistake::here("`gain` and `zeros` go with `poles`, not with coefficients"));
                }
                Form::Coefficients {
                    numerator: slots("numerator", numerator)?,
                    denominator: slots("denominator", denominator)?,
                }
            }
            _ => {
                return Err(Mistake::here("the plant is given neither by its poles nor by numerator and denominator")
                    .with_help("as in plant = { poles = [0.0, -4.0, -1.0], gain = 1.0 }, or { numerator = [1.0], denominator = [1.0, 5.0, 4.0, 0.0] }"));
            }
        };
        let (above, below) = match &form {
            Form::Roots { poles, zeros, .. } => (zeros.len(), poles.len()),
            Form::Coefficients { numerator, denominator } => {
                (numerator.len().saturating_sub(1), denominator.len().saturating_sub(1))
            }
        };
        if above >= below {
            return Err(Mistake::here(format!(
                "the plant must be strictly proper, but has order {above} over order {below}"
            ))
            .with_help("add the pole of the actuator or the sensor"));
        }
        Ok(Self { form })
    }

    /// Coefficients of rising powers, the denominator's leading one being 1 and left out.
    fn polynomials<S: Scalar>(&self, named: &[S]) -> Result<(Vec<S>, Vec<S>), Failure> {
        let values = |slots: &[Slot]| -> Vec<S> { slots.iter().map(|s| s.value(named)).collect() };
        let (mut numerator, mut denominator) = match &self.form {
            Form::Roots { poles, zeros, gain } => {
                let gain = gain.value(named);
                let numerator = from_roots(&values(zeros)).into_iter().map(|c| gain * c).collect();
                (numerator, from_roots(&values(poles)))
            }
            Form::Coefficients { numerator, denominator } => {
                let (mut above, mut below) = (values(numerator), values(denominator));
                above.reverse();
                below.reverse();
                (above, below)
            }
        };
        let leading = denominator.pop().unwrap_or(S::from(0.0));
        if leading.value() == 0.0 {
            return Err(Failure::Undefined("the leading coefficient of the plant's denominator is 0".into()));
        }
        numerator.iter_mut().chain(&mut denominator).for_each(|c| *c = *c / leading);
        numerator.resize(denominator.len(), S::from(0.0));
        Ok((numerator, denominator))
    }
}

fn slot(coefficient: &Coefficient, names: &mut Vec<String>) -> Result<Slot, Mistake> {
    match coefficient {
        Coefficient::Number(number) => Ok(Slot::Number(*number)),
        Coefficient::Name(name) if CONTROLLER.contains(&name.as_str()) => {
            Err(Mistake::here(format!("`{name}` is a parameter of the controller"))
                .with_help("give the plant's parameter another name"))
        }
        Coefficient::Name(name) => Ok(Slot::Named(names.iter().position(|known| known == name).unwrap_or_else(|| {
            names.push(name.clone());
            names.len() - 1
        }))),
    }
}

/// Coefficients, rising powers, of `(s - r1)(s - r2)...`.
fn from_roots<S: Scalar>(roots: &[S]) -> Vec<S> {
    let mut polynomial = vec![S::from(1.0)];
    for &root in roots {
        polynomial.push(S::from(0.0));
        for i in (0..polynomial.len()).rev() {
            let lower = if i > 0 { polynomial[i - 1] } else { S::from(0.0) };
            polynomial[i] = lower - root * polynomial[i];
        }
    }
    polynomial
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

impl Model for PidLoop {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        kernel::analyse(self, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(kernel::tangents(self, job, seeds))
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
        (numerator, denominator): (&[S], &[S]),
        controller: Controller<S>,
        start: X,
    ) -> Result<Recording, Failure> {
        let padded = |coefficients: &[S]| {
            let mut padded = start.clone();
            padded.as_mut()[..coefficients.len()].copy_from_slice(coefficients);
            padded
        };
        let mut dynamics = Loop {
            numerator: padded(numerator),
            denominator: padded(denominator),
            controller,
            limit: self.limit.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            setpoint: Drive::new(Some(job.case.input("r").unwrap_or(&self.setpoint))),
            load: Drive::new(job.case.input("d").or(self.load.as_ref())),
            saturated: 0.0,
            sampled: self.sampling.map(Sampled::new),
        };
        let output = |dynamics: &Loop<'_, S, X>, signal: usize, t: f64, x: &X| {
            let (r, y) = dynamics.compared(t, x);
            match signal {
                0 => S::from(r),
                1 => y,
                2 => -y + r,
                3 => dynamics.actuator(r, y, x),
                _ => S::from(dynamics.load.at(t)),
            }
        };
        record(&mut dynamics, start, job.horizon, &self.tolerance, &wanted(job, &self.interface.signals), &output)
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
    fn pass(&mut self, t: f64, controller: &Controller<S>, limit: [f64; 2], r: f64, y: S) {
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
    setpoint: Drive<'a>,
    load: Drive<'a>,
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
    fn compared(&self, t: f64, x: &X) -> (f64, S) {
        (self.setpoint.at(t), Self::dot(&self.numerator, x))
    }

    /// What the continuous controller asks for.
    #[inline]
    fn wanted(&self, r: f64, y: S, x: &X) -> S {
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
    fn actuator(&self, r: f64, y: S, x: &X) -> S {
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

    fn switch(&mut self, index: usize, _: f64, _: &mut X) -> &'static str {
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
