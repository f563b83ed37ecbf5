//! MCAP files with messages in JSON, for Foxglove and for the readers of MCAP (`docs/exchange.md`).

use std::collections::BTreeMap;
use std::io::{BufRead, Seek, Write};

use anyhow::{Context, ensure};
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use serde_json::Value;
use sonarfix_replay::{Lines, log};
use sonarfix_sim::trace::Wall;

use crate::log_messages;
use crate::row::{self, Row, Sink};
use crate::scene;
use crate::schema::{self, Schema};

/// The version of topics and messages, in the metadata `sonarfix` of a file.
pub const VERSION: u32 = 1;

/// A file that is being written.
pub struct File<W: Write + Seek> {
    out: mcap::Writer<W>,
    /// Channel and next sequence number of each topic.
    channels: BTreeMap<&'static str, (u16, u32)>,
    /// Time of the run's start on the clock of the file, seconds.
    epoch: f64,
    last: Option<f64>,
    verdict: String,
}

impl<W: Write + Seek> File<W> {
    /// Starts a file with its map. `epoch` is the time of the run's start on the clock of the file, seconds; `metadata` is
    /// written beside the version.
    ///
    /// # Errors
    /// If it cannot be written, or the epoch is negative: MCAP has no times before zero.
    pub fn new(
        out: W,
        epoch: f64,
        walls: &[Wall],
        metadata: &[(&str, String)],
    ) -> anyhow::Result<Self> {
        let library = concat!("sonarfix ", env!("CARGO_PKG_VERSION"));
        let out = WriteOptions::new().compression(None).library(library).create(out)?;
        let mut file =
            Self { out, channels: BTreeMap::new(), epoch, last: None, verdict: String::new() };
        let pairs = metadata.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
        let version = ("format".to_owned(), VERSION.to_string());
        let metadata = std::iter::once(version).chain(pairs).collect();
        file.out.write_metadata(&Metadata { name: "sonarfix".to_owned(), metadata })?;
        let state = schema::columns("sonarfix.Estimate", row::state_columns());
        for (topic, schema) in [
            ("/estimate", state),
            ("/fix", schema::columns("sonarfix.Fix", row::fix_columns())),
            ("/absolute", schema::columns("sonarfix.TakenAbsolute", row::absolute_columns())),
            ("/pose", schema::pose_in_frame()),
            ("/pose/with_covariance", schema::odometry()),
            ("/pose/dead_reckoning", schema::pose_in_frame()),
            ("/pose/true", schema::pose_in_frame()),
            ("/tf", schema::frame_transform()),
            ("/scene/map", schema::scene_update()),
            ("/scene/ellipse", schema::scene_update()),
            ("/scene/beam", schema::scene_update()),
            ("/health", schema::log()),
        ] {
            file.declare(topic, &schema)?;
        }
        let start = stamp(epoch)?;
        file.write("/scene/map", start, &scene::map(start, walls))?;
        Ok(file)
    }

    fn declare(&mut self, topic: &'static str, schema: &Schema) -> anyhow::Result<()> {
        let text = serde_json::to_vec(&schema.text)?;
        let schema = self.out.add_schema(schema.name, "jsonschema", &text)?;
        let channel = self.out.add_channel(schema, topic, "json", &BTreeMap::new())?;
        self.channels.insert(topic, (channel, 0));
        Ok(())
    }

    fn write(&mut self, topic: &str, time: u64, message: &Value) -> anyhow::Result<()> {
        let (channel, next) = self.channels.get_mut(topic).context("a topic is not declared")?;
        let header = MessageHeader {
            channel_id: *channel,
            sequence: *next,
            log_time: time,
            publish_time: time,
        };
        *next = next.wrapping_add(1);
        Ok(self.out.write_to_known_channel(&header, &serde_json::to_vec(message)?)?)
    }

