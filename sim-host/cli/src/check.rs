//! `sonarfix check`: checks scenario, robot and map files.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use serde::Serialize;
use sonarfix_map::{FileError, MapFile, Mistake, Scenario, plausibility, read_text, robot_file};

use crate::warnings::Warning;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenarios, robot files and maps (docs/formats.md).
    #[arg(required_unless_present = "rules")]
    files: Vec<PathBuf>,
    /// Prints JSON instead of lines.
    #[arg(long)]
    json: bool,
    /// Prints the usual values and their sources, as a page of the documentation.
    #[arg(long, conflicts_with_all = ["files", "json"])]
    rules: bool,
}

/// What was found in a file.
#[derive(Debug, Serialize)]
struct Checked {
    file: String,
    /// `scenario`, `robot` or `map`.
    kind: &'static str,
    errors: Vec<Warning>,
    warnings: Vec<Warning>,
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    if args.rules {
        print!("{}", plausibility::table());
        return Ok(());
    }
    let checked: Vec<_> = args.files.iter().map(|file| check(file)).collect();
    if args.json {
        sonarfix_terminal::json::print(&checked)?;
    }
    let errors: usize = checked.iter().map(|file| file.errors.len()).sum();
    for Checked { file, kind, errors, warnings } in checked.iter().filter(|_| !args.json) {
        let show = |severity: &str, found: &[Warning]| {
            for found in found {
                println!("{severity}: {found}");
            }
        };
        show("error", errors);
        show("warning", warnings);
        println!("{file}: {kind}, {} errors, {} warnings", errors.len(), warnings.len());
    }
    ensure!(errors == 0, "{errors} errors");
    Ok(())
}

fn check(file: &Path) -> Checked {
    let (kind, read) = read(file);
    let errors = read.err().into_iter().flatten().map(|mistake: Mistake| Warning::from(&mistake));
    let warnings = plausibility::of_file(file);
    Checked {
        file: file.display().to_string(),
        kind,
        errors: errors.collect(),
        warnings: warnings.iter().map(Warning::from).collect(),
    }
}

/// The kind of a file, and its mistakes.
fn read(file: &Path) -> (&'static str, Result<(), FileError>) {
    let text = read_text(file).unwrap_or_default();
    match plausibility::kind(&text) {
        plausibility::Kind::Scenario => ("scenario", Scenario::read(file).map(drop)),
        plausibility::Kind::Robot => ("robot", robot_file::read(file).map(drop)),
        plausibility::Kind::Map => ("map", MapFile::read(file, None).map(drop)),
    }
}
