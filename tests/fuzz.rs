//! Damaged input: expressions, studies and data files of any content are read or refused, without panic, overflow or
//! hang. A tenth of 20,000 inputs in the quick tier; `MOPS_FUZZ=1000000 cargo test --test fuzz -- --nocapture` reads a
//! million.
//!
//! Input `i` depends on `i` alone, so that a failure can be reproduced.

use std::io;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use mops::{
    Catalogue,
    data::DataFile,
    language::{
        Expression,
        expression::{DEEPEST, FUNCTIONS, equation},
        files::Files,
    },
};
use rand::prelude::*;
use rand::rngs::SmallRng;

/// Texts from which inputs are made.
struct Corpus {
    catalogue: Catalogue,
    studies: Vec<String>,
    expressions: Vec<String>,
    data: Vec<Vec<u8>>,
}

/// Data files of all shipped studies: any path is one of them.
struct Anything<'c>(&'c [Vec<u8>]);

impl Files for Anything<'_> {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        match path.len() {
            0 => Err(io::ErrorKind::NotFound.into()),
            length => Ok(self.0[length % self.0.len()].clone()),
        }
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

impl Corpus {
    fn new() -> Self {
        let catalogue = mops::catalogue();
        let shipped = mops::studies::shipped();
        let files = || shipped.iter().flat_map(|study| study.files.iter());
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let studies: Vec<String> =
            files().filter(|(name, _)| name.ends_with(".toml")).map(|(_, bytes)| text(bytes)).collect();
        // The first part of a data file suffices, except for MATLAB files, which contain their length.
        let short = |bytes: &[u8]| bytes[..bytes.len().min(1500)].to_vec();
        let mut data: Vec<Vec<u8>> =
            files().filter(|(name, _)| name.ends_with(".csv")).map(|(_, bytes)| short(bytes)).collect();
        data.extend(matrices());
        data.push(b"t [s];u;\"y, long\"\n0,5;1;\"2\"\n1,5;;nan\n".to_vec());
        let mut expressions: Vec<String> = studies.iter().flat_map(|text| quoted(text)).collect();
        expressions
            .extend(["if(x > 0 and not (y <= 1 or z > 2), a, x >= 5, 2, 0.5)".into(), "J*w' = k*i - der(b)".into()]);
        Self { catalogue, studies, expressions, data }
    }
}

/// Returns the texts in quotation marks.
fn quoted(text: &str) -> Vec<String> {
    text.split('"').skip(1).step_by(2).filter(|part| part.contains(['*', '+', '-', '('])).map(str::to_owned).collect()
}

