//! What is wrong with a log, for `replay` and `calibrate`.

use std::io::BufReader;
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use indicatif::ProgressStyle;
use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_replay::diagnosis::{self, Diagnosis, Finding};
use sonarfix_sim::trace::Pose;
use sonarfix_terminal::output::open;
use sonarfix_terminal::progress::bar;

/// Reads the log again, and looks for what is wrong; nothing is found in a pipe, which is read once.
pub fn diagnose(
    log: &Path,
    robot: &RobotConfig,
    walls: &[Wall],
    start: Option<Pose>,
) -> anyhow::Result<Diagnosis> {
    if !log.is_file() {
        return Ok(Diagnosis::default());
    }
    let file = open(log)?;
    let progress = bar(None)
        .with_style(ProgressStyle::default_spinner())
        .with_message("comparing the log with its files");
    progress.enable_steady_tick(Duration::from_millis(200));
    let diagnosis = diagnosis::diagnose(robot, walls, BufReader::new(file), start);
    progress.finish_and_clear();
    diagnosis.with_context(|| log.display().to_string())
}

/// What is wrong, a paragraph each; nothing if nothing is.
pub fn paragraphs(diagnosis: &Diagnosis) -> String {
    let paragraph = |finding: &Finding| {
        let place = finding.line.map(|line| format!("line {line}: ")).unwrap_or_default();
        let explains = finding
            .explained
            .map(|share| format!(" ({:.0} % of the ranges then fit)", 100.0 * share));
        let explains = explains.unwrap_or_default();
        format!("\nprobable cause: {place}{}{explains}\n    {}\n", finding.message, finding.remedy)
    };
    diagnosis.findings.iter().map(paragraph).collect()
}
