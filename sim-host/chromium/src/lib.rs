//! Headless Chromium for tests of pages.

use std::process::Command;

/// Names of the Chromium executable.
pub const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// No window, network or services.
const FLAGS: [&str; 8] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
];

/// The command of the first of [`NAMES`] on the path, without a window, network or services; `None` without a browser.
#[must_use]
pub fn headless() -> Option<Command> {
    let answers = |name: &&str| Command::new(name).arg("--version").output().is_ok();
    let mut command = Command::new(NAMES.into_iter().find(answers)?);
    command.args(FLAGS);
    Some(command)
}
