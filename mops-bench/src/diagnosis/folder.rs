//! Folders of external cases: `case.json` with the equations of a plant, and its data files.

mod answer;
mod declared;
mod matching;

use std::path::{Path, PathBuf};

use mops::{Unit, language::files::Files};

use super::guarded::guarded;
use super::tool::{Answer, Tools};
use crate::parallel::each;
use answer::{answer, predictions};
use declared::Declared;
pub(crate) use declared::schema;

/// Folder of cases.
pub(crate) struct Cases {
    /// Folders of the cases, sorted by name.
    folders: Vec<PathBuf>,
}

/// Result of a case.
pub(crate) struct Reply {
    /// Name of the case.
    pub name: String,
    /// Diagnosed study, a self-contained file.
    pub study: String,
    /// Answer, or the reason why there is none.
    pub answer: Result<CaseAnswer, String>,
    /// Answer of brute force, if requested.
    pub brute: Option<Result<Answer, String>>,
}

/// Answer to a case.
pub(crate) struct CaseAnswer {
    /// Answer as JSON.
    pub json: String,
    /// Predicted outputs as CSV, by data file.
    pub predictions: Vec<(String, String)>,
    /// Answer for the table.
    pub summary: Answer,
    /// Errors by experiment, before and after.
    pub errors: Vec<(String, [f64; 2])>,
}

/// Data files of a case; only those declared by the case can be read.
struct Data<'a> {
    folder: &'a Path,
    declared: &'a Declared,
}

