//! The bearings of a servo from a sweep in a corner of a room.
//!
//! The robot stands square to a wall ahead, with another wall at its left: the perpendiculars have bearings of 0° and 90°. The
//! answers and missing answers of both determine offset and scale ([`fit`]).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use sonarfix_batch::bearings::{Bearings, WallPing, fit};

/// A ping of the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweptPing {
    /// Bearing by the robot's configuration, radians.
    pub bearing: f64,
    /// Sign of the servo's motion to it.
    pub moved: f64,
    /// Range, metres; `None` without an echo.
    pub range: Option<f64>,
}

/// Why a sweep does not determine the bearings.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CornerError {
    /// A wall does not answer.
    #[error(
        "no wall {0} answers: put the robot 30 cm to 80 cm from both walls, with nothing between"
    )]
    NoWall(&'static str),
    /// The answers do not determine the bearings.
    #[error(
        "the answers do not determine the servo's bearings: take more passes, or another corner"
    )]
    Undetermined,
}

/// Step of the sweep, radians: four times the dead band of a hobby servo.
pub const STEP: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Echoes that a wall has at least, and the depth in which they lie, metres: off its axis the range grows.
const LEAST: usize = 8;
const DEPTH: f64 = 0.05;
/// Largest deviations of offset (radians) and scale.
const MOST: [f64; 2] = [2.0 * std::f64::consts::PI / 180.0, 0.03];

/// The bearings of a pass between two limits, rightmost first, radians.
pub fn pass([rightmost, leftmost]: [f64; 2]) -> Vec<f64> {
    let steps = step(rightmost)..=step(leftmost);
    let bearings = steps.map(|step| STEP * f64::from(step));
    bearings.filter(|bearing| (rightmost..=leftmost).contains(bearing)).collect()
}

/// The nearest step to a bearing.
#[expect(clippy::cast_possible_truncation, reason = "a bearing within a turn or so")]
fn step(bearing: f64) -> i32 {
    (bearing / STEP).round() as i32
}

/// Determines the bearings.
///
/// # Errors
/// [`CornerError`].
pub fn bearings(pings: &[SweptPing]) -> Result<Bearings, CornerError> {
    let is_left = |ping: &SweptPing| ping.bearing > FRAC_PI_4;
    let is_ahead = |ping: &SweptPing| ping.bearing.abs() <= FRAC_PI_4;
    let ahead = nearest(pings.iter().filter(|ping| is_ahead(ping)));
    let left = nearest(pings.iter().filter(|ping| is_left(ping)));
    let ahead = ahead.ok_or(CornerError::NoWall("ahead"))?;
    let left = left.ok_or(CornerError::NoWall("at its left"))?;
    let towards = |ping: &SweptPing| {
        let (perpendicular, distance) =
            if is_left(ping) { (FRAC_PI_2, left) } else { (0.0, ahead) };
        let answered = ping.range.is_some_and(|range| (range - distance).abs() < DEPTH);
        let &SweptPing { bearing: commanded, moved, .. } = ping;
        WallPing { commanded, perpendicular, distance, moved, answered }
    };
    let at_walls = pings.iter().filter(|ping| is_ahead(ping) || is_left(ping));
    let found = fit(&at_walls.map(towards).collect::<Vec<_>>());
    let is_determined =
        |found: &Bearings| found.offset_deviation < MOST[0] && found.scale_deviation < MOST[1];
    found.filter(is_determined).ok_or(CornerError::Undetermined)
}

