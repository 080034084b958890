//! Prose uses the field's words: the forbidden words and phrases below stand in no page, message or comment.

use std::fs;
use std::path::{Path, PathBuf};

/// Places whose prose is checked.
const PLACES: [&str; 18] = [
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "README.md",
    "SECURITY.md",
    "benches",
    "crates",
    "criteria",
    "diagnosis",
    "docs",
    "effects",
    "examples",
    "models",
    "mops-bench",
    "mops-core",
    "solvers",
    "src",
    "studies",
    "tests",
];

/// Pages that are not checked: histories, and the list of the words itself.
const LEFT_OUT: [&str; 2] = ["docs/adr", "tests/words.rs"];

/// Words that are not used, whole words in any case; the field's word stands behind each.
const WORDS: [(&str, &str); 10] = [
    ("afresh", "again, from a new start"),
    ("begun", "started"),
    ("held", "fixed, kept; held-out data are held-out"),
    ("led", "taken, mapped"),
    ("likeness", "cosine similarity"),
    ("said", "reported, stated, given"),
    ("tell", "report, distinguish"),
    ("telling", "reporting"),
    ("tells", "reports, shows"),
    ("told", "reported"),
];

/// Phrases that are not used.
const PHRASES: [(&str, &str); 6] = [
    ("all that can be had", "the best achievable"),
    ("stand there", "are present"),
    ("stands there", "is present"),
    ("to and fro", "back and forth"),
    ("what chance does", "what chance explains (p-value)"),
    ("what the model leaves", "the residual"),
];

/// First words that no doc comment has: they need the item above, which rustdoc does not show.
const OPENINGS: [&str; 5] = ["The same", "It ", "That ", "Those ", "Such "];

/// Lines with a key, an option or a file name that stays, or where a word has its other meaning: end of the path, part
/// of the line.
const ALLOWED: [(&str, &str); 11] = [
    ("", "held-out"),
    ("", "held out"),
    ("", "held_out"),
    ("", "--told"),
    ("src/command/diagnosis.rs", "long = \"told\""),
    ("src/diagnosis/folder.rs", "zoh (held)"),
    ("reference/run-files.md", "`begun`"),
    ("store/src/ending.rs", "begun"),
    ("store/src/runs.rs", "begun, state"),
    ("store/src/database.rs", "begun, state"),
    ("store/src/database.rs", "begun INTEGER"),
];

#[test]
fn prose_is_in_the_words_of_the_field() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for place in PLACES {
        for path in files(&root.join(place)) {
            let name = path.strip_prefix(root).expect("it is below").display().to_string().replace('\\', "/");
            if LEFT_OUT.iter().any(|left| name.starts_with(left)) {
                continue;
            }
            let text = fs::read_to_string(&path).expect("it is text");
            let is_code = name.ends_with(".rs");
            for (number, line) in text.lines().enumerate() {
                let allowed = |(end, part): &(&str, &str)| name.ends_with(end) && line.contains(part);
                if ALLOWED.iter().any(allowed) {
                    continue;
                }
                let prose = if is_code { prose_of(line) } else { line.to_owned() };
                let at = |what: String| format!("{name}:{}: {what}", number + 1);
                found.extend(faults(&prose).into_iter().map(at));
                found.extend(is_code.then(|| opening(line)).flatten().map(at));
            }
        }
    }
    assert!(found.is_empty(), "{} places:\n{}", found.len(), found.join("\n"));
}

#[test]
fn identifiers_are_in_the_words_of_the_field() {
    let mut found = Vec::new();
    for (name, text) in rust().into_iter().filter(|(name, _)| !LEFT_OUT.contains(&name.as_str())) {
        for (number, line) in text.lines().enumerate() {
            let allowed = |(end, part): &(&str, &str)| !end.is_empty() && name.ends_with(end) && line.contains(part);
            if ALLOWED.iter().any(allowed) {
                continue;
            }
            let code = code_of(line).replace("held_out", "").replace("HeldOut", "");
            let faults = parts(&code).into_iter().flat_map(|part| faults(&part));
            found.extend(faults.map(|fault| format!("{name}:{}: {fault}", number + 1)));
        }
    }
    assert!(found.is_empty(), "{} places:\n{}", found.len(), found.join("\n"));
}

#[test]
fn forbidden_words_are_found_as_whole_words_only() {
    for (text, count) in [
        ("as told above", 1),
        ("Told once, and it tells", 2),
        ("the threshold is held", 1),
        ("a controlled, labelled, filled vessel", 0),
        ("what `stands there` is", 1),
        ("a step is fixed", 0),
    ] {
        assert_eq!(faults(text).len(), count, "{text}");
    }
    assert_eq!(parts("let was_told = HeldTo::new(xTold);").join(" "), "let was told Held To new x Told");
    assert_eq!(code_of("f(\"it is told\", x); // told"), "f(, x); ");
    assert_eq!(prose_of("let told = 3; // not told"), " not told");
    assert_eq!(prose_of("f(\"it is said\", led)"), "it is said ");
    assert_eq!(prose_of("    /// Returns it."), " Returns it.");
    assert!(opening("    /// The same for doubles.").is_some() && opening("/// Thesis").is_none());
}

/// Public types that share their name with another one. It may only fall: a name has one meaning.
const HOMONYMS: usize = 64;

/// Constants of the diagnosis whose basis is "an assumption". It may only fall: `mops-bench ablation` gives them
/// another.
const ASSUMPTIONS: usize = 36;

