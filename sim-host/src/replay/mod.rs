//! Replays the recording of a robot through the localizer: the same one, told the same things at
//! the same instants as on the robot.
//!
//! A range belongs to the instant at which it was taken, which lies between two encoder records.
//! So what is taken waits for the encoder record after it; then the wheels' travel is shared out
//! evenly over the time between the two, the localizer is told the travel up to the range, is
//! fixed, and is told the rest. Rows of the reference are compared in the same way, each at its
//! own time. Nothing else is held: memory does not grow with the log.
//!
//! Of a scan, the replay hears what a rotating sonar would have heard: whenever a fix is due, the
//! localizer is asked where to look, and the earliest return inside the sonar's cone comes back.
//!
//! | module | what |
//! |---|---|
//! | [`log`], `lines` | the log format, and lines that may be damaged |
//! | `reference` | the true poses, read in step with the log |
//! | `session` | the replay itself |
//! | `wheels` | travel between two readings of the encoders |
//! | [`scan`] | what a cone hears of a scan |
//! | `score`, `median` | errors, and what the localizer said of itself |
//! | [`thinned`] | a trace of bounded size |
//! | [`fault`] | what can be wrong |

pub mod fault;
pub(crate) mod lines;
pub mod log;
mod median;
mod reference;
pub mod scan;
mod score;
mod session;
pub mod thinned;
mod wheels;

use std::io::BufRead;

use serde::Serialize;
use sonarfix::map::Wall;
use sonarfix_map::Robot;

use crate::observe;
use crate::statistics::FixCounts;
use crate::trace::{Calibration, Recorder};
use fault::{Complaint, ReplayError, Source};
use lines::Lines;
use reference::Reference;
use session::{End, Session, Trouble};

pub use lines::LONGEST;
pub use reference::HEADER as REFERENCE_HEADER;
pub use score::{Figures, Honesty, Verdicts};

/// What a replay needs beside the recording.
#[derive(Debug, Clone, Copy)]
pub struct Replay<'a> {
    /// The robot, as its builder knows it.
    pub robot: &'a Robot,
    /// The map.
    pub walls: &'a [Wall],
    /// Whether a line that is wrong ends the replay.
    pub strict: bool,
}

/// What a replay found. Lengths in metres, angles in radians, times in seconds since the start.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Errors of the localizer's position against the reference; nothing without one.
    pub position_rms: Option<f64>,
    /// Right to half a per cent.
    pub position_median: Option<f64>,
    /// The worst.
    pub position_max: Option<f64>,
    /// Errors of its heading.
    pub heading_rms: Option<f64>,
    /// Right to half a per cent.
    pub heading_median: Option<f64>,
    /// The worst.
    pub heading_max: Option<f64>,
    /// Errors of the position by the encoders alone, with the robot file's wheels.
    pub odometry_position_rms: Option<f64>,
    /// Right to half a per cent.
    pub odometry_position_median: Option<f64>,
    /// The worst.
    pub odometry_position_max: Option<f64>,
    /// Errors of the heading by the encoders alone.
    pub odometry_heading_rms: Option<f64>,
    /// Right to half a per cent.
    pub odometry_heading_median: Option<f64>,
    /// The worst.
    pub odometry_heading_max: Option<f64>,
    /// The sonar's turns.
    pub fixes: FixCounts,
    /// The calibration at the end.
    #[serde(rename = "final")]
    pub calibration: Calibration,
    /// Its standard deviations.
    pub final_deviation: Calibration,
    /// What the localizer said of itself.
    pub health: Verdicts,
    /// When it was wrong.
    pub honesty: Honesty,
    /// The start, on the log's clock.
    pub started_at: f64,
    /// From the start to the last encoder record.
    pub duration: f64,
    /// Way by the encoders.
    pub distance: f64,
    /// Lines of the log.
    pub lines: u64,
    /// Lines of the log that were wrong.
    pub lines_skipped: u64,
    /// Encoder records used.
    pub encoder_records: u64,
    /// How often the encoders' counts jumped and were taken up anew.
    pub encoder_jumps: u64,
    /// Ranges and scans from before the start or after the last encoder record.
    pub ranges_unused: u64,
    /// Rows of the reference that were compared.
    pub reference_rows: u64,
    /// Lines of the reference that were wrong.
    pub reference_lines_skipped: u64,
}

