//! The window against the path of the robot in `f64`, eqs. (32) and (33) among it.

use std::vec::Vec;

use nalgebra::{Rotation2, Vector2};
use proptest::prelude::*;

use super::*;

type Wide = Vector2<f64>;

fn wide(vector: Vector) -> Wide {
    Wide::new(vector.x.into(), vector.y.into())
}

fn turned(vector: Wide, angle: f64) -> Wide {
    Rotation2::new(angle) * vector
}

#[expect(clippy::cast_possible_truncation, reason = "the window takes f32")]
fn single(value: f64) -> f32 {
    value as f32
}

fn is_near(one: Wide, other: Wide) -> bool {
    (one - other).norm() < 2e-4
}

/// A step of the robot and the ping after it.
#[derive(Debug, Clone, Copy)]
struct Step {
    advance: f32,
    turn: f32,
    bearing: f32,
    range: Option<f32>,
}

prop_compose! {
    fn step()(
        advance in -0.1_f32..0.4, turn in -0.5_f32..0.5, bearing in -3.1_f32..3.1, range in prop::option::of(0.0_f32..4.0),
    ) -> Step {
        Step { advance, turn, bearing, range }
    }
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    prop::collection::vec(step(), 10..40)
}

prop_compose! {
    fn bend()(drift in -0.2_f32..0.2, turn_scale in -0.2_f32..0.2) -> Bend {
        Bend { drift, turn_scale }
    }
}

prop_compose! {
    fn mount()(x in -0.2_f32..0.2, y in -0.2_f32..0.2) -> Vector {
        Vector::new(x, y)
    }
}

/// The robot in the frame of the window.
#[derive(Debug, Clone, Copy, Default)]
struct Robot {
    axle: Wide,
    heading: f64,
    travelled: f64,
    turned: f64,
}

impl Robot {
    fn drive(&mut self, step: &Step, bend: Bend) {
        let (advance, turn) = (f64::from(step.advance), f64::from(step.turn));
        let after = self.heading
            + turn * (1.0 + f64::from(bend.turn_scale))
            + f64::from(bend.drift) * advance.abs();
        self.axle += turned(Wide::new(advance, 0.0), f64::midpoint(self.heading, after));
        self.heading = after;
        self.travelled += advance.abs();
        self.turned += turn;
    }

    fn sonar(&self, mount: Vector) -> Wide {
        self.axle + turned(wide(mount), self.heading)
    }

    /// Seen from the place where another one is.
    fn seen_from(mut self, reference: &Self) -> Self {
        self.axle -= reference.axle;
        self.travelled -= reference.travelled;
        self.turned -= reference.turned;
        self
    }
}

/// A ping as it should be in the window.
#[derive(Debug, Clone, Copy)]
struct Sent {
    robot: Robot,
    direction: f64,
    range: Option<f32>,
}

impl Sent {
    fn is(&self, ping: &Ping, mount: Vector) -> bool {
        is_near(wide(ping.station.at), self.robot.sonar(mount))
            && is_near(wide(ping.axis), turned(Wide::x(), self.direction))
            && (f64::from(ping.station.travelled) - self.robot.travelled).abs() < 1e-4
            && (f64::from(ping.station.turned) - self.robot.turned).abs() < 1e-4
            && ping.range() == self.range.map(|range| f32::from_bits(range.to_bits() & !WEIGHT))
    }
}

/// Takes every ping.
const ALL: [Radians; 2] = [Radians(0.0); 2];

/// A window with the bend `bend` taken out, after some steps; the robot, and the pings of the window.
fn driven<const PINGS: usize>(
    mount: Vector,
    bend: Bend,
    steps: &[Step],
) -> (Window<PINGS>, Robot, Vec<Sent>) {
    let mut window = Window::new(mount);
    window.begin_straightening(bend);
    let (mut robot, mut sent) = (Robot::default(), Vec::new());
    for step in steps {
        window.drive(step.advance, step.turn);
        robot.drive(step, bend);
        // Two axes may be equal but for the last bit.
        if window.ping(step.bearing, step.range, ALL) {
            let direction = robot.heading + f64::from(step.bearing);
            sent.push(Sent { robot, direction, range: step.range });
        }
    }
    sent.drain(..sent.len().saturating_sub(PINGS));
    (window, robot, sent)
}

