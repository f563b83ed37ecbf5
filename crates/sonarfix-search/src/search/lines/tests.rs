//! Votes, the list of lines and their fit, against the same rules in `f64`.

use std::vec::Vec as List;

use nalgebra::{Matrix2, Vector2};
use proptest::prelude::*;

use super::super::window::Window;
use super::*;

type Wide = Vector2<f64>;

fn wide(vector: Vector) -> Wide {
    Wide::new(vector.x.into(), vector.y.into())
}

fn direction(angle: f64) -> Wide {
    Wide::new(angle.cos(), angle.sin())
}

fn is_clear(value: f64, limit: f64) -> bool {
    (value - limit).abs() > 1e-5
}

/// A line, with the pings that support it.
#[derive(Debug, Clone, Copy)]
struct WideLine {
    angle: f64,
    offset: f64,
    stretch: (f64, f64),
    support: u16,
}

impl WideLine {
    fn normal(&self) -> Wide {
        direction(self.angle)
    }

    /// Whether a ping supports it; `None` at a limit.
    fn is_supported(&self, ping: &Ping, cone: f64) -> Option<bool> {
        let Some(range) = ping.range() else { return Some(false) };
        let normal = self.normal();
        let off = (normal.dot(&wide(ping.station.at)) + f64::from(range) - self.offset).abs();
        let (cosine, least) = (normal.dot(&wide(ping.axis)), (1.3 * cone).cos());
        (is_clear(off, 0.05) && is_clear(cosine, least)).then_some(off < 0.05 && cosine > least)
    }

    /// With its support and stretch; `None` at a limit.
    fn gathered(mut self, pings: &[Ping], cone: f64) -> Option<Self> {
        let along = direction(self.angle + std::f64::consts::FRAC_PI_2);
        self.support = 0;
        self.stretch = (f64::INFINITY, f64::NEG_INFINITY);
        for ping in pings {
            if self.is_supported(ping, cone)? {
                let at = along.dot(&wide(ping.station.at));
                self.stretch = (self.stretch.0.min(at), self.stretch.1.max(at));
                self.support += 1;
            }
        }
        Some(self)
    }

    fn is(&self, line: &Line) -> bool {
        let is_near = |one: f32, other: f64| (f64::from(one) - other).abs() < 1e-4;
        (wide(line.normal) - self.normal()).norm() < 1e-5
            && is_near(line.offset, self.offset)
            && is_near(line.stretch.0, self.stretch.0)
            && is_near(line.stretch.1, self.stretch.1)
            && line.support == self.support
    }
}

/// Keeps a line unless a similar one has as much support; `None` at a limit.
fn keep(list: &mut List<WideLine>, line: WideLine) -> Option<()> {
    let mut similar = None;
    for (at, other) in list.iter().enumerate() {
        let (cosine, off) = ((other.angle - line.angle).cos(), (other.offset - line.offset).abs());
        if !is_clear(cosine, 0.966) || !is_clear(off, 0.15) {
            return None;
        }
        if similar.is_none() && cosine > 0.966 && off < 0.15 {
            similar = Some(at);
        }
    }
    if let Some(at) = similar {
        if list[at].support >= line.support {
            return Some(());
        }
        list.remove(at);
    }
    list.push(line);
    // Stable: of equal support the first ones stay.
    list.sort_by_key(|line| core::cmp::Reverse(line.support));
    list.truncate(10);
    Some(())
}

/// Pings of walls around the robot, most of them within the limits of support, and the angles of their axes.
fn pings(
    walls: &[(f32, f32)],
    pings: &[(prop::sample::Index, f32, f32, f32, f32)],
    cone: f32,
) -> (Window<48>, List<f64>) {
    let (mut window, mut angles) = (Window::new(Vector::default()), List::new());
    for (wall, advance, turn, tilt, noise) in pings {
        let (angle, offset) = walls[wall.index(walls.len())];
        window.drive(*advance, *turn);
        let axis = angle + tilt * cone;
        let range = offset - Vector::of_angle(angle).dot(window.robot().at) + noise;
        let range = (*noise < 0.09 && range > 0.0).then_some(range);
        // Two axes may be equal but for the last bit.
        if window.ping(axis - window.heading(), range, [Radians(0.0); 2]) {
            angles.push(f64::from(axis));
        }
    }
    window.rebase();
    (window, angles)
}

type Seed = (prop::sample::Index, f32, f32, f32, f32);

fn seeds() -> impl Strategy<Value = List<Seed>> {
    let seed =
        (any::<prop::sample::Index>(), -0.2_f32..0.3, -0.4_f32..0.4, -1.5_f32..1.5, -0.08_f32..0.1);
    prop::collection::vec(seed, 10..48)
}

fn walls() -> impl Strategy<Value = List<(f32, f32)>> {
    prop::collection::vec((-3.1_f32..3.1, 1.0_f32..4.0), 1..9)
}

