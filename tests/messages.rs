//! Error messages on studies, data and the command line: position, fact and fix.
//!
//! Each case makes one error in a valid study. `tests/snapshots` has a page of messages per subject.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;

/// Valid design.
const DESIGN: &str = r#"[study]
name = "loop"

[models.loop.pid-loop]
plant   = { poles = ["p", -4.0, -1.0], gain = 1.0 }
horizon = "60 s"

[tuners]
k  = { start = 4.0, min = 0.1,  max = 50.0, scale = "log" }
Ti = { start = 2.0, min = 0.2,  max = 20.0, unit = "s" }
Td = { start = 1.0, min = 0.01, max = 10.0, unit = "s" }

[cases]
nominal = { p = 0.0 }

[criteria]
overshoot = { overshoot     = { signal = "y", target = 1.0 },              demand = 0.10 }
settling  = { settling-time = { signal = "y", target = 1.0, band = 0.01 }, demand = "15 s" }
"#;

/// Valid calibration.
const CALIBRATION: &str = r#"[study]
name = "swing"
task = "calibration"

[models.rig.furuta]
[models.rig.parameters]
a = 9e-4
b = 2e-3
c = 4e-4

[tuners]
d = { start = 2e-2, min = 5e-3, max = 1e-1, scale = "log" }

[experiments.swing]
file     = "swing.csv"
channels = { phi = "arm", theta = { column = "pendulum", noise = 0.003 } }
inputs   = { u = "torque" }
free     = ["theta"]

[criteria]
theta = { fit = { signal = "theta" }, demand = 1e-3 }
"#;

/// Recording of the calibration.
const RECORDING: &str = "\
t[s],arm[rad],pendulum[rad],torque[N*m]
0.00,0.000,3.00,0.0
0.05,0.001,2.99,0.1
0.10,0.003,2.96,0.1
0.15,0.006,2.91,0.0
";

/// A list of recordings that are not included.
const SOURCES: &str = "\
# Recordings of others.
[\"swings.csv\"]
source = \"cell 1 of Y in swings.mat\"
sha256 = \"06d8\"
";

/// One error: the files of the working directory, and the command line.
struct Case {
    what: &'static str,
    files: BTreeMap<String, Vec<u8>>,
    arguments: Vec<&'static str>,
}

impl Case {
    fn new(what: &'static str, study: &str) -> Self {
        let files = BTreeMap::from([("study.toml".to_owned(), study.as_bytes().to_vec())]);
        let arguments = vec!["run", "study.toml", "--out", "out", "--max-evaluations", "1"];
        Self { what, files, arguments }
    }

    fn with(mut self, file: &str, content: impl AsRef<[u8]>) -> Self {
        self.files.insert(file.to_owned(), content.as_ref().to_vec());
        self
    }

    fn called(self, arguments: &[&'static str]) -> Self {
        Self { arguments: arguments.to_vec(), ..self }
    }

    /// Returns the message of `mops`, which exits with status 2, prints no result and writes no file.
    fn message(&self) -> String {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in &self.files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        let output = cargo_bin_cmd!("mops").args(&self.arguments).current_dir(folder.path()).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{}: {message}", self.what);
        assert_eq!(String::from_utf8_lossy(&output.stdout), "", "{}", self.what);
        assert_eq!(files_below(folder.path()), self.files, "{}", self.what);
        message
    }
}

/// Returns all files below the folder, by relative path.
fn files_below(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            files.extend(files_below(&path).into_iter().map(|(below, content)| (format!("{name}/{below}"), content)));
        } else {
            files.insert(name, fs::read(path).unwrap());
        }
    }
    files
}

/// Replaces `right`, which occurs once in `text`, by `instead`.
fn broken(text: &str, right: &str, instead: &str) -> String {
    assert_eq!(text.matches(right).count(), 1, "`{right}` must occur once in\n{text}");
    text.replace(right, instead)
}

/// Design with an error.
fn design(what: &'static str, right: &str, instead: &str) -> Case {
    Case::new(what, &broken(DESIGN, right, instead))
}

/// Calibration with an error in its study.
fn calibration(what: &'static str, right: &str, instead: &str) -> Case {
    Case::new(what, &broken(CALIBRATION, right, instead)).with("swing.csv", RECORDING)
}

/// Calibration with an error in its recording.
fn recording(what: &'static str, right: &str, instead: &str) -> Case {
    Case::new(what, CALIBRATION).with("swing.csv", broken(RECORDING, right, instead))
}

/// Calibration with another data file.
fn data_file(what: &'static str, file: &str, content: impl AsRef<[u8]>) -> Case {
    Case::new(what, &broken(CALIBRATION, "swing.csv", file)).with(file, content)
}

/// Valid design with an error on the command line.
fn called(what: &'static str, arguments: &[&'static str]) -> Case {
    Case::new(what, DESIGN).called(arguments)
}

/// MATLAB file of level 4 with the column vector `t = [0; 1]`.
fn matlab_level_4() -> Vec<u8> {
    let header = [0_u32, 2, 1, 0, 2].map(u32::to_le_bytes).concat();
    [&header, b"t\0".as_slice(), &0.0_f64.to_le_bytes(), &1.0_f64.to_le_bytes()].concat()
}

/// MATLAB file of level 5 that ends within a matrix of 1000 bytes.
fn matlab_level_5_cut_off() -> Vec<u8> {
    let header = format!("{:<124}\0\u{1}IM", "MATLAB 5.0 MAT-file, Platform: GLNXA64");
    [header.as_bytes(), &14_u32.to_le_bytes(), &1000_u32.to_le_bytes(), &[0; 16]].concat()
}

/// First bytes of a MATLAB file of level 7.3.
fn matlab_level_7_3() -> Vec<u8> {
    [format!("{:<512}", "MATLAB 7.3 MAT-file, Platform: GLNXA64").as_bytes(), b"\x89HDF\r\n\x1a\n"].concat()
}

