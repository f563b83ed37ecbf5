//! How a cycle ends, against the rules of `docs/search.md` in `f64`, with a bank and lines that are made up.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::search::bank::State;
use crate::search::candidates::make_a_pair;
use crate::search::lines::Line;
use crate::search::refine::{Prior, Spread};
use crate::search::window::Bend;
use sonarfix::config::Config;
use sonarfix::geometry::units::PerRootMetre;
use sonarfix::map::Wall;

mod slices;

type Small<'m> = Search<'m, 16, 4>;

/// A search that has found something, for the tests of the navigator.
impl Search<'_> {
    /// Ends a cycle with this hypothesis as the best one, by its pose, deviations and fit.
    pub(crate) fn find(&mut self, pose: Pose, deviation: (f32, f32), fit: f32) {
        let turn = pose.heading.radians() - Radians(self.window.heading());
        let rotation = Vector::of_angle(turn.0);
        let at = Vector::from(pose.position()).minus(self.window.robot().at.turned(rotation));
        let placement = Placement { at, rotation, bend: self.window.bend() };
        let (pings, (position, heading)) = (10_u8, deviation);
        let score = fit * f32::from(pings);
        let (xx, rotation) = (position * position, heading * heading);
        let spread = Spread { xx, xy: 0.0, yy: xx, rotation };
        let entry =
            Entry { score, pings, echoes: pings, spread, ..Entry::proposed(placement, 0.0) };
        self.bank = Bank::of(&[entry]);
        self.answer = Decision::Several(1);
        self.cycles += 1;
    }

    /// The same, as the unique answer.
    pub(crate) fn find_unique(&mut self, pose: Pose, deviation: (f32, f32)) {
        self.find(pose, deviation, 1.0);
        self.answer = Decision::Unique(self.bank.entries()[0]);
    }

    /// Metres driven since the search began.
    pub(crate) fn driven(&self) -> f32 {
        self.window.since_start()
    }

    /// Ends a cycle that finds the same.
    pub(crate) fn find_again(&mut self) {
        self.cycles += 1;
    }

    /// The range of the latest ping, at the window's reference from here on.
    pub(crate) fn latest_range(&mut self) -> Option<f32> {
        self.window.rebase();
        self.window.newest(0).and_then(window::Ping::range)
    }

    /// The deviations of drift and turn scale, and the region.
    pub(crate) fn begun(&self) -> ([f32; 2], Option<Region>) {
        let Prior { drift, turn_scale } = self.odometry.prior;
        ([drift, turn_scale], self.region)
    }
}

/// A room of 6 m × 4 m.
fn room() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
    let wall = |ends: &[(f32, f32)]| {
        Wall::new(Point::new(ends[0].0, ends[0].1), Point::new(ends[1].0, ends[1].1)).unwrap()
    };
    corners.windows(2).map(wall).collect()
}

fn search(walls: &[Wall]) -> Small<'_> {
    let config = Config::for_track_width(Metres(0.2));
    Search::new(&config.rangers.first, Map::new(walls), SearchParameters::of(&config))
}

fn line(angle: f32, support: u16) -> Line {
    Line { normal: Vector::of_angle(angle), offset: 1.0, stretch: (0.0, 1.0), support }
}

/// The larger eigenvalue of a spread, and the angle of its axis.
fn largest_of(spread: &Spread) -> (f64, f64) {
    let (xx, xy, yy) = (f64::from(spread.xx), f64::from(spread.xy), f64::from(spread.yy));
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = angle.sin_cos();
    (xx * cos * cos + 2.0 * xy * sin * cos + yy * sin * sin, angle)
}

prop_compose! {
    fn spread()(
        (long, short) in (-5.0_f32..-0.3, 0.0_f32..1.0), turn in -3.1_f32..3.1, rotation in -5.0_f32..-2.0,
    ) -> Spread {
        // Decades.
        let (long, ratio) = (10.0_f32.powf(long), 10.0_f32.powf(-2.0 * short));
        let (sin, cos) = turn.sin_cos();
        Spread {
            xx: long * (cos * cos + ratio * sin * sin),
            xy: long * (1.0 - ratio) * sin * cos,
            yy: long * (sin * sin + ratio * cos * cos),
            rotation: 10.0_f32.powf(rotation),
        }
    }
}

