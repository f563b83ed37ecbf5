//! The rows of a trace: its columns with their types, and a recorder that passes each row on (`docs/formats.md`, "Traces").

use anyhow::ensure;
use sonarfix::health::Verdict;
use sonarfix_sim::trace::{AbsoluteRecord, FixRecord, Outcome, Recorder, Tick, Trace, Wall};

/// The type of a column's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Real,
    /// A whole number.
    Whole,
    /// A text.
    Text,
}

/// The value of a column in a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Real(f64),
    /// A whole number.
    Whole(i64),
    /// A text.
    Text(String),
    /// Unknown, or not there.
    Unknown,
}

/// The columns of the deviations of the states.
pub(crate) const DEVIATIONS: [&str; 7] = [
    "sigma_x_m",
    "sigma_y_m",
    "sigma_heading_rad",
    "sigma_scale_right",
    "sigma_scale_left",
    "sigma_track_width_m",
    "sigma_range_scale",
];

/// The columns of an instant: name with unit, and type.
const STATE_COLUMNS: [(&str, Kind); 35] = [
    ("time_s", Kind::Real),
    ("true_x_m", Kind::Real),
    ("true_y_m", Kind::Real),
    ("true_heading_rad", Kind::Real),
    ("true_scale_right", Kind::Real),
    ("true_scale_left", Kind::Real),
    ("true_track_width_m", Kind::Real),
    ("true_range_scale", Kind::Real),
    ("x_m", Kind::Real),
    ("y_m", Kind::Real),
    ("heading_rad", Kind::Real),
    ("scale_right", Kind::Real),
    ("scale_left", Kind::Real),
    ("track_width_m", Kind::Real),
    ("range_scale", Kind::Real),
    ("sigma_x_m", Kind::Real),
    ("sigma_y_m", Kind::Real),
    ("sigma_heading_rad", Kind::Real),
    ("sigma_scale_right", Kind::Real),
    ("sigma_scale_left", Kind::Real),
    ("sigma_track_width_m", Kind::Real),
    ("sigma_range_scale", Kind::Real),
    ("covariance_xy_m2", Kind::Real),
    ("verdict", Kind::Text),
    ("inflations", Kind::Whole),
    ("bound_x_m", Kind::Real),
    ("bound_y_m", Kind::Real),
    ("bound_heading_rad", Kind::Real),
    ("odometry_x_m", Kind::Real),
    ("odometry_y_m", Kind::Real),
    ("odometry_heading_rad", Kind::Real),
    ("true_gyro_bias_rad_per_s", Kind::Real),
    ("gyro_bias_rad_per_s", Kind::Real),
    ("sigma_gyro_bias_rad_per_s", Kind::Real),
    ("slips", Kind::Whole),
];

/// The columns of a measurement cycle.
const FIX_COLUMNS: [(&str, Kind); 17] = [
    ("fix_time_s", Kind::Real),
    ("fix_wall", Kind::Text),
    ("fix_bearing_rad", Kind::Real),
    ("fix_direction_rad", Kind::Real),
    ("fix_range_m", Kind::Real),
    ("fix_gain_m2", Kind::Real),
    ("fix_success", Kind::Real),
    ("fix_seconds", Kind::Real),
    ("fix_candidates", Kind::Whole),
    ("fix_outcome", Kind::Text),
    ("fix_association", Kind::Real),
    ("fix_reason", Kind::Text),
    ("fix_innovation_m", Kind::Real),
    ("fix_innovation_variance_m2", Kind::Real),
    ("fix_sonar_x_m", Kind::Real),
    ("fix_sonar_y_m", Kind::Real),
    ("fix_ranger", Kind::Whole),
];

/// The columns of a heading, position or pose from outside.
const ABSOLUTE_COLUMNS: [(&str, Kind); 7] = [
    ("absolute_time_s", Kind::Real),
    ("absolute_x_m", Kind::Real),
    ("absolute_y_m", Kind::Real),
    ("absolute_heading_rad", Kind::Real),
    ("absolute_outcome", Kind::Text),
    ("absolute_reason", Kind::Text),
    ("absolute_nis", Kind::Real),
];

/// All columns, in the order of a row.
pub fn columns() -> impl Iterator<Item = (&'static str, Kind)> {
    STATE_COLUMNS.into_iter().chain(FIX_COLUMNS).chain(ABSOLUTE_COLUMNS)
}

/// The columns of an instant.
pub fn state_columns() -> impl Iterator<Item = (&'static str, Kind)> {
    STATE_COLUMNS.into_iter()
}

/// The columns of a measurement cycle.
pub fn fix_columns() -> impl Iterator<Item = (&'static str, Kind)> {
    FIX_COLUMNS.into_iter()
}

/// The columns of a heading, position or pose from outside.
pub fn absolute_columns() -> impl Iterator<Item = (&'static str, Kind)> {
    ABSOLUTE_COLUMNS.into_iter()
}

