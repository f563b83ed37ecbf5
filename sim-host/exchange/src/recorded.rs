//! The records of a run from the rows of its trace.

use sonarfix::health::Verdict;
use sonarfix_sim::trace::{
    AbsoluteRecord, Calibration, Estimate, FixRecord, GyroEstimate, Outcome, Pose, Recorder, Tick,
    Truth, Wall, Why,
};

use crate::row::{DEVIATIONS, Row, Sink, Value};

/// Passes the records of each row on; the first row is the start. What a trace does not have stays unknown: the source of an echo, the search, and all of the bound.
#[derive(Debug)]
pub struct Recorded<'a, R> {
    recorder: &'a mut R,
    walls: &'a [Wall],
    /// Of the last tick: several measurement cycles before one have a row each, with the same tick.
    last: Option<f64>,
}

impl<'a, R: Recorder> Recorded<'a, R> {
    /// To a recorder, for a run on these walls.
    pub fn new(recorder: &'a mut R, walls: &'a [Wall]) -> Self {
        Self { recorder, walls, last: None }
    }
}

impl<R: Recorder> Sink for Recorded<'_, R> {
    fn take(&mut self, row: &Row) -> anyhow::Result<()> {
        if let Some(fix) = fix(row, self.walls) {
            self.recorder.fix(|| fix);
        }
        if let Some(absolute) = absolute(row) {
            self.recorder.absolute(|| absolute);
        }
        let time = row.real("time_s");
        if self.last.is_none() {
            self.recorder.started(|| tick(row));
        } else if time != self.last {
            self.recorder.tick(|| tick(row));
        }
        self.last = time;
        Ok(())
    }
}

fn tick(row: &Row) -> Tick {
    let estimate = Estimate {
        pose: pose(row, ["x_m", "y_m", "heading_rad"]).unwrap_or_default(),
        calibration: calibration(row, "").unwrap_or_default(),
        deviation: DEVIATIONS.map(|column| number(row, column)),
        covariance_xy: number(row, "covariance_xy_m2"),
        gyro: gyro(row),
        verdict: match row.text("verdict") {
            Some("lost") => Verdict::Lost,
            Some("degraded") => Verdict::Degraded,
            _ => Verdict::Tracking,
        },
        mismatch: None,
        inflations: whole(row, "inflations").unwrap_or_default(),
    };
    let truth = pose(row, ["true_x_m", "true_y_m", "true_heading_rad"]).map(|pose| Truth {
        pose,
        calibration: calibration(row, "true_"),
        gyro_bias: row.real("true_gyro_bias_rad_per_s"),
    });
    let odometry = ["odometry_x_m", "odometry_y_m", "odometry_heading_rad"];
    let odometry = pose(row, odometry).unwrap_or_default();
    Tick { time: number(row, "time_s"), truth, estimate, bound: None, odometry }
}

fn gyro(row: &Row) -> Option<GyroEstimate> {
    Some(GyroEstimate {
        bias: row.real("gyro_bias_rad_per_s")?,
        deviation: number(row, "sigma_gyro_bias_rad_per_s"),
        slips: whole(row, "slips").unwrap_or_default(),
    })
}

fn pose(row: &Row, [x, y, heading]: [&str; 3]) -> Option<Pose> {
    Some(Pose { x: row.real(x)?, y: row.real(y)?, heading: row.real(heading)? })
}

fn calibration(row: &Row, prefix: &str) -> Option<Calibration> {
    let of = |name: &str| row.real(&format!("{prefix}{name}"));
    Some(Calibration {
        scale_right: of("scale_right")?,
        scale_left: of("scale_left")?,
        track_width: of("track_width_m")?,
        range_scale: of("range_scale")?,
    })
}