prop_compose! {
    fn entry()(
        (x, y, angle) in (0.5_f32..5.5, 0.5_f32..3.5, -3.1_f32..3.1), score in 0.0_f32..1.5,
        pings in 12_u8..96, silent in 0_u8..6, spread in spread(),
        past in 0.0_f32..30.0, evidence in -10.0_f32..120.0, explained in 0.4_f32..1.0,
    ) -> Entry {
        let placement = Placement {
            at: Vector::new(x, y), rotation: Vector::of_angle(angle), bend: Bend::default(),
        };
        let echoes = pings - silent;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 96")]
        let explained = (explained * f32::from(echoes)) as u8;
        Entry {
            placement, score: score * f32::from(pings), pings, echoes, explained,
            spread, past, evidence, state: State::Fresh,
        }
    }
}

fn is_clear(value: f64, limit: f64) -> bool {
    (value - limit).abs() > 1e-4 * (1.0 + limit.abs())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2_000, max_global_rejects: 50_000, ..ProptestConfig::default()
    })]

    #[test]
    fn a_cycle_ends_by_the_rules(
        best in entry(), leads in prop::collection::vec(0.0_f32..60.0, 0..3), other in entry(),
        fresh in prop_oneof![0_u16..10, 0_u16..40], taken in 0_u16..500, cycles in 0_u32..50, are_separate in any::<bool>(),
        (was_unique, moved, turn) in (any::<bool>(), 0_u8..5, any::<u8>()),
        is_sharp_entry in any::<bool>(),
    ) {
        let walls = room();
        let mut search = search(&walls);
        let mut best = best;
        if is_sharp_entry {
            // Otherwise few would be unique.
            best.spread = Spread { xx: 1e-3, xy: 2e-4, yy: 5e-4, rotation: 1e-4 };
        }
        let mut bank: Vec<Entry> = Vec::from([best]);
        let mut evidence = best.evidence;
        for lead in leads {
            evidence -= lead;
            bank.push(Entry { evidence, ..other });
        }
        search.bank = Bank::of(&bank);
        let second = if are_separate { 1.6 } else { 0.1 };
        search.lines = Lines::of(Radians(0.2), &[line(0.0, 9), line(0.05, 8), line(second, 7)]);
        search.cycles = cycles;
        search.check = GlobalCheck { turn, moved, ..GlobalCheck::default() };
        search.taken = taken;
        search.window.set_taken(taken.wrapping_add(fresh));
        let before = if was_unique { Decision::Unique(best) } else { Decision::Several(3) };
        search.answer = before;
        search.work = Work::None;

        let explained = f64::from(best.explained) / (f64::from(best.echoes) + 4.0);
        let (least, odds) = (6.0, 6.0 + 22.0 * (1.0 - explained));
        let evidence: Vec<f64> = bank.iter().map(|entry| f64::from(entry.evidence)).collect();
        let (variance, axis) = largest_of(&best.spread);
        let sharpness = (
            f64::from(search.sharpness.0.0).powi(2), f64::from(search.sharpness.1.0).powi(2),
        );
        let rotation = f64::from(best.spread.rotation);
        let rival = evidence.get(1).copied().unwrap_or(0.0).max(0.0);
        let lead = evidence[0] - rival;
        prop_assume!(evidence.iter().skip(1).all(|other| is_clear(evidence[0] - other, least)));
        prop_assume!(is_clear(lead, odds) && is_clear(evidence[0], 0.0) && is_clear(evidence[0], 60.0) && is_clear(variance, 0.09));
        prop_assume!(is_clear(variance / sharpness.0, 1.0) && is_clear(rotation / sharpness.1, 1.0));
        let rivals = evidence.iter().filter(|other| evidence[0] - **other < least).count();
        let is_anywhere = evidence[0] > 0.0;
        let is_determined = variance < 0.09;
        let is_sharp = variance < sharpness.0 && rotation < sharpness.1;
        let is_unique_one = lead > odds && evidence[0] > 60.0 && is_sharp && are_separate;
        // What has moved through the window of 16 pings; the past fades in five windows.
        let share = (f64::from(fresh) / 16.0).min(1.0);
        let pasts: Vec<f64> = bank.iter().map(|entry| {
            let past = f64::from(entry.past);
            past * (1.0 - share / 5.0) + share * f64::from(entry.score)
        }).collect();

        search.decide();
        prop_assert_eq!(search.cycles, cycles + 1);
        prop_assert_eq!(search.taken, search.window.taken());
        for (entry, past) in search.bank.entries().iter().zip(pasts) {
            prop_assert!((f64::from(entry.past) - past).abs() < 1e-3, "{} {past}", entry.past);
        }
        // Two lines have reached the end since the last rival. A rival does not take the turn from a line.
        let moved = if rivals == 1 { moved } else { 0 };
        prop_assert_eq!(search.check, GlobalCheck { turn, moved, ..GlobalCheck::default() });
        let is_checked = was_unique || moved >= 2;
        let is_unique = is_anywhere && is_unique_one && is_checked;
        prop_assert_eq!(search.is_found, is_unique);
        if !is_anywhere {
            prop_assert_eq!(search.answer, Decision::Nowhere);
        } else if is_unique {
            prop_assert_eq!(search.answer, before);
        } else if is_determined {
            prop_assert_eq!(search.answer, Decision::Several(rivals));
        } else {
            // The nearest wall along the axis of the spread.
            let (sin, cos) = axis.sin_cos();
            let (x, y) = (f64::from(best.placement.at.x), f64::from(best.placement.at.y));
            prop_assume!(is_clear(sin * sin, 0.1) && is_clear(cos * cos, 0.1));
            // Walls 0 and 2 lie along x, 1 and 3 along y.
            let mut near: Vec<(f64, u32)> = Vec::new();
            if sin * sin < 0.1 {
                near.extend([(y, 0), (4.0 - y, 2)]);
            }
            if cos * cos < 0.1 {
                near.extend([(6.0 - x, 1), (x, 3)]);
            }
            near.sort_by(|one, other| one.0.total_cmp(&other.0));
            match near.as_slice() {
                [] => prop_assert_eq!(search.answer, Decision::Several(rivals)),
                [nearest, next, ..] => {
                    prop_assume!(is_clear(nearest.0, next.0));
                    let Decision::Along(wall, extent) = search.answer else {
                        return Err(TestCaseError::fail(std::format!("{:?}", search.answer)));
                    };
                    prop_assert_eq!(wall, WallId(nearest.1));
                    prop_assert!((f64::from(extent) - variance.sqrt()).abs() < 1e-3 * variance.sqrt());
                }
                [_] => unreachable!("walls are in pairs"),
            }
        }
    }

    /// The best pairs in every cycle, and the others in turn.
    #[test]
    fn the_pairs_of_a_cycle_are_the_best_and_some_others(
        angles in prop::collection::vec(-3.1_f32..3.1, 0..9), cycles in 0_u32..60,
    ) {
        let walls = room();
        let mut search = search(&walls);
        let lines: Vec<Line> = (1..20).rev().zip(&angles).map(|(n, angle)| line(*angle, n)).collect();
        search.lines = Lines::of(Radians(0.2), &lines);
        search.cycles = cycles;
        let mut all: Vec<(usize, usize)> = (0..lines.len())
            .flat_map(|one| (one + 1..lines.len()).map(move |other| (one, other)))
            .filter(|(one, other)| make_a_pair(&lines[*one], &lines[*other]))
            .collect();
        all.sort_by_key(|(one, other)| (one + other, *one));
        let others = all.len().saturating_sub(4);
        let mut expected: Vec<(usize, usize)> = all.iter().take(4).copied().collect();
        let turns = (0..others.min(4)).map(|turn| 4 + (cycles as usize * 4 + turn) % others);
        expected.extend(turns.map(|at| all[at]));
        for number in 0..12_u8 {
            let pair = search.pair(number);
            let expected = expected.get(usize::from(number)).map(|(one, other)| (lines[*one], lines[*other]));
            prop_assert_eq!(pair, expected, "{}", number);
        }
    }

    /// The parameters that follow from a robot's wheels.
    #[test]
    fn parameters_follow_from_the_calibration(
        (right, left) in (0.0_f32..0.03, 0.0_f32..0.03), track in 0.0_f32..0.02, width in 0.1_f32..0.5,
        noise in 1e-4_f32..0.01, missed in 0.0_f32..0.3, alike in proptest::option::of(1e-3_f32..0.05),
    ) {
        let mut config = Config::for_track_width(Metres(width));
        config.prior.scale_difference = alike;
        config.drive.wheel_noise = PerRootMetre(Metres(noise));
        config.echo.missed = missed;
        let is = SearchParameters::calibrated(&config, [right, left], Metres(track));
        let wide = f64::from;
        let independent = wide(right).hypot(wide(left));
        let least = 1.1 * (wide(right) - wide(left)).abs();
        let difference = alike.map_or(independent, |alike| wide(alike).max(least)).min(independent);
        let mean = (0.5 * independent.powi(2) - 0.25 * difference.powi(2)).sqrt();
        let odometry = (1.2 * std::f64::consts::SQRT_2 * wide(noise) / wide(width)).max(0.005);
        for (is, expected) in [
            (is.drift.0, (difference / wide(width)).max(0.005)),
            (is.turn_scale, (wide(track) / wide(width)).hypot(mean).max(0.003)),
            (is.odometry, odometry),
            (is.sharpness.0.0, (1.8 * odometry).max(0.05)),
        ] {
            prop_assert!((wide(is) - expected).abs() < 1e-5 * (1.0 + expected), "{} {}", is, expected);
        }
        prop_assert_eq!(is.echo, config.echo);
        config.prior.scale_right = right;
        config.prior.scale_left = left;
        config.prior.track_width = Metres(track);
        prop_assert_eq!(SearchParameters::of(&config), is);
    }

    #[test]
    fn the_larger_eigenvalue_is_that_of_the_matrix(spread in spread()) {
        let is = f64::from(largest(spread.xx, spread.xy, spread.yy));
        let (expected, _) = largest_of(&spread);
        prop_assert!((is - expected).abs() < 1e-5 * expected, "{} {}", is, expected);
    }
}

