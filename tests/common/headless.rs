//! A browser without a screen, where there is one.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

use assert_cmd::Command;

/// What a test says that needs a browser where there is none.
pub const SKIPPED: &str = "skipped: no browser of the Chromium family is on the path";

/// A browser of the Chromium family on the path.
pub fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|file| file.is_file())
}

/// What a browser is told that shows nothing and asks nobody.
pub const FLAGS: [&str; 8] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
];

/// The document that an address leads to once its scripts have run, with a profile of its own in the folder.
#[allow(dead_code)]
pub fn dump(browser: &Path, folder: &Path, address: &str, more: &[&str]) -> Output {
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let limit = Duration::from_secs(120);
    let mut command = Command::new(browser);
    command.args(FLAGS).arg("--dump-dom").args(more).args([&profile, address]);
    command.timeout(limit).output().unwrap()
}