fn fix(row: &Row, walls: &[Wall]) -> Option<FixRecord> {
    let wall = row.text("fix_wall");
    let why = || {
        Some(Why {
            gain: row.real("fix_gain_m2")?,
            success: row.real("fix_success")?,
            seconds: row.real("fix_seconds")?,
            candidates: whole(row, "fix_candidates")?,
        })
    };
    Some(FixRecord {
        time: row.real("fix_time_s")?,
        wall: wall.and_then(|name| walls.iter().position(|wall| wall.name == name)),
        ranger: whole(row, "fix_ranger").unwrap_or_default(),
        sonar: ["fix_sonar_x_m", "fix_sonar_y_m"].map(|column| number(row, column)),
        direction: number(row, "fix_direction_rad"),
        bearing: number(row, "fix_bearing_rad"),
        range: row.real("fix_range_m"),
        source: None,
        why: why(),
        outcome: outcome(row, "fix_outcome"),
        association: row.real("fix_association"),
        reason: row.text("fix_reason").unwrap_or_default().to_owned(),
        innovation: row.real("fix_innovation_m"),
        innovation_variance: row.real("fix_innovation_variance_m2"),
    })
}

fn absolute(row: &Row) -> Option<AbsoluteRecord> {
    Some(AbsoluteRecord {
        time: row.real("absolute_time_s")?,
        position: row.real("absolute_x_m").zip(row.real("absolute_y_m")).map(<[f64; 2]>::from),
        heading: row.real("absolute_heading_rad"),
        outcome: outcome(row, "absolute_outcome"),
        reason: row.text("absolute_reason").unwrap_or_default().to_owned(),
        nis: row.real("absolute_nis"),
    })
}

fn outcome(row: &Row, column: &str) -> Outcome {
    match row.text(column) {
        Some("accepted") => Outcome::Accepted,
        Some("downweighted") => Outcome::Downweighted,
        Some("gated") => Outcome::Gated,
        _ => Outcome::Refused,
    }
}

fn number(row: &Row, column: &str) -> f64 {
    row.real(column).unwrap_or(f64::NAN)
}

fn whole<T: TryFrom<i64>>(row: &Row, column: &str) -> Option<T> {
    match row.value(column) {
        Value::Whole(value) => T::try_from(*value).ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use sonarfix_map::Scenario;
    use sonarfix_sim::simulate::Simulation;
    use sonarfix_sim::trace::Trace;

    use super::*;
    use crate::trace_csv;

    fn written(trace: &Trace) -> Vec<u8> {
        let mut file = Vec::new();
        trace_csv::write(trace, &mut file).unwrap();
        file
    }

    /// A trace that is read and written again has the same bytes but for the bound, which is not read.
    #[test]
    fn a_trace_of_a_run_with_a_gyro_is_read_as_it_was_written() {
        let scenario = Scenario::parse(sonarfix_map::CLASSROOM, "", "".as_ref()).unwrap();
        let simulation = Simulation::new(scenario);
        let mut trace = simulation.empty_trace();
        simulation.run(3, &mut trace).unwrap();
        trace.ticks.truncate(500);
        let end = trace.ticks[499].time;
        trace.fixes.retain(|fix| fix.time <= end);
        for tick in trace.start.iter_mut().chain(&mut trace.ticks) {
            tick.bound = None;
            tick.estimate.gyro = Some(GyroEstimate { bias: 0.01, deviation: 0.002, slips: 1 });
        }
        for (number, reason) in [(0, Outcome::Accepted), (2, Outcome::Gated)] {
            trace.absolutes.push(AbsoluteRecord {
                time: trace.ticks[40 + number].time,
                position: Some([1.0, 2.0]),
                heading: None,
                outcome: reason,
                reason: String::new(),
                nis: Some(0.5),
            });
        }
        assert!(trace.fixes.len() > 20, "{} measurement cycles", trace.fixes.len());
        let file = written(&trace);
        let mut read = Trace { walls: trace.walls.clone(), ..Trace::default() };
        let walls = trace.walls.clone();
        let mut records = Recorded::new(&mut read, &walls);
        trace_csv::read(file.as_slice(), &mut [&mut records]).unwrap();
        assert_eq!(read.ticks.len(), trace.ticks.len());
        assert_eq!(read.fixes.len(), trace.fixes.len());
        assert_eq!(String::from_utf8(written(&read)).unwrap(), String::from_utf8(file).unwrap());
    }
}
