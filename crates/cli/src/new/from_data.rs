//! A calibration to start from, for a data file: a linear model of order 2 for every output.

use std::fmt::Write as _;
use std::path::Path;

use mops_content::numbers::significant;
use mops_core::{Input, case::Hold};
use mops_data::{DataFile, unit_since_1970};
use mops_file::edit::{key, number, quoted};
use mops_language::{Diagnostic, Unit, files::read_regular, plain::line, suggestion};
use mops_math as math;

use super::super::data;
use crate::terminal::CommandError;

/// Columns that the user has chosen.
pub(super) struct Chosen<'a> {
    pub time: Option<&'a str>,
    pub inputs: Option<&'a [String]>,
    pub outputs: Option<&'a [String]>,
}

/// A column of the file, with its name in the study.
struct Signal {
    column: String,
    name: String,
    unit: Unit,
    /// True if the header has no unit that mops knows.
    is_assumed: bool,
    values: Vec<f64>,
}

/// Share of the record for the calibration; the rest validates.
const SHARE: f64 = 0.7;

/// Words in the name of a column that is an input.
const WORDS: [&str; 16] = [
    "torque",
    "force",
    "voltage",
    "current",
    "power",
    "input",
    "command",
    "cmd",
    "heater",
    "valve",
    "pump",
    "duty",
    "pwm",
    "setpoint",
    "reference",
    "throttle",
];

/// Largest value whose squares can be summed over any file.
const LARGEST: f64 = 1e140;

/// Units of quantities that drive a plant rather than being measured at it.
const DRIVING: [&str; 6] = ["N", "N m", "V", "A", "W", "%"];

pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, CommandError> {
    let failed = |error| CommandError::Failure(format!("`{}` cannot be read: {error}", path.display()));
    read_regular(path).map_err(failed)
}

/// Returns the text of the study; `copy` is the name of the data file in its folder.
pub(super) fn study(name: &str, path: &Path, copy: &str, chosen: &Chosen<'_>) -> Result<String, Diagnostic> {
    let file = DataFile::read(path)?;
    let (time, times) = times(&file, chosen.time)?;
    let names = file.column_names();
    let time = names.into_iter().find(|name| file.is_same(name, &time)).unwrap_or(time);
    let (inputs, outputs) = signals(&file, &time, &times, chosen)?;
    // An input is needed from the first sample on.
    let skip = inputs.iter().filter_map(|u| u.values.iter().position(|v| v.is_finite())).max().unwrap_or(0);
    let mut text = head(name, copy, &inputs, &outputs);
    text += &model(&inputs, &outputs);
    text += &tuners(&times, &inputs, &outputs);
    text += &experiments(copy, &time, &file, (&times, skip), [&inputs, &outputs]);
    text += "\n[criteria]\n";
    for output in &outputs {
        let _ = writeln!(text, "{} = {{ normalised-error = {{ signal = {} }} }}", output.name, quoted(&output.name));
        let fit = format!("{}_fit", output.name);
        let _ =
            writeln!(text, "{fit} = {{ fit-percent = {{ signal = {} }}, usage = \"monitor\" }}", quoted(&output.name));
    }
    Ok(text)
}

/// Returns the name of the time column, chosen or recognised, and its times in s.
fn times(file: &DataFile, chosen: Option<&str>) -> Result<(String, Vec<f64>), Diagnostic> {
    let time = match chosen {
        Some(name) => name.to_owned(),
        None => file.time_column().ok_or_else(|| {
            let names = file.column_names().join(", ");
            file.without_time(&format!(
                "name it with `--time`, one of {names}; without any, write a study with `sample-time`: `mops new NAME`"
            ))
        })?,
    };
    let column = file.column(&time)?;
    let unit = column.unit.or_else(|| assumed_unit(column.values));
    let to_seconds = unit.map_or(Some(1.0), |unit| Unit::parse(unit).ok()?.factor_to(&Unit::known("s")));
    let to_seconds = to_seconds.ok_or_else(|| {
        let unit = column.unit.unwrap_or_default();
        Diagnostic::new(format!("the time column `{time}` is in `{unit}`, which is not a unit of time"))
            .with_help("correct the header of the file, or choose another column with `--time`")
    })?;
    let times: Vec<f64> = column.values.iter().map(|t| t * to_seconds).collect();
    file.increases(&time, &times, 0)?;
    Ok((time, times))
}

