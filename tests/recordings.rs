//! Recordings as people have them: inputs that are forgotten, clocks of several devices, headers and encodings.

use std::fmt::Write as _;
use std::path::Path;

use assert_cmd::Command;
use mops_math as math;

fn mops(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::cargo_bin("mops").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    (output.status.code().unwrap(), text)
}

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

/// An oven whose heater is switched on at 20 s: C T' = P - G (T - 20 degC).
const OVEN: &str = r#"
[study]
name = "oven"
task = "calibration"
[models.oven.equations]
states     = { T = "degC" }
inputs     = { P = "W" }
parameters = { G = "W/K" }
constants  = { C = "50 J/K", Ta = "20 degC" }
start      = { T = "20 degC" }
der        = { T = "C*T' = P - G*(T - Ta)" }
[tuners]
G = { start = 1, min = 0.1, max = 20 }
[experiments.e]
file     = "oven.csv"
channels = { T = { column = "T", noise = 0.3 } }
INPUTS
[criteria]
T = { normalised-error = { signal = "T" }, demand = 1.0 }
"#;

/// Rows of time, power and temperature for G = 2 W/K.
fn rows(separator: &str) -> String {
    let mut text = String::new();
    for k in 0..60 {
        let t = f64::from(k);
        let (power, after) = if k < 20 { (0, 0.0) } else { (100, t - 20.0) };
        let temperature = 20.0 + 50.0 * (1.0 - math::exp(-after / 25.0));
        writeln!(text, "{t}{separator}{power}{separator}{temperature:.4}").unwrap();
    }
    text
}

fn oven(header: &str, inputs: &str) -> tempfile::TempDir {
    let data = format!("{header}\n{}", rows(","));
    folder(&[("study.toml", OVEN.replace("INPUTS", inputs).as_bytes()), ("oven.csv", data.as_bytes())])
}

