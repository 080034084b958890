//! The files of every crate have no circular imports, so that each can be read after those that it imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Files with the files that they import.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Modules of a crate by their paths; that of its root is empty.
type Modules = BTreeMap<Vec<String>, Module>;

/// What a module defines, and what it takes from others.
#[derive(Default)]
struct Module {
    /// File with the module, relative to the sources of its crate.
    file: String,
    /// True if there is more in the module than modules, imports and re-exports.
    has_code: bool,
    /// Names of its items.
    items: BTreeSet<String>,
    /// Names of its macros that belong to the root of the crate by `#[macro_export]`.
    exported: BTreeSet<String>,
    /// Names that statements `use` bring into the module, each with its path; `*` for all names of a module.
    uses: Vec<(String, Vec<String>)>,
    /// Paths in code.
    paths: Vec<Vec<String>>,
}

#[test]
fn files_have_no_circular_imports() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let circles = crates(root).into_iter().filter_map(|name| {
        let imports = imports(&modules(&root.join(&name).join("src")));
        assert!(!imports.is_empty(), "{name}");
        circle(&imports).map(|circle| format!("{name}: {}", circle.join(" -> ")))
    });
    let circles: Vec<String> = circles.collect();
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}

#[test]
fn all_members_of_the_workspace_are_read() {
    assert_eq!(members("[workspace]\nmembers = [\"a\", \"b/c\"]\nresolver = \"3\""), ["a", "b/c"]);
    assert_eq!(members("[package]\nname = \"a\""), [""; 0]);
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
    let imported = |file: &str, text: &str| imported(file, text).join(" ");
    assert_eq!(imported("d.rs", "use crate::a::{x, y};"), "a.rs");
    assert_eq!(imported("d.rs", "use crate::{a::x, folder::b::{y, z as w}};"), "a.rs folder/b.rs");
    assert_eq!(imported("d.rs", "fn d() { crate::folder::b::f::<u8>(); }"), "folder/b.rs");
    assert_eq!(imported("d.rs", "use crate::a;\nfn d() { a::f(); }"), "a.rs");
    assert_eq!(imported("d.rs", "use super::a::x;"), "a.rs");
    assert_eq!(imported("folder/d.rs", "use super::from_macro;"), "folder/mod.rs");
    assert_eq!(imported("folder/d.rs", "use super::b::x;"), "folder/b.rs");
    assert_eq!(imported("folder/d.rs", "use super::super::a::x;"), "a.rs");
    assert_eq!(imported("folder.rs", "mod b;\nuse self::b::x;"), "folder/b.rs");
    assert_eq!(imported("folder.rs", "mod b;\nfn d() -> b::X { b::f() }"), "folder/b.rs");
    assert_eq!(imported("d.rs", "use mops_core::a::x;\nfn d(a: A) { a.folder(); std::mem::take(&mut a) }"), "");
}

#[test]
fn a_re_export_is_an_import_of_the_file_with_the_item() {
    let imported = |file: &str, text: &str| imported(file, text).join(" ");
    assert_eq!(imported("d.rs", "use crate::Thing;"), "folder/b.rs");
    assert_eq!(imported("d.rs", "use crate::folder::{Renamed, Other};"), "folder/b.rs folder/mod.rs");
    assert_eq!(imported("folder/d.rs", "use super::Thing;"), "folder/b.rs");
    assert_eq!(imported("folder/d.rs", "fn d() { super::Other::new(); }"), "folder/mod.rs");
    assert_eq!(imported("d.rs", "use crate::*;"), "folder/b.rs");
    assert_eq!(imported("d.rs", "use crate::Foreign;"), "");
    assert_eq!(imported("d.rs", "fn d() { crate::made!() }"), "a.rs");
}

#[test]
fn comments_literals_and_tests_are_not_read() {
    let imported = |text: &str| imported("d.rs", text).join(" ");
    assert_eq!(imported("// use crate::a::x;\n/* use crate::a::x; */\nfn d() {}"), "");
    assert_eq!(imported("const A: &str = \"crate::a::x\";\nconst B: &str = r#\"\"crate::a::x\"#;"), "");
    assert_eq!(imported("const A: char = '\"';\nuse crate::a::x;\nconst B: char = '\"';"), "a.rs");
    assert_eq!(imported("fn d<'a>(d: &'a str) { crate::a::f('\\'') }"), "a.rs");
    assert_eq!(
        imported("#[cfg(test)]\nmod tests { mod deep {} use crate::a::x; }\nuse crate::folder::b::x;"),
        "folder/b.rs"
    );
    assert_eq!(imported("#[cfg(test)]\nmod tests;\nuse crate::a::x;"), "a.rs");
    assert_eq!(imported("mod inner { use super::super::a::x; fn d() {} }"), "a.rs");
    assert_eq!(imported("mod inner { use super::a; fn d() { a::f() } mod a {} }"), "");
}