impl Files for Data<'_> {
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {
        let name = Path::new(path).file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let named = self.declared.files.iter().any(|file| file == name);
        if !named {
            return Err(std::io::ErrorKind::NotFound.into());
        }
        let bytes = std::fs::read(self.folder.join(name))?;
        let dropped = |unit: &str| self.declared.is_numeric() || Unit::parse(unit).is_err();
        Ok(String::from_utf8(bytes)
            .map_or_else(std::string::FromUtf8Error::into_bytes, |text| without_units(&text, dropped)))
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

impl Cases {
    /// Finds the cases in a folder: its subfolders with a `case.json`.
    ///
    /// # Errors
    /// If the folder cannot be read or has no case.
    pub fn find(folder: &Path) -> Result<Self, String> {
        let shown = folder.display();
        let entries = std::fs::read_dir(folder).map_err(|error| format!("cannot read {shown}: {error}"))?;
        let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        folders.retain(|path| path.join("case.json").is_file());
        folders.sort();
        if folders.is_empty() {
            return Err(format!("{shown} has no folders with a case.json"));
        }
        Ok(Self { folders })
    }

    /// Diagnoses all cases; `write` is called with every reply as soon as it is available.
    pub fn run(&self, tools: Tools<'_>, jobs: usize, against: bool, write: impl Fn(&Reply) + Sync) -> Vec<Reply> {
        each(&self.folders, jobs, tools.watch, |folder| {
            let reply = reply(folder, tools, against);
            write(&reply);
            Some(reply)
        })
    }
}

fn reply(folder: &Path, tools: Tools<'_>, against: bool) -> Reply {
    let name = folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let text = std::fs::read_to_string(folder.join("case.json")).map_err(|error| error.to_string());
    let declared = text.and_then(|text| Declared::read(&text));
    let study = declared.and_then(|declared| Ok((declared.study(&name, folder)?, declared)));
    let (study, declared) = match study {
        Ok(read) => read,
        Err(why) => return Reply { name, study: String::new(), answer: Err(why), brute: None },
    };
    let answer = guarded(|| diagnosed(&name, &study, &declared, folder, tools));
    let brute_force = || {
        let read = tools.study(&format!("{name}.toml"), &study, &Data { folder, declared: &declared })?;
        tools.brute_force(&read)
    };
    let brute = against.then(|| guarded(brute_force));
    Reply { name, study, answer, brute }
}

fn diagnosed(
    name: &str,
    text: &str,
    declared: &Declared,
    folder: &Path,
    tools: Tools<'_>,
) -> Result<CaseAnswer, String> {
    let study = tools.study(&format!("{name}.toml"), text, &Data { folder, declared })?;
    let times: Vec<(String, Vec<f64>)> = study.cases().iter().filter_map(times).collect();
    let (diagnosis, seconds) = tools.diagnose(&study)?;
    let after = |name: &str| diagnosis.after.iter().find(|e| e.name == name).map_or(f64::NAN, |e| e.normalised);
    Ok(CaseAnswer {
        json: answer(name, declared, &diagnosis, seconds, &tools.catalogue.effects),
        predictions: predictions(declared, &diagnosis, &times),
        errors: diagnosis.before.iter().map(|e| (e.name.clone(), [e.normalised, after(&e.name)])).collect(),
        summary: Answer::of(&diagnosis, seconds),
    })
}

/// Removes units from the header of a data file; its numbers are then used as they are.
fn without_units(text: &str, dropped: impl Fn(&str) -> bool) -> Vec<u8> {
    let (header, rows) = text.split_once('\n').unwrap_or((text, ""));
    let cells =
        header.split(',').map(|cell| match cell.trim().strip_suffix(']').and_then(|cell| cell.split_once('[')) {
            Some((name, unit)) if dropped(unit) => name,
            _ => cell,
        });
    format!("{}\n{rows}", cells.collect::<Vec<_>>().join(",")).into_bytes()
}

/// Returns the name and the sample times of an experiment.
fn times(case: &mops::Case) -> Option<(String, Vec<f64>)> {
    let channels = &case.experiment.as_ref()?.channels;
    let channel = channels.iter().max_by_key(|channel| channel.times.len())?;
    Some((case.name.clone(), channel.times.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cart that pulls a trailer, in partly unknown units, with a second output.
    const CASE: &str = r#"{ "case": "c", "states": [ { "name": "x", "unit": "m" }, { "name": "v", "unit": "m/s" } ],
        "inputs": [ { "name": "u", "unit": "knots" } ],
        "outputs": [ { "name": "x", "column": "x_m", "unit": "m", "equals_state": "x", "noise_std": 0.1, "noise_std_total": 0.2 },
                     { "name": "far", "column": "far_m", "unit": "m", "expression": "2*x", "noise_std_total": 0.2 } ],
        "equations": [ "m*v' = K*u - b*v", "x' = v" ],
        "parameters": [ { "name": "m", "unit": "kg", "guess": 2.0, "lower": 0.1, "upper": 10 },
                        { "name": "b", "unit": "N*s/m", "guess": 1, "lower": 0, "upper": 5 } ],
        "constants": { "K": 1.5 }, "locations": [ "process:x", "sensor:x", "actuator:u" ],
        "location_meaning": { "x": "equation of motion of the cart (1st equation)" },
        "files": [ "calibration.csv", "validation_1.csv" ] }"#;
    const DATA: &str = "t[s],u[knots],x_m[m],far_m[m]\n0,0,0,0\n0.1,1,0.1,0.2\n0.2,1,0.3,0.6\n0.3,0,0.4,0.8\n";

    #[test]
    fn a_case_becomes_a_valid_study_and_only_declared_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        for name in ["calibration.csv", "validation_1.csv", "truth.json"] {
            std::fs::write(folder.join(name), DATA).unwrap();
        }
        let declared = Declared::read(CASE).unwrap();
        let text = declared.study("c", folder).unwrap();
        let catalogue = mops::catalogue();
        let tools =
            Tools { catalogue: &catalogue, watch: &(), seed: 1, settings: &mops::diagnosis::Settings::default() };
        let data = Data { folder, declared: &declared };
        let study = tools.study("c.toml", &text, &data).unwrap_or_else(|why| panic!("{why}\n{text}"));
        let ports: Vec<String> = study.models()[0].1.interface().ports.iter().map(ToString::to_string).collect();
        assert!(ports.contains(&"joint:x".to_owned()) && ports.contains(&"sensor:far".to_owned()), "{ports:?}");
        let experiment = study.cases()[1].experiment.as_ref().unwrap();
        assert_eq!((experiment.role, experiment.channels[0].noise), (mops::core::Role::Selection, Some(0.2)));
        assert!(data.read("validation_1.csv").is_ok() && data.read("truth.json").is_err());
    }

    #[test]
    fn the_schema_in_the_repository_is_up_to_date() {
        assert_eq!(include_str!("../../case.schema.json"), schema());
    }

    #[test]
    fn a_case_of_another_format_is_refused() {
        let newer = CASE.replacen("\"states\"", "\"format\": 2, \"states\"", 1);
        assert!(Declared::read(&newer).unwrap_err().contains("expected format 1, found 2"));
    }

    #[test]
    fn the_input_hold_of_a_case_is_used_and_an_unknown_word_is_an_error() {
        let study = |hold: &str| {
            let case = CASE.replacen("\"states\"", &format!("\"input_hold\": \"{hold}\", \"states\""), 1);
            Declared::read(&case).unwrap().study("c", Path::new("folder"))
        };
        for (word, hold) in
            [("zoh (held)", "zero"), ("foh", "first"), ("piecewise linear", "first"), ("band-limited", "band-limited")]
        {
            assert!(study(word).unwrap().contains(&format!("hold = \"{hold}\"")), "{word}");
        }
        assert!(study("cubic").unwrap_err().contains("`cubic`"));
    }

    #[test]
    fn places_are_spelt_as_in_the_case() {
        let declared = Declared::read(CASE).unwrap();
        assert_eq!(answer::located("joint:x", &declared.locations), "process:x");
        assert_eq!(answer::located("sensor:x", &declared.locations), "sensor:x");
        assert_eq!(answer::located("sensor:far", &declared.locations), "sensor:far");
    }
}