/// Internal terms of the parsers, which must not occur in messages.
const JARGON: [&str; 12] = [
    "invalid type",
    "wrong type",
    "a sequence",
    "a map",
    "variant",
    "missing field",
    "f64",
    "usize",
    "wanted",
    "Some(",
    "os error",
    "panicked",
];

/// Compares the messages of all cases, on one page, with the snapshot.
fn check(subject: &str, cases: &[Case]) {
    let mut page = String::new();
    for case in cases {
        let message = case.message();
        for word in JARGON {
            assert!(!message.contains(word), "{}: `{word}` in\n{message}", case.what);
        }
        page += &format!("== {}\n$ mops {}\n{message}\n", case.what, case.arguments.join(" "));
    }
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(subject, page);
    });
}

#[test]
fn invalid_toml() {
    check(
        "toml",
        &[
            design("an equals sign is missing", "name = \"loop\"", "name \"loop\""),
            design("a text without quotes", "scale = \"log\"", "scale = log"),
            design("a text is not closed", "name = \"loop\"", "name = \"loop"),
            design("a table is not closed", "{ p = 0.0 }", "{ p = 0.0"),
            design("a key twice", "max = 20.0", "min = 20.0"),
            design("a quantity without quotes", "\"60 s\"", "60 s"),
            design("a value is missing", "start = 4.0", "start = "),
            design("a comma is missing", "start = 4.0, ", "start = 4.0 "),
            design("a bracket too many", "{ p = 0.0 }", "{ p = 0.0 } }"),
            design("a decimal comma", "demand = 0.10", "demand = 0,10"),
            Case::new("a study that is not UTF-8", "").with("study.toml", b"[study]\nname = \"R\xfcckf\xfchrung\"\n"),
            Case::new("an empty study", ""),
        ],
    );
}

#[test]
fn unknown_and_missing_keys() {
    check(
        "keys",
        &[
            design("no [study]", "[study]\nname = \"loop\"\n", ""),
            design("a study without a name", "name = \"loop\"", ""),
            design("no criteria", &DESIGN[DESIGN.find("[criteria]").unwrap()..], ""),
            design("an empty table of criteria", &DESIGN[DESIGN.find("overshoot =").unwrap()..], ""),
            Case::new("no model", &DESIGN[..DESIGN.find("[models").unwrap()]),
            design("an unknown table", "[cases]", "[case]"),
            design("an unknown key of the study", "name = \"loop\"", "name = \"loop\"\nsed = 7"),
            design("an unknown key of a tuner", "max = 20.0, unit", "max = 20.0, units"),
            design("an unknown option of a criterion", "band = 0.01", "bnd = 0.01"),
            design("an unknown option deep in a model", "gain = 1.0", "gains = 1.0"),
            design("an unknown key beside a criterion's kind", "demand = 0.10", "demnd = 0.10"),
            calibration("an unknown key of a channel", "noise = 0.003", "sigma = 0.003"),
            design("a misspelt kind of model", "[models.loop.pid-loop]", "[models.loop.pid]"),
            design("a misspelt kind of criterion", "{ overshoot     =", "{ overshot      ="),
            design("a misspelt kind of solver", "[cases]", "[solver.sqpp]\n[cases]"),
            design("a model without a kind", "[models.loop.pid-loop]\nplant", "[models.loop.parameters]\nk"),
            design("a criterion without a kind", "overshoot     = { signal = \"y\", target = 1.0 },", ""),
            design("a criterion of two kinds", "{ overshoot     =", "{ peak = { signal = \"u\" }, overshoot ="),
            design("a criterion without a signal", "signal = \"y\", target = 1.0 },", "target = 1.0 },"),
            design("a model without a horizon", "horizon = \"60 s\"", ""),
            calibration("an experiment without a file", "file     = \"swing.csv\"", ""),
            calibration("a channel without a column", "column = \"pendulum\", ", ""),
        ],
    );
}

#[test]
fn values_of_the_wrong_type() {
    check(
        "types",
        &[
            design("a text for a number", "name = \"loop\"", "name = \"loop\"\nseed = \"seven\""),
            design("a number for a text", "name = \"loop\"", "name = 7"),
            design("a number for a table", "{ p = 0.0 }", "0.0"),
            design("a number for a tuner", "{ start = 1.0, min = 0.01, max = 10.0, unit = \"s\" }", "1.0"),
            design("a text for a table", "{ signal = \"y\", target = 1.0 },", "\"y\","),
            design("a list for a number", "demand = 0.10", "demand = [0.10]"),
            design("a list for a quantity of a tuner", "max = 20.0", "max = [20.0, 30.0]"),
            design("a number for a list", "[\"p\", -4.0, -1.0]", "-4.0"),
            design("a list of the wrong things", "[\"p\", -4.0, -1.0]", "[\"p\", true, -1.0]"),
            design("a list that is too short", "horizon =", "limit = [1.0]\nhorizon ="),
            design("a word for yes or no", "unit = \"s\" }\nTd", "active = \"no\" }\nTd"),
            design("a fraction for a whole number", "name = \"loop\"", "name = \"loop\"\nseed = 1.5"),
            design("a whole number beyond all bounds", "max = 20.0", "max = 100000000000000000000"),
            design("a negative number of steps", "horizon =", "tolerance = { max-steps = -1 }\nhorizon ="),
            design(
                "a solver's option below its range",
                "[cases]",
                "[solver.pattern-search]\ntolerance = -1.0\n[cases]",
            ),
            design(
                "a solver's option above its range",
                "[cases]",
                "[solver.genetic]\npopulation = 10_000_000\n[cases]",
            ),
            design("a solver's option that is no number", "[cases]", "[solver.cma-es]\nsize = nan\n[cases]"),
            design("a word that is no usage", "demand = 0.10", "demand = 0.10, usage = \"minimize\""),
            design("a word that is no scale", "scale = \"log\"", "scale = \"cubic\""),
            calibration("a word that is no role", "free     =", "role     = \"training\"\nfree     ="),
            calibration("a word that is no task", "\"calibration\"", "\"identification\""),
            design("a word for a quantity", "demand = 0.10", "demand = \"small\""),
            design("an unknown unit in a quantity", "\"15 s\"", "\"15 sec\""),
            design("an unknown unit of a tuner", "max = 20.0, unit = \"s\"", "max = 20.0, unit = \"seconds\""),
            design("an input that is a truth value", "{ p = 0.0 }", "{ p = 0.0, inputs = { d = true } }"),
            design(
                "an input that moves in no known way",
                "{ p = 0.0 }",
                "{ p = 0.0, inputs = { d = { ramp = 1.0 } } }",
            ),
            design("an input that does not move", "{ p = 0.0 }", "{ p = 0.0, inputs = { d = {} } }"),
            design(
                "an input that moves in two ways",
                "{ p = 0.0 }",
                "{ p = 0.0, inputs = { d = { constant = 1.0, step = { after = 1.0 } } } }",
            ),
            design("a step without a value", "{ p = 0.0 }", "{ p = 0.0, inputs = { d = { step = { time = 1.0 } } } }"),
            calibration("free states that are a text", "[\"theta\"]", "\"theta\""),
            calibration("a column that is neither a name nor a number", "\"torque\"", "true"),
            design("a date for a name", "name = \"loop\"", "name = 2026-01-01"),
        ],
    );
}

