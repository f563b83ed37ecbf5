//! Tests that need what not every machine has, and say so where it is missing.

#![allow(dead_code, reason = "every test file takes what it needs of this")]

use std::io::Write;
use std::path::{Path, PathBuf};

/// Says that a test was skipped. Written past the test harness, which swallows what a test that
/// passes prints.
pub fn because(why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

/// A folder of recordings, in `SONARFIX_DATA` or in `../shared/data` beside the repository.
pub fn unless_recorded(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let data = std::env::var_os("SONARFIX_DATA").map_or_else(beside, PathBuf::from);
    let folder = data.join(name);
    if folder.exists() {
        return Some(folder);
    }
    because(&format!("there is no recording {}", folder.display()));
    None
}