/// Returns the files that a file imports in a crate with a file `a.rs`, and a folder with a file `b.rs`.
fn imported(file: &str, text: &str) -> Vec<String> {
    const A: &str = "pub fn f() {} #[macro_export] macro_rules! made { () => {} }";
    let mut modules = Modules::new();
    let root = "mod a; mod d; mod folder; pub use folder::Thing; pub use mops_core::Foreign;";
    let folder = "mod b; mod d; pub use b::{Thing, Thing as Renamed}; pub struct Other;";
    for (file, text) in [("lib.rs", root), ("a.rs", A), ("folder/b.rs", "pub struct Thing;")] {
        read(file, text, &mut modules);
    }
    if file != "folder.rs" {
        read("folder/mod.rs", folder, &mut modules);
    }
    read(file, &format!("{text}\nconst CODE: u8 = 0;"), &mut modules);
    imports(&modules).remove(file).into_iter().flatten().collect()
}

/// Returns the folders of the crates with sources: the members of the workspace, and its root.
fn crates(root: &Path) -> Vec<String> {
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("the workspace has a manifest");
    let folders = members(&manifest).into_iter().chain(["."]);
    folders.filter(|folder| root.join(folder).join("src").is_dir()).map(str::to_owned).collect()
}

/// Returns the members of a workspace.
fn members(manifest: &str) -> Vec<&str> {
    let list = manifest.split_once("members = [").and_then(|(_, rest)| rest.split_once(']'));
    list.map(|(list, _)| list.split('"').skip(1).step_by(2).collect()).unwrap_or_default()
}

/// Returns the modules of a crate.
fn modules(src: &Path) -> Modules {
    let mut modules = Modules::new();
    for path in files(src) {
        let file = path.strip_prefix(src).expect("the file is in the folder").to_string_lossy().replace('\\', "/");
        if file != "main.rs" {
            read(&file, &fs::read_to_string(&path).expect("the file exists"), &mut modules);
        }
    }
    modules
}

/// Returns the files of a crate except its tests.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder exists") {
        let path = entry.expect("the folder can be read").path();
        let name = path.file_name().expect("the path has a name").to_string_lossy().into_owned();
        if name == "tests" || name == "tests.rs" || name.ends_with("_tests.rs") {
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

/// Adds the modules of a file: its own, and those in braces.
fn read(file: &str, text: &str, modules: &mut Modules) {
    let path = file.trim_end_matches(".rs").split('/').filter(|part| !["lib", "mod"].contains(part));
    let tokens = tokens(text);
    read_module(file, path.map(str::to_owned).collect(), &tokens, modules);
}

fn read_module(file: &str, path: Vec<String>, tokens: &[String], modules: &mut Modules) {
    let mut module = Module { file: file.to_owned(), ..Module::default() };
    let (mut at, mut depth, mut is_exported) = (0, 0, false);
    while at < tokens.len() {
        at = match (token(tokens, at), token(tokens, at + 1)) {
            ("#", _) if is_test(&tokens[at..]) => end_of_item(tokens, at),
            ("#", next) => {
                is_exported |= token(tokens, at + 2) == "macro_export";
                end_of_group(tokens, at + if next == "!" { 2 } else { 1 })
            }
            ("pub", "(") if ["crate", "super", "self", "in"].contains(&token(tokens, at + 2)) => {
                end_of_group(tokens, at + 1)
            }
            ("pub", _) => at + 1,
            ("use", next) if next != "<" => {
                let end = (at..tokens.len()).find(|at| tokens[*at] == ";").unwrap_or(tokens.len());
                module.uses.extend(uses(&tokens[at + 1..end], &[]));
                end + 1
            }
            ("mod", name) if token(tokens, at + 2) == "{" => {
                let end = end_of_group(tokens, at + 2);
                read_module(file, inner(&path, name), &tokens[at + 3..end - 1], modules);
                end
            }
            ("mod", _) => at + 3,
            (first, _) => {
                module.has_code = true;
                depth = if first == "{" { depth + 1 } else { depth - usize::from(first == "}") };
                if depth == 0 && is_item(first) {
                    let names = if std::mem::take(&mut is_exported) { &mut module.exported } else { &mut module.items };
                    names.insert(name_of_item(tokens, at).to_owned());
                }
                let end = end_of_path(tokens, at);
                if end > at + 1 {
                    module.paths.push(tokens[at..end].iter().step_by(2).cloned().collect());
                }
                end
            }
        };
    }
    modules.insert(path, module);
}

fn token(tokens: &[String], at: usize) -> &str {
    tokens.get(at).map_or("", String::as_str)
}

fn is_item(keyword: &str) -> bool {
    ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "macro_rules"].contains(&keyword)
}