#[test]
fn unknown_names() {
    check(
        "names",
        &[
            design("an unknown signal", "signal = \"y\", target = 1.0 },", "signal = \"Y1\", target = 1.0 },"),
            design("a tuner that no model knows", "Ti = {", "Tn = {"),
            design("a tuner that no model knows, and nothing else of it", "Ti = {", "Tn = { start = 1.0 }\nTi = {"),
            design("a parameter that no model knows", "{ p = 0.0 }", "{ p = 0.0, q = 1.0 }"),
            design("a model's value for no parameter", "[tuners]", "[models.loop.parameters]\nTf = 1.0\n[tuners]"),
            calibration("an experiment's value for no parameter", "free     =", "parameters = { e = 1.0 }\nfree     ="),
            design("a criterion of an unknown model", "demand = 0.10", "demand = 0.10, model = \"lopp\""),
            design(
                "a criterion in an unknown case",
                "demand = 0.10",
                "demand = 0.10, cases = [\"nominal\", \"worst\"]",
            ),
            design(
                "two models and a criterion that names none",
                "[tuners]",
                "[models.other.pid-loop]\nplant = { poles = [-1.0] }\nhorizon = 9\n[tuners]",
            ),
            design("a parameter without a value", "{ p = 0.0 }", "{}"),
            design("an input that no model has", "{ p = 0.0 }", "{ p = 0.0, inputs = { w = { constant = 1.0 } } }"),
            driven_without_inputs(),
            calibration("a recorded input that no model has", "inputs   = { u =", "inputs   = { tau ="),
            calibration("a channel for no signal", "channels = { phi =", "channels = { phy ="),
            calibration("a free state that no model has", "[\"theta\"]", "[\"theta\", \"omega\"]"),
            calibration("a case and an experiment of one name", "[criteria]", "[cases]\nswing = {}\n[criteria]"),
            calibration("a fit to what nothing measures", "signal = \"theta\"", "signal = \"dphi\""),
            calibration(
                "a fit in a case without a measurement",
                "[criteria]\ntheta = { ",
                "[cases]\nrest = { horizon = 1 }\n[criteria]\ntheta = { cases = [\"rest\"], ",
            ),
        ],
    );
}

#[test]
fn invalid_tuners() {
    check(
        "tuners",
        &[
            design("a start value outside the bounds", "start = 2.0", "start = 25.0"),
            design("no start value", "start = 2.0, ", ""),
            design("no bounds", "min = 0.2,  max = 20.0, ", ""),
            design("no upper bound", "max = 20.0, ", ""),
            design("bounds the wrong way round", "min = 0.2,  max = 20.0", "min = 20.0, max = 0.2"),
            design("bounds that are equal", "min = 0.2,  max = 20.0", "min = 2.0,  max = 2.0"),
            design("a bound that is not a number", "max = 20.0", "max = nan"),
            design("a range wider than numbers reach", "min = 0.1,  max = 50.0", "min = 1e-300, max = 1e300"),
            design("a logarithmic range from zero", "min = 0.1, ", "min = 0.0, "),
            design("a bound without meaning for the parameter", "min = 0.2", "min = 0.0"),
            design("a bound in a unit that does not fit", "max = 20.0", "max = \"20 m\""),
            design("a unit that does not fit the parameter", "max = 20.0, unit = \"s\"", "max = 20.0, unit = \"m\""),
            design("a list of one value", "min = 0.2,  max = 20.0", "values = [2.0]"),
            design("a start value that is not in the list", "min = 0.2,  max = 20.0", "values = [1.0, 3.0]"),
            design(
                "a fraction as a bound of whole numbers",
                "min = 0.2,  max = 20.0",
                "min = 1.0, max = 20.5, integer = true",
            ),
            design("starts of cases of one value for all", "max = 20.0, ", "max = 20.0, starts = { nominal = 3.0 }, "),
            design("a start in no case", "max = 20.0, ", "max = 20.0, per-case = true, starts = { nominl = 3.0 }, "),
            design(
                "a start in a case outside the bounds",
                "max = 20.0, ",
                "max = 20.0, per-case = true, starts = { nominal = \"30 s\" }, ",
            ),
            design(
                "a start in a case that is not in the list",
                "min = 0.2,  max = 20.0, ",
                "values = [1.0, 2.0], per-case = true, starts = { nominal = 1.5 }, ",
            ),
            design("a tie beside a start value", "min = 0.01, max = 10.0, unit", "tie = \"Ti/4\", unit"),
            design("a tie to no tuner", "Td = { start = 1.0, min = 0.01, max = 10.0,", "Td = { tie = \"Tj/4\","),
            design("a tie to a later tuner", "Ti = { start = 2.0, min = 0.2,  max = 20.0,", "Ti = { tie = \"4*Td\","),
            design("a tie to itself", "Td = { start = 1.0, min = 0.01, max = 10.0,", "Td = { tie = \"Td/4\","),
            design(
                "a tie that is no expression",
                "Td = { start = 1.0, min = 0.01, max = 10.0,",
                "Td = { tie = \"Ti 4\",",
            ),
            design("a tie that ends early", "Td = { start = 1.0, min = 0.01, max = 10.0,", "Td = { tie = \"Ti/\","),
            design("a value of a case without meaning", "{ p = 0.0 }", "{ p = 0.0, Ti = -1.0 }"),
            calibration("a value of a model without meaning", "b = 2e-3", "b = -2e-3"),
            calibration("a value of a model in a unit that does not fit", "b = 2e-3", "b = \"2e-3 kg\""),
        ],
    );
}