/// Counts lines that are wrong and passes them on, or ends the replay at the first.
struct Complaints<'a> {
    strict: bool,
    in_log: u64,
    in_reference: u64,
    report: &'a mut dyn FnMut(&Complaint),
}

impl Complaints<'_> {
    fn add(&mut self, complaint: Complaint) -> Result<(), ReplayError> {
        if self.strict {
            return Err(complaint.into());
        }
        match complaint.source_file {
            Source::Log => self.in_log += 1,
            Source::Reference => self.in_reference += 1,
        }
        (self.report)(&complaint);
        Ok(())
    }
}

impl Replay<'_> {
    /// Replays a log, beside a reference if there is one. Lines that are wrong go to `report`.
    ///
    /// # Errors
    /// [`ReplayError`], by what ended the replay early.
    pub fn run(
        &self,
        log: impl BufRead,
        reference: Option<impl BufRead>,
        recorder: &mut impl Recorder,
        report: &mut dyn FnMut(&Complaint),
    ) -> Result<Summary, ReplayError> {
        let mut complaints = Complaints { strict: self.strict, in_log: 0, in_reference: 0, report };
        let reference = reference.map(Reference::open).transpose()?;
        let mut session = Session::new(self.robot, self.walls, reference, recorder);
        let mut lines = Lines::of(log);
        reference::expect_header(&mut lines, Source::Log, log::HEADER)?;
        loop {
            let line = lines.next().map_err(|error| ReplayError::Read(Source::Log, error))?;
            let Some(line) = line else { break };
            let fault = match line.and_then(log::parse) {
                Ok(None) => continue,
                Err(malformed) => malformed.into(),
                Ok(Some(record)) => {
                    let mut complain = |line, fault| {
                        complaints.add(Complaint { source_file: Source::Reference, line, fault })
                    };
                    match session.take(record, &mut complain) {
                        Ok(()) => continue,
                        Err(Trouble::End(error)) => return Err(error),
                        Err(Trouble::Skip(fault)) => fault,
                    }
                }
            };
            complaints.add(Complaint { source_file: Source::Log, line: lines.number(), fault })?;
        }
        let (in_log, in_reference) = (complaints.in_log, complaints.in_reference);
        Ok(Summary {
            lines: lines.number(),
            lines_skipped: in_log,
            reference_lines_skipped: in_reference,
            ..Summary::of(&session.end()?)
        })
    }
}

impl Summary {
    fn of(end: &End) -> Self {
        let estimate = observe::estimate(&end.localizer);
        let [.., scale_right, scale_left, track_width, range_scale] = estimate.deviation;
        let (localizer, odometry) = (end.score.localizer(), end.score.odometry());
        Self {
            position_rms: localizer.map(|f| f.position_rms),
            position_median: localizer.map(|f| f.position_median),
            position_max: localizer.map(|f| f.position_max),
            heading_rms: localizer.map(|f| f.heading_rms),
            heading_median: localizer.map(|f| f.heading_median),
            heading_max: localizer.map(|f| f.heading_max),
            odometry_position_rms: odometry.map(|f| f.position_rms),
            odometry_position_max: odometry.map(|f| f.position_max),
            odometry_position_median: odometry.map(|f| f.position_median),
            odometry_heading_rms: odometry.map(|f| f.heading_rms),
            odometry_heading_median: odometry.map(|f| f.heading_median),
            odometry_heading_max: odometry.map(|f| f.heading_max),
            fixes: end.tally.fixes,
            calibration: estimate.calibration,
            final_deviation: Calibration { scale_right, scale_left, track_width, range_scale },
            health: end.tally.verdicts,
            honesty: end.score.honesty(),
            started_at: end.started_at,
            duration: end.duration,
            distance: end.tally.distance,
            lines: 0,
            lines_skipped: 0,
            encoder_records: end.tally.encoder_records,
            encoder_jumps: end.tally.encoder_jumps,
            ranges_unused: end.tally.unused,
            reference_rows: end.score.rows(),
            reference_lines_skipped: 0,
        }
    }
}