/// An instant of a trace, with at most one measurement cycle and one absolute measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    values: Vec<Value>,
}

impl Row {
    /// The row of an instant, and of a measurement cycle and an absolute measurement at or before it.
    #[must_use]
    pub fn new(
        tick: &Tick,
        fix: Option<&FixRecord>,
        absolute: Option<&AbsoluteRecord>,
        walls: &[Wall],
    ) -> Self {
        let mut values = state_values(tick);
        match fix {
            Some(fix) => values.extend(fix_values(fix, walls)),
            None => values.extend(FIX_COLUMNS.map(|_| Value::Unknown)),
        }
        match absolute {
            Some(absolute) => values.extend(absolute_values(absolute)),
            None => values.extend(ABSOLUTE_COLUMNS.map(|_| Value::Unknown)),
        }
        Self { values }
    }

    /// A row of these values.
    ///
    /// # Errors
    /// If their number is not that of the columns.
    pub fn of_values(values: Vec<Value>) -> anyhow::Result<Self> {
        ensure!(values.len() == columns().count(), "the row has {} values", values.len());
        Ok(Self { values })
    }

    /// The values, in the order of [`columns`].
    #[must_use]
    pub fn values(&self) -> &[Value] {
        &self.values
    }

    /// The value of a column; unknown if there is no such column.
    #[must_use]
    pub fn value(&self, column: &str) -> &Value {
        let at = columns().position(|(name, _)| name == column);
        at.and_then(|at| self.values.get(at)).unwrap_or(&Value::Unknown)
    }

    /// The number in a column.
    #[must_use]
    pub fn real(&self, column: &str) -> Option<f64> {
        match self.value(column) {
            Value::Real(value) => Some(*value),
            _ => None,
        }
    }

    /// The text in a column.
    #[must_use]
    pub fn text(&self, column: &str) -> Option<&str> {
        match self.value(column) {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Whether there is a measurement cycle.
    #[must_use]
    pub fn has_fix(&self) -> bool {
        self.real("fix_time_s").is_some()
    }

    /// The columns of the instant with their values.
    pub fn state(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        state_columns().map(|(name, _)| name).zip(&self.values)
    }

    /// The columns of the measurement cycle with their values.
    pub fn fix(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        let values = self.values.iter().skip(STATE_COLUMNS.len());
        fix_columns().map(|(name, _)| name).zip(values)
    }

    /// The columns of the absolute measurement with their values.
    pub fn absolute(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        let values = self.values.iter().skip(STATE_COLUMNS.len() + FIX_COLUMNS.len());
        absolute_columns().map(|(name, _)| name).zip(values)
    }
}

fn optional(value: Option<f64>) -> Value {
    value.map_or(Value::Unknown, Value::Real)
}

fn state_values(tick: &Tick) -> Vec<Value> {
    let truth = tick.truth.map(|truth| truth.pose);
    let calibration = tick.truth.and_then(|truth| truth.calibration);
    let estimate = &tick.estimate;
    let mut values = vec![Value::Real(tick.time)];
    let pose = [truth.map(|p| p.x), truth.map(|p| p.y), truth.map(|p| p.heading)];
    let scales = [
        calibration.map(|c| c.scale_right),
        calibration.map(|c| c.scale_left),
        calibration.map(|c| c.track_width),
        calibration.map(|c| c.range_scale),
    ];
    values.extend(pose.into_iter().chain(scales).map(optional));
    let (pose, c) = (estimate.pose, estimate.calibration);
    let states =
        [pose.x, pose.y, pose.heading, c.scale_right, c.scale_left, c.track_width, c.range_scale];
    values.extend(states.into_iter().chain(estimate.deviation).map(Value::Real));
    values.push(Value::Real(estimate.covariance_xy));
    values.push(Value::Text(verdict(estimate.verdict).to_owned()));
    values.push(Value::Whole(estimate.inflations.into()));
    let bound = tick.bound.map_or([None; 3], |[x, y, heading, ..]| [x, y, heading].map(Some));
    values.extend(bound.map(optional));
    values.extend([tick.odometry.x, tick.odometry.y, tick.odometry.heading].map(Value::Real));
    let gyro = estimate.gyro;
    let true_bias = gyro.and_then(|_| tick.truth?.gyro_bias);
    values.extend(
        [true_bias, gyro.map(|gyro| gyro.bias), gyro.map(|gyro| gyro.deviation)].map(optional),
    );
    values.push(gyro.map_or(Value::Unknown, |gyro| Value::Whole(gyro.slips.into())));
    values
}

fn text(text: &str) -> Value {
    if text.is_empty() { Value::Unknown } else { Value::Text(text.to_owned()) }
}

fn outcome(outcome: Outcome) -> Value {
    text(match outcome {
        Outcome::Accepted => "accepted",
        Outcome::Downweighted => "downweighted",
        Outcome::Gated => "gated",
        Outcome::Refused => "refused",
    })
}

fn absolute_values(of: &AbsoluteRecord) -> [Value; ABSOLUTE_COLUMNS.len()] {
    [
        Value::Real(of.time),
        optional(of.position.map(|[x, _]| x)),
        optional(of.position.map(|[_, y]| y)),
        optional(of.heading),
        outcome(of.outcome),
        text(&of.reason),
        optional(of.nis),
    ]
}

fn fix_values(fix: &FixRecord, walls: &[Wall]) -> [Value; FIX_COLUMNS.len()] {
    let wall = fix.wall.and_then(|wall| walls.get(wall));
    let [x, y] = fix.sonar;
    [
        Value::Real(fix.time),
        wall.map_or(Value::Unknown, |wall| text(&wall.name)),
        Value::Real(fix.bearing),
        Value::Real(fix.direction),
        optional(fix.range),
        optional(fix.why.map(|why| why.gain)),
        optional(fix.why.map(|why| why.success)),
        optional(fix.why.map(|why| why.seconds)),
        fix.why.map_or(Value::Unknown, |why| Value::Whole(why.candidates.into())),
        outcome(fix.outcome),
        optional(fix.association),
        text(&fix.reason),
        optional(fix.innovation),
        optional(fix.innovation_variance),
        Value::Real(x),
        Value::Real(y),
        Value::Whole(fix.ranger.into()),
    ]
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Tracking => "tracking",
        Verdict::Degraded => "degraded",
        Verdict::Lost => "lost",
    }
}

/// Receives rows.
pub trait Sink {
    /// Takes the next row.
    ///
    /// # Errors
    /// If it cannot be written.
    fn take(&mut self, row: &Row) -> anyhow::Result<()>;
}

/// Passes the rows of a run on as it proceeds. A measurement cycle is in the row of the first instant at or after it, and so is a measurement
/// from outside; several before one instant have a row each, with the same state.
pub struct Rows<'a> {
    sinks: Vec<&'a mut dyn Sink>,
    walls: &'a [Wall],
    pending: Vec<FixRecord>,
    pending_absolutes: Vec<AbsoluteRecord>,
    error: Option<anyhow::Error>,
}