/// Returns the name of an item whose keyword is at `at`.
fn name_of_item(tokens: &[String], at: usize) -> &str {
    let name = token(tokens, at + 1);
    if ["!", "mut"].contains(&name) { token(tokens, at + 2) } else { name }
}

/// True if the tokens begin with an attribute `#[cfg(test)]` of a module.
fn is_test(tokens: &[String]) -> bool {
    let attribute = ["#", "[", "cfg", "(", "test", ")", "]"];
    let rest = || tokens[attribute.len()..].iter().take_while(|token| *token != "{" && *token != ";");
    tokens.iter().take(attribute.len()).eq(attribute) && rest().any(|token| token == "mod")
}

/// Returns the position after an item: after its first semicolon, or its group of braces.
fn end_of_item(tokens: &[String], at: usize) -> usize {
    let end = (at..tokens.len()).find(|at| [";", "{"].contains(&tokens[*at].as_str())).unwrap_or(tokens.len());
    if token(tokens, end) == "{" { end_of_group(tokens, end) } else { end + 1 }
}

/// Returns the position after a group in brackets of any kind, which begins at `at`.
fn end_of_group(tokens: &[String], at: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(at) {
        match token.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

/// Returns the position after a path `a::b::c` that begins at `at`, or after the token there.
fn end_of_path(tokens: &[String], at: usize) -> usize {
    let before = if at == 0 { "" } else { token(tokens, at - 1) };
    let mut end = at + 1;
    if !is_word(token(tokens, at)) || ["::", ".", "$"].contains(&before) {
        return end;
    }
    while token(tokens, end) == "::" && is_word(token(tokens, end + 1)) {
        end += 2;
    }
    end
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Returns the names that a statement `use` brings into a module, each with its path; `before` is the path so far.
fn uses(tokens: &[String], before: &[String]) -> Vec<(String, Vec<String>)> {
    let end = tokens.iter().position(|token| token == "{");
    let words = tokens[..end.unwrap_or(tokens.len())].iter().filter(|token| *token != "::");
    let mut path: Vec<String> = before.iter().chain(words).cloned().collect();
    if let Some(begin) = end {
        let end = end_of_group(tokens, begin);
        return members_of(&tokens[begin + 1..end - 1]).into_iter().flat_map(|member| uses(member, &path)).collect();
    }
    let renamed = path.iter().position(|word| word == "as").map(|at| path.split_off(at)[1].clone());
    if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
        path.pop();
    }
    let name = renamed.or_else(|| path.last().cloned());
    name.map(|name| (name, path)).into_iter().collect()
}

/// Returns the members of a group, which commas separate.
fn members_of(tokens: &[String]) -> Vec<&[String]> {
    let mut depth = 0;
    let members = tokens.split(|token| {
        depth += i32::from(token == "{") - i32::from(token == "}");
        depth == 0 && token == ","
    });
    members.filter(|member| !member.is_empty()).collect()
}

/// Returns the words and signs of a text, without its comments and literals; `::` is one sign.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = length_of_literal(rest).or_else(|| length_of_comment(rest));
        if let Some(length) = length {
            rest = rest.get(length..).unwrap_or_default();
            continue;
        }
        let word = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let sign = if rest.starts_with("::") { 2 } else { first.len_utf8() };
        let length = if word > 0 { word } else { sign };
        if !first.is_whitespace() {
            tokens.push(rest[..length].to_owned());
        }
        rest = &rest[length..];
    }
    tokens
}

/// Returns the length of the comment that the text begins with, if it does.
fn length_of_comment(text: &str) -> Option<usize> {
    let end = |end: &str| text.find(end).map_or(text.len(), |at| at + end.len());
    if text.starts_with("//") { Some(end("\n")) } else { text.starts_with("/*").then(|| end("*/")) }
}

/// Returns the length of the string, character or lifetime that the text begins with, if it does.
fn length_of_literal(text: &str) -> Option<usize> {
    let after = text.trim_start_matches(['b', 'c', 'r']);
    let prefix = text.len() - after.len();
    let raw = text[..prefix].ends_with('r');
    let hashes = if raw { after.len() - after.trim_start_matches('#').len() } else { 0 };
    let inner = after[hashes..].strip_prefix('"').filter(|_| prefix <= 2);
    if let Some(inner) = inner {
        let end = format!("\"{}", "#".repeat(hashes));
        let length = if raw { inner.find(&end)? + end.len() } else { end_of_escaped(inner, '"') };
        return Some(text.len() - inner.len() + length);
    }
    let inner = after.strip_prefix('\'').filter(|_| prefix <= 1)?;
    let is_character = inner.starts_with('\\') || inner.chars().nth(1) == Some('\'');
    let length = if is_character { end_of_escaped(inner, '\'') } else { 0 };
    Some(text.len() - inner.len() + length)
}

