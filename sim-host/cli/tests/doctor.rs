//! `sonarfix doctor` on computers with and without programs.

#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test should stop")]

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What it finds of one program if the path has this folder only.
fn found(path: &Path, purpose: &str) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sonarfix"));
    let output = command.args(["doctor", "--json"]).env("PATH", path).output().unwrap();
    assert!(output.status.success());
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let tools = json["tools"].as_array().unwrap();
    tools.iter().find(|tool| tool["purpose"].as_str().unwrap().contains(purpose)).unwrap().clone()
}

fn install(folder: &Path, name: &str, answer: &str) {
    let file = folder.join(name);
    std::fs::write(&file, format!("#!/bin/sh\necho '{answer}'\n")).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o755)).unwrap();
}

#[test]
fn a_missing_program_has_a_remedy_and_a_present_one_its_version() {
    let folder = tempfile::tempdir().unwrap();
    let missing = found(folder.path(), "Pico");
    assert_eq!(missing["version"], Value::Null);
    assert!(missing["remedy"].as_str().unwrap().contains("picotool"));
    install(folder.path(), "picotool", "picotool v2.1.0 (Linux, GNU)");
    let present = found(folder.path(), "Pico");
    assert_eq!((&present["version"], &present["remedy"]), (&"v2.1.0".into(), &Value::Null));
    // One browser of several is enough.
    install(folder.path(), "google-chrome", "Google Chrome 140.0.1");
    let browser = found(folder.path(), "live page");
    assert_eq!(
        (&browser["name"], &browser["version"]),
        (&"google-chrome".into(), &"140.0.1".into())
    );
}
