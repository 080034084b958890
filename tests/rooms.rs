//! The modules of every crate have no circular imports, so that each can be read after those that it imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Crates that are checked.
const CRATES: [&str; 21] = [
    "crates/math",
    "crates/language",
    "crates/data",
    "crates/linear",
    "crates/statistics",
    "crates/file",
    "crates/outcome",
    "crates/content",
    "crates/tasks",
    "crates/output",
    "crates/report",
    "crates/store",
    "crates/watch",
    "crates/cli",
    "mops-core",
    "criteria",
    "effects",
    "models",
    "solvers",
    "diagnosis",
    ".",
];

/// Modules with their imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

#[test]
fn modules_have_no_circular_imports() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in CRATES {
        let imports = imports(&root.join(name).join("src"));
        assert!(!imports.is_empty(), "{name}");
        if let Some(circle) = circle(&imports) {
            panic!("{name}: {}", circle.join(" -> "));
        }
    }
}

#[test]
fn a_circular_import_is_found() {
    let import = |from: &str, to: &[&str]| (from.to_owned(), to.iter().map(|to| (*to).to_owned()).collect());
    let open = Imports::from([import("a", &["b", "c"]), import("b", &["c"]), import("c", &[])]);
    assert_eq!(circle(&open), None);
    let closed = Imports::from([import("a", &["b"]), import("b", &["c"]), import("c", &["b"])]);
    assert_eq!(circle(&closed), Some(vec!["b".to_owned(), "c".to_owned(), "b".to_owned()]));
}

#[test]
fn all_forms_of_imports_are_read() {
    let known = ["a", "b", "c"].map(str::to_owned);
    let exports = BTreeMap::from([("Thing".to_owned(), "c".to_owned())]);
    let read =
        |text: &str, depth: usize| names(text, depth, &known, &exports).into_iter().collect::<Vec<_>>().join(" ");
    assert_eq!(read("use crate::a::{x, y};", 1), "a");
    assert_eq!(read("use crate::{a::x, b::{y, z}};", 1), "a b");
    assert_eq!(read("let x = crate::b::f();", 2), "b");
    assert_eq!(read("use crate::Thing;", 1), "c");
    assert_eq!(read("use super::a::x;", 1), "a");
    assert_eq!(read("use super::a::x;", 2), "");
    assert_eq!(read("use super::super::a::x;", 2), "a");
    assert_eq!(read("// use crate::a;\n#[cfg(test)]\nmod tests { use crate::b; }", 1), "");
}

/// Returns the imports of the modules of a crate, by the first name of each path.
fn imports(src: &Path) -> Imports {
    let root = fs::read_to_string(src.join("lib.rs")).expect("the crate has a library");
    let files = files(src);
    let module = |file: &PathBuf| {
        let path = file.strip_prefix(src).expect("the file is in the folder").with_extension("");
        path.iter().map(|part| part.to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    let paths: Vec<(Vec<String>, &PathBuf)> = files.iter().map(|file| (module(file), file)).collect();
    let known: Vec<String> = paths.iter().map(|(path, _)| path[0].clone()).filter(|name| name != "lib").collect();
    let exports = exports(&root, &known);
    let mut imports = Imports::new();
    for (path, file) in paths.iter().filter(|(path, _)| path[0] != "lib" && path[0] != "main") {
        let text = fs::read_to_string(file).expect("the file exists");
        let depth = path.iter().filter(|part| *part != "mod").count();
        let named = names(&text, depth, &known, &exports);
        imports.entry(path[0].clone()).or_default().extend(named.into_iter().filter(|name| *name != path[0]));
    }
    imports
}

/// Returns the files of a crate except its tests.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder exists") {
        let path = entry.expect("the folder can be read").path();
        let name = path.file_name().expect("the path has a name").to_string_lossy().into_owned();
        if name.starts_with("tests") || name.ends_with("_tests.rs") {
            continue;
        }
        if path.is_dir() {
            found.extend(files(&path));
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    found
}

/// Returns the modules of the names that the root of a crate re-exports: `pub use a::{X, Y}`.
fn exports(root: &str, known: &[String]) -> BTreeMap<String, String> {
    let statements = root.split(';').filter_map(|statement| Some(statement.rsplit_once("use ")?.1));
    let of = |statement: &str| -> Vec<(String, String)> {
        let Some((module, rest)) = statement.split_once("::") else { return Vec::new() };
        let words = rest.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
        words.map(|word| (word.to_owned(), module.trim().to_owned())).collect()
    };
    statements.flat_map(of).filter(|(_, module)| known.contains(module)).collect()
}

/// Returns the modules that a file names by `crate::`, or by `super::` up to the root of its crate.
fn names(text: &str, depth: usize, known: &[String], exports: &BTreeMap<String, String>) -> BTreeSet<String> {
    let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let text = lines.collect::<Vec<_>>().join("\n");
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let mut found = BTreeSet::new();
    for prefix in ["crate::".to_owned(), "super::".repeat(depth)] {
        for (at, _) in text.match_indices(&prefix) {
            let before = text[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || "_:$".contains(c)) {
                continue;
            }
            let rest = &text[at + prefix.len()..];
            let firsts = if let Some(group) = rest.strip_prefix('{') { firsts(group) } else { vec![word(rest)] };
            for first in firsts {
                if known.iter().any(|module| module == first) {
                    found.insert(first.to_owned());
                } else if let Some(module) = exports.get(first) {
                    found.insert(module.clone());
                }
            }
        }
    }
    found
}

/// Returns the first names of the members of a group; the text starts after the opening brace.
fn firsts(group: &str) -> Vec<&str> {
    let (mut depth, mut begins) = (0, true);
    let mut firsts = Vec::new();
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => begins = true,
            c if begins && !c.is_whitespace() => {
                firsts.push(word(&group[at..]));
                begins = false;
            }
            _ => {}
        }
    }
    firsts
}

fn word(text: &str) -> &str {
    &text[..text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len())]
}

/// Returns a cycle of imports, from a module back to itself, if there is one.
fn circle(imports: &Imports) -> Option<Vec<String>> {
    let mut done = BTreeSet::new();
    imports.keys().find_map(|start| visit(start, imports, &mut Vec::new(), &mut done))
}

fn visit(at: &str, imports: &Imports, way: &mut Vec<String>, done: &mut BTreeSet<String>) -> Option<Vec<String>> {
    if let Some(begin) = way.iter().position(|module| module == at) {
        return Some(way[begin..].iter().cloned().chain([at.to_owned()]).collect());
    }
    if done.contains(at) {
        return None;
    }
    way.push(at.to_owned());
    let found = imports.get(at).into_iter().flatten().find_map(|next| visit(next, imports, way, done));
    way.pop();
    done.insert(at.to_owned());
    found
}
