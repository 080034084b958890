//! Recalibrated study: the user's study file with the effects found, as a calibration that runs by itself.

use std::fmt::Write;
use std::sync::Arc;

use mops_core::{
    AnalysisKind, Effect, Study,
    effect::{EffectParameter, Scope},
};
use mops_file::edit::{TomlText, key, number, quoted, settled};
use mops_language::{Quantity, Unit};
use mops_math as math;
use mops_outcome::diagnosis::{Alignment, Diagnosis, Found, StrengthValue};

use super::words;

/// Study that was diagnosed.
pub struct Original<'a> {
    /// Text of its file.
    pub text: &'a str,
    /// Settings of the command line, as `key=value`.
    pub settings: &'a [String],
    /// Study built from the file.
    pub study: &'a Study,
    /// Effects of the catalogue.
    pub effects: &'a [Arc<dyn Effect>],
}

/// Bound of an effect's parameter relative to its value, if physics sets none.
const BOUND_RATIO: f64 = 10.0;

/// Returns the text of the recalibrated study, a calibration whose initial guess is the values found.
///
/// `locate` maps the path of a data file to its path relative to the new study file.
pub fn repaired(original: &Original<'_>, diagnosis: &Diagnosis, locate: &dyn Fn(&str) -> String) -> String {
    let mut text = settled(original.text, original.settings, locate);
    text.set(&["study", "name"], &quoted(&format!("{}-repaired", original.study.name())));
    text.set(&["study", "task"], "\"calibration\"");
    noise_and_criteria(&mut text, diagnosis);
    alignment(&mut text, diagnosis);
    parameters(&mut text, original.study, diagnosis);
    initial_states(&mut text, original, diagnosis);
    for found in &diagnosis.found {
        effect(&mut text, original, diagnosis, found);
    }
    text.head(&words::verdict(diagnosis).replace('`', ""));
    text.into_text()
}

/// Adds the noise of sensors without one, and criteria if there are none. Entries of the user are kept.
fn noise_and_criteria(text: &mut TomlText, diagnosis: &Diagnosis) {
    let without = text.keys(&["criteria"]).is_empty();
    for p in diagnosis.predictions.iter().filter(|p| p.noise.is_finite() && p.noise > 0.0) {
        let channel = ["experiments", &p.experiment, "channels", &p.signal];
        let own = [&channel[..], &["noise"]].concat();
        if text.has(&channel) && !text.has(&own) && !text.has(&["sensors", &p.signal]) {
            text.set(&["sensors", &p.signal, "noise"], &number(p.noise));
        }
    }
    for p in diagnosis.predictions.iter().filter(|_| without) {
        if !text.has(&["criteria", &p.signal]) {
            let criterion = format!("{{ normalised-error = {{ signal = {} }} }}", quoted(&p.signal));
            text.set(&["criteria", &p.signal], &criterion);
        }
    }
}

/// Sets hold and shift of the inputs that act at other times than the study says.
fn alignment(text: &mut TomlText, diagnosis: &Diagnosis) {
    for experiment in text.keys(&["experiments"]) {
        for Alignment { input, shift, hold } in &diagnosis.alignment {
            let place = ["experiments", &experiment, "inputs", input];
            if let Some(column) = text.item(&place).and_then(|column| column.as_str().map(quoted)) {
                text.set(&place, &format!("{{ column = {column} }}"));
            }
            if text.has(&place) {
                let own = |key| [&place[..], &[key]].concat();
                text.set(&own("hold"), &quoted(hold.name()));
                let second = Unit::known("s");
                let declared = text.item(&own("shift"));
                let declared = declared.and_then(|shift| Quantity::parse(shift.as_str()?).ok()?.to(&second).ok());
                let shift = shift + declared.unwrap_or(0.0);
                if shift != 0.0 {
                    text.set(&own("shift"), &quoted(&format!("{} s", number(shift))));
                }
            }
        }
    }
}

