//! Pages that the command writes or serves, and that are checked like those of the site.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::cargo;

/// A scenario of all parts of a report.
const SCENARIO: &str = "crates/sonarfix-map/scenarios/classroom.toml";
/// The commands, in the folder of the pages.
const COMMANDS: [&str; 3] = [
    "run scenario.toml --runs 2 --out report --trace informative.csv",
    "run scenario.toml --runs 1 --policy nearest --record drive.csv",
    "compare informative.csv drive.csv --map scenario.toml --map map.toml --out comparison",
];

/// Writes a report and a comparison of two runs into the folder `reports` of a folder that has the program `sonarfix`. `check.mjs` opens them, and
/// the page of a run that is served.
pub fn prepare(folder: &Path) -> anyhow::Result<()> {
    let (program, reports) = (folder.join("sonarfix"), folder.join("reports"));
    if reports.exists() {
        fs::remove_dir_all(&reports)?;
    }
    fs::create_dir_all(&reports)?;
    fs::copy(cargo::root().join(SCENARIO), reports.join("scenario.toml"))?;
    for command in COMMANDS {
        let mut sonarfix = Command::new(&program);
        sonarfix.args(command.split(' ')).current_dir(&reports);
        cargo::check(sonarfix)?;
    }
    Ok(())
}
