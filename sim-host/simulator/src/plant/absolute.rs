//! Sensors that measure heading, position or pose from outside.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix_map::{AbsoluteSensors, HeadingSensor, PositionSensor, Sampling};

use crate::random;
use crate::trace;

/// Half of the side of the square in which an outlying position lies, metres.
const ASTRAY: f64 = 5.0;

/// The sensors, and what they have measured that has not arrived.
#[derive(Debug, Clone)]
pub struct Absolute {
    sensors: AbsoluteSensors,
    /// The times of the next heading and of the next position, µs.
    next: [u64; 2],
    /// Arrival, µs, and measurement with its time.
    under_way: Vec<(u64, Instant, AbsoluteMeasurement)>,
}

impl Absolute {
    /// The sensors of a scenario; the first measurement is after one period.
    #[must_use]
    pub fn new(sensors: AbsoluteSensors) -> Self {
        let first = |sampling: Option<Sampling>| sampling.map_or(u64::MAX, |it| it.period);
        let next = [
            first(sensors.heading.map(|sensor| sensor.sampling)),
            first(sensors.position.map(|sensor| sensor.sampling)),
        ];
        Self { sensors, next, under_way: Vec::new() }
    }

    /// When something is measured or arrives after `now`, µs.
    #[must_use]
    pub fn next(&self, now: u64) -> u64 {
        let later = self.under_way.iter().map(|(arrival, ..)| *arrival).filter(|at| *at > now);
        let [heading, position] = self.next;
        heading.min(position).min(later.min().unwrap_or(u64::MAX))
    }

    /// Whether something is to be measured at `now`, µs.
    #[must_use]
    pub fn is_due(&self, now: u64) -> bool {
        self.next.iter().any(|&next| next <= now)
    }

    /// Measures what is due at the true pose.
    pub fn measure(&mut self, now: u64, truth: &trace::Pose, rng: &mut ChaCha8Rng) {
        let at = Instant::from_ticks(now);
        let [heading, position] = &mut self.next;
        if let Some(sensor) = self.sensors.heading.filter(|_| *heading <= now) {
            *heading += sensor.sampling.period;
            let arrival = now + sensor.sampling.delay;
            self.under_way.push((arrival, at, measure_heading(&sensor, truth, rng)));
        }
        if let Some(sensor) = self.sensors.position.filter(|_| *position <= now) {
            *position += sensor.sampling.period;
            let arrival = now + sensor.sampling.delay;
            self.under_way.push((arrival, at, measure_position(&sensor, truth, rng)));
        }
    }

    /// What has arrived of what was measured up to `until`, µs, with the time of its measurement.
    pub fn arrived(&mut self, now: u64, until: u64) -> Option<(Instant, AbsoluteMeasurement)> {
        let is_due = |(arrival, at, _): &(u64, Instant, AbsoluteMeasurement)| {
            *arrival <= now && at.ticks() <= until
        };
        let first = self.under_way.iter().position(is_due)?;
        let (_, at, measurement) = self.under_way.remove(first);
        Some((at, measurement))
    }
}

fn is_outlier(sampling: &Sampling, rng: &mut ChaCha8Rng) -> bool {
    rng.random_bool(sampling.outliers)
}

fn any_heading(rng: &mut ChaCha8Rng) -> f64 {
    rng.random_range(-std::f64::consts::PI..std::f64::consts::PI)
}

fn measure_heading(
    sensor: &HeadingSensor,
    truth: &trace::Pose,
    rng: &mut ChaCha8Rng,
) -> AbsoluteMeasurement {
    let measured = truth.heading + sensor.deviation * random::normal(rng);
    let measured = if is_outlier(&sensor.sampling, rng) { any_heading(rng) } else { measured };
    let [angle, deviation] = single([measured, sensor.deviation]);
    AbsoluteMeasurement::Heading { angle: Radians(angle), deviation: Radians(deviation) }
}

fn measure_position(
    sensor: &PositionSensor,
    truth: &trace::Pose,
    rng: &mut ChaCha8Rng,
) -> AbsoluteMeasurement {
    let is_outlier = is_outlier(&sensor.sampling, rng);
    let mut measured = |true_value: f64| {
        let noise = sensor.deviation * random::normal(rng);
        true_value + if is_outlier { rng.random_range(-ASTRAY..ASTRAY) } else { noise }
    };
    let [x, y, deviation] = single([measured(truth.x), measured(truth.y), sensor.deviation]);
    let Some(heading_deviation) = sensor.heading_deviation else {
        let noise = PositionNoise::circular(Metres(deviation));
        return AbsoluteMeasurement::Position { point: Point::new(x, y), noise };
    };
    let noise = heading_deviation * random::normal(rng);
    let heading = if is_outlier { any_heading(rng) } else { truth.heading + noise };
    let [heading, heading_deviation] = single([heading, heading_deviation]);
    let noise = PoseNoise::independent(Metres(deviation), Radians(heading_deviation));
    AbsoluteMeasurement::Pose { pose: Pose::new(x, y, Radians(heading)), noise }
}

#[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
fn single<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|value| value as f32)
}
