//! The records of a run as events, each one line of JSON.
//!
//! A record has the columns of the report's player (`sonarfix_player::columns`), which the page appends to its own, and `more` for
//! the curves. All values are in SI units, in the map frame.

use std::fmt::Debug;
use std::sync::Arc;

use serde::Serialize;
use serde_json::json;
use sonarfix::config::CalibrationPrior;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::Floor;
use sonarfix_player::columns;
use sonarfix_sim::trace::{
    AbsoluteRecord, FixRecord, GyroEstimate, SearchRecord, Tick, Trace, Wall,
};
use sonarfix_sim::world::obstacle::Obstacle;

/// What the page shows, and what it may ask for.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Scene {
    /// The title of the page.
    pub title: String,
    /// `robot`, `recording` or `simulation`.
    pub source: &'static str,
    /// Whether the robot takes commands.
    pub commands: bool,
    /// Half of the sonar's cone, radians.
    pub cone: f64,
    /// Track width of the robot, metres; 0 if it is unknown.
    pub track: f64,
    /// The map; empty if it is unknown.
    #[serde(skip)]
    pub walls: Vec<Wall>,
    /// The unmapped obstacles of a simulation.
    #[serde(skip)]
    pub obstacles: Vec<Obstacle>,
    /// Of the robot file; exact without one.
    #[serde(skip)]
    pub prior: CalibrationPrior,
}

impl Scene {
    /// A robot, as far as its map and its configuration are known; and the place of its sonar, metres.
    #[must_use]
    pub fn of_robot(
        title: String,
        floor: Option<&Floor>,
        robot: Option<&RobotConfig>,
    ) -> (Self, [f64; 2]) {
        let sonar = robot.map(|robot| robot.localizer.rangers.first);
        let cone = sonar.map(|sonar| sonar.cone).unwrap_or_default();
        let walls = floor.map_or_else(Vec::new, |floor| Trace::of(floor, cone).walls);
        let track = robot.map_or(0.0, |robot| f64::from(robot.localizer.drive.track_width.0));
        let mount = sonar.map_or([0.0; 2], |of| [of.mount.x.0.into(), of.mount.y.0.into()]);
        let scene = Self {
            title,
            source: "robot",
            commands: true,
            cone: cone.0.into(),
            track,
            walls,
            obstacles: Vec::new(),
            prior: robot.map(|robot| robot.localizer.prior).unwrap_or_default(),
        };
        (scene, mount)
    }
}

/// The loop, the link and what to check.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Status {
    /// Seconds since the robot's clock began.
    pub time: f64,
    /// Longest duration of a poll so far, seconds.
    pub longest_poll: Option<f64>,
    /// Missed deadlines so far.
    pub deadlines: Option<u32>,
    /// All telemetry as lines of text.
    pub lines: Vec<String>,
    /// What to check.
    pub hints: Vec<String>,
    /// The file that is recorded.
    pub recording: Option<String>,
}

/// Where events go.
pub trait Events: Debug + Send + Sync {
    /// Appends an event, a line of JSON.
    fn push(&self, line: &str);

    /// No event will follow.
    fn close(&self);
}

/// Publishes events.
#[derive(Debug, Clone)]
pub struct Feed(Option<Arc<dyn Events>>);

impl Feed {
    /// To these events.
    #[must_use]
    pub fn new(events: Arc<dyn Events>) -> Self {
        Self(Some(events))
    }

    /// To nobody.
    #[must_use]
    pub fn nowhere() -> Self {
        Self(None)
    }

    /// A run begins: the page discards what it has.
    pub fn scene(&self, scene: &Scene) {
        let wall = |wall: &Wall| {
            let [[x0, y0], [x1, y1]] = [wall.from, wall.to];
            json!({ "name": wall.name, "ends": [x0, y0, x1, y1] })
        };
        let walls: Vec<_> = scene.walls.iter().map(wall).collect();
        let obstacles = columns::obstacles(&scene.obstacles);
        self.push(
            &json!({ "kind": "scene", "scene": scene, "walls": walls, "obstacles": obstacles }),
        );
    }

    /// Another run beside that of the scene, with its name: the page shows it at the same time since its start.
    ///
    /// # Errors
    /// If it cannot be written as JSON.
    pub fn beside(&self, name: &str, run: &Trace) -> serde_json::Result<()> {
        let run: serde_json::Value = serde_json::from_str(&sonarfix_player::json(run)?)?;
        self.push(&json!({ "kind": "beside", "name": name, "run": run }));
        Ok(())
    }

    /// An encoder tick, and the gyro if the estimate contains one.
    pub fn tick(&self, tick: &Tick) {
        if let Some(gyro) = &tick.estimate.gyro {
            self.gyro(tick.time, gyro);
        }
        let estimate = &tick.estimate;
        let c = &estimate.calibration;
        self.push(&json!({
            "kind": "record",
            "columns": { "ticks": columns::tick(tick) },
            "more": { "states": {
                "time": [tick.time],
                "scale_right": [c.scale_right],
                "scale_left": [c.scale_left],
                "track_width": [c.track_width],
                "range_scale": [c.range_scale],
            } },
        }));
    }

    /// A measurement cycle.
    pub fn fix(&self, fix: &FixRecord) {
        self.push(&json!({
            "kind": "record",
            "columns": { "fixes": columns::fix(fix) },
            "more": { "weights": { "weight": [fix.association], "bearing": [fix.bearing] } },
        }));
    }

    /// A gyro at a time, seconds.
    pub fn gyro(&self, time: f64, gyro: &GyroEstimate) {
        let columns = json!({ "gyro": columns::gyro(time, gyro) });
        self.push(&json!({ "kind": "record", "columns": columns }));
    }

    /// A heading, position or pose from outside.
    pub fn absolute(&self, absolute: &AbsoluteRecord) {
        let columns = json!({ "absolutes": columns::absolute(absolute) });
        self.push(&json!({ "kind": "record", "columns": columns }));
    }

    /// The state of the search; `text` has its answer in words.
    pub fn search(&self, record: &SearchRecord, text: &str) {
        self.push(&json!({
            "kind": "record",
            "columns": { "searches": columns::search(record) },
            "search": text,
        }));
    }

    /// The distances that the wheels have rolled, metres.
    pub fn wheels(&self, time: f64, right: f64, left: f64) {
        let wheels = json!({ "time": [time], "right": [right], "left": [left] });
        self.push(&json!({ "kind": "record", "columns": {}, "more": { "wheels": wheels } }));
    }

    /// The loop, the link and what to check.
    pub fn status(&self, status: &Status) {
        self.push(&json!({ "kind": "status", "status": status }));
    }

    /// A line for the list of notices.
    pub fn notice(&self, text: &str) {
        self.push(&json!({ "kind": "notice", "text": text }));
    }

    /// No event will follow.
    pub fn end(&self) {
        if let Some(events) = &self.0 {
            events.close();
        }
    }

    fn push(&self, event: &serde_json::Value) {
        if let Some(events) = &self.0 {
            events.push(&event.to_string());
        }
    }
}
