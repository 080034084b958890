//! PID controllers of a model, as definitions, states and clocks.

use mops_core::file::{Entries, Short};
use mops_core::{Quantity, StudyError};

use super::definition::{path, under};
use super::filters::in_brackets;
use super::options::{Clock, Described, EquationsOptions, Formula, Output, Pid};

/// Returns the options with each controller replaced by what it computes.
///
/// Every given value becomes a definition, or a constant, of its own: `u_k` is the gain of the controller `u`.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), sections 3.4 to 3.6.
pub(super) fn expanded(mut options: EquationsOptions) -> Result<EquationsOptions, StudyError> {
    for (name, pid) in std::mem::take(&mut options.pid.0) {
        add(&mut options, &name, &pid).map_err(|mistake| under(&path(&["pid", &name]), mistake))?;
    }
    Ok(options)
}

/// Returns the mistake at the key of the controller, or of the filter, in which the text was given.
pub(super) fn at_its_key(mistake: StudyError, options: &EquationsOptions) -> StudyError {
    let keys: Vec<&str> = mistake.path.iter().map(String::as_str).collect();
    let [section, key, rest @ ..] = keys.as_slice() else { return mistake };
    if let ("clocks", [table @ ("next" | "memory"), memory, ..]) = (*section, rest) {
        let filters = options.clocks.0.iter().filter(|(name, _)| name == key).flat_map(|(_, clock)| &clock.filter.0);
        let part_of = |of: &str| memory.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
        let found = filters.map(|(name, _)| name).find(|name| part_of(name) && (*table == "next" || name != memory));
        if let Some(name) = found {
            return StudyError { path: path(&["clocks", key, "filter", name]), span: None, ..mistake.clone() };
        }
    }
    for (name, pid) in options.pid.0.iter().filter(|_| !["inputs", "start"].contains(section)) {
        let part = key.strip_prefix(name.as_str()).and_then(|part| part.strip_prefix('_'));
        if let Some((given, _)) = pid.given().iter().find(|(given, _)| part == Some(given)) {
            // The text is the given one, so that its span holds.
            let given = if given.starts_with("limit") { "limit" } else { given };
            return StudyError { path: path(&["pid", name, given]), ..mistake.clone() };
        }
        if key == name || part.is_some_and(|part| COMPUTED.contains(&part)) {
            return StudyError { path: path(&["pid", name]), span: None, ..mistake.clone() };
        }
    }
    mistake
}

/// Endings of the names of computed quantities.
const COMPUTED: [&str; 5] = ["unlimited", "integral", "filtered", "derivative", "last"];

impl Pid {
    /// Returns the given values with their keys; both limits have one key.
    fn given(&self) -> Vec<(&'static str, &Formula)> {
        let [low, high] = self.limit.as_ref().map_or([None, None], |[low, high]| [Some(low), Some(high)]);
        let all = [
            ("setpoint", Some(&self.setpoint)),
            ("measured", Some(&self.measured)),
            ("k", Some(&self.k)),
            ("Ti", self.ti.as_ref()),
            ("Td", self.td.as_ref()),
            ("Nd", self.nd.as_ref()),
            ("wp", self.wp.as_ref()),
            ("wd", self.wd.as_ref()),
            ("Tt", self.tt.as_ref()),
            ("feedforward", self.feedforward.as_ref()),
            ("limit_low", low),
            ("limit_high", high),
        ];
        all.into_iter().filter_map(|(key, formula)| Some((key, formula?))).collect()
    }
}

fn add(options: &mut EquationsOptions, u: &str, pid: &Pid) -> Result<(), StudyError> {
    let unit = unit_of(options, u, pid)?;
    options.inputs.0.retain(|(name, _)| name != u);
    for (key, formula) in pid.given() {
        let name = format!("{u}_{key}");
        match Quantity::parse(&formula.0) {
            Ok(quantity) => options.constants.0.push((name, quantity)),
            Err(_) => options.definitions.0.push((name, formula.clone())),
        }
    }
    let mut controller = Controller { u, unit, pid, options };
    match &pid.every {
        None => controller.continuous(),
        Some(every) => controller.sampled(every),
    }
}