proptest! {
    /// Also after the frame has moved.
    #[test]
    fn the_path_is_that_along_the_mid_headings(steps in steps(), at in 0_usize..40, bend in bend()) {
        let mut window: Window<4> = Window::new(Vector::default());
        window.begin_straightening(bend);
        let (mut robot, mut start, mut since_start) = (Robot::default(), Wide::zeros(), 0.0);
        for (number, step) in steps.iter().enumerate() {
            if number == at {
                let reference = window.rebase();
                prop_assert!(is_near(wide(reference.at), robot.axle));
                start -= robot.axle;
                robot = robot.seen_from(&robot);
                prop_assert_eq!(*window.robot(), Station::default());
            }
            window.drive(step.advance, step.turn);
            robot.drive(step, bend);
            since_start += f64::from(step.advance.abs());
            let station = window.robot();
            prop_assert!(is_near(wide(station.at), robot.axle), "{station:?} {robot:?}");
            prop_assert!((f64::from(station.travelled) - robot.travelled).abs() < 1e-4);
            prop_assert!((f64::from(station.turned) - robot.turned).abs() < 1e-4);
            prop_assert!((f64::from(window.since_start()) - since_start).abs() < 1e-4);
            prop_assert!(is_near(wide(window.start()), start));
            prop_assert!(is_near(wide(Vector::of_angle(window.heading())), turned(Wide::x(), robot.heading)));
            prop_assert!(window.heading().abs() < 3.2);
        }
        window.restart(Vector::default());
        prop_assert_eq!(*window.robot(), Station::default());
        prop_assert_eq!((window.start(), window.since_start(), window.heading()), (Vector::default(), 0.0, 0.0));
        prop_assert_eq!((window.bend(), window.count(), window.taken()), (Bend::NONE, 0, 0));
    }

    /// An echo of a place of which n older ones were heard from other stations has the weight 1/(1 + n), a ping without an echo the whole;
    /// also after older ones have left the window.
    #[test]
    fn of_the_echoes_of_one_place_from_several_stations_the_first_tells_most(
        pings in prop::collection::vec(
            (0_usize..3, prop::option::weighted(0.9, (0_usize..3, 0_usize..3))), 30..70,
        ),
        mount in mount(), several in 1_usize..8,
    ) {
        let mut window: Window<24> = Window::new(mount);
        let (mut robot, mut sent): (_, Vec<(f64, Option<Wide>, u32)>) = (Robot::default(), Vec::new());
        for (number, (step, place)) in pings.into_iter().enumerate() {
            // Stations are 0, 12, or at least 24 cm apart; echoes up to 11, or at least 21 cm.
            let advance = [0.0_f32, 0.12, 0.3][step];
            window.drive(advance, 0.0);
            robot.drive(&Step { advance, turn: 0.0, bearing: 0.0, range: None }, Bend::NONE);
            let end = place.map(|(place, offset)| {
                Wide::new([3.0, 5.0, 7.0][place] + [0.0, 0.1, 0.21][offset], [1.0, -2.0, 1.5][place])
            });
            let beam = end.unwrap_or_default() - robot.sonar(mount);
            let range = end.map(|_| single(beam.norm()));
            if !window.ping(single(beam.y.atan2(beam.x)), range, ALL) {
                // In the very direction of one before.
                continue;
            }
            sent.drain(..sent.len().saturating_sub(23));
            sent.push((robot.axle.x, end, 0));
            if number % several > 0 {
                continue;
            }
            for number in 0..sent.len() {
                window.weigh(number);
                let (older, others) = sent.split_at_mut(number);
                let (from, end, repeats) = &mut others[0];
                let is_repeat = |other: &&(f64, Option<Wide>, u32)| {
                    let apart = end.zip(other.1).map(|(end, at)| (end - at).norm());
                    apart.is_some_and(|apart| apart < 0.2) && *from - other.0 > 0.2
                };
                let count = u32::try_from(older.iter().filter(is_repeat).count()).unwrap();
                *repeats = count.max(*repeats);
                let weight = f64::from(window.pings[number].weight());
                // In whole parts of 240.
                let expected = (240.0 / f64::from(1 + *repeats)).floor() / 240.0;
                prop_assert!((weight - expected).abs() < 1e-6, "{weight} {repeats}");
            }
        }
    }

    /// A ping is taken if no other of the window was sent from within 30 cm in its direction; the oldest drops out.
    #[test]
    fn the_window_takes_novel_pings(
        steps in prop::collection::vec((step(), any::<bool>()), 10..60), mount in mount(),
        (at_rest, driving) in (0.05_f32..0.5, 0.3_f32..1.5), at in 0_usize..60,
    ) {
        let mut window: Window<8> = Window::new(mount);
        let (mut robot, mut sent): (_, Vec<Sent>) = (Robot::default(), Vec::new());
        let (mut taken, mut referred) = (0_usize, 0_usize);
        for (number, (mut step, stands)) in steps.into_iter().enumerate() {
            if number == at {
                window.rebase();
                for ping in &mut sent {
                    ping.robot = ping.robot.seen_from(&robot);
                }
                robot = robot.seen_from(&robot);
                referred = taken;
            }
            if stands {
                (step.advance, step.turn) = (0.0, 0.2 * step.turn);
            }
            window.drive(step.advance, step.turn);
            robot.drive(&step, Bend::NONE);
            let direction = robot.heading + f64::from(step.bearing);
            let first = sent.first().map_or(robot.travelled, |ping| ping.robot.travelled);
            let left = robot.travelled - first - 0.2;
            prop_assume!(left.abs() > 1e-4);
            let novel = f64::from(if left > 0.0 { driving } else { at_rest });
            let mut is_known = false;
            for ping in &sent {
                let agreement = (ping.direction - direction).cos() - novel.cos();
                let distance = (ping.robot.sonar(mount) - robot.sonar(mount)).norm() - 0.2;
                prop_assume!(agreement.abs() > 1e-4 && distance.abs() > 1e-4);
                is_known |= agreement > 0.0 && distance < 0.0;
            }
            let is_taken = window.ping(step.bearing, step.range, [Radians(at_rest), Radians(driving)]);
            prop_assert_eq!(is_taken, !is_known, "{:?}", step);
            if is_taken {
                sent.push(Sent { robot, direction, range: step.range });
                taken += 1;
            }
            sent.drain(..sent.len().saturating_sub(8));
            prop_assert_eq!(usize::from(window.taken()), taken);
            prop_assert_eq!(window.count(), sent.len());
            let referred = sent.len().saturating_sub(taken - referred);
            prop_assert_eq!(window.pings().len(), referred);
            for (k, expected) in sent.iter().take(referred).rev().enumerate() {
                let ping = window.newest(k).unwrap();
                prop_assert!(expected.is(ping, mount), "{ping:?} {expected:?}");
            }
            prop_assert!(window.newest(referred).is_none());
        }
    }

    /// Eqs. (32) and (33) with the bend of a placement, for a window that has another one taken out.
    #[test]
    fn a_chain_is_the_bent_path_with_its_derivatives(
        steps in steps(), mount in mount(), (taken, bend) in (bend(), bend()),
    ) {
        let (mut window, robot, sent) = driven::<64>(mount, taken, &steps);
        window.rebase();
        let difference = bend.minus(taken);
        let angle = |robot: &Robot| {
            f64::from(difference.drift) * robot.travelled + f64::from(difference.turn_scale) * robot.turned
        };
        let mut chain = Chain::new(Vector::default());
        let (mut at, mut by_drift, mut by_turn_scale) = (Wide::zeros(), Wide::zeros(), Wide::zeros());
        let mut last = Robot::default();
        for (k, sent) in sent.iter().rev().enumerate() {
            let next = sent.robot.seen_from(&robot);
            let path = next.axle - last.axle;
            let step = 0.5 * (turned(path, angle(&last)) + turned(path, angle(&next)));
            at += step;
            let left = Wide::new(-step.y, step.x);
            by_drift += left * f64::midpoint(last.travelled, next.travelled);
            by_turn_scale += left * f64::midpoint(last.turned, next.turned);
            last = next;
            let link = window.link(window.newest(k).unwrap(), difference);
            chain.add(&link);
            let sonar = at + turned(wide(mount), next.heading + angle(&next));
            prop_assert!(is_near(wide(chain.sonar(&link)), sonar));
            prop_assert!(is_near(wide(link.bent), turned(Wide::x(), angle(&next))));
            let size = 1.0 + last.travelled.abs() + last.turned.abs();
            prop_assert!((wide(chain.by_drift) - by_drift).norm() < 1e-4 * size);
            prop_assert!((wide(chain.by_turn_scale) - by_turn_scale).norm() < 1e-4 * size);
        }
    }

    /// A bend is taken out of the pings before the reference as by one chain, while others arrive.
    #[test]
    fn straightened_pings_lie_on_the_bent_path(
        steps in steps(), meanwhile in prop::collection::vec(step(), 6), mount in mount(),
        (before, after) in (bend(), bend()),
    ) {
        let (mut window, robot, sent) = driven::<24>(mount, before, &steps);
        window.rebase();
        let mut chain = Chain::new(Vector::default());
        let difference = after.minus(before);
        let mut expected: Vec<(Wide, Wide)> = Vec::new();
        for ping in window.pings().iter().rev() {
            let link = window.link(ping, difference);
            chain.add(&link);
            expected.push((wide(chain.sonar(&link)), wide(ping.axis.turned(link.bent))));
        }
        let mut straightening = window.begin_straightening(after);
        prop_assert_eq!(window.bend(), after);
        let mut robot = robot.seen_from(&robot);
        let mut slices = 0;
        let mut more = meanwhile.iter();
        while window.straighten(&mut straightening) {
            slices += 1;
            if let Some(step) = more.next() {
                window.drive(step.advance, step.turn);
                robot.drive(step, after);
                window.ping(step.bearing, step.range, ALL);
                prop_assert!(is_near(wide(window.robot().at), robot.axle));
            }
        }
        prop_assert!(slices <= sent.len().div_ceil(8) && slices + 1 >= window.pings().len().div_ceil(8));
        prop_assert!(window.pings().len() <= expected.len());
        for (ping, (at, axis)) in window.pings().iter().rev().zip(expected) {
            prop_assert!(is_near(wide(ping.station.at), at) && is_near(wide(ping.axis), axis));
        }
    }
}