/// Sets the initial guess of the tuners to the values found, and comments out the tuners of dropped terms.
fn parameters(text: &mut TomlText, study: &Study, diagnosis: &Diagnosis) {
    for moved in diagnosis.parameters.iter().filter(|p| p.after.is_finite()) {
        let tuner = ["tuners", &moved.name];
        if text.has(&tuner) && !text.has(&["tuners", &moved.name, "tie"]) {
            text.set(&["tuners", &moved.name, "start"], &number(moved.after));
        }
    }
    for dropped in &diagnosis.removed {
        let term = &dropped.term;
        text.remove(&["tuners", term], &format!("The data show that {term} is not needed."));
        let has_term = |model: &&(String, _)| has_parameter(study, &model.0, term);
        if let Some((model, _)) = study.models().iter().find(has_term) {
            text.set(&["models", model, "parameters", term], "0.0");
        }
    }
}

fn has_parameter(study: &Study, model: &str, parameter: &str) -> bool {
    let parameters =
        study.models().iter().filter(|(name, _)| name == model).flat_map(|(_, m)| &m.interface().parameters);
    parameters.into_iter().any(|p| p.variable.name == parameter)
}

/// Sets the initial guess of free initial states to the values found, and adds the states of effects.
fn initial_states(text: &mut TomlText, original: &Original<'_>, diagnosis: &Diagnosis) {
    for experiment in text.keys(&["experiments"]) {
        let place = ["experiments", &experiment, "free"];
        let starts = diagnosis.starts.iter().filter(|(name, _, value)| *name == experiment && value.is_finite());
        let starts: Vec<FreeStart> =
            starts.filter_map(|(_, p, value)| free_start(original, diagnosis, p, *value)).collect();
        if let (Some(list), false) = (text.item(&place).and_then(|free| free.as_array()), starts.is_empty()) {
            let states = list.iter().filter_map(|state| Some(format!("{} = {{}}", key(state.as_str()?))));
            let states = states.collect::<Vec<_>>().join(", ");
            text.set(&place, &format!("{{ {states} }}"));
        }
        for (state, values) in starts {
            let state_place = ["experiments", &experiment, "free", &state];
            if !text.has(&state_place) {
                let entries = values.iter().map(|(bound, value)| format!("{bound} = {}", number(*value)));
                text.set(&state_place, &format!("{{ {} }}", entries.collect::<Vec<_>>().join(", ")));
                continue;
            }
            for (bound, value) in values {
                text.set(&["experiments", &experiment, "free", &state, bound], &number(value));
            }
        }
    }
}