/// Returns the unit of times without one that are dates since 1970, if that is not the second.
fn assumed_unit(times: &[f64]) -> Option<&'static str> {
    times.iter().find(|t| t.is_finite()).and_then(|t| unit_since_1970(*t))
}

/// Returns the inputs and the outputs among the columns that change.
fn signals(
    file: &DataFile,
    time: &str,
    times: &[f64],
    chosen: &Chosen<'_>,
) -> Result<(Vec<Signal>, Vec<Signal>), Diagnostic> {
    let names = file.column_names();
    let unknown = |name: &String| {
        Diagnostic::new(format!("no column `{name}` in {}", file.source.name))
            .with_help(suggestion(name, names.iter().map(String::as_str)))
    };
    let mut wanted = chosen.inputs.into_iter().chain(chosen.outputs).flatten();
    if let Some(missing) = wanted.find(|name| !names.contains(name)) {
        return Err(unknown(missing));
    }
    let (mut inputs, mut outputs): (Vec<Signal>, Vec<Signal>) = (Vec::new(), Vec::new());
    for name in names.iter().filter(|name| *name != time) {
        let column = file.column(name)?;
        let is_listed = |list: Option<&[String]>| list.is_some_and(|list| list.contains(name));
        let unit = column.unit.and_then(|unit| Unit::parse(unit).ok());
        let drives = match (chosen.inputs, chosen.outputs) {
            (Some(_), _) => is_listed(chosen.inputs),
            (None, Some(_)) if is_listed(chosen.outputs) => false,
            _ => is_driving(name, unit.as_ref()),
        };
        if !drives && chosen.outputs.is_some() && !is_listed(chosen.outputs) {
            continue;
        }
        let finite: Vec<f64> = column.values.iter().copied().filter(|v| v.is_finite()).collect();
        if finite.iter().any(|v| v.abs() > LARGEST) {
            return Err(Diagnostic::new(format!("column `{name}` has values above {LARGEST:e}"))
                .with_help("scale the column, or choose others with --inputs and --outputs"));
        }
        let changes = finite.windows(2).any(|pair| pair[0] != pair[1]);
        if column.values.len() != times.len() || finite.len() < 4 || !(changes || is_listed(chosen.inputs)) {
            continue;
        }
        let list = if drives { &mut inputs } else { &mut outputs };
        list.push(Signal {
            column: name.clone(),
            name: String::new(),
            is_assumed: unit.is_none(),
            unit: unit.unwrap_or_else(Unit::one),
            values: column.values.to_vec(),
        });
    }
    if outputs.is_empty() && chosen.outputs.is_none() {
        outputs.extend(inputs.pop());
    }
    if outputs.is_empty() {
        return Err(Diagnostic::new(format!("no column of {} changes over time", file.source.name))
            .with_help("name the outputs with --outputs"));
    }
    let mut taken = Vec::new();
    for signal in inputs.iter_mut().chain(&mut outputs) {
        signal.name = identifier(&signal.column, &taken);
        taken.push(signal.name.clone());
    }
    Ok((inputs, outputs))
}

/// Returns true if a column with this name and unit is more likely an input than an output.
fn is_driving(name: &str, unit: Option<&Unit>) -> bool {
    let lower = name.to_lowercase();
    let mut letters = name.chars();
    let (first, second) = (letters.next(), letters.next());
    let stands_alone = second.is_none_or(|c| !c.is_lowercase());
    match first {
        Some('u' | 'U') if stands_alone => return true,
        Some('y' | 'Y') if stands_alone => return false,
        _ => {}
    }
    let drives = |unit: &Unit| {
        let of_share = unit.to_string() == "%";
        DRIVING.iter().map(|known| Unit::known(known)).any(|known| match known.dimension().is_none() {
            true => of_share,
            false => unit.is_compatible(&known),
        })
    };
    WORDS.iter().any(|word| lower.contains(word)) || unit.is_some_and(drives)
}

