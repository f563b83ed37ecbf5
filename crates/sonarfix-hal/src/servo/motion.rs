//! The bearing of a servo while it turns, by the model [`ServoMotion`] in place of feedback.

use sonarfix::config::ServoTiming;
use sonarfix::geometry::units::{Instant, Radians};
use sonarfix::sensor::servo::ServoMotion;

use crate::time::{NEVER, after, micros, since};

/// One turn of the servo.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn {
    from: Radians,
    to: Radians,
    starts: Instant,
    arrives: Instant,
}

/// The model's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    timing: ServoTiming,
    turn: Option<Turn>,
}

impl Motion {
    /// A servo at an unknown bearing.
    pub fn unknown(timing: ServoTiming) -> Self {
        Self { timing, turn: None }
    }

    /// Starts a turn to `to`. From an unknown bearing its time is that from the farther limit.
    pub fn start(&mut self, now: Instant, to: Radians, limits: (Radians, Radians)) {
        let from = self.bearing_or_worst(now, to, limits);
        let starts = after(now, self.timing.frame);
        let arrives = after(starts, ServoMotion::new(&self.timing).slew(to - from));
        self.turn = Some(Turn { from, to, starts, arrives });
    }

    fn bearing_or_worst(&self, now: Instant, to: Radians, limits: (Radians, Radians)) -> Radians {
        let (rightmost, leftmost) = limits;
        let farther = if to - rightmost > leftmost - to { rightmost } else { leftmost };
        self.bearing(now).unwrap_or(farther)
    }

    /// The clock was set back to `now`: a whole turn begins now.
    pub fn set_clock(&mut self, now: Instant, limits: (Radians, Radians)) {
        if let Some(turn) = self.turn.take() {
            self.start(now, turn.to, limits);
        }
    }

    pub fn target(&self) -> Option<Radians> {
        self.turn.map(|turn| turn.to)
    }

    pub fn bearing(&self, now: Instant) -> Option<Radians> {
        let turn = self.turn?;
        if now >= turn.arrives {
            return Some(turn.to);
        }
        let whole = micros(since(turn.arrives, turn.starts));
        let done = micros(since(now, turn.starts));
        // `whole` is at least 1 µs, because a slew is rounded up.
        Some(turn.from + (turn.to - turn.from) * (done / whole))
    }

    pub fn arrives_at(&self) -> Instant {
        self.turn.map_or(NEVER, |turn| turn.arrives)
    }

    pub fn settles_at(&self) -> Instant {
        self.turn.map_or(NEVER, |turn| after(turn.arrives, self.timing.settle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: (Radians, Radians) = (Radians(-1.5), Radians(1.5));

    fn at(millis: u64) -> Instant {
        Instant::from_ticks(millis * 1_000)
    }

    fn about(time: Instant, millis: u64) -> bool {
        time.ticks().abs_diff(millis * 1_000) < 200
    }

    #[test]
    fn a_turn_waits_a_frame_slews_and_settles() {
        let mut motion = Motion::unknown(ServoTiming::SG90);
        assert_eq!(motion.bearing(at(0)), None);
        // From an unknown bearing: 1.5 + 1.047 rad at worst, 292 ms.
        motion.start(at(0), Radians::from_degrees(60.0), LIMITS);
        assert!(about(motion.arrives_at(), 20 + 292), "{motion:?}");
        assert!(about(motion.settles_at(), 20 + 292 + 60), "{motion:?}");
        // From 60° to 0°: 120 ms, 30° after 20 + 60.
        motion.start(at(1_000), Radians(0.0), LIMITS);
        assert_eq!(motion.bearing(at(1_010)), Some(Radians::from_degrees(60.0)));
        let half = motion.bearing(at(1_080)).unwrap();
        assert!((half - Radians::from_degrees(30.0)).abs() < Radians(1e-3), "{half:?}");
        assert!(about(motion.settles_at(), 1_200));
        assert_eq!(motion.bearing(at(1_141)), Some(Radians(0.0)));
    }

    #[test]
    fn a_new_turn_starts_from_where_the_old_one_was() {
        let mut motion = Motion::unknown(ServoTiming::SG90);
        motion.start(at(0), Radians::from_degrees(60.0), LIMITS);
        motion.start(at(1_000), Radians(0.0), LIMITS);
        // Back from there are 30°: 60 ms.
        motion.start(at(1_080), Radians::from_degrees(60.0), LIMITS);
        assert!(about(motion.settles_at(), 1_080 + 20 + 60 + 60), "{motion:?}");
    }
}
