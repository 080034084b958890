//! Inputs of cases: functions of time from the study file.

use mops_core::{
    case::{Chirp, Hold, Input, PRBS_STAGES},
    study::StudyError,
};
use mops_language::{Diagnostic, Quantity, Unit};

use super::experiment::recorded;
use super::input_sections::{FileSection, InputEntry, InputSection, Sweep, TableSection};
use super::sections::InputTable;
use super::tree::Node;
use mops_language::files::Files;

/// Relative difference of times that rounding explains.
const ROUNDING: f64 = 1e-12;

/// Stages of a pseudo-random binary sequence, if none are given: a period of 127 intervals.
const STAGES: usize = 7;

impl FileSection {
    /// Returns the column and its conversion as those of an experiment.
    fn column(&self) -> InputTable {
        InputTable {
            column: self.column.clone(),
            constant: None,
            unit: self.unit.clone(),
            scale: self.scale,
            offset: self.offset.clone(),
            hold: self.hold,
            shift: self.shift.clone(),
            file: None,
            time: self.time.clone(),
            time_unit: self.time_unit.clone(),
            sample_time: self.sample_time.clone(),
        }
    }
}

/// Where inputs of a case are read: the unit of the input, and the end of the simulation.
pub(super) struct Reader<'a> {
    pub unit: &'a Unit,
    pub until: Option<f64>,
    pub files: &'a dyn Files,
}