#[test]
fn invalid_demands() {
    check(
        "demands",
        &[
            design("a demand of zero", "demand = 0.10", "demand = 0.0"),
            design("a negative demand", "demand = 0.10", "demand = -0.10"),
            design("no demand", ", band = 0.01 }, demand = \"15 s\"", " }"),
            design("good without bad", "demand = 0.10", "good = 0.10"),
            design("bad without good", "demand = 0.10", "bad = 0.10"),
            design("good and bad alike", "demand = 0.10", "good = 0.10, bad = 0.10"),
            design("a demand beside good and bad", "demand = 0.10", "demand = 0.1, good = 0.0, bad = 0.1"),
            design("good and bad against the sense of the kind", "demand = 0.10", "good = 0.3, bad = \"10 %\""),
            design("a value that the kind never has", "demand = 0.10", "good = -0.1, bad = 0.1"),
            design("a demand in a unit that does not fit", "\"15 s\"", "\"15 m\""),
            design("a weight of zero", "demand = 0.10", "demand = 0.10, weight = 0.0"),
            design("an option in a unit that does not fit", "target = 1.0 }, ", "target = \"1 rad/s\" }, "),
            design("a band of zero", "band = 0.01", "band = 0.0"),
        ],
    );
}

/// Valid model of equations.
const EQUATIONS: &str = r#"[study]
name = "rig"

[models.rig.equations]
states     = { th = "rad", w = "rad/s", T = "J" }
inputs     = { u = "N m" }
parameters = { J = "kg m2", b = "N m s/rad" }
constants  = { g = "9.81 m/s2" }
let        = { load = "2*sin(th)*1 [N m]", heat = "b*w^2" }
der        = { th = "w", w = "J*w' = u - load - b*w", T = "heat - T/1 [s]" }
start      = { T = "20 J" }
friction.w = { coulomb = 0.1 }
when.hit   = { guard = "1 - th", reset = { w = "-w" } }
horizon    = "3 s"

[tuners]
J = { start = 1.0, min = 0.1, max = 5.0 }
b = { start = 0.1, min = 0.0, max = 1.0 }

[criteria]
highest = { peak = { signal = "th" }, demand = 1.0 }
"#;

/// The model from text without inputs, driven by one that it does not have.
fn driven_without_inputs() -> Case {
    let still = broken(&broken(EQUATIONS, "inputs     = { u = \"N m\" }\n", ""), "u - load", "-load");
    let driven = broken(&still, "[criteria]", "[cases]\npushed = { inputs = { u = { constant = 1.0 } } }\n[criteria]");
    Case::new("an input of a model without inputs", &driven)
}

/// Model of equations with an error.
fn equations(what: &'static str, right: &str, instead: &str) -> Case {
    Case::new(what, &broken(EQUATIONS, right, instead))
}

#[test]
fn invalid_equations() {
    check(
        "equations",
        &[
            equations("a name that is not there", "u - load", "u - laod"),
            equations("a bracket that does not close", "2*sin(th)", "2*sin(th"),
            equations("a bracket of the wrong kind", "2*sin(th)", "2*sin(th]"),
            equations("a function that is not there", "2*sin(th)", "2*sinus(th)"),
            equations("a function with too few values", "2*sin(th)", "clip(th, 1)"),
            equations("a condition as a number", "2*sin(th)", "2*(th > 1)"),
            equations("a number as a condition", "2*sin(th)", "if(th, 1, 2)"),
            equations("an unknown unit", "kg m2", "kg mm2x"),
            equations("a start value in another unit", "20 J", "20 V"),
            equations("definitions in a circle", "2*sin(th)", "heat + load"),
            equations("a state without derivative", ", T = \"heat - T/1 [s]\"", ""),
            equations("a derivative of something else", "T = \"heat - T/1 [s]\"", "T = \"heat - T/1 [s]\", u = \"1\""),
            equations("the derivative of a parameter", "J*w' =", "b*J' ="),
            equations("an equation that is not linear in the derivatives", "J*w' =", "w'^2 ="),
            equations("an equation without a derivative", "J*w' =", "J ="),
            equations("equations that leave a derivative open", "T = \"heat - T/1 [s]\"", "T = \"w' = T\""),
            equations("an equation where none belongs", "2*sin(th)", "x = 2*sin(th)"),
            equations("a name given twice", "b = \"N m s/rad\"", "b = \"N m s/rad\", u = \"1\""),
            equations("a name with a meaning of its own", "b = \"N m s/rad\"", "b = \"N m s/rad\", time = \"s\""),
            equations("a name that is no name", "g = \"9.81", "g-n = \"9.81"),
            equations("a start value that changes", "20 J", "2*th"),
            equations("friction of something else", "friction.w", "friction.T"),
            equations("an event that resets no state", "w = \"-w\"", "v = \"-w\""),
            equations("a mass matrix with one name", "start      =", "mass = { w = 1 }\nstart      ="),
            equations("a family without ends", "T = \"J\"", "\"T[1..3]\" = \"J\""),
            equations("a bracket in a key", "T = \"J\"", "\"T[1..\" = \"J\""),
            equations("a number that is no expression", "2*sin(th)", "2 sin(th)"),
        ],
    );
}