#[test]
fn names_with_two_meanings_become_no_more() {
    let types = rust().into_iter().filter(|(name, _)| !name.starts_with("tests") && !name.contains("/tests")).flat_map(
        |(_, text)| {
            let of = |line: &str| {
                let rest = line.trim_start().strip_prefix("pub ")?;
                let kinds = ["struct ", "enum ", "trait ", "type "];
                let rest = kinds.iter().find_map(|kind| rest.strip_prefix(kind))?;
                Some(rest.chars().take_while(|c| c.is_alphanumeric()).collect::<String>())
            };
            text.lines().filter_map(of).collect::<Vec<String>>()
        },
    );
    let mut types: Vec<String> = types.collect();
    let all = types.len();
    assert!(all > 500, "{all}");
    types.sort();
    types.dedup();
    assert!(all - types.len() <= HOMONYMS, "{} public types share a name, at most {HOMONYMS} may", all - types.len());
}

#[test]
fn assumptions_become_no_more() {
    let of = |text: &str| text.replace("\n/// ", " ").matches("an assumption").count();
    let found: usize = rust().iter().filter(|(name, _)| name.starts_with("diagnosis/")).map(|(_, text)| of(text)).sum();
    assert!(found <= ASSUMPTIONS, "{found} constants rest on an assumption, at most {ASSUMPTIONS} may");
}

#[test]
fn comments_fit_into_120_columns() {
    // Tables, examples in fences and code within a line cannot be broken.
    let wide = rust().into_iter().flat_map(|(name, text)| {
        let mut is_fenced = false;
        let mut wide = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let Some(comment) = line.trim_start().strip_prefix("//") else {
                is_fenced = false;
                continue;
            };
            let comment = comment.trim_start_matches(['/', '!']).trim_start();
            if comment.starts_with("```") {
                is_fenced = !is_fenced;
            }
            let is_whole = is_fenced || comment.starts_with('|') || comment.starts_with('`');
            if line.chars().count() > 120 && !is_whole {
                wide.push(format!("{name}:{}", number + 1));
            }
        }
        wide
    });
    let wide: Vec<String> = wide.collect();
    assert!(wide.is_empty(), "{} comments are wider than 120 columns:\n{}", wide.len(), wide.join("\n"));
}

#[test]
fn every_decision_has_a_status() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/adr");
    let decisions = files(&folder);
    assert!(decisions.len() > 20, "{decisions:?}");
    for path in decisions {
        let text = fs::read_to_string(&path).expect("it is text");
        assert!(text.lines().nth(2).is_some_and(|line| line.starts_with("Status: ")), "{}", path.display());
    }
}

/// The Rust files of the project with their paths from its root.
fn rust() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let places = PLACES.iter().filter(|place| !place.ends_with(".md"));
    let paths = places.flat_map(|place| files(&root.join(place)));
    let read = |path: PathBuf| {
        let name = path.strip_prefix(root).expect("it is below").display().to_string().replace('\\', "/");
        (name, fs::read_to_string(&path).expect("it is text"))
    };
    paths.filter(|path| path.extension().is_some_and(|end| end == "rs")).map(read).collect()
}

/// Forbidden words and phrases in a text, each with what to write instead.
fn faults(text: &str) -> Vec<String> {
    let lower = text.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphanumeric());
    let of_word = |word: &str| WORDS.iter().find(|(forbidden, _)| *forbidden == word);
    let phrases = PHRASES.iter().filter(|(forbidden, _)| lower.contains(forbidden));
    words.filter_map(of_word).chain(phrases).map(|(word, instead)| format!("`{word}`: write {instead}")).collect()
}

/// The comment and the string literals of a line of Rust.
fn prose_of(line: &str) -> String {
    split(line).1
}

/// A line of Rust without its comment and its string literals.
fn code_of(line: &str) -> String {
    split(line).0
}

/// The code of a line of Rust, and its prose: string literals and comment.
fn split(line: &str) -> (String, String) {
    let (mut code, mut prose) = (String::new(), String::new());
    let mut rest = line;
    let mut in_string = false;
    while let Some(c) = rest.chars().next() {
        if !in_string && rest.starts_with("//") {
            prose.push_str(rest.trim_start_matches(['/', '!']));
            break;
        }
        if in_string && rest.starts_with('\\') {
            rest = rest.get(2..).unwrap_or("");
            continue;
        }
        if c == '"' {
            in_string = !in_string;
            prose.push_str(if in_string { "" } else { " " });
        } else if in_string {
            prose.push(c);
        } else {
            code.push(c);
        }
        rest = &rest[c.len_utf8()..];
    }
    (code, prose)
}

/// The words that the identifiers of a line consist of.
fn parts(code: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let mut part = String::new();
    for c in code.chars() {
        if !c.is_ascii_alphabetic() || c.is_ascii_uppercase() && part.ends_with(|last: char| last.is_ascii_lowercase())
        {
            parts.push(std::mem::take(&mut part));
        }
        if c.is_ascii_alphabetic() {
            part.push(c);
        }
    }
    parts.push(part);
    parts.retain(|part| !part.is_empty());
    parts
}

/// A doc comment that opens without its noun.
fn opening(line: &str) -> Option<String> {
    let text = line.trim_start();
    let text = text.strip_prefix("///").or_else(|| text.strip_prefix("//!"))?.trim_start();
    let word = OPENINGS.iter().find(|opening| text.starts_with(**opening))?;
    Some(format!("a comment opens with `{}`: name the thing", word.trim()))
}

/// The file, or the files of prose below a folder.
fn files(place: &Path) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.to_owned()];
    }
    let entries = fs::read_dir(place).unwrap_or_else(|error| panic!("{}: {error}", place.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("it can be read").path()).collect();
    paths.sort();
    let is_prose = |path: &PathBuf| path.extension().is_some_and(|end| end == "rs" || end == "md");
    paths.into_iter().filter(|path| path.is_dir() || is_prose(path)).flat_map(|path| files(&path)).collect()
}