impl Reader<'_> {
    /// Returns the input that an entry describes, in the unit of the input.
    pub fn read(&self, entry: &InputEntry, node: &Node<'_>) -> Result<Input, Diagnostic> {
        match entry {
            InputEntry::Sum(parts) => self.sum(parts, node),
            entry => self.converted(Term::open(entry, node, self.files)?),
        }
    }

    /// Returns a sum. Of temperatures, one term at most is a temperature, wherever it stands, and all others are
    /// differences.
    fn sum(&self, parts: &[InputEntry], node: &Node<'_>) -> Result<Input, Diagnostic> {
        let terms = parts.iter().zip(node.elements()).map(|(entry, node)| Term::open(entry, &node, self.files));
        let terms = terms.collect::<Result<Vec<_>, _>>()?;
        let absolute = self.absolute(&terms)?;
        let difference = self.unit.difference();
        let rest = Reader { unit: &difference, ..*self };
        let convert = |(k, term)| if Some(k) == absolute { self.converted(term) } else { rest.converted(term) };
        terms.into_iter().enumerate().map(convert).collect::<Result<_, _>>().map(Input::Sum)
    }

    /// Returns the term of a sum that is a temperature: the one on a temperature scale. Without one, in an input on a
    /// scale, the only one in K, unless numbers without a unit are on that scale.
    fn absolute(&self, terms: &[Term<'_, '_>]) -> Result<Option<usize>, Diagnostic> {
        let having = |is_meant: &dyn Fn(Option<&Unit>) -> bool| -> Vec<usize> {
            (0..terms.len()).filter(|&k| terms[k].units().into_iter().any(is_meant)).collect()
        };
        let zero = self.unit.zero();
        let on_scale = having(&|unit| unit.is_some_and(|unit| unit.zero() != 0.0));
        let on_other = having(&|unit| unit.is_some_and(|unit| unit.zero() != 0.0 && unit.zero() != zero));
        let in_kelvin = having(&|unit| unit.is_some_and(|unit| unit.zero() == 0.0));
        // Of an input in degC, numbers without a unit are in degC.
        let numbers = if zero == 0.0 { Vec::new() } else { having(&|unit| unit.is_none()) };
        let in_doubt = |k: usize| {
            let scale = if zero == 0.0 { Unit::known("degC") } else { self.unit.clone() };
            let fact = "another term of the sum may be the temperature, of which this one would be a difference";
            let help = format!("write one term in {scale}, and the differences in {}", scale.difference());
            Err(terms[k].node.diagnostic(fact.to_owned()).with_help(help))
        };
        match (&on_scale[..], &in_kelvin[..]) {
            ([_, second, ..], _) => in_doubt(*second),
            ([one], _) if on_other.contains(one) && numbers.iter().any(|k| k != one) => in_doubt(*one),
            ([one], _) => Ok(Some(*one)),
            ([], _) if zero == 0.0 || !numbers.is_empty() => Ok(None),
            ([], [_, second, ..]) => in_doubt(*second),
            ([], only) => Ok(only.first().copied()),
        }
    }

    /// Returns a term in the unit of the input.
    fn converted(&self, Term { entry, recorded, node }: Term<'_, '_>) -> Result<Input, Diagnostic> {
        if let Some(Recorded { input, unit, column }) = recorded {
            let Some(own) = unit.filter(|own| own != self.unit) else { return Ok(input) };
            let Some(factor) = own.factor_to(self.unit) else {
                let fact = format!("the column `{column}` is in `{own}`, but the input is in `{}`", self.unit);
                return Err(node.diagnostic(fact).with_help("choose another column, or set `unit`"));
            };
            return Ok(input.mapped(&|value| own.convert(value, self.unit).expect("they are compatible"), factor));
        }
        match entry {
            InputEntry::Constant(value) => {
                let constant = self.number("", value, self.unit);
                constant.map(Input::Constant).map_err(|mut mistake| {
                    mistake.path.clear();
                    node.locate(&mistake)
                })
            }
            InputEntry::Function(section) => self.function(section).map_err(|mistake| node.locate(&mistake)),
            InputEntry::Sum(_) => unreachable!("the schema has no sums within sums"),
        }
    }

    fn number(&self, key: &str, quantity: &Quantity, unit: &Unit) -> Result<f64, StudyError> {
        let value = quantity
            .to(unit)
            .map_err(|why| StudyError::new(key, why).with_help(format!("a number without a unit is in `{unit}`")))?;
        let finite = || StudyError::new(key, format!("expected a finite value of the input, found {value}"));
        value.is_finite().then_some(value).ok_or_else(|| finite().with_help("give a number"))
    }

    fn or_zero(&self, key: &str, quantity: &Option<Quantity>, unit: &Unit) -> Result<f64, StudyError> {
        quantity.as_ref().map_or(Ok(0.0), |quantity| self.number(key, quantity, unit))
    }

    fn value(&self, key: &str, quantity: &Quantity) -> Result<f64, StudyError> {
        self.number(key, quantity, self.unit)
    }

    fn value_or_zero(&self, key: &str, quantity: &Option<Quantity>) -> Result<f64, StudyError> {
        self.or_zero(key, quantity, self.unit)
    }

    fn amplitude(&self, quantity: &Quantity) -> Result<f64, StudyError> {
        self.number("amplitude", quantity, &self.unit.difference())
    }

    fn time(&self, quantity: &Option<Quantity>) -> Result<f64, StudyError> {
        self.or_zero("time", quantity, &Unit::known("s"))
    }

    /// Returns a positive quantity.
    fn positive(&self, key: &str, quantity: &Quantity, unit: &str) -> Result<f64, StudyError> {
        let value = self.number(key, quantity, &Unit::known(unit))?;
        let wrong = || StudyError::new(key, format!("`{key}` must be above 0 {unit}, and is {value} {unit}"));
        (value > 0.0).then_some(value).ok_or_else(wrong)
    }

    /// Returns a quantity that is not negative.
    fn not_negative(&self, key: &str, quantity: &Quantity, unit: &str) -> Result<f64, StudyError> {
        let value = self.number(key, quantity, &Unit::known(unit))?;
        let wrong = || StudyError::new(key, format!("`{key}` must not be negative, and is {value} {unit}"));
        (value >= 0.0).then_some(value).ok_or_else(|| wrong().with_help("reverse a sine by its amplitude or phase"))
    }

    /// Returns the end of the simulation, up to which a periodic input is computed.
    fn until(&self, start: f64) -> Result<f64, StudyError> {
        let missing =
            || StudyError::here("the end of the simulation is unknown").with_help("give the case a `horizon`");
        self.until.map(|until| until.max(start)).ok_or_else(missing)
    }

    fn function(&self, section: &InputSection) -> Result<Input, StudyError> {
        let here = |why: String| StudyError::here(why).with_help("use longer times, or a shorter horizon");
        let read = || match section {
            InputSection::Constant(value) => Ok(Input::Constant(self.value("constant", value)?)),
            InputSection::Step(step) => Ok(Input::Step {
                time: self.time(&step.time)?,
                before: self.value_or_zero("before", &step.before)?,
                after: self.value("after", &step.after)?,
            }),
            InputSection::Ramp(ramp) => {
                let duration = self.positive("duration", &ramp.duration, "s")?;
                let before = self.value_or_zero("before", &ramp.before)?;
                Ok(Input::ramp(self.time(&ramp.time)?, duration, before, self.value("after", &ramp.after)?))
            }
            InputSection::Pulse(pulse) => {
                let (start, width) = (self.time(&pulse.time)?, self.positive("width", &pulse.width, "s")?);
                let levels = [self.value_or_zero("before", &pulse.before)?, self.value("value", &pulse.value)?];
                let Some(period) = &pulse.period else {
                    return Input::pulse(start, width, levels, None, start).map_err(here);
                };
                let period = self.positive("period", period, "s")?;
                if period <= width {
                    let fact = format!("the period of {period} s is not longer than the pulse of {width} s");
                    return Err(StudyError::new("period", fact).with_help("shorten `width`"));
                }
                Input::pulse(start, width, levels, Some(period), self.until(start)?).map_err(here)
            }
            InputSection::Doublet(doublet) => {
                let (start, width) = (self.time(&doublet.time)?, self.positive("width", &doublet.width, "s")?);
                let offset = self.value_or_zero("offset", &doublet.offset)?;
                Ok(Input::doublet(start, width, self.amplitude(&doublet.amplitude)?, offset))
            }
            InputSection::Sine(sine) => Ok(Input::Sine {
                amplitude: self.amplitude(&sine.amplitude)?,
                frequency: self.not_negative("frequency", &sine.frequency, "Hz")?,
                phase: self.or_zero("phase", &sine.phase, &Unit::known("rad"))?,
                offset: self.value_or_zero("offset", &sine.offset)?,
            }),
            InputSection::Multisine(sines) => {
                let from = self.positive("from", &sines.from, "Hz")?;
                let to = self.positive("to", &sines.to, "Hz")?;
                let step = (to - from) / (sines.count - 1) as f64;
                let frequencies: Vec<f64> = (0..sines.count).map(|k| from + k as f64 * step).collect();
                let amplitude = self.amplitude(&sines.amplitude)?;
                Ok(Input::multisine(&frequencies, amplitude, self.value_or_zero("offset", &sines.offset)?))
            }
            InputSection::Chirp(chirp) => {
                let start = self.time(&chirp.time)?;
                let duration = match &chirp.duration {
                    Some(duration) => self.positive("duration", duration, "s")?,
                    None => self.until(start)? - start,
                };
                let frequencies = [self.positive("from", &chirp.from, "Hz")?, self.positive("to", &chirp.to, "Hz")?];
                let logarithmic = chirp.sweep == Some(Sweep::Logarithmic);
                let amplitude = self.amplitude(&chirp.amplitude)?;
                // At its last instant, a sweep over the rest of the simulation has not fallen to the offset yet.
                let last = self.until(start).unwrap_or(f64::INFINITY);
                let end = if start + duration < (1.0 - ROUNDING) * last { start + duration } else { f64::INFINITY };
                let sine = Input::Chirp(Chirp { amplitude, frequencies, start, duration, end, logarithmic });
                let offset = self.value_or_zero("offset", &chirp.offset)?;
                Ok(if offset == 0.0 { sine } else { Input::Sum(vec![Input::Constant(offset), sine]) })
            }
            InputSection::Prbs(prbs) => {
                let (start, interval) = (self.time(&prbs.time)?, self.positive("interval", &prbs.interval, "s")?);
                let (amplitude, offset) =
                    (self.amplitude(&prbs.amplitude)?, self.value_or_zero("offset", &prbs.offset)?);
                let stages = prbs.stages.unwrap_or(STAGES).clamp(*PRBS_STAGES.start(), *PRBS_STAGES.end());
                Input::prbs(start, interval, stages, amplitude, offset, self.until(start)?).map_err(here)
            }
            InputSection::Table(table) => self.table(table),
            InputSection::File(_) => unreachable!("it is read elsewhere"),
        };
        read().map_err(|mistake| match section {
            InputSection::Constant(_) => mistake,
            section => mistake.within(section.name()),
        })
    }

    fn table(&self, table: &TableSection) -> Result<Input, StudyError> {
        if table.time.is_empty() || table.time.len() != table.value.len() {
            let fact = format!("`time` has {} numbers and `value` {}", table.time.len(), table.value.len());
            return Err(StudyError::here(fact).with_help("give one value for each time, and at least one"));
        }
        let second = Unit::known("s");
        let times = table.time.iter().map(|t| self.number("time", t, &second)).collect::<Result<Vec<_>, _>>()?;
        if let Some(pair) = times.windows(2).find(|pair| pair[1] <= pair[0]) {
            let fact = format!("the times must increase, but {} s follows {} s", pair[1], pair[0]);
            return Err(StudyError::new("time", fact).with_help("sort them; a step takes hold = \"zero\""));
        }
        let values = table.value.iter().map(|v| self.value("value", v)).collect::<Result<_, _>>()?;
        Ok(Input::Sampled { times, values, hold: table.hold.unwrap_or(Hold::First) })
    }
}

