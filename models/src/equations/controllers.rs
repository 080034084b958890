//! PID controllers of a model, as definitions, states and clocks.

use mops_core::StudyError;
use mops_language::{
    Quantity, Unit,
    entries::{Entries, Short},
};

use super::definition::{path, under};
use super::filters::{in_brackets, number_before_formulas};
use super::options::{Clock, Described, EquationsOptions, Formula, Output, Pid};

/// Returns the options with each controller replaced by what it computes.
///
/// Every given value becomes a definition, or a constant, of its own: `u_k` is the gain of the controller `u`.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), sections 3.4 to 3.6.
pub(super) fn expanded(mut options: EquationsOptions) -> Result<EquationsOptions, StudyError> {
    for (name, pid) in options.pid.0.clone() {
        add(&mut options, &name, &pid).map_err(|mistake| under(&path(&["pid", &name]), mistake))?;
    }
    options.pid.0.clear();
    Ok(options)
}

/// Returns the mistake at the key of the controller, or of the filter, in which the text was given.
pub(super) fn at_its_key(mistake: StudyError, options: &EquationsOptions) -> StudyError {
    let keys: Vec<&str> = mistake.path.iter().map(String::as_str).collect();
    let [section, key, rest @ ..] = keys.as_slice() else { return mistake };
    if let ("clocks", [table @ ("next" | "memory"), memory, ..]) = (*section, rest) {
        let clock = options.clocks.0.iter().find(|(name, _)| name == key).map(|(_, clock)| clock);
        let is_own = clock.is_some_and(|clock| {
            let next = clock.next.0.iter().any(|(name, _)| *table == "next" && name == memory);
            next || clock.memory.0.iter().any(|(name, _)| *table == "memory" && name == memory)
        });
        let filters = clock.into_iter().filter(|_| !is_own).flat_map(|clock| &clock.filter.0);
        let part_of = |of: &str| memory.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
        if let Some((name, filter)) = filters.into_iter().find(|(name, _)| part_of(name)) {
            let place = ["clocks", key, "filter", name];
            if let Some((list, help)) = number_before_formulas(filter) {
                let place = path(&[&place[..], &["continuous", list]].concat());
                return StudyError { path: place, span: None, help: Some(help), ..mistake.clone() };
            }
            return StudyError { path: path(&place), span: None, ..mistake.clone() };
        }
    }
    let is_own = options.definitions.0.iter().any(|(name, _)| *section == "let" && name == key)
        || options.constants.0.iter().any(|(name, _)| *section == "constants" && name == key)
        || options.states.0.iter().any(|(name, _)| ["states", "der"].contains(section) && name == key)
        || options.outputs.0.iter().any(|(name, _)| *section == "outputs" && name == key)
        || ["inputs", "start"].contains(section);
    for (name, pid) in options.pid.0.iter().filter(|_| !is_own) {
        if let ("clocks", true, [time @ ("every" | "delay"), ..]) = (*section, key == name, rest) {
            return StudyError { path: path(&["pid", name, time]), ..mistake.clone() };
        }
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
const COMPUTED: [&str; 6] = ["unlimited", "limited", "integral", "filtered", "derivative", "last"];

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
    if options.states.0.iter().any(|(name, _)| name == u) {
        let fact = format!("`{u}` is a state, and the output of a controller is none");
        return Err(StudyError::here(fact).with_help("name the input of the plant that the controller replaces"));
    }
    let unit = unit_of(options, u, pid)?;
    check(options, u, pid, &unit)?;
    options.inputs.0.retain(|(name, _)| name != u);
    let plain = is_plain(options) && unit == "1";
    for (key, formula) in pid.given() {
        let name = format!("{u}_{key}");
        match Quantity::parse(&formula.0) {
            Ok(mut quantity) => {
                if quantity.unit.is_none() && !plain {
                    quantity.unit = unit_of_number(options, pid, key, &unit, quantity.number)?;
                }
                options.constants.0.push((name, quantity));
            }
            Err(_) => options.definitions.0.push((name, formula.clone())),
        }
    }
    let mut controller = Controller { u, unit, pid, options, second: if plain { "1" } else { "1 [s]" } };
    match &pid.every {
        None => controller.continuous(),
        Some(every) => controller.sampled(every),
    }
}

/// Refuses a setpoint weight for a temperature: `w r - y` depends on the zero of its scale, unless the weight is 1.
fn refuse_weighted_temperature(options: &EquationsOptions, pid: &Pid) -> Result<(), StudyError> {
    let is_one = |weight: &&Formula| weight.0.trim().parse::<f64>() == Ok(1.0);
    let of_part = |given: Option<&Formula>, acts: bool| given.filter(|weight| acts && !is_one(weight)).is_some();
    let Some(key) = [("wp", of_part(pid.wp.as_ref(), true)), ("wd", of_part(pid.wd.as_ref(), pid.td.is_some()))]
        .into_iter()
        .find_map(|(key, weights)| weights.then_some(key))
    else {
        return Ok(());
    };
    let unit = |formula: &Formula| match Quantity::parse(&formula.0) {
        Ok(quantity) => quantity.unit,
        Err(_) => declared_unit(options, &formula.0).and_then(|unit| Unit::parse(unit).ok()),
    };
    let Some(scale) =
        [&pid.setpoint, &pid.measured].into_iter().find_map(|of| unit(of).filter(|unit| unit.zero() != 0.0))
    else {
        return Ok(());
    };
    let [setpoint, measured] = [&pid.setpoint.0, &pid.measured.0];
    let setpoint = if Quantity::parse(setpoint).is_ok() { "r" } else { setpoint };
    let fact = format!(
        "`{key}` weights the setpoint, which is a temperature in {scale}: the result depends on the zero of the scale"
    );
    let help = format!(
        "control a difference: setpoint = \"{setpoint} - 20 [{scale}]\", measured = \"{measured} - 20 [{scale}]\", with the \
         temperature at rest for 20"
    );
    Err(StudyError::new(key, fact).with_help(help))
}

/// Returns the unit of a state, an input, an output or a memory.
fn declared_unit<'o>(options: &'o EquationsOptions, name: &str) -> Option<&'o str> {
    let states = options.states.0.iter().map(|(state, of)| (state, Some(&of.0.unit)));
    let inputs = options.inputs.0.iter().map(|(input, of)| (input, Some(&of.0.unit)));
    let outputs = options.outputs.0.iter().map(|(output, of)| (output, of.0.unit.as_ref()));
    let memory = options.clocks.0.iter().flat_map(|(_, clock)| &clock.memory.0);
    let mut known = states.chain(inputs).chain(outputs).chain(memory.map(|(memory, of)| (memory, Some(&of.0.unit))));
    known.find(|(known, _)| *known == name.trim()).and_then(|(_, unit)| unit).map(String::as_str)
}

