//! A simulated drive as the log that the robot would have recorded, with the truth beside it.

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, ensure};
use sonarfix::localizer::Localizer;
use sonarfix_hal::robot::Report;
use sonarfix_link::{Reporter, Telemetry};
use sonarfix_map::{Fidelity, robot_file};
use sonarfix_replay::REFERENCE_HEADER;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

use sonarfix_telemetry::Received;
use sonarfix_telemetry::recording::Recording;

use crate::log_files::LogFiles;

/// Simulates a drive, at the fidelity of pins; writes the log, and the true poses at the encoder ticks into `truth`, by default
/// `reference.csv` beside it, so that `replay` finds them. Beside the log it writes `robot.toml` and `map.toml`, which are what
/// the robot's software knows. Files that exist are replaced only if `is_forced`.
///
/// # Errors
/// If the scenario has another fidelity, the run fails, a file exists, or one cannot be written.
pub fn record(
    simulation: &Simulation,
    seed: u64,
    log: &Path,
    truth: Option<&Path>,
    is_forced: bool,
) -> anyhow::Result<()> {
    let scenario = &simulation.scenario;
    let is_pins = scenario.fidelity == Fidelity::Pins;
    ensure!(is_pins, "--record: only a robot of the fidelity \"pins\" records: --fidelity pins");
    let beside = |name: &str| log.with_file_name(name);
    let usual = beside("reference.csv");
    let truth = truth.unwrap_or(&usual);
    let (robot, map) = (beside("robot.toml"), beside("map.toml"));
    for file in [log, truth, robot.as_path(), map.as_path()] {
        let is_free = is_forced || !file.exists();
        ensure!(is_free, "--record: {} exists: name another file, or use --force", file.display());
    }
    let mut recorder = Recorded::new(Recording::new(LogFiles::new(log.to_owned(), is_forced)));
    simulation.run(seed, &mut recorder)?;
    recorder.end().with_context(|| log.display().to_string())?;
    sonarfix_files::write(truth, recorder.truth)?;
    sonarfix_files::write(&robot, robot_file::text(&scenario.robot))?;
    sonarfix_files::write(&map, scenario.floor.to_toml())?;
    Ok(())
}

/// Records what the robot would send.
struct Recorded {
    recording: Option<Recording>,
    reporter: Option<Reporter>,
    truth: Vec<u8>,
    error: Option<io::Error>,
}

impl Recorded {
    fn new(recording: Recording) -> Self {
        let truth = format!("{REFERENCE_HEADER}\n").into_bytes();
        Self { recording: Some(recording), reporter: None, truth, error: None }
    }

    fn take(&mut self, telemetry: Telemetry) {
        if let (Some(recording), None) = (&mut self.recording, &self.error) {
            self.error = recording.take(&Received { lost: 0, telemetry }).err();
        }
    }

    /// Ends the log.
    fn end(&mut self) -> io::Result<()> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        self.recording.take().map_or(Ok(0), Recording::end).map(drop)
    }
}

impl Recorder for Recorded {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let Tick { time, truth, .. } = make();
        if let Some(truth) = truth {
            let pose = truth.pose;
            // Writing into memory does not fail.
            let _ = writeln!(self.truth, "{time:.6},{},{},{}", pose.x, pose.y, pose.heading);
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn began(&mut self, localizer: &Localizer) {
        let (reporter, began) = Reporter::begin(localizer);
        self.reporter = Some(reporter);
        self.take(began);
    }

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        let Some(mut reporter) = self.reporter.take() else { return };
        reporter.report(report, localizer, &mut |telemetry: &Telemetry| self.take(*telemetry));
        self.reporter = Some(reporter);
    }
}
