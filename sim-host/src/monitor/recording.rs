//! Telemetry as a log that `sonarfix replay` reads (`docs/formats.md`, "Logs").
//!
//! All that the localizer was told is in it, so a replay makes its estimates again, bit for bit, if
//! no frame was lost. A log has one start; when a robot begins anew, so does a log.

use std::fs::File;
use std::io::{self, LineWriter, Write};
use std::path::PathBuf;

use sonarfix::ekf::State;
use sonarfix::units::Instant;
use sonarfix_link::message::{Skip, Step};
use sonarfix_link::{Estimate, Look, Telemetry};

use crate::monitor::Said;
use crate::replay::log::HEADER;

/// Writes logs into files: the first where it is told, further ones with a number in the name.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    written: u32,
    log: Option<Log<LineWriter<File>>>,
    /// The last step, for a log that begins under way.
    step: Option<Step>,
}

impl Recording {
    /// A recording into `path`, which is written as soon as the robot begins or is known to have
    /// begun.
    #[must_use]
    pub fn new(path: PathBuf) -> Self {
        Self { path, written: 0, log: None, step: None }
    }

    /// How many logs were begun.
    #[must_use]
    pub fn logs(&self) -> u32 {
        self.written
    }

    /// Takes what the robot said.
    ///
    /// # Errors
    /// Of a file that cannot be written.
    pub fn take(&mut self, said: &Said) -> io::Result<()> {
        if let Telemetry::Step(step) = &said.telemetry {
            // The robot's clock has started anew, and the frame that said so was lost.
            self.log = self.log.take().filter(|log| step.at >= log.last);
        }
        match (&said.telemetry, &mut self.log) {
            (Telemetry::Began(began), _) => {
                let file = self.next_file()?;
                self.log = Some(Log::begin(file, began)?);
            }
            (_, Some(log)) => log.take(said)?,
            (Telemetry::Step(step), None) => self.step = Some(*step),
            (Telemetry::Estimate(estimate), None) => {
                if let Some(step) = self.step.filter(|step| step.at == estimate.at) {
                    let file = self.next_file()?;
                    self.log = Some(Log::join(file, estimate, &step)?);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn next_file(&mut self) -> io::Result<LineWriter<File>> {
        self.written += 1;
        let mut path = self.path.clone();
        if self.written > 1 {
            let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
            path.set_file_name(format!("{stem}-{}", self.written));
            if let Some(extension) = self.path.extension() {
                path.set_extension(extension);
            }
        }
        Ok(LineWriter::new(File::create(path)?))
    }
}

/// One log.
#[derive(Debug)]
pub struct Log<W> {
    out: W,
    /// The time of the last encoder record.
    last: Instant,
}

impl<W: Write> Log<W> {
    /// A log of a robot that begins.
    ///
    /// # Errors
    /// The writer's.
    pub fn begin(out: W, began: &Estimate) -> io::Result<Self> {
        Self::of(out, "", began, [0.0, 0.0])
    }

    /// A log of a robot that is under way: from an estimate, and the step that led to it. Of what
    /// the estimate's errors have to do with each other it knows nothing, so a replay will come near
    /// the robot's estimates and not be the same.
    ///
    /// # Errors
    /// The writer's.
    pub fn join(out: W, estimate: &Estimate, step: &Step) -> io::Result<Self> {
        let note = "# joined under way: the replay starts from an estimate\n";
        Self::of(out, note, estimate, [step.right_metres, step.left_metres])
    }

    fn of(mut out: W, note: &str, start: &Estimate, wheels: [f64; 2]) -> io::Result<Self> {
        writeln!(
            out,
            "{HEADER}\n{note}resume,{}{}{}",
            Time(start.at),
            List(&start.state),
            List(&start.deviation)
        )?;
        let [right, left] = wheels;
        writeln!(out, "wheels,{},{right},{left}", Time(start.at))?;
        Ok(Self { out, last: start.at })
    }

    /// Takes what the robot said.
    ///
    /// # Errors
    /// The writer's.
    pub fn take(&mut self, said: &Said) -> io::Result<()> {
        if said.lost > 0 {
            writeln!(self.out, "# {} frames were lost here", said.lost)?;
        }
        match &said.telemetry {
            Telemetry::Step(step) => self.step(step),
            Telemetry::Look(look) => self.look(look),
            Telemetry::Skip(Skip { at, .. }) => writeln!(self.out, "skip,{}", Time(*at)),
            _ => Ok(()),
        }
    }

    fn step(&mut self, step: &Step) -> io::Result<()> {
        // A step that took no time went no way, and a log has one encoder record an instant.
        if step.at > self.last {
            self.last = step.at;
            let Step { at, right_metres, left_metres } = step;
            writeln!(self.out, "wheels,{},{right_metres},{left_metres}", Time(*at))?;
        }
        Ok(())
    }

    fn look(&mut self, look: &Look) -> io::Result<()> {
        let range = look.outcome.map_or(String::new(), |echo| f64::from(echo.range.0).to_string());
        let (time, bearing) = (Time(look.at), f64::from(look.aim.bearing.0));
        writeln!(self.out, "range,{time},{bearing},{range},{}", look.aim.wall.0)
    }
}

/// Seconds, to the microsecond.
struct Time(Instant);

impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let micros = self.0.ticks();
        write!(f, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)
    }
}

/// A comma and a number for each state. As `f64`, whose shortest decimals come back as the very
/// same `f32`; those of an `f32` might not, being read as an `f64` and rounded a second time.
struct List<'a>(&'a State);

impl std::fmt::Display for List<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let s = self.0;
        let pose = [s.x, s.y, s.heading];
        let calibration = [s.scale_right, s.scale_left, s.track_width_error, s.range_scale];
        for value in pose.into_iter().chain(calibration) {
            write!(f, ",{}", f64::from(value))?;
        }
        Ok(())
    }
}