#[test]
fn invalid_models() {
    check(
        "models",
        &[
            design("a plant that is not strictly proper", "gain = 1.0", "zeros = [-1.0, -2.0, -3.0]"),
            design("a plant given in neither way", "poles = [\"p\", -4.0, -1.0], gain", "gain"),
            design("a plant given in half a way", "poles = [\"p\", -4.0, -1.0], gain = 1.0", "numerator = [1.0]"),
            design("a plant's parameter called as the controller's", "\"p\", -4.0", "\"Ti\", -4.0"),
            design("a negative horizon", "\"60 s\"", "\"-60 s\""),
            design("a horizon of zero in a case", "{ p = 0.0 }", "{ p = 0.0, horizon = 0 }"),
            design("a horizon that is no time", "\"60 s\"", "\"60 m\""),
            design("a tolerance out of range", "horizon =", "tolerance = { relative = 2.0 }\nhorizon ="),
            design("limits the wrong way round", "horizon =", "limit = [1.0, -1.0]\nhorizon ="),
            Case::new("a model that never ends", &broken(CALIBRATION, "furuta]", "furuta]\nhorizon = -5"))
                .with("swing.csv", RECORDING),
            calibration(
                "a case without a horizon",
                "[criteria]",
                "[cases.rest]\n[criteria]\nhighest = { peak = { signal = \"phi\" }, cases = [\"rest\"], demand = 1.0 }",
            ),
            design("a run of no evaluation", "[cases]", "[solver]\nmax-evaluations = 0\n[cases]"),
        ],
    );
}

#[test]
fn experiments_that_contradict_their_data() {
    check(
        "experiments",
        &[
            calibration("a file that is not there", "swing.csv", "swings.csv"),
            calibration("a file that is listed in sources.toml", "swing.csv", "swings.csv")
                .with("sources.toml", SOURCES),
            calibration("a file that is not there beside a broken sources.toml", "swing.csv", "swings.csv")
                .with("sources.toml", broken(SOURCES, "\"06d8\"", "06d8")),
            calibration("a file that is a folder", "swing.csv", "data").with("data/swing.csv", RECORDING),
            calibration("a column that is not there", "\"pendulum\"", "\"pendulm\""),
            calibration("a time column that is not there", "free     =", "time = \"clock\"\nfree     ="),
            calibration("a time column in a unit that is no time", "free     =", "time-unit = \"rad\"\nfree     ="),
            calibration("a time in a unit that is no time", "free     =", "from = \"2 m\"\nfree     ="),
            calibration("a start after the end of the file", "free     =", "from = \"2 s\"\nfree     ="),
            calibration("an end that leaves one sample", "free     =", "to = 0.01\nfree     ="),
            calibration("every sample skipped", "free     =", "skip = 4\nfree     ="),
            calibration("an experiment that measures nothing", "channels = {", "channels = {}\n# {"),
            calibration(
                "an input that is not known when the simulation begins",
                "free     =",
                "skip = 1\nreset-time = false\nfree     =",
            ),
            calibration("a noise of zero", "noise = 0.003", "noise = 0.0"),
            calibration(
                "an error in units of a noise that nobody gave",
                "fit = { signal = \"theta\" }",
                "normalised-error = { signal = \"phi\" }",
            ),
            calibration("a noise in a unit that does not fit", "noise = 0.003", "noise = \"3 mm\""),
            calibration(
                "a sensor that no experiment has",
                "[criteria]",
                "[sensors]\nthetta = { noise = 0.003 }\n\n[criteria]",
            ),
            calibration("a sensor without noise", "[criteria]", "[sensors]\nphi = { noise = \"0 rad\" }\n\n[criteria]"),
            calibration("a unit that does not fit the signal", "noise = 0.003", "unit = \"N m\""),
            calibration("a column of another kind than its signal", "phi = \"arm\"", "phi = \"torque\""),
            calibration("a column of another kind than its input", "u = \"torque\"", "u = \"arm\""),
            calibration(
                "a free state of which nothing is measured",
                ", theta = { column = \"pendulum\", noise = 0.003 }",
                "",
            ),
            calibration(
                "a free start value outside its bounds",
                "[\"theta\"]",
                "{ theta = { start = 3.0, min = 4.0, max = 5.0 } }",
            ),
        ],
    );
}

