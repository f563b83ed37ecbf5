//! The committed code of the derived filters is the output of its script.

use std::process::Command;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../workload/generate/generate.py");

#[test]
fn the_derived_code_is_that_of_its_script() {
    let imported = Command::new("python3").args(["-c", "import sympy"]).output();
    if !imported.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: python3 has no sympy");
        return;
    }
    let output = Command::new("python3").args([SCRIPT, "--check"]).output().expect("it ran before");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