/// Small MATLAB files: a matrix of level 4, and of level 5 with a cell in it.
fn matrices() -> Vec<Vec<u8>> {
    let word = |n: u32| n.to_le_bytes();
    let mut level4: Vec<u8> = [0, 2, 2, 0, 2].iter().flat_map(|&n| word(n)).collect();
    level4.extend(b"a\0");
    level4.extend([1.0f64, 2.0, 3.0, 4.0].iter().flat_map(|x| x.to_le_bytes()));
    let element = |kind: u32, bytes: &[u8]| {
        let padding = vec![0; (8 - bytes.len() % 8) % 8];
        [&word(kind)[..], &word(u32::try_from(bytes.len()).unwrap())[..], bytes, &padding].concat()
    };
    let array = |class: u32, name: &str, data: Vec<u8>| {
        let sizes = [word(2), word(2)].concat();
        let head = [element(6, &[word(class), word(0)].concat()), element(5, &sizes), element(1, name.as_bytes())];
        element(14, &[head.concat(), data].concat())
    };
    let numbers: Vec<u8> = [1.0f64, 2.0, 3.0, 4.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let matrix = |name: &str| array(6, name, element(9, &numbers));
    let cells = array(1, "c", (0..4).flat_map(|_| matrix("")).collect());
    let mut level5 = b"MATLAB 5.0 MAT-file".to_vec();
    level5.resize(124, b' ');
    level5.extend(b"\x00\x01IM");
    level5.extend(matrix("m"));
    level5.extend(cells);
    vec![level4, level5]
}

/// Fragments inserted into a text: those with a meaning to the readers.
const PIECES: [&str; 60] = [
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "'",
    "\"\"\"",
    "=",
    ",",
    ";",
    ".",
    "..",
    "\n",
    "\r\n",
    "\t",
    " ",
    "#",
    "\\",
    "\0",
    "\u{feff}",
    "\u{85}",
    "é",
    "Ω",
    "1",
    "0",
    "-0.0",
    "1e308",
    "1e-400",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "0x7f",
    "1_000",
    "x",
    "T[i-1]",
    "T[1..100]",
    "der(",
    "sin(",
    "table(",
    "if(",
    " and ",
    " or ",
    "not ",
    "^",
    "*",
    "/",
    "+",
    "-",
    ">=",
    "m/s2",
    "degC",
    "%",
    "kg m2",
    "true",
    "[study]\n",
    "[models.m.equations]\nstates = { x = \"1\" }\n",
];

/// Damages a text.
fn damaged(text: &str, other: &str, random: &mut SmallRng) -> String {
    let mut text: Vec<char> = text.chars().collect();
    let other: Vec<char> = other.chars().collect();
    for _ in 0..random.random_range(0..6) {
        let (a, b) = (random.random_range(0..=text.len()), random.random_range(0..=text.len()));
        let (from, to) = (a.min(b), a.max(b).min(a.min(b) + 40));
        match random.random_range(0..7) {
            0 => drop(text.drain(from..to)),
            1 => drop(text.splice(from..from, PIECES.choose(random).unwrap().chars())),
            2 => drop(text.splice(from..to, PIECES.choose(random).unwrap().chars())),
            3 => {
                let part: Vec<char> = text[from..to].to_vec();
                let place = random.random_range(0..=text.len());
                drop(text.splice(place..place, part));
            }
            4 => {
                let start = random.random_range(0..=other.len());
                let part = other[start..].iter().take(60).copied().collect::<Vec<char>>();
                drop(text.splice(from..from, part));
            }
            5 if from < text.len() => text[from] = char::from_u32(random.random_range(0..0x3000)).unwrap_or('?'),
            _ => text.truncate(from.max(1)),
        }
    }
    text.into_iter().collect()
}

/// Values for a key: valid TOML, but mostly invalid for the key.
const VALUES: [&str; 40] = [
    "0",
    "-1",
    "1",
    "-0.0",
    "1e-320",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "4294967296",
    "true",
    "[]",
    "{}",
    "[[]]",
    "[0, 0]",
    "[1e308, -1e308]",
    "[\"x\", \"x\"]",
    "{ x = 1 }",
    "1979-05-27",
    "\"\"",
    "\" \"",
    "\"x\"",
    "\"T[i]\"",
    "\"T[1..3]\"",
    "\"T[1..1000000000000]\"",
    "\"T[9223372036854775807]\"",
    "\"1e400 s\"",
    "\"-1 s\"",
    "\"1e-320 s\"",
    "\"1 m^999999999999\"",
    "\"1 (((kg\"",
    "\"300 %\"",
    "\"1/0\"",
    "\"0/0\"",
    "\"der(x) = x'\"",
    "\"sensor:x\"",
    "\"../../x.csv\"",
];

/// Replaces some values of a study.
fn revalued(text: &str, other: &str, random: &mut SmallRng) -> String {
    let mut text = text.to_owned();
    for _ in 0..random.random_range(1..4) {
        let Some(place) = values(&text).choose(random).cloned() else { return text };
        let value = match values(other).choose(random) {
            Some(value) if random.random_ratio(1, 4) => other[value.clone()].to_owned(),
            _ => (*VALUES.choose(random).unwrap()).to_owned(),
        };
        text.replace_range(place, &value);
    }
    text
}

/// Returns the positions of texts and numbers that may be values.
fn values(text: &str) -> Vec<Range<usize>> {
    let (bytes, mut places, mut at) = (text.as_bytes(), Vec::new(), 0);
    while at < bytes.len() {
        let is_end = |byte: &u8| !byte.is_ascii_alphanumeric() && !b"+-._".contains(byte);
        let length = match bytes[at] {
            b'"' => text[at + 1..].find('"').map_or(1, |end| end + 2),
            b'0'..=b'9' | b'-' => bytes[at..].iter().position(is_end).unwrap_or(bytes.len() - at).max(1),
            byte => {
                at += if is_end(&byte) { 1 } else { bytes[at..].iter().position(is_end).unwrap_or(1) };
                continue;
            }
        };
        places.push(at..at + length);
        at += length;
    }
    places
}

/// Generates an expression of the grammar with this nesting depth.
fn grown(levels: u32, random: &mut SmallRng) -> String {
    if levels == 0 || random.random_ratio(1, 6) {
        let leaves = ["x", "y", "T[2]", "1.5", "2", "pi", "time", "x'", "1e3"];
        return (*leaves.choose(random).unwrap()).to_owned();
    }
    let part = |random: &mut SmallRng| grown(levels - 1, random);
    match random.random_range(0..6) {
        0 => format!("{} + {} - {}", part(random), part(random), part(random)),
        1 => format!("{}*{}/{}", part(random), part(random), part(random)),
        2 => format!("({})^{}", part(random), part(random)),
        3 => format!("-({})", part(random)),
        4 => format!(
            "if({} > {} and {} <= 1, {}, {})",
            part(random),
            part(random),
            part(random),
            part(random),
            part(random)
        ),
        _ => {
            let (name, _, least, most) = *FUNCTIONS.choose(random).unwrap();
            let count = random.random_range(least..=most.min(least + 3));
            let arguments: Vec<String> = (0..count).map(|_| part(random)).collect();
            format!("{name}({})", arguments.join(", "))
        }
    }
}

fn an_expression(corpus: &Corpus, random: &mut SmallRng) {
    let [one, other] = [0; 2].map(|_| corpus.expressions.choose(random).unwrap().clone());
    let text = match random.random_range(0..4) {
        0 => grown(random.random_range(0..6), random),
        1 => damaged(&grown(4, random), &other, random),
        2 => {
            let open = *["(", "sin(", "x^", "-(", "max(1, ", "T[", "if(x > "].choose(random).unwrap();
            open.repeat(random.random_range(0..3 * DEEPEST)) + &one
        }
        _ => damaged(&one, &other, random),
    };
    let read = Expression::parse(&text);
    if let Ok(expression) = &read {
        let values: Vec<f64> = expression.names().iter().map(|_| random.random_range(-3.0..3.0)).collect();
        let _ = expression.evaluate(&values);
    }
    for wrong in [read.err(), equation(&text).err()].into_iter().flatten() {
        assert!(wrong.span.end <= text.len() && text.is_char_boundary(wrong.span.start), "{wrong:?}: {text}");
    }
}

fn a_study(corpus: &Corpus, random: &mut SmallRng) {
    let [one, other] = [0; 2].map(|_| corpus.studies.choose(random).unwrap());
    let text = if random.random_ratio(1, 2) { revalued(one, other, random) } else { damaged(one, other, random) };
    let settings: Vec<String> = match random.random_ratio(1, 4) {
        true => vec![damaged("tuners.k.start=5", "criteria={}", random)],
        false => Vec::new(),
    };
    let files = Anything(&corpus.data);
    if let Err(mistake) = mops::file::read(&corpus.catalogue, "study.toml", &text, &settings, &files) {
        let _ = (mistake.line_column(), mistake.to_string());
    }
}

fn a_data_file(corpus: &Corpus, random: &mut SmallRng) {
    let [one, other] = [0; 2].map(|_| corpus.data.choose(random).unwrap());
    let mut bytes = one.clone();
    if random.random_ratio(1, 2) && std::str::from_utf8(&bytes).is_ok() {
        bytes = damaged(&String::from_utf8_lossy(one), &String::from_utf8_lossy(other), random).into_bytes();
    }
    for _ in 0..random.random_range(0..8) {
        let at = random.random_range(0..=bytes.len());
        match random.random_range(0..4) {
            0 if at < bytes.len() => bytes[at] = random.random(),
            1 => bytes.truncate(at),
            2 => bytes.insert(at, random.random()),
            _ => drop(bytes.splice(at..at, [0xff_u8, 0xff, 0xff, 0x7f])),
        }
    }
    if let Ok(file) = DataFile::parse(["a.csv", "a.mat"].choose(random).unwrap(), bytes) {
        for name in file.column_names().iter().take(50) {
            let _ = (file.column(name), file.span_of(name, 1));
        }
    }
}

#[test]
fn damaged_input_is_read_or_refused() {
    let number = |text: String| text.parse::<u64>().expect("MOPS_FUZZ is a number");
    let count = std::env::var("MOPS_FUZZ").map_or_else(|_| u64::from(mops_tiers::cases(20_000)), number);
    let first = std::env::var("MOPS_FUZZ_FROM").map_or(0, number);
    let (next, corpus) = (AtomicU64::new(first), Corpus::new());
    let readers: [fn(&Corpus, &mut SmallRng); 3] = [an_expression, a_study, a_data_file];
    let work = || {
        let (mut broken, mut slowest) = (Vec::new(), (Duration::ZERO, 0));
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= first + count || broken.len() >= 5 {
                return (broken, slowest);
            }
            if i % 50_000 == 0 {
                eprintln!("input {i}");
            }
            let (started, mut random) = (Instant::now(), SmallRng::seed_from_u64(i));
            let reader = readers[usize::try_from(i % 3).expect("below three")];
            if catch_unwind(AssertUnwindSafe(|| reader(&corpus, &mut random))).is_err() {
                broken.push(i);
            }
            slowest = slowest.max((started.elapsed(), i));
        }
    };
    let found: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().expect("panics are caught")).collect()
    });
    let broken: Vec<u64> = found.iter().flat_map(|(broken, _)| broken.clone()).collect();
    eprintln!("{count} inputs; the slowest took {:?}", found.iter().map(|(_, slowest)| slowest).max());
    assert!(broken.is_empty(), "MOPS_FUZZ=1 MOPS_FUZZ_FROM={} makes the first of {broken:?} again", broken[0]);
}