/// Returns a name for a column that an equation can contain.
fn identifier(column: &str, taken: &[String]) -> String {
    let mut name: String = column.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    name = name.trim_matches('_').to_owned();
    const RESERVED: [&str; 9] = ["t", "time", "pi", "der", "and", "or", "not", "if", "delay"];
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || RESERVED.contains(&name.as_str()) {
        name = format!("c_{name}");
    }
    // Names that the study derives from those of the columns must differ, too.
    let derived = |known: &String| {
        *known == name || name.starts_with(&format!("{known}_")) || known.starts_with(&format!("{name}_"))
    };
    if taken.iter().any(derived) || ["w_", "z_", "rest_", "k_"].iter().any(|prefix| name.starts_with(prefix)) {
        name = format!("c{}_{name}", taken.len() + 1);
    }
    name
}

fn list(signals: &[Signal]) -> String {
    signals.iter().map(|signal| format!("`{}`", line(&signal.column))).collect::<Vec<_>>().join(", ")
}

fn head(name: &str, copy: &str, inputs: &[Signal], outputs: &[Signal]) -> String {
    let found = match inputs {
        [] => "No input was found: each output decays freely from its initial state.".to_owned(),
        inputs => format!("Inputs: {}; `mops new --inputs` chooses others.", list(inputs)),
    };
    // Names from the file stay on one line: a line break would end the comment.
    let copy = line(copy);
    format!(
        "#:schema study.schema.json
# A calibration to start from, for {copy}: `mops run study.toml` estimates the tuners, and its report shows measured against
# simulated signals. Outputs: {}. {found}
# `mops diagnose study.toml` then asks which physical effect the model lacks.

[study]
name = {}
task = \"calibration\"

",
        list(outputs),
        quoted(name)
    )
}

fn model(inputs: &[Signal], outputs: &[Signal]) -> String {
    let (mut states, mut parameters, mut der) = (Vec::new(), Vec::new(), Vec::new());
    for Signal { name: y, unit, .. } in outputs {
        states.push(format!("{y} = {}", quoted(&unit.to_string())));
        states.push(format!("{y}_rate = {}", quoted(&unit.difference().power(1, -1).to_string())));
        parameters.push(format!("w_{y} = \"1/s\", z_{y} = \"1\", rest_{y} = {}", quoted(&unit.to_string())));
        let mut driven = String::new();
        for Signal { name: u, unit: of_input, .. } in inputs {
            let gain = Unit::product(&[(&unit.difference(), 1), (&of_input.difference(), -1)]).to_string();
            parameters.push(format!("k_{y}_{u} = {}", quoted(&gain)));
            let _ = write!(driven, "k_{y}_{u}*{u} + ");
        }
        der.push(format!("{y} = \"{y}_rate\""));
        der.push(format!("{y}_rate = \"w_{y}^2*({driven}(rest_{y} - {y})) - 2*z_{y}*w_{y}*{y}_rate\""));
    }
    let inputs: Vec<String> =
        inputs.iter().map(|u| format!("{} = {}", u.name, quoted(&u.unit.difference().to_string()))).collect();
    let table = |entries: &[String]| entries.join(", ");
    format!(
        "# For each output y a linear model of order 2: natural frequency w, damping ratio z, value at rest, gains k of the inputs.
# YOUR EQUATIONS go here, in place of these: `mops describe equations` has the language, docs/how-to/write-equations.md the ways.
[models.plant.equations]
states     = {{ {} }}
inputs     = {{ {} }}
parameters = {{ {} }}

[models.plant.equations.der]
{}

",
        table(&states),
        table(&inputs),
        table(&parameters),
        der.join("\n")
    )
}