/// A term of an input, before its values are converted to the unit of the input.
struct Term<'e, 't> {
    entry: &'e InputEntry,
    /// Values of a data file.
    recorded: Option<Recorded<'e>>,
    node: Node<'t>,
}

/// Column of a data file, in its unit.
struct Recorded<'e> {
    input: Input,
    unit: Option<Unit>,
    column: &'e str,
}

impl<'e, 't> Term<'e, 't> {
    /// Creates the term; a data file is read.
    fn open(entry: &'e InputEntry, node: &Node<'t>, files: &dyn Files) -> Result<Self, Diagnostic> {
        let node = node.clone();
        let InputEntry::Function(section) = entry else { return Ok(Self { entry, recorded: None, node }) };
        let InputSection::File(file) = &**section else { return Ok(Self { entry, recorded: None, node }) };
        let node = node.child("file").unwrap_or(node);
        let (input, unit) = recorded(&node, &file.path, &file.column(), files)?;
        Ok(Self { entry, recorded: Some(Recorded { input, unit, column: &file.column }), node })
    }

    /// Returns the units in which values are given, not amplitudes or times; `None` for a number without a unit.
    fn units(&self) -> Vec<Option<&Unit>> {
        match (&self.recorded, self.entry) {
            (Some(recorded), _) => vec![recorded.unit.as_ref()],
            (None, InputEntry::Constant(value)) => vec![value.unit.as_ref()],
            (None, InputEntry::Function(section)) => {
                section.values().into_iter().map(|value| value.unit.as_ref()).collect()
            }
            (None, InputEntry::Sum(_)) => unreachable!("the schema has no sums within sums"),
        }
    }
}

