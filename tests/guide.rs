//! The guide is true: every command of its pages runs, in one folder and in their order, and what a page shows of the output
//! is in it.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A fenced block of a page: its language, the file that it is, and its lines.
struct Block {
    language: String,
    file: Option<String>,
    lines: Vec<String>,
}

/// The fenced blocks of a page.
fn blocks(page: &str) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    let mut open = false;
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(head) => {
                let mut words = head.split_whitespace().map(str::to_owned);
                let language = words.next().unwrap_or_default();
                all.push(Block { language, file: words.next(), lines: Vec::new() });
                open = true;
            }
            None if open => all.last_mut().expect("a block is open").lines.push(line.to_owned()),
            None => {}
        }
    }
    assert!(!open, "a block is not closed");
    all
}

/// A line with single spaces, as tables are as wide as they must be.
fn plain(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The words of a command, as a shell takes them: what stands in double quotes is one.
fn arguments(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in command.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            _ => words.last_mut().expect("there is one").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Runs a command as it stands after `$ `; `shown` is what the page shows of its output: `? 2` is its exit status, `...` stands
/// for any lines, and a line may go on.
fn run(command: &str, shown: &[String], folder: &Path) {
    let words = arguments(command);
    assert_eq!(words[0], "mops", "{command}");
    let output = Command::new(env!("CARGO_BIN_EXE_mops"))
        .args(&words[1..])
        .current_dir(folder)
        .output()
        .expect("mops can be started");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let status = shown.iter().find_map(|line| line.strip_prefix("? ")).map_or(0, |s| s.parse().expect("a number"));
    assert_eq!(output.status.code(), Some(status), "{command}\n{text}");
    let mut left = text.lines();
    for line in shown.iter().filter(|line| !line.starts_with("? ") && *line != "...") {
        let found = left.any(|printed| plain(printed).starts_with(&plain(line)));
        assert!(found, "`{command}` does not print, in this order, `{line}`:\n{text}");
    }
}

/// Does what the page says, in a folder that the pages share.
fn follow(page: &Path, folder: &Path) -> usize {
    let text = std::fs::read_to_string(page).expect("the page can be read");
    let mut commands = 0;
    for Block { language, file, lines } in blocks(&text) {
        if let Some(file) = file {
            std::fs::write(folder.join(file), lines.join("\n") + "\n").expect("the folder can be written");
        } else if language == "console" {
            let mut at = 0;
            while at < lines.len() {
                let command = lines[at].strip_prefix("$ ").expect("a block begins with a command");
                let end = (at + 1..lines.len()).find(|&k| lines[k].starts_with("$ ")).unwrap_or(lines.len());
                run(command, &lines[at + 1..end], folder);
                commands += 1;
                at = end;
            }
        }
    }
    commands
}

#[test]
fn every_command_of_the_guide_runs_and_prints_what_the_page_shows() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut pages: Vec<PathBuf> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide"))
        .expect("the guide is there")
        .map(|entry| entry.expect("it can be read").path())
        .collect();
    pages.sort();
    let commands: usize = pages.iter().map(|page| follow(page, folder.path())).sum();
    assert!(commands > 10, "{commands} commands were found");
}