#[test]
fn damaged_recordings() {
    check(
        "recordings",
        &[
            data_file("an empty file", "empty.csv", ""),
            recording("a header and nothing else", &RECORDING[RECORDING.find('\n').unwrap()..], "\n"),
            recording("a text in a column of numbers", "0.003", "0.oo3"),
            recording("an infinite number", "0.003", "inf"),
            recording("a row with too few cells", "2.96,0.1", "2.96"),
            recording("a row with too many cells", "2.96,0.1", "2,96,0.1"),
            recording("two columns of one name", "torque[N*m]", "arm[rad]"),
            recording("an unknown unit in the header", "pendulum[rad]", "pendulum[counts]"),
            recording("an unknown unit of the time", "t[s]", "t[ticks]"),
            recording("no column that is called time", "t[s]", "clock[s]"),
            recording("a gap in the time", "0.10,0.003", "nan,0.003"),
            recording("a time that does not increase", "0.10,0.003", "0.05,0.003"),
            recording("a gap at the start of an input", "3.00,0.0", "3.00,"),
            recording(
                "a column of gaps",
                "3.00,0.0\n0.05,0.001,2.99,0.1\n0.10,0.003,2.96,0.1\n0.15,0.006,2.91",
                ",0\n1,1,,1\n2,2,,2\n3,3,",
            ),
            recording(
                "a column of words",
                "3.00,0.0\n0.05,0.001,2.99,0.1\n0.10,0.003,2.96,0.1\n0.15,0.006,2.91",
                "up,0\n1,1,up,1\n2,2,up,2\n3,3,down",
            ),
            data_file("a MATLAB file that is cut off", "cut.mat", &matlab_level_4()[..30]),
            data_file("a MATLAB file of level 5 that is cut off", "cut.mat", matlab_level_5_cut_off()),
            data_file("a MATLAB file of level 7.3", "new.mat", matlab_level_7_3()),
            data_file("a MATLAB file without the column", "old.mat", matlab_level_4()),
            data_file(
                "a MATLAB file by its name only",
                "swing.mat",
                "The recording of Tuesday\nis on the other computer.\n",
            ),
            data_file("bytes of another program", "swing.bin", b"\x7fELF\x02\x01\x01\x00\x00\x00\x00"),
            data_file(
                "bytes that are no text, without a zero",
                "swing.dat",
                b"\x8a\x01\xff\xfe\x03\x1b[31m\x90\x07\n\xc3\x28",
            ),
            data_file("a text in Latin-1", "swing.csv", b"t,arm,pendulum,torque\n# gr\xfcn\n"),
            data_file("a text in UTF-16", "swing.csv", b"\xff\xfet\x00,\x00a\x00\n\x00"),
        ],
    );
}

#[test]
fn invalid_command_lines() {
    check(
        "command-line",
        &[
            called("no such study, but a shipped one of nearly that name", &["run", "pid-desing"]),
            called("no such study file", &["check", "loop/study.toml"]),
            Case::new("a folder without a study", DESIGN).with("empty/notes.txt", "").called(&["check", "empty"]),
            called("a setting that is no value", &["check", "study.toml", "--set", "tuners.Ti.start=fast"]),
            called("a setting without a value", &["check", "study.toml", "--set", "tuners.Ti.start"]),
            called("a setting of an unknown key", &["check", "study.toml", "--set", "tuners.Ti.strat=2.0"]),
            called("a setting of an unknown tuner", &["check", "study.toml", "--set", "tuners.Tj.start=2.0"]),
            called("a setting of the wrong type", &["check", "study.toml", "--set", "tuners.Ti.start=true"]),
            called(
                "a setting out of bounds, the second",
                &["check", "study.toml", "--set", "study.seed=3", "--set", "tuners.Ti.start=\"30 s\""],
            ),
            called("an unknown solver", &["run", "study.toml", "--solver", "levenberg"]),
            called("a solver that cannot do it", &["run", "pid-design", "--quiet", "--solver", "levenberg-marquardt"]),
            Case::new("a solver of the study that cannot do it", &broken(DESIGN, "[cases]", "[solver.nsga2]\n[cases]"))
                .called(&["check", "study.toml"]),
            called("no evaluation", &["run", "study.toml", "--max-evaluations", "0"]),
            called("an unknown tuner", &["simulate", "study.toml", "--at", "Tx=1"]),
            called("a tuner without a value", &["simulate", "study.toml", "--at", "Ti"]),
            called("a tuner's value that is no number", &["simulate", "study.toml", "--at", "Ti=slow"]),
            called("a tuner's value in a unit that does not fit", &["simulate", "study.toml", "--at", "Ti=2 m"]),
            called("an unknown case", &["simulate", "study.toml", "--case", "nominl"]),
            Case::new("a folder that is already there", DESIGN).with("mine/study.toml", "").called(&["new", "mine"]),
            called("a copy of an unknown study", &["new", "mine", "--from", "furuta"]),
            called("a kind that is not there", &["describe", "settle-time"]),
            called("a data file that is not there", &["data", "swing.csv"]),
            called("a data file that is listed in sources.toml", &["data", "swings.csv"]).with("sources.toml", SOURCES),
            called("a data file whose entry in sources.toml is broken", &["data", "swings.csv"])
                .with("sources.toml", broken(SOURCES, "sha256", "sha")),
            Case::new("a study of the name of a shipped one", "")
                .with("mine/loop/study.toml", broken(DESIGN, "\"loop\"", "\"pid-design\""))
                .called(&["list", "--studies", "mine"]),
            called("an unknown command", &["rum", "study.toml"]),
        ],
    );
}

/// Calibration of a model of equations with an effect instead of its friction.
fn effect(what: &'static str, effects: &str) -> Case {
    let study = broken(CALIBRATION, "[models.rig.furuta]\n", SHAFT);
    let study = broken(&study, "[models.rig.parameters]\na = 9e-4\nb = 2e-3\nc = 4e-4\n", "");
    let study = broken(&study, "[tuners]", &format!("[models.rig.effects]\n{effects}\n[tuners]"));
    Case::new(what, &study).with("swing.csv", RECORDING)
}

/// Two pendulums on one shaft.
const SHAFT: &str = r#"[models.rig.equations]
states     = { phi = "rad", dphi = "rad/s", theta = "rad", dtheta = "rad/s" }
inputs     = { u = "N m" }
parameters = { d = "N m" }
constants  = { J = "0.01 kg m2" }

[models.rig.equations.der]
phi    = "dphi"
theta  = "dtheta"
dphi   = "J*dphi' = u - d*sin(phi)"
dtheta = "J*dtheta' = d*sin(theta)"
"#;