/// Mean and standard deviation of the finite values.
#[allow(clippy::cast_precision_loss)]
fn moments(values: &[f64]) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let n = finite().count() as f64;
    let mean = finite().sum::<f64>() / n;
    [mean, (finite().map(|v| math::powi(v - mean, 2)).sum::<f64>() / n).sqrt()]
}

#[allow(clippy::cast_precision_loss)]
fn tuners(times: &[f64], inputs: &[Signal], outputs: &[Signal]) -> String {
    let mut text = "# Start values and bounds from the data; narrow them to what you know.\n[tuners]\n".to_owned();
    let rounded = |value: f64| {
        let text = format!("{value:.3e}");
        number(text.parse().expect("it was printed as a number"))
    };
    let finite_times = || times.iter().copied().filter(|t| t.is_finite());
    let duration = finite_times().next_back().unwrap_or(1.0) - finite_times().next().unwrap_or(0.0);
    for Signal { name: y, values, .. } in outputs {
        let [mean, deviation] = moments(values);
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        // Crossings of the mean with a hysteresis of a quarter of the deviation, so that noise does not count.
        let (mut side, mut crossings) = (0.0, 0);
        for value in &finite {
            let now = if (value - mean).abs() > 0.25 * deviation { (value - mean).signum() } else { side };
            crossings += usize::from(side != 0.0 && now != side);
            side = now;
        }
        let swings = crossings >= 4;
        let w = if swings { std::f64::consts::PI * crossings as f64 / duration } else { 4.0 / duration };
        let z = if swings { 0.1 } else { 0.7 };
        let _ = writeln!(
            text,
            "w_{y} = {{ start = {}, min = {}, max = {}, scale = \"log\" }}",
            rounded(w),
            rounded(w / 100.0),
            rounded(w * 100.0)
        );
        let _ = writeln!(text, "z_{y} = {{ start = {z}, min = 0.001, max = 50.0, scale = \"log\" }}");
        let mut rest = mean;
        let mut gains = String::new();
        for Signal { name: u, values: driven, .. } in inputs {
            let [of_input, spread] = moments(driven);
            let pairs = || driven.iter().zip(values).filter(|(u, y)| u.is_finite() && y.is_finite());
            let covariance = pairs().map(|(u, v)| (u - of_input) * (v - mean)).sum::<f64>() / pairs().count() as f64;
            let most = if spread > 0.0 { 50.0 * deviation / spread } else { 1.0 };
            let gain = if spread > 0.0 { covariance / (spread * spread) } else { 0.0 };
            rest -= gain * of_input / inputs.len() as f64;
            let gain = gain / inputs.len() as f64;
            let [low, high] = [-most, most].map(rounded);
            let _ = writeln!(gains, "k_{y}_{u} = {{ start = {}, min = {low}, max = {high} }}", rounded(gain));
        }
        let reach = 20.0 * deviation;
        let [low, high] = [rest - reach, rest + reach].map(rounded);
        let _ = writeln!(text, "rest_{y} = {{ start = {}, min = {low}, max = {high} }}\n{gains}", rounded(rest));
    }
    text.truncate(text.trim_end().len());
    text + "\n"
}

