//! `sonarfix init`: a folder with the files of a new robot.

use std::fs;

use anyhow::{Context, ensure};
use sonarfix_map::{MapFile, Scenario, robot_file};

use answers::Answers;
use sonarfix_terminal::output::check_folder;

mod answers;
mod question;
mod texts;

pub use answers::Args;

pub fn execute(args: &Args) -> anyhow::Result<()> {
    let dir = &args.dir;
    let entries = fs::read_dir(dir).map(Iterator::count);
    ensure!(
        entries.as_ref().map_or(true, |count| *count == 0),
        "{} is not empty: name a new folder, so that no file is overwritten",
        dir.display()
    );
    // Before the questions.
    check_folder("the folder", dir)?;
    let written = write(args);
    if written.is_err() && entries.is_err() {
        // Only if it is empty.
        let _ = fs::remove_dir(dir);
    }
    written
}

fn write(args: &Args) -> anyhow::Result<()> {
    let dir = &args.dir;
    let answers = Answers::collect(args)?;
    let files = texts::all(&answers)?;
    check(&files)?;
    for (name, text) in &files {
        let file = dir.join(name);
        sonarfix_files::write(&file, text)?;
    }
    println!("wrote {}", files.map(|(name, _)| dir.join(name).display().to_string()).join(", "));
    println!("next: cd {}; sonarfix run scenario.toml --out report", dir.display());
    Ok(())
}

/// Checks the files before the folder is made: a length may have no unit, a path may be too fast for the wheels.
fn check(files: &[(&str, String); 4]) -> anyhow::Result<()> {
    let trial = std::env::temp_dir().join(format!("sonarfix-init-{}", std::process::id()));
    fs::create_dir_all(&trial).with_context(|| format!("cannot make {}", trial.display()))?;
    let read = || -> anyhow::Result<()> {
        for (name, text) in files {
            fs::write(trial.join(name), text)?;
        }
        robot_file::read(&trial.join("robot.toml"))?;
        MapFile::read(&trial.join("map.toml"), None)?;
        Scenario::read(&trial.join("scenario.toml"))?;
        Ok(())
    };
    let result = read();
    // What remains there harms nobody.
    let _ = fs::remove_dir_all(&trial);
    result.context("these answers give no valid robot")
}