    fn instant(&mut self, row: &Row, seconds: f64) -> anyhow::Result<()> {
        let time = stamp(self.epoch + seconds)?;
        self.write("/estimate", time, &object(row.state()))?;
        let reals = |names: [&str; 3]| -> Option<[f64; 3]> {
            let [a, b, c] = names.map(|name| row.real(name));
            Some([a?, b?, c?])
        };
        let pose = reals(["x_m", "y_m", "heading_rad"]);
        if let Some(pose) = pose {
            self.write("/pose", time, &scene::pose_in_frame(time, pose))?;
            self.write("/tf", time, &scene::transform(time, pose))?;
        }
        let sigma = reals(["sigma_x_m", "sigma_y_m", "sigma_heading_rad"]);
        if let (Some(pose), Some(sigma), Some(xy)) = (pose, sigma, row.real("covariance_xy_m2")) {
            let message = scene::with_covariance(time, pose, sigma, xy);
            self.write("/pose/with_covariance", time, &message)?;
            self.write("/scene/ellipse", time, &scene::ellipse(time, pose, sigma, xy))?;
        }
        for (topic, names) in [
            ("/pose/dead_reckoning", ["odometry_x_m", "odometry_y_m", "odometry_heading_rad"]),
            ("/pose/true", ["true_x_m", "true_y_m", "true_heading_rad"]),
        ] {
            if let Some(pose) = reals(names) {
                self.write(topic, time, &scene::pose_in_frame(time, pose))?;
            }
        }
        self.health(row, time)
    }

    /// A line for each change of the verdict.
    fn health(&mut self, row: &Row, time: u64) -> anyhow::Result<()> {
        let Some(verdict) = row.text("verdict").filter(|verdict| *verdict != self.verdict) else {
            return Ok(());
        };
        self.verdict = verdict.to_owned();
        let level = match verdict {
            "tracking" => 2,
            "degraded" => 3,
            _ => 4,
        };
        let message = serde_json::json!({
            "timestamp": scene::stamp(time),
            "level": level,
            "message": verdict,
            "name": "verdict",
            "file": "",
            "line": 0,
        });
        self.write("/health", time, &message)
    }

    /// Writes the records of a log as they are. Malformed lines are left out. `mount` is the place of the sonar on the robot,
    /// metres.
    ///
    /// # Errors
    /// If the log cannot be read, or the file cannot be written.
    pub fn take_log(&mut self, log: impl BufRead, mount: [f64; 2]) -> anyhow::Result<u64> {
        for (topic, schema) in log_messages::topics() {
            self.declare(topic, &schema)?;
        }
        let mut lines = Lines::of(log);
        let mut count = 0;
        while let Some(line) = lines.next()? {
            let Ok(Some(record)) = line.and_then(log::parse) else { continue };
            let time = stamp(log_messages::time(&record))?;
            let (topic, message) = log_messages::message(&record, time, mount);
            self.write(topic, time, &message)?;
            count += 1;
        }
        Ok(count)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> anyhow::Result<W> {
        self.out.finish()?;
        Ok(self.out.into_inner())
    }
}

impl<W: Write + Seek> Sink for File<W> {
    fn take(&mut self, row: &Row) -> anyhow::Result<()> {
        let seconds = row.real("time_s").context("a row without a time")?;
        let is_new = self.last.is_none_or(|last| last.total_cmp(&seconds).is_ne());
        if is_new {
            self.instant(row, seconds)?;
            self.last = Some(seconds);
        }
        if let Some(seconds) = row.real("fix_time_s") {
            let time = stamp(self.epoch + seconds)?;
            self.write("/fix", time, &object(row.fix()))?;
            if let Some(beam) = scene::beam(time, row) {
                self.write("/scene/beam", time, &beam)?;
            }
        }
        if let Some(seconds) = row.real("absolute_time_s") {
            let time = stamp(self.epoch + seconds)?;
            self.write("/absolute", time, &object(row.absolute()))?;
        }
        Ok(())
    }
}

fn object<'v>(columns: impl Iterator<Item = (&'static str, &'v row::Value)>) -> Value {
    let value = |value: &row::Value| match value {
        row::Value::Real(value) => (*value).into(),
        row::Value::Whole(value) => (*value).into(),
        row::Value::Text(text) => text.as_str().into(),
        row::Value::Unknown => Value::Null,
    };
    columns.map(|(name, of)| (name.to_owned(), value(of))).collect()
}

/// Seconds as the nanoseconds of MCAP.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked before")]
fn stamp(seconds: f64) -> anyhow::Result<u64> {
    ensure!(
        (0.0..=1.8e10).contains(&seconds),
        "the time {seconds} s: MCAP holds times from 0 to 500 years"
    );
    Ok((seconds * 1e9).round() as u64)
}
