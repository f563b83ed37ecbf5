//! The header is generated, and the comment of each function says what a caller must know.

use std::process::Command;

use anyhow::{Context, bail, ensure};
use regex::Regex;

use crate::cargo;

/// Pinned, because another version writes another header.
const CBINDGEN: &str = "0.29.4";

const HEADER: &str = "c/include/sonarfix.h";

/// Generates the header; writes it, or compares it.
pub fn run(write: bool) -> anyhow::Result<()> {
    cargo::install("cbindgen", CBINDGEN)?;
    let header = generated()?;
    check_comments(&header)?;
    let path = cargo::root().join(HEADER);
    if write {
        return std::fs::write(&path, header).with_context(|| format!("cannot write {HEADER}"));
    }
    let present =
        std::fs::read_to_string(&path).with_context(|| format!("cannot read {HEADER}"))?;
    ensure!(present == header, "{HEADER} is not current: run `cargo xtask c --write`");
    Ok(())
}

fn generated() -> anyhow::Result<String> {
    let mut command = Command::new("cbindgen");
    command.current_dir(cargo::root());
    command.args(["--quiet", "--config", "c/cbindgen.toml", "--crate", "sonarfix-c"]);
    command.args(["--lockfile", "Cargo.lock", "crates/sonarfix-c"]);
    cargo::printed(command)
}

/// Suffixes of the names of floating-point and of 64-bit arguments, by which the unit is known.
const UNITS: [&str; 3] = ["_m", "_rad", "_us"];

/// Every function has a comment on each argument, its results and its threads; every number has a unit.
fn check_comments(header: &str) -> anyhow::Result<()> {
    let function = Regex::new(r"\*/\n[a-z][a-z_ \*]*(sonarfix_[a-z0-9_]+)\(([^)]*)\);")?;
    let mut count = 0;
    for found in function.captures_iter(header) {
        let [declaration, name, arguments] = [0, 1, 2].map(|group| found.get(group));
        let (declaration, name) = declaration.zip(name).context("no declaration")?;
        let arguments = arguments.map_or("", |arguments| arguments.as_str());
        let before = header.get(..declaration.start()).unwrap_or_default();
        let comment = before.rfind("/*").and_then(|start| before.get(start..));
        let (comment, name) = (comment.unwrap_or_default(), name.as_str());
        check_function(comment, arguments).with_context(|| format!("{HEADER}: {name}"))?;
        count += 1;
    }
    let all = Regex::new(r"(?m)^[a-z][a-z_ \*]*sonarfix_[a-z0-9_]+\(")?.find_iter(header).count();
    ensure!(count == all && count > 0, "{HEADER}: {} functions have no comment", all - count);
    println!("{count} functions, each with its arguments, results and threads");
    Ok(())
}

fn check_function(comment: &str, arguments: &str) -> anyhow::Result<()> {
    ensure!(comment.contains("@return "), "no `@return`");
    ensure!(comment.contains("Threads: "), "no `Threads:`");
    for argument in arguments.split(',').map(str::trim) {
        let name = argument.rsplit([' ', '*']).next().unwrap_or(argument);
        ensure!(comment.contains(&format!("@param {name}  ")), "no `@param {name}`");
        let is_quantity = argument.starts_with("float ") || argument.starts_with("uint64_t ");
        let has_unit = UNITS.iter().any(|unit| name.ends_with(unit));
        if is_quantity && !argument.contains('*') && !has_unit {
            bail!("the name of `{name}` has no unit");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "/*\n Turns.\n\n @param angle_rad  the angle\n @return SONARFIX_OK\n Threads: any.\n */\n\
                        sonarfix_status_t sonarfix_turn(float angle_rad);\n";

    #[test]
    fn a_comment_without_a_part_is_refused() {
        check_comments(GOOD).unwrap();
        for (part, without) in [
            ("@param angle_rad  ", "@param angle  "),
            ("@return ", "returns "),
            ("Threads: ", "Thread "),
        ] {
            assert!(check_comments(&GOOD.replace(part, without)).is_err(), "{part}");
        }
        let unknown = GOOD.replace("angle_rad", "angle");
        assert!(format!("{:#}", check_comments(&unknown).unwrap_err()).contains("no unit"));
    }

    #[test]
    fn a_function_without_a_comment_is_refused() {
        let bare = format!("{GOOD}sonarfix_status_t sonarfix_go(void);\n");
        assert!(check_comments(&bare).is_err());
    }
}