impl<'a> Rows<'a> {
    /// Rows of a run on these walls.
    #[must_use]
    pub fn new(walls: &'a [Wall], sinks: Vec<&'a mut dyn Sink>) -> Self {
        let (pending, pending_absolutes) = (Vec::new(), Vec::new());
        Self { sinks, walls, pending, pending_absolutes, error: None }
    }

    /// Ends the run.
    ///
    /// # Errors
    /// The first error of a sink.
    pub fn end(self) -> anyhow::Result<()> {
        self.error.map_or(Ok(()), Err)
    }

    fn instant(&mut self, tick: &Tick) -> anyhow::Result<()> {
        let due = self.pending.iter().take_while(|fix| fix.time <= tick.time).count();
        let fixes: Vec<FixRecord> = self.pending.drain(..due).collect();
        let is_due = |absolute: &&AbsoluteRecord| absolute.time <= tick.time;
        let due = self.pending_absolutes.iter().take_while(is_due).count();
        let absolutes: Vec<AbsoluteRecord> = self.pending_absolutes.drain(..due).collect();
        for at in 0..fixes.len().max(absolutes.len()).max(1) {
            let row = Row::new(tick, fixes.get(at), absolutes.get(at), self.walls);
            for sink in &mut self.sinks {
                sink.take(&row)?;
            }
        }
        Ok(())
    }

    fn note(&mut self, tick: &Tick) {
        if self.error.is_none() {
            self.error = self.instant(tick).err();
        }
    }
}

/// Passes the rows of a recorded trace on, as [`Rows`] does those of a run; the start is the first, if it is known.
///
/// # Errors
/// The first error of the sink.
pub fn pass(trace: &Trace, sink: &mut dyn Sink) -> anyhow::Result<()> {
    let mut rows = Rows::new(&trace.walls, vec![sink]);
    let mut fixes = trace.fixes.iter().peekable();
    let mut absolutes = trace.absolutes.iter().peekable();
    for tick in trace.start.iter().chain(&trace.ticks) {
        while let Some(fix) = fixes.next_if(|fix| fix.time <= tick.time) {
            rows.fix(|| fix.clone());
        }
        while let Some(absolute) = absolutes.next_if(|absolute| absolute.time <= tick.time) {
            rows.absolute(|| absolute.clone());
        }
        rows.tick(|| *tick);
    }
    rows.end()
}

impl Recorder for Rows<'_> {
    fn started(&mut self, make: impl FnOnce() -> Tick) {
        self.note(&make());
    }

    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        self.note(&make());
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        self.pending.push(make());
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        self.pending_absolutes.push(make());
    }
}
