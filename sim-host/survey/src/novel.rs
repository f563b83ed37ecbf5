//! Which pings count. A sonar that sweeps fast pings the same places from the same place again and again: an object that is no wall would
//! return as many echoes as a drive along a wall does. A ping is novel if none was sent from within 20 cm of driving and 10° of turning in a
//! direction within 10°. The search has a similar rule without the turns (docs/search.md), from which a survey estimates the track width.

use sonarfix_batch::odometry::wrap;
use sonarfix_batch::recording::Recording;

/// Distance driven, metres.
const NEAR: f64 = 0.2;
/// Difference of headings and of directions, radians: slightly less than 10°, the step of the sweep.
const SIMILAR: f64 = 0.17;

/// A ping that counts, by the encoders.
struct Kept {
    /// Distance driven, metres.
    driven: f64,
    /// Heading, and direction of the axis, radians.
    heading: f64,
    direction: f64,
}

impl Kept {
    fn is_near(&self, later: &Self) -> bool {
        later.driven - self.driven < NEAR
    }

    fn is_like(&self, later: &Self) -> bool {
        (later.heading - self.heading).abs() < SIMILAR
            && wrap(later.direction - self.direction).abs() < SIMILAR
    }
}

/// The recording with the novel pings alone. Headings are those of the encoders of a robot with this track width, metres.
#[must_use]
pub fn novel(recording: &Recording, track_width: f64) -> Recording {
    let mut steps = recording.readings.iter().zip(recording.readings.iter().skip(1)).peekable();
    let (mut driven, mut heading) = (0.0, 0.0);
    let mut kept: Vec<Kept> = Vec::new();
    let mut novel = recording.clone();
    novel.pings.retain(|ping| {
        while let Some((from, to)) = steps.next_if(|(_, to)| to.time <= ping.time) {
            let [right, left] = [0, 1].map(|k| match (from.travel.get(k), to.travel.get(k)) {
                (Some(from), Some(to)) => to - from,
                _ => 0.0,
            });
            driven += f64::midpoint(right, left).abs();
            heading += (right - left) / track_width;
        }
        let this = Kept { driven, heading, direction: heading + ping.bearing };
        let is_novel =
            !kept.iter().rev().take_while(|it| it.is_near(&this)).any(|it| it.is_like(&this));
        if is_novel {
            kept.push(this);
        }
        is_novel
    });
    novel
}

#[cfg(test)]
mod tests {
    use sonarfix_batch::recording::{Ping, Reading};

    use super::*;

    /// 1 m straight ahead in steps of 1 cm, with a ping at each, to the bearings in turn.
    fn drive(bearings: &[f64], turn: f64) -> Recording {
        let mut recording = Recording::default();
        for (step, &bearing) in (0_u8..=100).zip(bearings.iter().cycle()) {
            let (time, travel) = (f64::from(step), 0.01 * f64::from(step));
            let aside = 0.06 * turn * travel;
            recording.readings.push(Reading { time, travel: [travel + aside, travel - aside] });
            recording.pings.push(Ping { time, bearing, range: Some(1.0) });
        }
        recording
    }

    #[test]
    fn one_direction_counts_once_in_20_cm() {
        let pings = |bearings: &[f64], turn| novel(&drive(bearings, turn), 0.12).pings;
        let ahead = pings(&[0.0], 0.0);
        assert!((5..=6).contains(&ahead.len()), "{ahead:?}");
        // A sweep that takes 21 cm repeats nothing.
        let sweep: Vec<f64> = (0..21).map(|k| 0.1746 * f64::from(k)).collect();
        assert!(pings(&sweep, 0.0).len() > 95);
        // The direction is that in the room: a robot that turns by 1 rad/m pings another one after 17 cm.
        assert_eq!(pings(&[0.0], 1.0).len(), 6);
        assert_eq!(pings(&[0.0], 4.0).len(), 21);
        // A sonar that turns back as the robot turns on pings one direction at other headings.
        let back: Vec<f64> = (0..=100).map(|k| -0.04 * f64::from(k)).collect();
        assert_eq!(pings(&back, 4.0).len(), 21);
    }

    #[test]
    fn pings_of_a_robot_at_rest_count_once_for_each_direction() {
        let mut recording = drive(&[0.0, 0.5, 1.0], 0.0);
        recording.readings.clear();
        assert_eq!(novel(&recording, 0.12).pings.len(), 3);
    }
}
