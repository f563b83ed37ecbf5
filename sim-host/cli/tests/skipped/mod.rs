//! Reports tests that are skipped because a requirement is missing.

#![allow(dead_code, reason = "the program `memory` does not use all of it")]

use std::io::Write;
use std::path::{Path, PathBuf};

/// Reports that a test is skipped: on standard error directly, because the test harness captures the output of a passing
/// test, and in the file that CI reads.
pub fn because(why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
    if let Some(file) = std::env::var_os("SONARFIX_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(file);
        let _ = file.and_then(|mut file| writeln!(file, "{why}"));
    }
}

/// A folder of recordings, in `SONARFIX_DATA` or in `../shared/data` beside the repository.
pub fn unless_recorded(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("SONARFIX_DATA").map_or_else(beside, PathBuf::from);
    let folder = data.join(name);
    if folder.exists() {
        return Some(folder);
    }
    because(&format!("there is no recording {}", folder.display()));
    None
}
