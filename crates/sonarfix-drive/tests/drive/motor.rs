//! A motor with gear, wheel and encoder: a first-order lag with dry friction, in steps of a millisecond.

use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond};
use sonarfix_drive::wheel::{Limits, Motor};

/// The motor as its builder measured it, and a ramp of 1 m/s².
pub const MEASURED: Motor = Motor {
    full_speed: MetresPerSecond(0.5),
    dead_band: 0.15,
    time_constant: Duration::from_ticks(80_000),
    travel_per_tick: Metres(0.000_488_7),
};
pub const LIMITS: Limits = Limits {
    response: Duration::from_ticks(150_000),
    ramp: Duration::from_ticks(500_000),
    duty: 1.0,
};

/// The step of the model, seconds.
const STEP: f64 = 0.001;

/// The true motor in motion.
#[derive(Debug, Clone)]
pub struct MotorModel {
    /// Speed at the full voltage, m/s, dead band, and time constant, seconds.
    pub full_speed: f64,
    pub dead_band: f64,
    pub time_constant: f64,
    /// Whether the wheel is held.
    pub is_blocked: bool,
    pub speed: f64,
    travel: f64,
}

impl MotorModel {
    /// The measured motor, with these factors of its full speed, dead band and time constant.
    pub fn differing([full_speed, dead_band, time_constant]: [f64; 3]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "a short time")]
        let lag = MEASURED.time_constant.to_micros() as f64 * 1e-6;
        Self {
            full_speed: f64::from(MEASURED.full_speed.0) * full_speed,
            dead_band: f64::from(MEASURED.dead_band) * dead_band,
            time_constant: lag * time_constant,
            is_blocked: false,
            speed: 0.0,
            travel: 0.0,
        }
    }

    /// Whether the wheel does not turn.
    pub fn is_at_rest(&self) -> bool {
        self.speed.abs() <= 0.0
    }

    /// A millisecond at this duty.
    pub fn step(&mut self, duty: f32) {
        let duty = f64::from(duty);
        let per_duty = self.full_speed / (1.0 - self.dead_band);
        let is_held = self.is_at_rest() && duty.abs() <= self.dead_band;
        if self.is_blocked || is_held {
            self.speed = 0.0;
            return;
        }
        let direction = if self.is_at_rest() { duty.signum() } else { self.speed.signum() };
        let friction = self.dead_band * direction;
        let change = (per_duty * (duty - friction) - self.speed) * STEP / self.time_constant;
        let speed = self.speed + change;
        // Friction stops a wheel and does not turn it back.
        let is_stopped = speed * direction < 0.0 && duty.abs() <= self.dead_band;
        self.speed = if is_stopped { 0.0 } else { speed };
        self.travel += self.speed * STEP;
    }

    /// The speed that the measured friction adds to that of the true one, at most.
    pub fn excess_by_friction(&self) -> f64 {
        let excess = f64::from(MEASURED.dead_band) - self.dead_band;
        excess.max(0.0) * self.full_speed / (1.0 - self.dead_band)
    }

    /// The position of the encoder.
    pub fn ticks(&self) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "some metres")]
        let ticks = (self.travel / f64::from(MEASURED.travel_per_tick.0)).floor() as i64;
        ticks
    }
}
