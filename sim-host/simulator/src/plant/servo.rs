//! The true motion of the servo that turns the sonar: delayed, with dead band, backlash and ringing.

use std::f64::consts::TAU;

/// The motion model of a servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoModel {
    /// Period of the pulses, seconds: a new width takes effect with the next pulse.
    pub frame: f64,
    /// Turn rate, rad/s.
    pub slew: f64,
    /// Dead band: it stops this near to the commanded bearing, radians.
    pub dead_band: f64,
    /// Backlash: the lag of the horn in the direction of motion, radians.
    pub backlash: f64,
    /// Amplitude of the ringing on arrival, radians.
    pub ringing: f64,
    /// Decay time of the ringing to 1/e, seconds.
    pub settling: f64,
}

/// Frequency of a small servo's ringing, Hz. Chosen.
const RINGING: f64 = 15.0;

impl ServoModel {
    /// Reaches the commanded bearing at once.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            frame: 0.0,
            slew: f64::INFINITY,
            dead_band: 0.0,
            backlash: 0.0,
            ringing: 0.0,
            settling: 1.0,
        }
    }

    /// SG90, from `docs/hardware.md`: 20 ms frame, 0.10–0.12 s/60°, dead band 5–10 µs (0.5–1°),
    /// 30–60 ms to settle. Backlash and ringing are in no datasheet: chosen.
    #[must_use]
    pub fn sg90() -> Self {
        Self {
            frame: 0.020,
            slew: 60_f64.to_radians() / 0.11,
            dead_band: 0.5_f64.to_radians(),
            backlash: 1_f64.to_radians(),
            ringing: 2_f64.to_radians(),
            settling: 0.015,
        }
    }
}

impl ServoModel {
    /// MG996R, from `docs/hardware.md`: 0.13–0.17 s/60°; otherwise as an SG90.
    #[must_use]
    pub fn mg996r() -> Self {
        Self { slew: 60_f64.to_radians() / 0.15, ..Self::sg90() }
    }
}

/// A motion from one bearing to another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn {
    from: f64,
    to: f64,
    starts: f64,
    arrives: f64,
}

/// A servo. Bearings in radians to the left of ahead, times in seconds.
#[derive(Debug, Clone)]
pub struct ServoPlant {
    model: ServoModel,
    turn: Turn,
}

impl ServoPlant {
    /// A servo at bearing zero, ahead.
    #[must_use]
    pub fn new(model: ServoModel) -> Self {
        Self { model, turn: Turn { from: 0.0, to: 0.0, starts: 0.0, arrives: 0.0 } }
    }

    /// A sonar at a fixed bearing.
    #[must_use]
    pub fn fixed(bearing: f64) -> Self {
        let model = ServoModel::ideal();
        Self { model, turn: Turn { from: bearing, to: bearing, starts: 0.0, arrives: 0.0 } }
    }

    /// Commands a bearing; the motion takes `slowness` times the nominal time.
    pub fn send(&mut self, now: f64, bearing: f64, slowness: f64) {
        let ServoModel { frame, slew, dead_band, .. } = self.model;
        let starts = if frame > 0.0 { (now / frame).ceil() * frame } else { now };
        let from = self.shaft(starts);
        let travel = bearing - from;
        if travel.abs() <= dead_band {
            return;
        }
        let to = bearing - dead_band * travel.signum();
        self.turn =
            Turn { from, to, starts, arrives: starts + slowness * (to - from).abs() / slew };
    }

    /// The bearing of its shaft, without ringing.
    fn shaft(&self, time: f64) -> f64 {
        let Turn { from, to, starts, arrives } = self.turn;
        if time >= arrives {
            return to;
        }
        from + (to - from) * ((time - starts) / (arrives - starts)).max(0.0)
    }

    /// The bearing of the sonar.
    #[must_use]
    pub fn bearing(&self, time: f64) -> f64 {
        let ServoModel { backlash, ringing, settling, .. } = self.model;
        let Turn { from, to, arrives, .. } = self.turn;
        let came_from = (to - from).signum();
        let since = time - arrives;
        let swing = if since > 0.0 && to.total_cmp(&from).is_ne() {
            ringing * libm::exp(-since / settling) * libm::sin(TAU * RINGING * since)
        } else {
            0.0
        };
        self.shaft(time) + came_from * (swing - 0.5 * backlash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ideal_servo_turns_instantly() {
        let mut servo = ServoPlant::new(ServoModel::ideal());
        for (time, bearing) in [(0.0, 1.0), (0.1, -2.0), (0.1, 3.0)] {
            servo.send(time, bearing, 1.0);
            assert!((servo.bearing(time) - bearing).abs() < 1e-12, "{bearing}");
        }
    }

    #[test]
    fn a_real_servo_waits_for_the_frame_turns_and_rings() {
        let model = ServoModel::sg90();
        let mut servo = ServoPlant::new(model);
        let sixty = 60_f64.to_radians();
        servo.send(0.005, sixty, 1.0);
        assert!(servo.bearing(0.0199).abs() <= 0.5 * model.backlash + 1e-12, "before the frame");
        // Half of the motion after 55 ms.
        let half = servo.bearing(0.020 + 0.055);
        assert!((half - 0.5 * sixty).abs() < 0.01, "{half}");
        // It rings on arrival; 60 ms later it is still, short by dead band and half the backlash.
        let arrived = 0.020 + 0.11;
        assert!((servo.bearing(arrived + 0.017) - servo.bearing(1.0)).abs() > 0.005);
        let short = sixty - servo.bearing(arrived + 0.060);
        assert!((short - model.dead_band - 0.5 * model.backlash).abs() < 1e-3, "{short}");
    }

    #[test]
    fn the_servo_stops_within_backlash_and_ignores_the_dead_band() {
        let model = ServoModel::sg90();
        let mut servo = ServoPlant::new(model);
        servo.send(0.0, 1.0, 1.0);
        let from_the_right = servo.bearing(1.0);
        servo.send(1.0, 1.0 - 0.5 * model.dead_band, 1.0);
        assert!((servo.bearing(2.0) - from_the_right).abs() < 1e-12);
        servo.send(2.0, 1.5, 1.0);
        servo.send(3.0, 1.0, 1.0);
        let apart = servo.bearing(4.0) - from_the_right;
        assert!((apart - 2.0 * model.dead_band - model.backlash).abs() < 1e-9, "{apart}");
    }
}
