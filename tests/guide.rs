//! Checks the guide: every command of its pages runs, in order and in one folder, and prints the output shown.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Fenced block of a page: its language, the file to write it to, and its lines.
struct Block {
    language: String,
    file: Option<String>,
    lines: Vec<String>,
}

/// Returns the fenced blocks of a page.
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

/// Returns the line with single spaces: the widths of table columns vary.
fn plain(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Splits a command into words as a shell does; a text in double quotes is one word.
fn arguments(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in command.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            _ => words.last_mut().expect("the list is not empty").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Runs the command of a line that starts with `$ `. `shown` is the output on the page: `? 2` is the exit status, `...`
/// means any lines, and a line may continue.
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

/// Writes the files and runs the commands of a page in the common folder; returns the number of commands.
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
fn every_command_of_the_guide_runs_and_prints_the_output_shown() {
    let folder = tempfile::tempdir().expect("a folder can be created");
    let mut pages: Vec<PathBuf> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide"))
        .expect("the guide exists")
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    pages.sort();
    let commands: usize = pages.iter().map(|page| follow(page, folder.path())).sum();
    assert!(commands > 10, "{commands} commands were found");
}
