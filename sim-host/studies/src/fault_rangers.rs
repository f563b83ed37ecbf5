//! Robots with several rangers of which the first one fails: they measure as often as the same robots without it.

use std::fmt::Write;
use std::path::Path;

use sonarfix_map::{CLASSROOM, Fault, FaultKind, Fidelity, PAPER, Scenario};
use sonarfix_sim::monte_carlo;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::statistics::Summary;

use crate::fault_table::TableError;

/// Where the rangers are mounted, ahead of the axle; the first one fails.
const MOUNTS: [&str; 3] = ["60 mm", "-40 mm", "10 mm"];

/// How a ranger fails, with names.
const KINDS: [(&str, FaultKind); 4] = [
    ("dead: no echo line", FaultKind::DeadSonar),
    ("silent: no echo", FaultKind::LostEchoes(1.0)),
    ("stuck: the echo line stays high", FaultKind::StuckEcho),
    ("lying: any range", FaultKind::FalseRanges(1.0)),
];

const SCENARIOS: [(&str, &str); 2] = [("classroom", CLASSROOM), ("paper", PAPER)];
const ROBOTS: [usize; 2] = [2, 3];

/// Number of rows; each has as many runs again without the ranger that fails.
#[expect(clippy::cast_possible_truncation, reason = "a dozen")]
pub const CASES: u32 = (SCENARIOS.len() * ROBOTS.len() * (KINDS.len() + 1)) as u32;

/// The heading of the table.
const HEAD: &str = "
## With several rangers

Robots with two and three sonars, each on a servo, at pin level. The first sonar fails a second after the start and stays so. *Accepted*: ranges,
compared with those of the same robot without that sonar. *RMS*: error of the position. Seeds from 0.

| scenario | sonars | the first one | runs | accepted | RMS, mm | lost |
|---|---|---|---|---|---|---|
";

/// One row.
#[derive(Debug, Clone)]
pub struct Row {
    scenario: &'static str,
    rangers: usize,
    fault: &'static str,
    failed: Summary,
    /// Ranges that the same robot without the ranger accepts.
    without: f64,
}

impl Row {
    /// Accepted ranges in those of the same robot without the ranger.
    #[must_use]
    pub fn share(&self) -> f64 {
        accepted(&self.failed) / self.without
    }

    /// Lost runs.
    #[must_use]
    pub fn lost(&self) -> usize {
        self.failed.lost_runs
    }
}

/// Ranges that a run accepts.
#[expect(clippy::cast_precision_loss, reason = "some hundred runs of some thousand ranges")]
fn accepted(summary: &Summary) -> f64 {
    summary.fixes.accepted as f64 / summary.runs as f64
}

/// Runs every fault on every robot with the seeds 0 to `runs` − 1.
///
/// # Errors
/// The [`TableError`] of the first run that fails.
pub fn rows(runs: u32, progress: &impl Progress) -> Result<Vec<Row>, TableError> {
    let mut rows = Vec::new();
    for (name, text) in SCENARIOS {
        for rangers in ROBOTS {
            let mounts = MOUNTS.get(..rangers).unwrap_or(&MOUNTS);
            let rest = mounts.get(1..).unwrap_or_default();
            let without = accepted(&summary(scenario(text, rest)?, runs, progress)?);
            for (fault, kind) in KINDS {
                let mut scenario = scenario(text, mounts)?;
                scenario.faults = vec![Fault { kind, from: 1.0, to: 1e6 }];
                let failed = summary(scenario, runs, progress)?;
                rows.push(Row { scenario: name, rangers, fault, failed, without });
            }
        }
    }
    Ok(rows)
}

fn summary(scenario: Scenario, runs: u32, progress: &impl Progress) -> Result<Summary, TableError> {
    let results = monte_carlo::results(&Simulation::new(scenario), 0, runs, progress)?;
    Ok(Summary::of(&results))
}

/// The scenario with a sonar at each of these mounts in place of its one.
fn scenario(text: &str, mounts: &[&str]) -> Result<Scenario, TableError> {
    const SONAR: &str = "[robot.sonar]";
    let (head, rest) = text.split_once(SONAR).unwrap_or((text, ""));
    let (sonar, tail) = rest.split_once("\n[").unwrap_or((rest, ""));
    let sonar_at = |(number, mount): (usize, &&str)| {
        let is_kept = |line: &&str| {
            let of_all = ["fix_period", "temperature"].iter().any(|key| line.starts_with(key));
            !line.starts_with("mount =") && (number == 0 || !of_all)
        };
        let lines: Vec<&str> = sonar.lines().filter(is_kept).collect();
        format!("[[robot.sonar]]\nmount = [\"{mount}\", \"0 mm\"]{}\n", lines.join("\n"))
    };
    let sonars: String = mounts.iter().enumerate().map(sonar_at).collect();
    let text = format!("{head}{sonars}\n[{tail}");
    let mut scenario = Scenario::parse(&text, "several-rangers.toml", Path::new(""))?;
    scenario.fidelity = Fidelity::Pins;
    Ok(scenario)
}

/// The section of the page.
#[must_use]
pub fn markdown(rows: &[Row]) -> String {
    let mut page = HEAD.to_owned();
    // An interrupted command has no runs of some of them.
    for row in rows.iter().filter(|row| row.failed.runs > 0 && row.without > 0.0) {
        // Writing to a String does not fail.
        let _ = writeln!(
            page,
            "| `{}` | {} | {} | {} | {:.1} % | {:.0} | {} |",
            row.scenario,
            row.rangers,
            row.fault,
            row.failed.runs,
            100.0 * row.share(),
            1e3 * row.failed.rms_path.x.hypot(row.failed.rms_path.y),
            row.lost(),
        );
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_robots_have_their_rangers() {
        for (_, text) in SCENARIOS {
            for rangers in 1..=3 {
                let scenario = scenario(text, &MOUNTS[..rangers]).unwrap();
                assert_eq!(scenario.robot.localizer.rangers.iter().count(), rangers);
            }
        }
    }
}
