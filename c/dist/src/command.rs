//! Runs other programs.

use std::process::Command;

use anyhow::{Context, Result, ensure};

/// What a command prints.
///
/// # Errors
/// If it cannot be started or fails, with what it writes to its standard error.
pub fn output(command: &mut Command) -> Result<String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let done = command.output().with_context(|| format!("cannot start `{program}`"))?;
    let said = String::from_utf8_lossy(&done.stderr);
    ensure!(done.status.success(), "`{program}` has failed:\n{said}");
    Ok(String::from_utf8(done.stdout)?)
}