/// Returns the position after the first `end` that no backslash precedes.
fn end_of_escaped(text: &str, end: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices() {
        if c == end && !escaped {
            return at + 1;
        }
        escaped = c == '\\' && !escaped;
    }
    text.len()
}

/// Returns the imports of the files with code.
fn imports(modules: &Modules) -> Imports {
    let with_code: BTreeSet<&str> =
        modules.values().filter(|module| module.has_code).map(|module| module.file.as_str()).collect();
    let mut imports: Imports = with_code.iter().map(|file| ((*file).to_owned(), BTreeSet::new())).collect();
    for (at, module) in modules {
        let Some(imported) = imports.get_mut(&module.file) else { continue };
        for path in module.uses.iter().map(|(_, path)| path).chain(&module.paths) {
            let files = files_of(modules, at, path);
            imported.extend(files.into_iter().filter(|file| *file != module.file && with_code.contains(file.as_str())));
        }
    }
    imports
}

/// What a path leads to.
enum Target {
    Module(Vec<String>),
    /// An item of the file.
    Item(String),
}

/// Returns the files that a path in a module imports: for `*`, those with what the other module re-exports, too.
fn files_of(modules: &Modules, at: &[String], path: &[String]) -> Vec<String> {
    let all = path.strip_suffix(&["*".to_owned()]);
    match target(modules, at, all.unwrap_or(path), LONGEST) {
        Some(Target::Item(file)) => vec![file],
        Some(Target::Module(found)) => {
            let module = &modules[&found];
            let exported = module.uses.iter().filter(|_| all.is_some() && found != at);
            let files = exported.flat_map(|(_, path)| files_of(modules, &found, path));
            files.chain([module.file.clone()]).collect()
        }
        None => Vec::new(),
    }
}

/// Largest number of re-exports and names on the way to an item.
const LONGEST: usize = 32;

/// Returns what a path in a module leads to, unless that is outside the crate.
fn target(modules: &Modules, at: &[String], path: &[String], left: usize) -> Option<Target> {
    let (first, rest) = path.split_first()?;
    match first.as_str() {
        "crate" => within(modules, &[], rest, left),
        "self" => within(modules, at, rest, left),
        "super" => within(modules, at.split_last()?.1, rest, left),
        _ => named(modules, at, first, rest, left),
    }
}

/// Returns what a path leads to from a module that holds its first name. A name that is not found there is made by a
/// macro.
fn within(modules: &Modules, at: &[String], path: &[String], left: usize) -> Option<Target> {
    let Some((first, rest)) = path.split_first() else { return Some(Target::Module(at.to_vec())) };
    if first == "super" {
        return target(modules, at, path, left);
    }
    let module = modules.get(at)?;
    let is_known = module.uses.iter().any(|(used, _)| used == first) || modules.contains_key(&inner(at, first));
    let unknown = || (!is_known).then(|| Target::Item(module.file.clone()));
    named(modules, at, first, rest, left).or_else(unknown)
}

/// Returns what a name in a module leads to, and the rest of its path: a module, an item, or what is imported there.
fn named(modules: &Modules, at: &[String], name: &str, rest: &[String], left: usize) -> Option<Target> {
    let left = left.checked_sub(1)?;
    let (module, inner) = (modules.get(at)?, inner(at, name));
    if modules.contains_key(&inner) {
        return within(modules, &inner, rest, left);
    }
    if module.items.contains(name) {
        return Some(Target::Item(module.file.clone()));
    }
    if let Some(of) = modules.values().find(|of| at.is_empty() && of.exported.contains(name)) {
        return Some(Target::Item(of.file.clone()));
    }
    module.uses.iter().find_map(|(used, path)| match path.strip_suffix(&["*".to_owned()]) {
        Some(of) => target(modules, at, &[of, &[name.to_owned()], rest].concat(), left),
        None => (used == name).then(|| target(modules, at, &[path, rest].concat(), left)).flatten(),
    })
}

/// Returns the path of a module in another one.
fn inner(at: &[String], name: &str) -> Vec<String> {
    [at, &[name.to_owned()]].concat()
}

/// Returns a cycle of imports, from a file back to itself, if there is one.
fn circle(imports: &Imports) -> Option<Vec<String>> {
    let mut done = BTreeSet::new();
    imports.keys().find_map(|start| visit(start, imports, &mut Vec::new(), &mut done))
}

fn visit(at: &str, imports: &Imports, way: &mut Vec<String>, done: &mut BTreeSet<String>) -> Option<Vec<String>> {
    if let Some(begin) = way.iter().position(|file| file == at) {
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