/// The shortest range at which a wall answers; the corner itself is farther away than both walls.
fn nearest<'p>(pings: impl Iterator<Item = &'p SweptPing>) -> Option<f64> {
    let mut ranges: Vec<f64> = pings.filter_map(|ping| ping.range).collect();
    ranges.sort_by(f64::total_cmp);
    let together = |cluster: &&[f64]| match cluster {
        [first, .., last] => last - first < DEPTH,
        _ => false,
    };
    let cluster = ranges.windows(LEAST).find(together)?;
    cluster.get(LEAST / 2).copied()
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sonarfix_sim::world::segment::Segment;
    use sonarfix_sim::world::sensor::SensorModel;
    use sonarfix_sim::world::{Ping, World};

    use super::{CornerError, SweptPing, bearings, pass};

    /// True offset, scale and play of a servo: it arrives by half of the play short of where it moves to.
    #[derive(Debug, Clone, Copy)]
    struct Truth {
        offset: f64,
        scale: f64,
        play: f64,
    }

    /// Four passes with two pings at a bearing, of a simulated HC-SR04 in the corner of a room of 4 m by 5 m.
    fn swept(truth: Truth, [ahead, left]: [f64; 2], seed: u64) -> Vec<SweptPing> {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 5.0], [0.0, 5.0]];
        let walls = (0..4).map(|wall| Segment::new(corners[wall], corners[(wall + 1) % 4]));
        let world = World::of(walls.collect());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut noise = ChaCha8Rng::seed_from_u64(seed + 1_000);
        let sensor = SensorModel::hc_sr04();
        let mut bearings = pass([-FRAC_PI_2, FRAC_PI_2]);
        let mut pings = Vec::new();
        for moved in [1.0, -1.0, 1.0, -1.0] {
            for &bearing in bearings.iter().flat_map(|bearing| [bearing; 2]) {
                let ping = Ping {
                    time: 0.0,
                    sonar_after: &|_| [4.0 - ahead, 5.0 - left],
                    direction: truth.offset + truth.scale * bearing - 0.5 * moved * truth.play,
                };
                let echo = world.echo(&ping, &sensor, &mut noise, &mut rng);
                pings.push(SweptPing { bearing, moved, range: echo.map(|echo| echo.range) });
            }
            bearings.reverse();
        }
        pings
    }

    /// Errors of offset (degrees) and scale (percent), and both over their deviations, of a servo up to 8 % and 6° wrong.
    fn errors(seed: u64) -> Option<[[f64; 2]; 2]> {
        let random = |salt: f64| (salt * 12.9898 * (seed as f64 + 1.0)).sin();
        let offset = 6.0_f64.to_radians() * random(1.0);
        let truth = Truth { offset, scale: 1.0 + 0.08 * random(2.0), play: 0.02 };
        let distances = [0.55 + 0.2 * random(3.0), 0.55 + 0.2 * random(4.0)];
        let found = bearings(&swept(truth, distances, seed)).ok()?;
        let [of_offset, of_scale] = [found.offset - truth.offset, found.scale - truth.scale];
        Some([
            [of_offset.to_degrees(), 100.0 * of_scale],
            [of_offset / found.offset_deviation, of_scale / found.scale_deviation],
        ])
    }

    #[test]
    fn bearings_of_a_simulated_sweep_are_determined() {
        let all: Vec<_> = (0..100).filter_map(errors).collect();
        let count = all.len() as f64;
        let rms = |k: usize| (all.iter().map(|[e, _]| e[k] * e[k]).sum::<f64>() / count).sqrt();
        let worst = |k: usize| all.iter().map(|[e, _]| e[k].abs()).fold(0.0, f64::max);
        let inside =
            |k: usize| all.iter().filter(|[_, n]| n[k].abs() < 1.96).count() as f64 / count;
        assert!(all.len() >= 95, "{count} of 100 are determined");
        for (k, limit) in [(0, 0.7), (1, 2.0)] {
            let (rms, worst, inside) = (rms(k), worst(k), inside(k));
            println!("RMS {rms:.2}, at most {worst:.2}, inside the interval {inside:.2}");
            assert!(rms < limit && worst < 4.0 * limit, "RMS {rms}, at most {worst}");
            assert!(inside >= 0.9, "{inside} inside the intervals");
        }
    }

    #[test]
    fn a_wall_that_is_missing_is_named() {
        let truth = Truth { offset: 0.0, scale: 1.0, play: 0.0 };
        let pings = swept(truth, [0.5, 0.5], 1);
        let without = |left: bool| -> Vec<SweptPing> {
            let silent = |ping: &SweptPing| {
                let is_silent = left == (ping.bearing > 0.8);
                SweptPing { range: ping.range.filter(|_| !is_silent), ..*ping }
            };
            pings.iter().map(silent).collect()
        };
        assert_eq!(bearings(&without(true)), Err(CornerError::NoWall("at its left")));
        assert_eq!(bearings(&without(false)), Err(CornerError::NoWall("ahead")));
        assert_eq!(bearings(&[]), Err(CornerError::NoWall("ahead")));
    }
}