#[test]
fn unknown_and_unsuitable_effects() {
    check(
        "effects",
        &[
            effect("a misspelt effect", "arm = { coulomb-frction = { place = \"joint:phi\" } }"),
            effect("no effect", "arm = {}"),
            effect(
                "two effects under one name",
                "arm = { coulomb-friction = { place = \"joint:phi\" }, viscous-friction = { place = \"joint:phi\" } }",
            ),
            effect("an effect without a place", "arm = { coulomb-friction = {} }"),
            effect("a place alone", "arm = { coulomb-friction = \"joint:phi\" }"),
            effect("a key that is not known", "arm = { coulomb-friction = { place = \"joint:phi\", c = 0.1 } }"),
            effect("a misspelt place", "arm = { coulomb-friction = { place = \"joint:pih\" } }"),
            effect("a place without its sort", "arm = { coulomb-friction = { place = \"phi\" } }"),
            effect(
                "a place that the effect does not act at",
                "arm = { coulomb-friction = { place = \"actuator:u\" } }",
            ),
            effect("the equation of a joint's speed", "arm = { coulomb-friction = { place = \"process:phi\" } }"),
            effect(
                "a companion that is not wanted",
                "arm = { coulomb-friction = { place = \"joint:phi\", companion = \"actuator:u\" } }",
            ),
            effect("a companion that is missing", "ripple = { torque-ripple = { place = \"actuator:u\" } }"),
            effect(
                "a companion of the wrong sort",
                "ripple = { torque-ripple = { place = \"actuator:u\", companion = \"sensor:theta\" } }",
            ),
            effect(
                "a misspelt companion",
                "arm = { coulomb-friction = { place = \"joint:phi\", companion = \"actuator:v\" } }",
            ),
            effect("a name with a point", "\"arm.1\" = { coulomb-friction = { place = \"joint:phi\" } }"),
            effect(
                "a misspelt strength",
                "arm = { coulomb-friction = { place = \"joint:phi\" } }\n[models.rig.parameters]\n\"arm.d\" = 0.1",
            ),
            design(
                "a model without places",
                "[tuners]",
                "[models.loop.effects]\narm = { coulomb-friction = { place = \"joint:phi\" } }\n[tuners]",
            ),
            effect("a linearisation", "arm = { coulomb-friction = { place = \"joint:phi\" } }\n[models.rig.linearise]"),
        ],
    );
}

/// Asserts that the message marks the last occurrence of `wrong` in the file; line and column are counted from 1, in
/// characters.
fn points_at(case: &Case, file: &str, wrong: &str) {
    let text = std::str::from_utf8(&case.files[file]).unwrap();
    let before = &text[..text.rfind(wrong).unwrap()];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
    let (place, message) = (format!("[{file}:{line}:{column}]"), case.message());
    assert!(message.contains(&place), "{}: not at {place}\n{message}", case.what);
}

#[test]
fn the_erroneous_one_of_two_equal_keys_is_marked() {
    let bounds = design("the bounds of the second tuner", "min = 0.01, max = 10.0", "min = 30.0, max = 20.0");
    points_at(&bounds, "study.toml", "20.0");
    let signal = design("the signal of the second criterion", "\"y\", target = 1.0, band", "\"k\", target = 1.0, band");
    points_at(&signal, "study.toml", "\"k\"");
    let element =
        design("the second element of a list", "demand = 0.10", "cases = [\"nominal\", \"p\"], demand = 0.10");
    points_at(&element, "study.toml", "\"p\"");
    let kind = design("the second pole", "[\"p\", -4.0, -1.0]", "[\"p\", [-4.0], [-1.0, 0.0]]");
    points_at(&kind, "study.toml", "[-4.0]");
    let cell = recording("the same text in two cells", "0.10,0.003,2.96,0.1", "0.05,0.003,2.96,0.1");
    points_at(&cell, "swing.csv", "0.05");
}

#[test]
fn columns_are_counted_in_characters() {
    let above = design("characters above", "[cases]", "# Die Fälle: Größe, 大きさ\n[cases]\nbeide = { q = 1.0 }");
    points_at(&above, "study.toml", "q = 1.0");
    let before = design("characters before", "nominal = { p = 0.0 }", "\"größer, 大\" = { p = true }");
    points_at(&before, "study.toml", "true");
    let row =
        data_file("characters in a row", "swing.csv", "größe,t\n\"früh, 早い\",0\n\"spät\",x\n\"später, 後\",1.O\n");
    points_at(&row, "swing.csv", "x");
}

#[test]
fn positions_are_right_in_files_with_windows_line_ends_and_byte_order_marks() {
    let windows = broken(DESIGN, "demand = 0.10", "demand = -0.10").replace('\n', "\r\n");
    points_at(&Case::new("line ends of Windows", &windows), "study.toml", "-0.10");
    let marked = Case::new("a byte order mark", &format!("\u{feff}{}", broken(DESIGN, "name = \"loop\"", "name = 7")));
    assert!(marked.message().contains("[study.toml:2:8]"), "{}", marked.message());
}

/// Diagnosis with this text in its table.
fn diagnosis(what: &'static str, table: &str) -> Case {
    let study = format!("{}\n[diagnosis]\n{table}\n", broken(CALIBRATION, "\"calibration\"", "\"diagnosis\""));
    Case::new(what, &study).with("swing.csv", RECORDING)
}

#[test]
fn invalid_diagnoses() {
    let diagnose: &[&str] = &["diagnose", "study.toml", "--out", "out"];
    check(
        "diagnosis",
        &[
            diagnosis("an unknown effect", "effects = [\"viscous-friction\", \"coulomb-frction\"]"),
            diagnosis("an unknown effect that is left out", "without = [\"viscos-friction\"]"),
            diagnosis(
                "an effect that is named and left out",
                "effects = [\"coulomb-friction\"]\nwithout = [\"coulomb-friction\"]",
            ),
            diagnosis("no effect to try", "effects = []"),
            diagnosis("no effect to add", "max-effects = 0"),
            diagnosis("a certain false alarm", "level = 1.0"),
            diagnosis("a misspelt key", "max-efects = 2"),
            Case::new("a design, which has no measurement", DESIGN).called(diagnose),
            calibration("only validation data", "free     =", "role     = \"validation\"\nfree     =").called(diagnose),
            calibration("an experiment without a channel", "channels = {", "channels = {}\n# {").called(diagnose),
            calibration("an export without a diagnosis", "9e-4", "9.1e-4").called(&[
                "run",
                "study.toml",
                "--export",
                "rust",
            ]),
            calibration("an export to an unknown language", "9e-4", "9.1e-4").called(&[
                "diagnose",
                "study.toml",
                "--export",
                "python",
            ]),
        ],
    );
}

