//! Where a servo points while it turns: the model in place of the feedback it has not.
//!
//! ```text
//!   bearing
//!      ▲                    ┌──────────┬───▶ settled
//!      │                  ╱ │ settle   │
//!      │                ╱   │          │
//!      │───────────────╱    │          │
//!      └──┬────────────┬────┬──────────┬───▶ time
//!       point   frame     slew
//! ```

use sonarfix::config::Pace;
use sonarfix::units::{Duration, Instant, Radians};

use crate::time::{after, micros, since};

/// How long a servo of this pace takes for a turn, once it has begun.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative; the cast saturates, and rounds NaN to zero"
)]
fn slew(pace: &Pace, turn: Radians) -> Duration {
    let sixty = core::f32::consts::FRAC_PI_3;
    let time = micros(pace.sixty_degrees) * (turn.abs().0 / sixty);
    // Rounded up: never settled too early.
    Duration::from_ticks((time + 1.0) as u64)
}

/// One turn of the servo, from where it was to where it was sent.
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
    pace: Pace,
    turn: Option<Turn>,
}

impl Motion {
    /// A servo of which nobody knows where it points.
    pub fn unknown(pace: Pace) -> Self {
        Self { pace, turn: None }
    }

    pub fn pace(&self) -> &Pace {
        &self.pace
    }

    /// Starts a turn to `to`. From an unknown bearing it takes as long as from the farther limit.
    pub fn start(&mut self, now: Instant, to: Radians, limits: (Radians, Radians)) {
        let from = self.bearing_or_worst(now, to, limits);
        let starts = after(now, self.pace.frame);
        let arrives = after(starts, slew(&self.pace, to - from));
        self.turn = Some(Turn { from, to, starts, arrives });
    }

    fn bearing_or_worst(&self, now: Instant, to: Radians, limits: (Radians, Radians)) -> Radians {
        let (rightmost, leftmost) = limits;
        let farther = if to - rightmost > leftmost - to { rightmost } else { leftmost };
        self.bearing(now).unwrap_or(farther)
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
        // `whole` is at least 1 µs: a slew is rounded up.
        Some(turn.from + (turn.to - turn.from) * (done / whole))
    }

    pub fn settles_at(&self) -> Instant {
        self.turn
            .map_or(Instant::from_ticks(u64::MAX), |turn| after(turn.arrives, self.pace.settle))
    }

    pub fn time_to(&self, now: Instant, bearing: Radians, limits: (Radians, Radians)) -> Duration {
        if self.target() == Some(bearing) {
            return since(self.settles_at(), now);
        }
        let from = self.bearing_or_worst(now, bearing, limits);
        let slew = slew(&self.pace, bearing - from);
        let times = [self.pace.frame, slew, self.pace.settle];
        Duration::from_ticks(times.iter().fold(0, |sum, time| sum.saturating_add(time.ticks())))
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
        let mut motion = Motion::unknown(Pace::SG90);
        assert_eq!(motion.bearing(at(0)), None);
        // From nobody knows where: 1.5 + 1.047 rad at worst, 292 ms.
        motion.start(at(0), Radians::from_degrees(60.0), LIMITS);
        assert!(about(motion.settles_at(), 20 + 292 + 60), "{motion:?}");
        // From 60° to 0°: 120 ms, half-way after 20 + 60.
        motion.start(at(1_000), Radians(0.0), LIMITS);
        assert_eq!(motion.bearing(at(1_010)), Some(Radians::from_degrees(60.0)));
        let half = motion.bearing(at(1_080)).unwrap();
        assert!((half - Radians::from_degrees(30.0)).abs() < Radians(1e-3), "{half:?}");
        assert!(about(motion.settles_at(), 1_200));
        assert_eq!(motion.bearing(at(1_141)), Some(Radians(0.0)));
    }

    #[test]
    fn a_new_turn_starts_from_where_the_old_one_was() {
        let mut motion = Motion::unknown(Pace::SG90);
        motion.start(at(0), Radians::from_degrees(60.0), LIMITS);
        motion.start(at(1_000), Radians(0.0), LIMITS);
        // Half-way back is 30° to go: 60 ms.
        motion.start(at(1_080), Radians::from_degrees(60.0), LIMITS);
        assert!(about(motion.settles_at(), 1_080 + 20 + 60 + 60), "{motion:?}");
    }

    #[test]
    fn time_to_says_what_start_then_does() {
        let mut motion = Motion::unknown(Pace::MG996R);
        for (now, to) in [(0, 1.2), (2_000, -0.3), (2_100, 0.9), (2_110, -1.5)] {
            let promised = motion.time_to(at(now), Radians(to), LIMITS);
            motion.start(at(now), Radians(to), LIMITS);
            assert_eq!(since(motion.settles_at(), at(now)), promised);
        }
    }
}