/// Along the walls of a room, where one of the axes of the spread has no other component.
#[test]
fn a_position_is_undetermined_along_the_nearest_parallel_wall() {
    let walls = room();
    let search = search(&walls);
    // Walls 0 and 2 lie along x, 1 and 3 along y.
    for (xx, yy, at, expected) in [
        (1.0, 1e-4, (2.0, 1.0), 0),
        (1.0, 1e-4, (2.0, 3.0), 2),
        (1e-4, 1.0, (5.0, 1.0), 1),
        (1e-4, 1.0, (1.0, 1.0), 3),
    ] {
        let rotation = Vector::new(1.0, 0.0);
        let at = Vector::new(at.0, at.1);
        let placement = Placement { at, rotation, bend: Bend::default() };
        let spread = Spread { xx, xy: 0.0, yy, rotation: 1e-4 };
        let entry = Entry { spread, ..Entry::proposed(placement, 0.0) };
        assert_eq!(search.along(&entry), Some(Decision::Along(WallId(expected), 1.0)));
    }
}

#[test]
fn a_region_is_finite_and_not_empty() {
    let region = |x0, y0, x1, y1| Region { from: Point::new(x0, y0), to: Point::new(x1, y1) };
    assert!(region(1.0, 2.0, 1.5, 2.5).is_valid());
    for (x0, y0, x1, y1) in [
        (1.0, 2.0, 1.0, 2.5),
        (1.0, 2.0, 1.5, 2.0),
        (1.5, 2.0, 1.0, 2.5),
        (1.0, 2.5, 1.5, 2.0),
        (f32::NEG_INFINITY, 2.0, 1.5, 2.5),
        (1.0, 2.0, f32::INFINITY, 2.5),
        (1.0, f32::NEG_INFINITY, 1.5, 2.5),
        (1.0, 2.0, 1.5, f32::INFINITY),
    ] {
        assert!(!region(x0, y0, x1, y1).is_valid(), "{x0} {y0} {x1} {y1}");
    }
}

/// A proposed pose is that of the robot, wherever it is in the odometry frame.
#[test]
fn a_proposed_pose_is_the_best_hypothesis_until_it_is_scored() {
    let walls = room();
    let mut search = search(&walls);
    for _ in 0..20 {
        search.odometry(Metres(0.05), Radians(0.04)).unwrap();
    }
    let pose = Pose::new(2.5, 1.5, Radians(0.7));
    search.propose(pose).unwrap();
    let found = search.ranked(0).unwrap().pose;
    assert!((found.x - pose.x).0.abs() < 1e-5 && (found.y - pose.y).0.abs() < 1e-5, "{found:?}");
    assert!(found.heading.from(pose.heading).0.abs() < 1e-5, "{found:?}");
    assert!(search.propose(Pose::new(f32::NAN, 0.0, Radians(0.0))).is_err());
}
