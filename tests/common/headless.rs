//! A headless browser, if one is installed.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

use assert_cmd::Command;

/// Message of a test that is skipped because no browser is installed.
pub const SKIPPED: &str = "skipped: no browser of the Chromium family is on the path";

/// Returns a browser of the Chromium family on the path.
pub fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|file| file.is_file())
}

/// Options of a browser without window, dialogs or network services.
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

/// Returns the document at an address after its scripts have run; the browser profile is in the folder.
#[allow(dead_code)]
pub fn dump(browser: &Path, folder: &Path, address: &str, more: &[&str]) -> Output {
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let limit = Duration::from_secs(120);
    let mut command = Command::new(browser);
    command.args(FLAGS).arg("--dump-dom").args(more).args([&profile, address]);
    command.timeout(limit).output().unwrap()
}