/// State, with the keys and values of its entry in `free`.
type FreeStart = (String, Vec<(&'static str, f64)>);

/// Returns the state whose initial value is `parameter`, with its initial guess; for a state of an effect also with
/// bounds.
fn free_start(original: &Original<'_>, diagnosis: &Diagnosis, parameter: &str, value: f64) -> Option<FreeStart> {
    let states = original.study.models().iter().flat_map(|(_, model)| &model.interface().states);
    if let Some(state) = states.into_iter().find(|state| state.start == parameter) {
        return Some((state.name.clone(), vec![("start", value)]));
    }
    // States of effects are numbered from 1: `name.start1` is the initial value of `name.1`.
    let (name, start) = parameter.rsplit_once('.')?;
    let index = start.strip_prefix("start")?;
    diagnosis.found.iter().find(|found| found.name == name)?;
    let [low, high] = range(value, [f64::NEG_INFINITY, f64::INFINITY]);
    Some((format!("{name}.{index}"), vec![("start", value), ("min", low), ("max", high)]))
}

/// Adds an effect to its model, and its parameters to the tuners.
fn effect(text: &mut TomlText, original: &Original<'_>, diagnosis: &Diagnosis, found: &Found) {
    let model = model_of(original.study, &found.place);
    let name = found.name.as_str();
    let companion =
        found.companion.as_ref().map_or_else(String::new, |other| format!(", companion = {}", quoted(other)));
    let value = format!("{{ {} = {{ place = {}{companion} }} }}", key(&found.effect), quoted(&found.place));
    text.set(&["models", model, "effects", name], &value);
    let known = original.effects.iter().find(|effect| effect.name() == found.effect);
    for strength in &found.strengths {
        let same_name = |known: &&EffectParameter| known.name == strength.name;
        let known = known.and_then(|effect| effect.parameters().iter().find(same_name));
        let tuner_name = format!("{name}.{}", strength.name);
        let own = diagnosis.starts.iter().filter(|(_, parameter, value)| *parameter == tuner_name && value.is_finite());
        let own: Vec<(String, f64)> = own.map(|(experiment, _, value)| (experiment.clone(), *value)).collect();
        text.set(&["tuners", &tuner_name], &tuner(strength, known, &own));
    }
    // An effect of one experiment has its null value in all others.
    if let (Some(only), Some(first)) = (&found.only, known.and_then(|effect| effect.parameters().first())) {
        let parameter = format!("{name}.{}", first.name);
        let is_other = |name: &&String| *name != only && !only.starts_with(&format!("{name}-"));
        for experiment in text.keys(&["experiments"]).iter().filter(is_other) {
            text.set(&["experiments", experiment, "parameters", &parameter], &number(first.null_value.unwrap_or(0.0)));
        }
    }
}

/// Returns the name of the model that has the place.
pub(super) fn model_of<'a>(study: &'a Study, place: &str) -> &'a str {
    let simulated = || study.models().iter().filter(|(_, model)| model.interface().analysis == AnalysisKind::Time);
    let has = |(_, model): &&(String, _)| ports(model).any(|port| port == place);
    let found = simulated().find(has).or_else(|| simulated().next()).or_else(|| study.models().first());
    &found.expect("a study has a model").0
}

fn ports(model: &Arc<dyn mops_core::Model>) -> impl Iterator<Item = String> {
    model.interface().ports.iter().map(ToString::to_string)
}

/// Returns the tuner of an effect's parameter, within its physical bounds. `own` lists the values by experiment, if the
/// parameter differs between experiments.
fn tuner(strength: &StrengthValue, known: Option<&EffectParameter>, own: &[(String, f64)]) -> String {
    let bounds = known.map_or([f64::NEG_INFINITY, f64::INFINITY], |known| known.bounds);
    let largest =
        own.iter().map(|(_, value)| *value).chain([strength.value]).max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let [low, high] = range(largest.unwrap_or(strength.value), bounds);
    let at = |value: f64| number(value.clamp(low, high));
    let mut tuner = format!("{{ start = {}, min = {}, max = {}", at(strength.value), number(low), number(high));
    if known.is_some_and(|known| known.fixed) {
        tuner += ", active = false";
    }
    if known.is_some_and(|known| known.scope == Scope::Experiment) {
        tuner += ", per-case = true";
        let own: Vec<String> = own.iter().map(|(case, value)| format!("{} = {}", key(case), at(*value))).collect();
        if !own.is_empty() {
            write!(tuner, ", starts = {{ {} }}", own.join(", ")).expect("writing to a string succeeds");
        }
    }
    tuner + " }"
}

/// Returns the bounds of a parameter. An infinite bound becomes plus or minus ten times the value, rounded up to one
/// digit; plus or minus 1 if the value is 0.
fn range(value: f64, [low, high]: [f64; 2]) -> [f64; 2] {
    let size = if value.is_finite() && value != 0.0 { BOUND_RATIO * value.abs() } else { 1.0 };
    // Up to the next round number.
    let decade = math::powf(10.0, math::log10(size).floor());
    let reach = (size / decade - 1e-9).ceil() * decade;
    // Via decimal text, as 3 * 0.1 is not 0.3.
    let reach: f64 = format!("{reach:.0e}").parse().unwrap_or(reach);
    let [low, high] = [low, high].map(|bound| if bound.is_finite() { bound } else { bound.signum() * reach });
    if low < high { [low, high] } else { [low - reach, high + reach] }
}