/// Checks the values that are quantities, and that the controller acts.
fn check(options: &EquationsOptions, u: &str, pid: &Pid, unit: &str) -> Result<(), StudyError> {
    refuse_weighted_temperature(options, pid)?;
    for (key, formula) in pid.given() {
        let Ok(Quantity { number, unit: given }) = Quantity::parse(&formula.0) else { continue };
        let is_limit = key.starts_with("limit_");
        if number.is_nan() || number.is_infinite() && !is_limit {
            let key = if is_limit { "limit" } else { key };
            return Err(StudyError::new(key, format!("expected a finite value for `{key}`, found {number}")));
        }
        let (key, expected) = match key {
            "Ti" | "Td" | "Tt" => (key, "s"),
            "Nd" | "wp" | "wd" => (key, "1"),
            "limit_low" | "limit_high" => ("limit", unit),
            "feedforward" => (key, unit),
            _ => continue,
        };
        let wrong = given.zip(Unit::parse(expected).ok()).filter(|(given, expected)| !given.is_compatible(expected));
        if let Some((given, expected)) = wrong {
            return Err(StudyError::new(key, format!("expected a quantity in {expected}, found {given}")));
        }
        let is_positive = number > 0.0 || key == "Td" && number == 0.0;
        if ["Ti", "Td", "Tt", "Nd"].contains(&key) && !is_positive {
            return Err(StudyError::new(key, format!("expected a value above 0 for `{key}`, found {number}"))
                .with_help("omit `Ti` or `Td` for a controller without this part"));
        }
    }
    if let Some([Ok(low), Ok(high)]) =
        pid.limit.as_ref().map(|limit| limit.each_ref().map(|end| Quantity::parse(&end.0)))
        && let Ok(unit) = Unit::parse(unit)
        && let (Ok(low), Ok(high)) = (low.to(&unit), high.to(&unit))
        && low >= high
    {
        let fact = format!("expected a lower limit below the upper limit, found {low} and {high}");
        return Err(StudyError::new("limit", fact));
    }
    if pid.tt.is_some() && (pid.ti.is_none() || pid.limit.is_none()) {
        let fact = "a tracking time has an effect only with an integral part and a limit";
        return Err(StudyError::new("Tt", fact).with_help("give `Ti` and `limit`, or omit `Tt`"));
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let uses = |text: &str| {
        text.match_indices(u)
            .any(|(at, _)| !text[..at].ends_with(is_name) && !text[at + u.len()..].starts_with(is_name))
    };
    let texts = options.definitions.0.iter().chain(&options.der.0).map(|(_, text)| &text.0);
    let outputs = options.outputs.0.iter().map(|(_, output)| &output.0.value.0);
    let others = options.pid.0.iter().flat_map(|(_, pid)| pid.given()).map(|(_, text)| &text.0);
    let events = options
        .when
        .0
        .iter()
        .flat_map(|(_, when)| std::iter::once(&when.guard.0).chain(when.reset.0.iter().map(|(_, text)| &text.0)));
    let clocks = options.clocks.0.iter().flat_map(|(_, clock)| {
        let filters = clock.filter.0.iter().map(|(_, filter)| &filter.of.0);
        clock.next.0.iter().map(|(_, text)| &text.0).chain(filters)
    });
    if !texts.chain(outputs).chain(others).chain(events).chain(clocks).any(|text| uses(text)) {
        return Err(StudyError::here(format!("no equation contains the output `{u}` of the controller"))
            .with_help("name the input of the plant that the controller replaces, or use it in an equation"));
    }
    Ok(())
}

/// Returns true if nothing in the model has a unit, so that time is a pure number.
fn is_plain(options: &EquationsOptions) -> bool {
    let states = options.states.0.iter().map(|(_, state)| &state.0.unit);
    let described = options.inputs.0.iter().map(|(_, input)| &input.0.unit);
    let parameters = options.parameters.0.iter().map(|(_, parameter)| &parameter.0.unit);
    let outputs = options.outputs.0.iter().filter_map(|(_, output)| output.0.unit.as_ref());
    let mut units = states.chain(described).chain(parameters).chain(outputs);
    let texts = options.definitions.0.iter().chain(&options.der.0).chain(&options.start.0).map(|(_, text)| &text.0);
    let mut texts = texts.chain(options.outputs.0.iter().map(|(_, output)| &output.0.value.0));
    units.all(|unit| ["", "1"].contains(&unit.trim()))
        && options.constants.0.iter().all(|(_, constant)| constant.unit.is_none())
        && texts.all(|text| !text.contains(" [") && !text.contains('"'))
}

/// Returns the unit of a number without one: that of the output for its limits, that of the measured quantity for the
/// setpoint, s for times. `None` for the unit that the equations require, which counts in SI units.
fn unit_of_number(
    options: &EquationsOptions,
    pid: &Pid,
    key: &str,
    unit: &str,
    number: f64,
) -> Result<Option<Unit>, StudyError> {
    let measured = declared_unit(options, &pid.measured.0);
    let unit = match key {
        "limit_low" | "limit_high" | "feedforward" => Some(unit),
        "setpoint" => match measured {
            Some(unit) => Some(unit),
            None if number == 0.0 => None,
            None => {
                let fact = format!("the setpoint {number} has no unit");
                return Err(StudyError::new("setpoint", fact).with_help("give it one, for example \"90 deg\""));
            }
        },
        "Ti" | "Td" | "Tt" => Some("s"),
        "Nd" | "wp" | "wd" => Some("1"),
        _ => None,
    };
    // A wrong unit is refused where it is declared.
    Ok(unit.filter(|unit| !unit.trim().is_empty()).and_then(|unit| Unit::parse(unit).ok()))
}

/// Returns the unit of the output: that of the input it replaces, or the one given.
fn unit_of(options: &EquationsOptions, u: &str, pid: &Pid) -> Result<String, StudyError> {
    let input = options.inputs.0.iter().find(|(name, _)| name == u).map(|(_, input)| input.0.unit.clone());
    match (input, &pid.unit) {
        (Some(unit), None) => Ok(unit),
        (None, Some(unit)) => Ok(unit.clone()),
        (None, None) => Err(StudyError::here(format!("the output `{u}` of the controller has no unit"))
            .with_help("give unit = \"V\", or declare the output of the controller as an input, whose place it takes")),
        (Some(_), Some(_)) => {
            let fact = format!("the controller replaces the input `{u}`, whose unit applies");
            Err(StudyError::new("unit", fact).with_help("remove `unit`"))
        }
    }
}

struct Controller<'a> {
    u: &'a str,
    unit: String,
    pid: &'a Pid,
    options: &'a mut EquationsOptions,
    /// A second, in an expression.
    second: &'static str,
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
            (None, Some(_)) => format!("if({u}_Td > 0*{u}_Td, sqrt({u}_Ti*{u}_Td), {u}_Ti)"),
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
            let rate = self.integral_rate(&format!("{u}_limited"));
            self.state("integral", "integral part of the controller", rate);
        }
        let derivative = self.pid.td.as_ref().map(|_| {
            let nd = self.part(self.pid.nd.is_some(), "Nd", "10");
            let input = self.derivative_input();
            // Without a derivative time the state stays 0, and is no mode at the stability limit.
            let (is_active, second) = (format!("{u}_Td > 0*{u}_Td"), self.second);
            let rate = format!("if({is_active}, ({input} - {u}_filtered)*{nd}/{u}_Td, -{u}_filtered/({second}))");
            self.state("filtered", "filter of the derivative part", rate);
            format!("if({is_active}, {input} - {u}_filtered, 0*{u}_filtered)")
        });
        let unlimited = self.unlimited(derivative);
        self.define(format!("{u}_unlimited"), unlimited);
        // A cut at `u` leaves the anti-windup as it is.
        let limited = self.limited();
        self.define(format!("{u}_limited"), limited);
        self.define(u.to_owned(), format!("{u}_limited"));
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