/// Returns the unit of the output: that of the input it replaces, or the one given.
fn unit_of(options: &EquationsOptions, u: &str, pid: &Pid) -> Result<String, StudyError> {
    let input = options.inputs.0.iter().find(|(name, _)| name == u).map(|(_, input)| input.0.unit.clone());
    match (input, &pid.unit) {
        (Some(unit), None) => Ok(unit),
        (None, Some(unit)) => Ok(unit.clone()),
        (None, None) => Err(StudyError::here(format!("the unit of `{u}` is not known"))
            .with_help("give unit = \"V\", or declare the output of the controller as an input, whose place it takes")),
        (Some(_), Some(_)) => {
            let fact = format!("`{u}` takes the place of an input, and has its unit");
            Err(StudyError::new("unit", fact).with_help("remove `unit`"))
        }
    }
}

struct Controller<'a> {
    u: &'a str,
    unit: String,
    pid: &'a Pid,
    options: &'a mut EquationsOptions,
}

impl Controller<'_> {
    /// Returns the name of a part of the controller, or its default.
    fn part(&self, given: bool, key: &str, default: &str) -> String {
        if given { format!("{}_{key}", self.u) } else { default.to_owned() }
    }

    fn described(&self, about: &str) -> Described {
        Described { unit: self.unit.clone(), about: Some(about.to_owned()) }
    }

    /// Returns the error with the setpoint weighted: `w r - y`.
    fn error(&self, weight: &str) -> String {
        let u = self.u;
        format!("({weight}*{u}_setpoint - {u}_measured)")
    }

    /// Returns the tracking time.
    fn tracking(&self) -> String {
        let u = self.u;
        match (&self.pid.tt, &self.pid.td) {
            (Some(_), _) => format!("{u}_Tt"),
            (None, Some(_)) => format!("if({u}_Td > 0 [s], sqrt({u}_Ti*{u}_Td), {u}_Ti)"),
            (None, None) => format!("{u}_Ti"),
        }
    }

    /// Returns the rate of the integral part, with anti-windup if the output is limited to `limited`.
    fn integral_rate(&self, limited: &str) -> String {
        let u = self.u;
        let rate = format!("{u}_k/{u}_Ti*{}", self.error("1"));
        match self.pid.limit {
            Some(_) => format!("{rate} + ({limited} - {u}_unlimited)/({})", self.tracking()),
            None => rate,
        }
    }

    /// Returns the gain of the derivative part at high frequencies, times the weighted error.
    fn derivative_input(&self) -> String {
        let nd = self.part(self.pid.nd.is_some(), "Nd", "10");
        let wd = self.part(self.pid.wd.is_some(), "wd", "1");
        format!("{}_k*{nd}*{}", self.u, self.error(&wd))
    }

    /// Returns the output before its limitation, with this derivative part.
    fn unlimited(&self, derivative: Option<String>) -> String {
        let u = self.u;
        let wp = self.part(self.pid.wp.is_some(), "wp", "1");
        let mut terms = vec![format!("{u}_k*{}", self.error(&wp))];
        terms.extend(self.pid.ti.as_ref().map(|_| format!("{u}_integral")));
        terms.extend(derivative.map(|derivative| format!("({derivative})")));
        terms.extend(self.pid.feedforward.as_ref().map(|_| format!("{u}_feedforward")));
        terms.join(" + ")
    }

    fn limited(&self) -> String {
        let u = self.u;
        match self.pid.limit {
            Some(_) => format!("clip({u}_unlimited, {u}_limit_low, {u}_limit_high)"),
            None => format!("{u}_unlimited"),
        }
    }

    fn define(&mut self, name: String, text: String) {
        self.options.definitions.0.push((name, Formula(text)));
    }

    fn state(&mut self, name: &str, about: &str, rate: String) {
        let Described { unit, about } = self.described(about);
        let key = format!("{}_{name}", self.u);
        let state = super::options::StateOptions { unit, scale: None, about };
        self.options.states.0.push((key.clone(), Short(state)));
        self.options.der.0.push((key, Formula(rate)));
    }

    /// Adds the controller as states and definitions.
    fn continuous(&mut self) -> Result<(), StudyError> {
        let u = self.u;
        if self.pid.delay.is_some() {
            return Err(StudyError::new("delay", "a delay needs a sampled controller").with_help("give `every`"));
        }
        if self.pid.ti.is_some() {
            let rate = self.integral_rate(u);
            self.state("integral", "integral part of the controller", rate);
        }
        let derivative = self.pid.td.as_ref().map(|_| {
            let nd = self.part(self.pid.nd.is_some(), "Nd", "10");
            let input = self.derivative_input();
            // Without a derivative time the state stays 0, and is no mode at the stability limit.
            let rate = format!("if({u}_Td > 0 [s], ({input} - {u}_filtered)*{nd}/{u}_Td, -{u}_filtered/1 [s])");
            self.state("filtered", "filter of the derivative part", rate);
            format!("if({u}_Td > 0 [s], {input} - {u}_filtered, 0*{u}_filtered)")
        });
        let unlimited = self.unlimited(derivative);
        self.define(format!("{u}_unlimited"), unlimited);
        let limited = self.limited();
        self.define(u.to_owned(), limited);
        let is_shown = self.options.outputs.0.iter().any(|(name, _)| name == u);
        if !is_shown {
            let Described { unit, about } = self.described("output of the controller");
            let output = Output { value: Formula(u.to_owned()), unit: Some(unit), about };
            self.options.outputs.0.push((u.to_owned(), Short(output)));
        }
        Ok(())
    }

    /// Adds the controller as a clock with backward differences; the integral is updated after the output.
    fn sampled(&mut self, every: &Formula) -> Result<(), StudyError> {
        let u = self.u;
        if self.options.clocks.0.iter().any(|(name, _)| name == u) {
            let fact = format!("there is a clock `{u}` already");
            return Err(StudyError::new("every", fact).with_help("rename the clock"));
        }
        let period = in_brackets(every);
        let limited = self.limited();
        let mut next = vec![(u.to_owned(), limited.clone())];
        let mut memory = vec![(u.to_owned(), "output of the controller")];
        if self.pid.ti.is_some() {
            let rate = self.integral_rate(&format!("({limited})"));
            next.push((format!("{u}_integral"), format!("{u}_integral + {period}*({rate})")));
            memory.push((format!("{u}_integral"), "integral part of the controller"));
        }
        let derivative = self.pid.td.as_ref().map(|_| {
            let nd = self.part(self.pid.nd.is_some(), "Nd", "10");
            let input = self.derivative_input();
            let part = format!("{u}_Td/({u}_Td + {nd}*{period})*({u}_derivative + {input} - {u}_last)");
            next.push((format!("{u}_derivative"), part.clone()));
            next.push((format!("{u}_last"), input));
            memory.push((format!("{u}_derivative"), "derivative part of the controller"));
            memory.push((format!("{u}_last"), "last input of the derivative part"));
            part
        });
        let unlimited = self.unlimited(derivative);
        self.define(format!("{u}_unlimited"), unlimited);
        let clock = Clock {
            every: every.clone(),
            offset: None,
            delay: self.pid.delay.clone(),
            memory: Entries(memory.into_iter().map(|(name, about)| (name, Short(self.described(about)))).collect()),
            next: Entries(next.into_iter().map(|(name, text)| (name, Formula(text))).collect()),
            filter: Entries(Vec::new()),
        };
        self.options.clocks.0.push((u.to_owned(), clock));
        Ok(())
    }
}