proptest! {
    #![proptest_config(ProptestConfig { max_global_rejects: 50_000, ..ProptestConfig::default() })]

    #[test]
    fn the_lines_are_those_with_the_most_votes(walls in walls(), seeds in seeds(), cone in 0.1_f32..0.4) {
        let (window, angles) = pings(&walls, &seeds, cone);
        let pings = window.pings();
        let mut lines = Lines::new(Radians(1.0), false);
        lines.vote(pings, 0, 0.0);
        lines.restart(Radians(cone), false);
        prop_assert!(lines.all().is_empty());
        let wide_cone = f64::from(cone);
        let mut expected = List::new();
        for (voter, (ping, angle)) in pings.iter().zip(angles).enumerate() {
            for tilt in TILTS {
                lines.vote(pings, voter, tilt);
                let Some(range) = ping.range() else { continue };
                let angle = angle + f64::from(tilt) * wide_cone;
                let offset = direction(angle).dot(&wide(ping.station.at)) + f64::from(range);
                let line = WideLine { angle, offset, stretch: (0.0, 0.0), support: 0 };
                let line = line.gathered(pings, wide_cone);
                prop_assume!(line.is_some());
                if let Some(line) = line.filter(|line| line.support >= 3) {
                    prop_assume!(keep(&mut expected, line).is_some());
                }
            }
        }
        prop_assert_eq!(lines.all().len(), expected.len());
        for (line, expected) in lines.all().iter().zip(&expected) {
            prop_assert!(expected.is(line), "{line:?} {expected:?}");
        }
        lines.vote(pings, pings.len(), 0.0);
        prop_assert_eq!(lines.all().len(), expected.len());
        lines.clear();
        prop_assert!(lines.all().is_empty());
    }

    /// Least squares of ranges and directions, unless pings get lost by it.
    #[test]
    fn a_fit_is_a_step_of_least_squares(
        wall in (-3.1_f32..3.1, 1.0_f32..4.0), seeds in seeds(), cone in 0.1_f32..0.4,
        (turn, shift) in (-0.1_f32..0.1, -0.04_f32..0.04), scale in 0.0_f32..1.0,
        (lean, pace) in (-1.3_f32..1.3, prop_oneof![Just(0.0_f32), 0.0_f32..1.0]),
    ) {
        let seeds: List<Seed> =
            seeds.into_iter().map(|(at, advance, turn, tilt, noise)| (at, pace * advance, turn, scale * tilt + (1.0 - scale) * lean, scale * noise)).collect();
        let (window, _) = pings(&[wall], &seeds, cone);
        let (pings, wide_cone) = (window.pings(), f64::from(cone));
        let offset = pings.iter().rev().find_map(|ping| {
            Some(Vector::of_angle(wall.0).dot(ping.station.at) + ping.range()?)
        });
        let (angle, offset) = (wall.0 + scale * turn, offset.unwrap_or(1.0) + shift);
        let line = WideLine { angle: angle.into(), offset: offset.into(), stretch: (0.0, 0.0), support: 0 };
        let before = line.gathered(pings, wide_cone);
        prop_assume!(before.is_some_and(|line| line.support > 0));
        let before = before.unwrap();
        let (mut information, mut right) = (Matrix2::identity() * 1e-3, Wide::zeros());
        for ping in pings.iter().filter(|ping| before.is_supported(ping, wide_cone) == Some(true)) {
            let along = direction(before.angle + std::f64::consts::FRAC_PI_2);
            let at = wide(ping.station.at);
            let residual = before.normal().dot(&at) + f64::from(ping.range().unwrap()) - before.offset;
            // Residuals of turn and shift, each over its deviation.
            for (h, residual, deviation) in [
                (Wide::new(along.dot(&at), -1.0), residual, 0.03),
                (Wide::new(-1.0, 0.0), along.dot(&wide(ping.axis)), 0.7 * wide_cone),
            ] {
                information += h * h.transpose() / (deviation * deviation);
                right -= h * residual / (deviation * deviation);
            }
        }
        let step = information.try_inverse().unwrap() * right;
        prop_assume!(is_clear(step[0].abs(), wide_cone));
        let after = WideLine { angle: before.angle + step[0], offset: before.offset + step[1], ..before };
        let after = after.gathered(pings, wide_cone);
        prop_assume!(after.is_some());
        let is_taken = step[0].abs() < wide_cone && after.is_some_and(|after| after.support >= before.support);
        let expected = if is_taken { after.unwrap() } else { before };
        let mut lines = Lines::new(Radians(cone), false);
        let mut line = Line { normal: Vector::of_angle(angle), offset, stretch: (0.0, 0.0), support: 0 };
        lines.gather(pings, &mut line);
        lines.found.push(line).unwrap();
        lines.fit(pings, 0);
        lines.fit(pings, 1);
        let is = lines.all()[0];
        let is_near = |one: f32, other: f64| (f64::from(one) - other).abs() < 1e-3;
        prop_assert!((wide(is.normal) - expected.normal()).norm() < 1e-3, "{is:?} {expected:?}");
        prop_assert!(is_near(is.offset, expected.offset), "{is:?} {expected:?}");
        prop_assert!(is_near(is.stretch.0, expected.stretch.0), "{is:?} {expected:?}");
        prop_assert!(is_near(is.stretch.1, expected.stretch.1), "{is:?} {expected:?}");
        prop_assert_eq!(is.support, expected.support);
    }

    /// No ping supports two separate lines, and lines at right angles are separate.
    #[test]
    fn separate_lines_are_more_than_two_cones_apart(
        (one, other) in (-3.1_f32..3.1, -3.1_f32..3.1), cone in 0.05_f32..0.8,
    ) {
        let line = |angle| Line { normal: Vector::of_angle(angle), offset: 1.0, stretch: (0.0, 1.0), support: 3 };
        let cosine = (f64::from(one) - f64::from(other)).cos().abs();
        let limit = (2.6 * f64::from(cone)).cos().max(0.259);
        prop_assume!(is_clear(cosine, limit));
        let are_separate = Lines::new(Radians(cone), false).are_separate(&line(one), &line(other));
        prop_assert_eq!(are_separate, cosine < limit);
    }
}