/// Design with an uncertain pole and these tables.
fn uncertain(what: &'static str, tables: &str) -> Case {
    Case::new(what, &format!("{DESIGN}\n{tables}\n"))
}

#[test]
fn invalid_uncertain_parameters() {
    let worst: &[&str] = &["run", "study.toml", "--out", "out", "--set", "study.task='worst-case'"];
    let monte_carlo: &[&str] = &["run", "study.toml", "--out", "out", "--set", "study.task='monte-carlo'"];
    check(
        "uncertain",
        &[
            Case::new("nothing is uncertain", DESIGN).called(worst),
            uncertain("a robust design of nothing", "[robust]"),
            uncertain("an unknown parameter", "[uncertain]\nq = { min = -0.1, max = 0.1 }"),
            uncertain("an empty range", "[uncertain]\np = { min = 0.1, max = -0.1 }"),
            uncertain("no range", "[uncertain]\np = { min = 0.1 }"),
            uncertain("a wrong unit", "[uncertain]\nTi = { min = \"1 V\", max = 3 }"),
            uncertain(
                "two distributions",
                "[uncertain]\np = { normal = { mean = 0, deviation = 1 }, triangular = { mode = 0 } }",
            ),
            uncertain("half a distribution", "[uncertain]\np = { normal = { mean = 0 } }"),
            uncertain("a negative deviation", "[uncertain]\np = { normal = { mean = 0, deviation = -1 } }"),
            uncertain("a mode outside", "[uncertain]\np = { triangular = { mode = 3 }, min = -1, max = 1 }"),
            uncertain(
                "a distribution far from its bounds",
                "[uncertain]\np = { normal = { mean = 0, deviation = 0.1 }, min = 5 }",
            ),
            uncertain("a tolerance of no tuner", "[uncertain]\np = { tolerance = 0.1 }"),
            uncertain("a box without an end", "[uncertain]\np = { normal = { mean = 0, deviation = 0.1 } }")
                .called(worst),
            uncertain("a tuner to choose and to guard against", "[uncertain]\nk = { min = 1, max = 2 }\n[robust]"),
            uncertain(
                "an unknown criterion",
                "[uncertain]\np = { min = -0.1, max = 0.1 }\n[worst-case]\ncriteria = [\"setling\"]",
            )
            .called(worst),
            uncertain(
                "a share that is none",
                "[uncertain]\np = { min = -0.1, max = 0.1 }\n[monte-carlo]\nquantiles = [5, 95]",
            )
            .called(monte_carlo),
            uncertain("one sample", "[uncertain]\np = { min = -0.1, max = 0.1 }\n[monte-carlo]\nsamples = 1")
                .called(monte_carlo),
            uncertain("a tolerance of nothing", "[uncertain]\np = { min = -0.1, max = 0.1 }\n[robust]\ntolerance = 0"),
            uncertain("uncertain estimates of a design", "[uncertainty]\nbands = true"),
            calibration(
                "a profile of what is not estimated",
                "[criteria]",
                "[uncertainty]\nprofile = [\"e\"]\n[criteria]",
            ),
            calibration("an empty block", "[criteria]", "[uncertainty]\nbootstrap = 200\nblock = 0\n[criteria]"),
            calibration(
                "a robust calibration",
                "[criteria]",
                "[uncertain]\na = { min = 1e-4, max = 1e-3 }\n[robust]\n[criteria]",
            ),
        ],
    );
}

/// Pareto front with an error and further tables.
fn front(what: &'static str, study: &str, criteria: &str, tables: &str) -> Case {
    let text = broken(DESIGN, "name = \"loop\"", &format!("name = \"loop\"\ntask = \"pareto\"{study}"));
    Case::new(what, &(broken(&text, "demand = \"15 s\" }", &format!("demand = \"15 s\"{criteria} }}")) + tables))
}

#[test]
fn invalid_fronts() {
    check(
        "front",
        &[
            front("one criterion alone", "", ", usage = \"inequality\"", ""),
            front("one number for all criteria", "\nobjective = \"max\"", "", ""),
            front("too few points", "", "", "[pareto]\npoints = 2\n"),
            front("too many points", "", "", "[pareto]\npoints = 1000\n"),
            front("an unknown key", "", "", "[pareto]\npoint = 30\n"),
        ],
    );
}

/// Design and its result, for `mops pick` with this demand.
fn picked(what: &'static str, result: &str, demand: &'static str) -> Case {
    Case::new(what, DESIGN).with("result.json", result).called(&["pick", ".", "--demand", demand])
}

#[test]
fn invalid_picks() {
    let front = r#"{ "study": "loop", "front": [{ "tuners": { "k": 4.0 } }], "trade_offs": {} }"#;
    check(
        "pick",
        &[
            called("no result", &["pick", "nowhere", "--demand", "settling=12"]),
            picked("no front", r#"{ "study": "loop", "front": [{}] }"#, "settling=12"),
            picked("a result that is none", "{", "settling=12"),
            picked("an unknown criterion", front, "setling=12"),
            picked("a demand without a value", front, "settling"),
            picked("a unit that does not fit", front, "settling=12 m"),
            picked("the front of another study", front, "settling=12"),
        ],
    );
}