fn experiments(
    copy: &str,
    time: &str,
    file: &DataFile,
    (times, skip): (&[f64], usize),
    [inputs, outputs]: [&[Signal]; 2],
) -> String {
    let column = |signal: &Signal, more: &str| {
        let unit = if signal.is_assumed { ", unit = \"1\"" } else { "" };
        if unit.is_empty() && more.is_empty() {
            format!("{} = {}", key(&signal.name), quoted(&signal.column))
        } else {
            format!("{} = {{ column = {}{unit}{more} }}", key(&signal.name), quoted(&signal.column))
        }
    };
    let channel = |signal: &Signal| {
        let deviation = moments(&signal.values)[1];
        let noise = data::noise(&signal.values, Some(times)).filter(|noise| *noise > 1e-6 * deviation);
        let noise = noise.unwrap_or(0.01 * deviation);
        let noise = format!("{noise:.2e}").parse().expect("it was printed as a number");
        column(signal, &format!(", noise = {}", number(noise)))
    };
    let input = |signal: &Signal| {
        let sampled = Input::Sampled { times: times.to_vec(), values: signal.values.clone(), hold: Hold::Zero };
        // Missing samples keep the value under zero-order hold only.
        let has_gaps = signal.values.iter().any(|v| !v.is_finite());
        column(signal, if sampled.looks_smooth() && !has_gaps { ", hold = \"first\"" } else { ", hold = \"zero\"" })
    };
    let channels: Vec<String> = outputs.iter().map(channel).collect();
    let driven: Vec<String> = inputs.iter().map(input).collect();
    let free: Vec<String> =
        outputs.iter().flat_map(|y| [quoted(&y.name), quoted(&format!("{}_rate", y.name))]).collect();
    let names = file.time_column();
    let mut time_key =
        if names.as_deref() == Some(time) { String::new() } else { format!("time = {}\n", quoted(time)) };
    let column = file.column(time).ok().filter(|column| column.unit.is_none());
    if let Some(unit) = column.and_then(|column| assumed_unit(column.values)) {
        let _ = writeln!(time_key, "time-unit = {}", quoted(unit));
    }
    let skipped = if skip > 0 { format!("skip     = {skip}\n") } else { String::new() };
    let finite: Vec<f64> = times[skip..].iter().copied().filter(|t| t.is_finite()).collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
    let split = ((finite.len() - 1) as f64 * SHARE) as usize;
    let split = quoted(&format!("{} s", between(finite[split], finite.get(split + 1).copied())));
    let common = format!(
        "file     = {}\n{time_key}channels = {{ {} }}\ninputs   = {{ {} }}\nfree     = [{}]\n{skipped}",
        quoted(copy),
        channels.join(", "),
        driven.join(", "),
        free.join(", ")
    );
    format!(
        "
# The first part of the record estimates the tuners, the rest validates them. The noise is estimated from the data.
[experiments.calibration]
{common}to       = {split}

[experiments.validation]
{common}from     = {split}
role     = \"validation\"
"
    )
}

/// Returns a number of few digits between two instants, so that no sample is in both parts.
fn between(last: f64, next: Option<f64>) -> String {
    let Some(next) = next else { return number(last) };
    let middle = |digits: usize| significant(0.5 * (last + next), digits);
    let is_between = |text: &String| text.parse().is_ok_and(|value: f64| last < value && value < next);
    (1..17).map(middle).find(is_between).unwrap_or_else(|| number(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_record_share_no_sample() {
        let cases =
            [((1.0, 2.0), "1.5"), ((1999.0, 2001.0), "2000"), ((12.34, 12.35), "12.345"), ((-0.2, 0.1), "-0.05")];
        for ((last, next), expected) in cases {
            assert_eq!(between(last, Some(next)), expected);
        }
        assert_eq!(between(7.0, None), "7.0");
    }

    #[test]
    fn inputs_are_known_by_name_or_unit() {
        for (name, unit, expected) in [
            ("u", None, true),
            ("uEst", Some("V"), true),
            ("yEst", Some("V"), false),
            ("F", Some("N"), true),
            ("Q1", Some("%"), true),
            ("T1", Some("degC"), false),
            ("motor torque", None, true),
            ("position", None, false),
            ("undamped", None, false),
            ("q", Some("m"), false),
            ("P", Some("kW"), true),
        ] {
            assert_eq!(is_driving(name, unit.map(Unit::known).as_ref()), expected, "{name}");
        }
    }

    #[test]
    fn a_name_of_any_column_fits_into_an_equation() {
        let taken = ["T".to_owned()];
        assert_eq!(
            ["T", "T (left)", "1", "t", "w'", "and", "k_y"].map(|c| identifier(c, &taken)),
            ["c2_T", "c2_T__left", "c_1", "c_t", "w", "c_and", "c2_k_y"]
        );
    }
}