impl InputSection {
    /// Returns the values that the study gives to the input, without amplitudes, which are differences.
    fn values(&self) -> Vec<&Quantity> {
        fn given(quantities: [Option<&Quantity>; 2]) -> Vec<&Quantity> {
            quantities.into_iter().flatten().collect()
        }
        match self {
            Self::Constant(value) => vec![value],
            Self::Step(step) => given([step.before.as_ref(), Some(&step.after)]),
            Self::Ramp(ramp) => given([ramp.before.as_ref(), Some(&ramp.after)]),
            Self::Pulse(pulse) => given([pulse.before.as_ref(), Some(&pulse.value)]),
            Self::Doublet(doublet) => given([doublet.offset.as_ref(), None]),
            Self::Sine(sine) => given([sine.offset.as_ref(), None]),
            Self::Multisine(sines) => given([sines.offset.as_ref(), None]),
            Self::Chirp(chirp) => given([chirp.offset.as_ref(), None]),
            Self::Prbs(prbs) => given([prbs.offset.as_ref(), None]),
            Self::Table(table) => table.value.iter().collect(),
            Self::File(_) => Vec::new(),
        }
    }

    /// Returns the key of the function in the study file.
    fn name(&self) -> &'static str {
        match self {
            Self::Constant(_) => "constant",
            Self::Step(_) => "step",
            Self::Ramp(_) => "ramp",
            Self::Pulse(_) => "pulse",
            Self::Doublet(_) => "doublet",
            Self::Sine(_) => "sine",
            Self::Multisine(_) => "multisine",
            Self::Chirp(_) => "chirp",
            Self::Prbs(_) => "prbs",
            Self::Table(_) => "table",
            Self::File(_) => "file",
        }
    }
}