#[cfg(test)]
mod tests {
    use mops_file::StudyFile;
    use mops_language::files::Files;
    use mops_outcome::diagnosis::Removed;

    use super::super::made_up;
    use super::*;

    const STUDY: &str = "\
# A swing of the rig on Tuesday.
[study]
name = \"swing\"
task = \"diagnosis\"

[models.rig.furuta]
[models.rig.parameters]
a = 9.035e-4   # weighed

[tuners]
b  = { start = 2e-3, min = 5e-4, max = 1e-2, scale = \"log\" }   # inertia of the arm
d  = { start = 2e-2, min = 5e-3, max = 1e-1, scale = \"log\" }
c  = { start = 4e-4, min = 1e-4, max = 1e-3 }
bp = { start = 1e-5, min = 0.0,  max = 1e-4 }

[experiments.swing]
file     = \"swing.csv\"   # 100 Hz
channels = { phi = \"phi\", theta = { column = \"theta\" } }
free     = [\"phi\", \"theta\"]
";

    struct Memory;

    impl Files for Memory {
        fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
            assert_eq!(path, "../data/swing.csv");
            let rows = (0..20)
                .map(|i| format!("{},{},{}\n", f64::from(i) * 0.01, math::sin(f64::from(i)), math::cos(f64::from(i))));
            Ok(format!("t,phi,theta\n{}", rows.collect::<String>()).into_bytes())
        }

        fn show(&self, path: &str) -> String {
            path.to_owned()
        }
    }

    fn read(text: &str) -> StudyFile {
        let settings: [String; 0] = [];
        mops_file::read(&crate::testing::catalogue(), "study.toml", text, &settings, &Memory)
            .unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    /// Returns the text of the recalibrated study.
    fn made(diagnosis: &Diagnosis, settings: &[String]) -> String {
        let study = read(&STUDY.replace("swing.csv", "../data/swing.csv")).study;
        let original = Original { text: STUDY, settings, study: &study, effects: &crate::testing::catalogue().effects };
        repaired(&original, diagnosis, &|path| format!("../data/{path}"))
    }

    #[test]
    fn the_repaired_study_is_the_users_file_with_the_effect_and_the_values_found() {
        let mut diagnosis = made_up::coulomb();
        diagnosis.removed = vec![Removed { term: "bp".into(), place: "joint:theta".into() }];
        insta::assert_snapshot!(made(&diagnosis, &["tuners.c.max=\"2e-3 kg m2\"".to_owned()]));
    }

    #[test]
    fn the_repaired_study_is_read_as_a_calibration_without_criteria_of_the_user() {
        // Without the effect, which this test does not need.
        let mut diagnosis = made_up::coulomb();
        diagnosis.found = Vec::new();
        let study = read(&made(&diagnosis, &[])).study;
        assert_eq!((study.name(), study.task().name()), ("swing-repaired", "calibration"));
        let start = |name: &str| study.tuners().iter().find(|t| t.name == name).unwrap().start;
        assert_eq!([start("b"), start("d"), start("c"), start("swing/phi0")], [1.133e-3, 2.5267e-2, 4e-4, 0.98]);
        let keys: Vec<String> = study.rows().iter().map(|row| study.key(row)).collect();
        assert_eq!(keys, ["swing/phi", "swing/theta"]);
        let channels = &study.cases()[0].experiment.as_ref().unwrap().channels;
        assert!(channels.iter().all(|channel| channel.noise == Some(0.003)));
    }

    #[test]
    fn an_effect_of_one_experiment_has_its_null_value_in_all_others() {
        let mut diagnosis = made_up::coulomb();
        diagnosis.found[0].only = Some("another".into());
        diagnosis.found[0].effect = "wind-gust".into();
        let text = made(&diagnosis, &[]);
        let found: toml::Table = text.parse().expect("TOML");
        let parameters = &found["experiments"]["swing"]["parameters"];
        assert_eq!(parameters["phi-coulomb-friction.a"].as_float(), Some(0.0), "{text}");
    }

    #[test]
    fn a_state_of_an_effect_is_free_in_the_experiments_where_it_was_estimated() {
        let mut diagnosis = made_up::coulomb();
        diagnosis.starts.push(("swing".into(), "phi-coulomb-friction.start1".into(), 0.03));
        let text = made(&diagnosis, &[]);
        let free = "theta = { start = 0.51 }, \"phi-coulomb-friction.1\" = { start = 0.03, min = -0.3, max = 0.3 } }";
        assert!(text.contains(free), "{text}");
    }

    #[test]
    fn an_input_that_acts_earlier_has_its_hold_and_shift() {
        let given = "[experiments.e]\ninputs = { u = \"u\", w = { column = \"w\", shift = \"10 ms\" } }\n";
        let mut text = TomlText::new(given);
        let mut diagnosis = Diagnosis::default();
        let of = |input: &str| Alignment { input: input.to_owned(), shift: -0.02, hold: mops_core::case::Hold::First };
        diagnosis.alignment = vec![of("u"), of("w")];
        alignment(&mut text, &diagnosis);
        let found: toml::Table = text.into_text().parse().expect("TOML");
        let inputs = &found["experiments"]["e"]["inputs"];
        let all = |input: &str| ["column", "hold", "shift"].map(|key| inputs[input][key].as_str().unwrap().to_owned());
        assert_eq!(all("u"), ["u", "first", "-0.02 s"]);
        assert_eq!(all("w"), ["w", "first", "-0.01 s"]);
    }

    #[test]
    fn a_tuner_per_case_has_the_initial_guess_of_its_case() {
        let one = "c  = { start = 4e-4, min = 1e-4, max = 1e-3 }";
        let own = "c  = { start = 4e-4, min = 1e-4, max = 1e-3, per-case = true, starts = { swing = 6e-4 } }";
        let study = read(&STUDY.replace("swing.csv", "../data/swing.csv").replace(one, own)).study;
        let start = |name: &str| study.tuners().iter().find(|tuner| tuner.name == name).map(|tuner| tuner.start);
        assert_eq!((start("swing/c"), start("c")), (Some(6e-4), None));
    }

    #[test]
    fn a_phase_has_the_value_found_as_initial_guess_in_each_experiment() {
        let phase = StrengthValue {
            name: "phase".into(),
            value: 0.4,
            unit: "rad".into(),
            std_error: None,
            interval95: None,
            at_bound: false,
        };
        let catalogue = crate::testing::catalogue();
        let known = catalogue.effects.iter().flat_map(|effect| effect.parameters());
        let known = known.filter(|known| known.scope == Scope::Experiment).find(|known| known.name == "phase").unwrap();
        let own = [("swing".to_owned(), 0.4), ("push".to_owned(), -2.5)];
        let text = tuner(&phase, Some(known), &own);
        let text = text.parse::<toml::Value>().expect("TOML");
        assert_eq!((text["start"].as_float(), text["per-case"].as_bool()), (Some(0.4), Some(true)));
        assert_eq!((text["starts"]["swing"].as_float(), text["starts"]["push"].as_float()), (Some(0.4), Some(-2.5)));
        assert!(text["min"].as_float() <= Some(-2.5) && text["max"].as_float() >= Some(0.4), "{text}");
    }

    #[test]
    fn ranges_of_parameters_end_at_round_numbers_and_contain_the_value() {
        assert_eq!(range(0.0124, [0.0, f64::INFINITY]), [0.0, 0.2]);
        assert_eq!(range(-3.0, [f64::NEG_INFINITY, f64::INFINITY]), [-30.0, 30.0]);
        let rounded = range(0.03, [f64::NEG_INFINITY, f64::INFINITY]).map(number);
        assert_eq!(rounded, ["-0.3", "0.3"]);
        assert_eq!(range(0.5, [0.0, 1.0]), [0.0, 1.0]);
        assert_eq!(range(0.0, [0.0, f64::INFINITY]), [0.0, 1.0]);
    }
}