#[test]
fn an_input_that_is_not_given_is_refused_with_the_columns_that_nothing_uses() {
    let study = oven("t [s],P [W],T [degC]", "");
    let (code, text) = mops(study.path(), &["check", "study.toml"]);
    assert_eq!(code, 2, "{text}");
    for part in ["the input `P` is not given", "`P [W]`", "`P = 0`", "study.toml:"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // Of windows and of several files, too.
    for more in ["windows = \"20 s\"", "skip = 1"] {
        let (code, text) = mops(oven("t [s],P [W],T [degC]", more).path(), &["check", "study.toml"]);
        assert!(code == 2 && text.contains("the input `P` is not given"), "{more}: {text}");
    }
}

#[test]
fn an_input_that_is_given_as_a_column_or_as_a_constant_is_accepted() {
    let estimate = |inputs: &str| {
        let study = oven("t [s],P [W],T [degC]", inputs);
        let (code, text) = mops(study.path(), &["run", "study.toml", "--out", "out", "--quiet"]);
        let bytes = std::fs::read(study.path().join("out/result.json")).unwrap_or_else(|_| panic!("{code}: {text}"));
        let result: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        result["tuners"][0]["value"].as_f64().unwrap()
    };
    assert!((estimate("inputs = { P = \"P\" }") - 2.0).abs() < 0.01);
    // A constant power of 100 W from the start on is another experiment.
    assert!((estimate("inputs = { P = 100 }") - 2.0).abs() > 0.1);
    assert_eq!(estimate("inputs = { P = 100 }"), estimate("inputs = { P = { constant = \"0.1 kW\" } }"));
    for (inputs, fact) in [
        ("{ P = { constant = 1, column = \"P\" } }", "`column` is for a recorded input"),
        ("{ P = { } }", "neither a column nor a constant"),
        ("{ P = { constant = \"1 K\" } }", "is in `K`"),
        ("{ P = nan }", "finite"),
    ] {
        let (code, text) =
            mops(oven("t [s],P [W],T [degC]", &format!("inputs = {inputs}")).path(), &["check", "study.toml"]);
        assert!(code == 2 && text.contains(fact), "{inputs}: {text}");
    }
}

#[test]
fn an_offset_with_a_unit_needs_a_column_with_one() {
    let study = oven("t [s],P,T [degC]", "inputs = { P = { column = \"P\", offset = \"1 kW\" } }");
    let (code, text) = mops(study.path(), &["check", "study.toml"]);
    assert!(code == 2 && text.contains("the column `P` has no unit"), "{text}");
    let study = oven("t [s],P,T [degC]", "inputs = { P = { column = \"P\", unit = \"W\", offset = \"1 kW\" } }");
    assert_eq!(mops(study.path(), &["check", "study.toml"]).0, 0);
}

#[test]
fn an_input_without_a_column_for_it_stays_at_zero() {
    let data: String = (0..30).map(|k| format!("{k},20\n")).collect();
    let study = OVEN.replace("INPUTS", "");
    let study = folder(&[("study.toml", study.as_bytes()), ("oven.csv", format!("t [s],T [degC]\n{data}").as_bytes())]);
    let (code, text) = mops(study.path(), &["check", "study.toml"]);
    assert_eq!(code, 0, "{text}");
}

const TWO_CLOCKS: &str = r#"
[study]
name = "house"
task = "calibration"
[models.p.equations]
states     = { y = "1" }
inputs     = { u = "1" }
parameters = { tau = "h" }
der        = { y = "tau*y' = u - y" }
[tuners]
tau = { start = "3 h", min = "0.5 h", max = "50 h" }
[experiments.a]
file     = "drive.csv"
channels = { y = { column = "y", file = "sensor.csv", noise = 0.01 } }
inputs   = { u = "u" }
[criteria]
e = { normalised-error = { signal = "y" } }
"#;

#[test]
fn stamps_with_and_without_a_zone_are_never_on_one_clock() {
    let stamps = |date: &str, zone: &str, name: &str, hour: u32| {
        let rows: String = (0..8).map(|k| format!("{date}{:02}:00:00{zone},0.{k}\n", hour + k)).collect();
        format!("time,{name}\n{rows}")
    };
    let check = |drive: &str, sensor: &str| {
        let files: [(&str, &[u8]); 3] =
            [("study.toml", TWO_CLOCKS.as_bytes()), ("drive.csv", drive.as_bytes()), ("sensor.csv", sensor.as_bytes())];
        mops(folder(&files).path(), &["check", "study.toml"])
    };
    let [zoned, local, none] = [("2024-06-01T", "Z"), ("2024-06-01T", ""), ("", "")];
    let of = |(date, zone): (&str, &str), name: &str, hour: u32| stamps(date, zone, name, hour);
    for (drive, sensor, fact) in [
        (zoned, local, "only the time stamps of the file of the experiment have a zone"),
        (local, zoned, "only the time stamps of this file have a zone"),
        (zoned, none, "only the time stamps of the file of the experiment have dates"),
        (none, local, "only the time stamps of this file have dates"),
    ] {
        let (code, text) = check(&of(drive, "u", 0), &of(sensor, "y", 1));
        assert!(code == 2 && text.contains(fact) && text.contains("no common clock"), "{text}");
    }
    for same in [zoned, local, none] {
        let (code, text) = check(&of(same, "u", 0), &of(same, "y", 1));
        assert_eq!(code, 0, "{text}");
    }
    let (code, text) = check(&of(zoned, "u", 0), &stamps("2024-06-01T", "+02:00", "y", 3));
    assert_eq!(code, 0, "{text}");
    // One hour each, two hours apart.
    let (code, text) = check(&of(zoned, "u", 0), &of(zoned, "y", 12));
    assert!(code == 2 && text.contains("begins 18000 s after the experiment ends"), "{text}");
}

#[test]
fn a_study_is_made_from_headers_and_encodings_as_people_have_them() {
    let latin = |text: String| text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect::<Vec<u8>>();
    let german = format!("Zeit / s;Heizleistung / W;Ofentemperatur / \u{b0}C\n{}", rows(";").replace('.', ","));
    let utf16: Vec<u8> = german.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let english = format!("time_s,P_heater_W,T_oven_degC\n{}", rows(","));
    let preamble = format!("Oven controller 3\nserial number,0815,x\n{english}");
    for (name, bytes, time) in [
        ("english", english.into_bytes(), "time_s"),
        ("german", german.clone().into_bytes(), "Zeit"),
        ("latin", latin(german), "Zeit"),
        ("utf16", utf16, "Zeit"),
        ("preamble", preamble.into_bytes(), "time_s"),
    ] {
        let place = folder(&[("oven.csv", &bytes)]);
        let (code, text) = mops(place.path(), &["data", "oven.csv"]);
        assert!(code == 0 && text.contains(&format!("`{time}` (s) from 0 to 59")), "{name}: {text}");
        let message = [("latin", "Latin-1"), ("utf16", "UTF-16"), ("preamble", "2 lines before the header skipped")];
        for (_, message) in message.iter().filter(|(of, _)| *of == name) {
            assert!(text.contains(message), "{name}: {text}");
        }
        let (code, text) = mops(place.path(), &["new", "study", "--from-data", "oven.csv"]);
        assert_eq!(code, 0, "{name}: {text}");
        let study = std::fs::read_to_string(place.path().join("study/study.toml")).unwrap();
        assert!(study.contains("= \"degC\"") || study.contains("= \"\u{b0}C\""), "{name}: {study}");
        let (code, text) = mops(&place.path().join("study"), &["check", "study.toml"]);
        assert_eq!(code, 0, "{name}: {text}");
        for (_, message) in message.iter().filter(|(of, _)| *of == name) {
            assert!(text.contains(message), "{name}: {text}");
        }
    }
}

#[test]
fn the_time_column_of_a_new_study_can_be_named() {
    let data = format!("stage,P [W],T [degC]\n{}", rows(","));
    let place = folder(&[("oven.csv", data.as_bytes())]);
    let (code, text) = mops(place.path(), &["new", "study", "--from-data", "oven.csv"]);
    assert!(code == 2 && text.contains("--time") && text.contains("stage"), "{text}");
    let (code, text) = mops(place.path(), &["new", "study", "--from-data", "oven.csv", "--time", "stage"]);
    assert_eq!(code, 0, "{text}");
    let (code, text) = mops(&place.path().join("study"), &["check", "study.toml"]);
    assert_eq!(code, 0, "{text}");
    let (code, text) = mops(place.path(), &["data", "oven.csv", "--time", "stage"]);
    assert!(code == 0 && text.contains("`stage` (s) from 0 to 59"), "{text}");
}

#[test]
fn a_time_column_that_cannot_be_read_is_not_called_missing() {
    let rows: String = (0..3).map(|k| format!("05/01/2024 11:5{k}:00 AM,{k},20\n")).collect();
    let study = OVEN.replace("INPUTS", "inputs = { P = \"P\" }");
    let place =
        folder(&[("study.toml", study.as_bytes()), ("oven.csv", format!("time,P [W],T [degC]\n{rows}").as_bytes())]);
    for arguments in [&["check", "study.toml"][..], &["new", "study", "--from-data", "oven.csv"]] {
        let (code, text) = mops(place.path(), arguments);
        assert!(code == 2 && text.contains("may be day/month or month/day; write them as year-month-day"), "{text}");
    }
}

#[test]
fn gaps_in_a_record_are_reported_once_for_all_signals() {
    let study = OVEN.replace("INPUTS", "inputs = { P = \"P\" }");
    let check = |keep: fn(usize) -> bool| {
        let kept: Vec<String> =
            rows(",").lines().enumerate().filter(|(k, _)| keep(*k)).map(|(_, row)| row.to_owned()).collect();
        let data = format!("t [s],P [W],T [degC]\n{}\n", kept.join("\n"));
        let (code, text) = mops(
            folder(&[("study.toml", study.as_bytes()), ("oven.csv", data.as_bytes())]).path(),
            &["check", "study.toml"],
        );
        assert_eq!(code, 0, "{text}");
        text
    };
    let one = check(|k| !(30..36).contains(&k));
    assert!(one.contains("`T` in `e` has a gap of 7 s at 29 s: inputs are continued across it"), "{one}");
    let two = check(|k| !(30..36).contains(&k) && !(40..50).contains(&k));
    assert!(two.contains("a gap of 11 s at 39 s, the longer of 2"), "{two}");
    assert!(!check(|k| k != 30 && k != 40).contains("gap"));
    assert!(!check(|_| true).contains("gap"));
}
