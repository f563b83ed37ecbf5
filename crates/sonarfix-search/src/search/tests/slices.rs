//! The slices of a cycle: how many, in which order, and which candidates are tried.

use std::format;
use std::vec::Vec;

use super::*;
use crate::search::candidates::{AlongWalls, Generated};
use crate::search::trial::Trial;

/// Lines at these angles, the best supported first.
fn lines(angles: &[f32]) -> Lines {
    let lines: Vec<Line> =
        (1..20).rev().zip(angles).map(|(support, angle)| line(*angle, support)).collect();
    Lines::of(Radians(0.2), &lines)
}

/// Pings without an echo from one place.
fn ping(search: &mut Small<'_>, pings: u8) {
    for n in 0..pings {
        assert_eq!(search.ping(Radians(0.2 * f32::from(n) - 1.4), None), Ok(true));
    }
}

/// Makes evaluations until the phase is another; returns how many it takes.
fn until_end_of(search: &mut Small<'_>, phase: Phase) -> u32 {
    let mut evaluations = 0;
    while search.poll(0) == phase {
        search.poll(1);
        evaluations += 1;
        assert!(evaluations < 100_000, "{phase:?} does not end");
    }
    evaluations
}

#[test]
fn a_search_begins_with_twelve_pings() {
    let walls = room();
    let mut search = search(&walls);
    ping(&mut search, 11);
    search.poll(1_000);
    assert_eq!(search.cycles(), 0);
    assert!(matches!(search.task, Task::Rebase));
    assert_eq!(search.ping(Radians(3.0), None), Ok(true));
    search.poll(1_000);
    assert!(search.cycles() > 0);
    assert_eq!(search.answer(), Answer::Nowhere);
}

/// One slice moves the reference, each ping votes in five and ends in another one, each line is fitted in one.
#[test]
fn lines_take_six_slices_a_ping_and_one_a_line() {
    let walls = room();
    let mut search = search(&walls);
    ping(&mut search, 14);
    assert_eq!(until_end_of(&mut search, Phase::Lines), 1 + 14 * 6 + 1);
    // With hypotheses, eight pings are straightened in one.
    let mut search = self::search(&walls);
    ping(&mut search, 14);
    search.propose(Pose::new(2.0, 2.0, Radians(0.0))).unwrap();
    assert_eq!(until_end_of(&mut search, Phase::Lines), 1 + 2 + 14 * 6 + 1);
}

#[test]
fn every_line_is_fitted_once() {
    let walls = room();
    for count in 1..5_u8 {
        let mut search = search(&walls);
        let angles: Vec<f32> = (0..count).map(|n| 0.7 * f32::from(n)).collect();
        search.lines = lines(&angles);
        search.task = Task::Fit { line: 0 };
        ping(&mut search, 14);
        let mut fitted = Vec::new();
        while let Task::Fit { line } = search.task {
            fitted.push(line);
            search.poll(1);
        }
        assert_eq!(fitted, (0..count).collect::<Vec<u8>>());
    }
}

/// The best four lines are moved along all walls, one after the other, and the best one again.
#[test]
fn lines_take_turns_in_the_global_check() {
    let walls = room();
    for (count, turns) in [(2, [0, 1, 0, 1, 0]), (3, [0, 1, 2, 0, 1]), (6, [0, 1, 2, 3, 0])] {
        let mut search = search(&walls);
        ping(&mut search, 14);
        search.lines = lines(&[0.0, 1.0, 2.0, 0.3, 1.3, 2.3][..count]);
        for (lines_moved, turn) in (0_u8..).zip(turns) {
            assert_eq!(search.check.moved, lines_moved);
            let line = search.lines.all()[turn];
            let mut along = AlongWalls::default();
            while search.check.moved == lines_moved {
                assert_eq!(search.check.along, along);
                let moved = along.next(&search.echoes.reflectors.map, &line, Bend::NONE);
                search.task = Task::Check { steps: 0 };
                search.work = Work::None;
                search.poll(1);
                match (moved, &search.work) {
                    (Generated::Candidate(placement), Work::Trial(trial)) => {
                        let expected = Trial::of_candidate(placement, 0.0, 0.0);
                        assert_eq!(format!("{trial:?}"), format!("{expected:?}"));
                    }
                    (Generated::Nothing | Generated::Done, Work::None) => {}
                    other => panic!("{other:?}"),
                }
            }
        }
    }
}

/// A part of the check ends the cycle; the next cycle goes on where it has ended.
#[test]
fn a_cycle_makes_a_part_of_the_global_check() {
    let walls: Vec<Wall> = (0..1_000).flat_map(|_| room()).collect();
    let mut search = search(&walls);
    ping(&mut search, 14);
    search.lines = lines(&[0.0, 1.0, 2.0]);
    search.task = Task::Check { steps: 0 };
    let mut steps = 0;
    while let Task::Check { .. } = search.task {
        search.work = Work::None;
        search.poll(1);
        steps += 1;
    }
    // The last one ends the cycle.
    assert_eq!((steps, search.cycles()), (501, 1));
    let check = search.check;
    assert_ne!(check.along, AlongWalls::default());
    assert_eq!((check.turn, check.moved), (0, 0));
    until_end_of(&mut search, Phase::Lines);
    assert_eq!(search.check, check);
    // Without a line there is nothing to check.
    search.lines = lines(&[]);
    search.task = Task::Check { steps: 0 };
    search.poll(1);
    assert_eq!((search.check, search.cycles()), (check, 2));
}

/// What a hypothesis is, from an entry and the robot's place.
#[test]
fn a_hypothesis_has_the_figures_of_its_entry() {
    let walls = room();
    let mut search = search(&walls);
    let placement = Placement {
        at: Vector::new(2.0, 1.0),
        rotation: Vector::of_angle(0.5),
        bend: Bend { drift: 0.02, turn_scale: 0.03 },
    };
    let spread = Spread { xx: 0.04, xy: 0.0, yy: 0.01, rotation: 0.09 };
    let entry = Entry {
        score: 12.0,
        pings: 20,
        echoes: 16,
        explained: 12,
        spread,
        ..Entry::proposed(placement, 0.0)
    };
    search.bank = Bank::of(&[entry]);
    let is = search.ranked(0).unwrap();
    for (is, expected) in [
        (is.pose.x.0, 2.0),
        (is.pose.y.0, 1.0),
        (is.pose.heading.radians().0, 0.5),
        (is.position_deviation.0, 0.2),
        (is.heading_deviation.0, 0.3),
        (is.fit, 0.6),
        (is.explained, 0.75),
        (is.drift, 0.02),
        (is.turn_scale, 0.03),
    ] {
        assert!((f64::from(is) - expected).abs() < 1e-5, "{is} {expected}");
    }
    // Nothing has been scored yet.
    search.bank = Bank::of(&[Entry { pings: 0, echoes: 0, explained: 0, ..entry }]);
    let is = search.ranked(0).unwrap();
    assert!((is.fit - 12.0).abs() < 1e-5 && is.explained.abs() < 1e-5, "{is:?}");
    assert_eq!(search.hypotheses().count(), 1);
    assert!(search.ranked(1).is_none());
}

/// Pings and lines where the best hypothesis places them, rotated by a right angle here.
#[test]
fn pings_and_lines_are_placed_by_the_best_hypothesis() {
    let walls = room();
    let mut search = search(&walls);
    search.odometry(Metres(1.0), Radians(0.0)).unwrap();
    search.ping(Radians(0.0), Some(Metres(2.0))).unwrap();
    search.ping(Radians(core::f32::consts::FRAC_PI_2), None).unwrap();
    search.odometry(Metres(1.0), Radians(0.0)).unwrap();
    search.window.rebase();
    search.lines = Lines::of(
        Radians(0.2),
        &[Line { normal: Vector::new(0.0, 1.0), offset: 0.5, stretch: (-1.0, 2.0), support: 5 }],
    );
    assert_eq!((search.placed_pings().count(), search.placed_lines().count()), (0, 0));
    let rotation = Vector::new(0.0, 1.0);
    let placement = Placement { at: Vector::new(3.0, 1.0), rotation, bend: Bend::NONE };
    search.bank = Bank::of(&[Entry::proposed(placement, 0.0)]);
    let is_at = |point: Point, x: f32, y: f32| (point.x.0 - x).hypot(point.y.0 - y) < 1e-5;
    let pings: Vec<(Point, Option<Point>)> = search.placed_pings().collect();
    assert!(is_at(pings[0].0, 3.0, 0.0) && is_at(pings[1].0, 3.0, 0.0), "{pings:?}");
    assert!(is_at(pings[0].1.unwrap(), 3.0, 2.0) && pings[1].1.is_none(), "{pings:?}");
    let lines: Vec<[Point; 2]> = search.placed_lines().collect();
    assert!(is_at(lines[0][0], 2.5, 2.0) && is_at(lines[0][1], 2.5, -1.0), "{lines:?}");
}

/// A sweep turns by its step and back at the limits, a part of a step off.
#[test]
fn a_sweep_stays_within_the_limits_of_the_servo() {
    let limits = (-1.0, 1.0);
    let mut sweep = Sweep { bearing: -1.0, step: 0.5 };
    let mut bearings = Vec::new();
    for _ in 0..9 {
        sweep.advance(limits);
        bearings.push(sweep.bearing);
    }
    let part = 0.381_966 * 0.5;
    let expected = [-0.5, 0.0, 0.5, 1.0, 1.0 - part, 0.5 - part, -part, -0.5 - part, -0.5];
    for (is, expected) in bearings.iter().zip(expected) {
        assert!((is - expected).abs() < 1e-5, "{bearings:?}");
    }
    // A servo that is narrower than a part of a step does not turn.
    let mut narrow = Sweep { bearing: 0.0, step: 0.5 };
    for _ in 0..4 {
        narrow.advance((0.0, 0.1));
        assert!((narrow.bearing - 0.0).abs() < 1e-6, "{narrow:?}");
    }
}

proptest! {
    #[test]
    fn a_region_has_a_margin(
        from in (-2.0_f32..2.0, -2.0_f32..2.0), size in (0.1_f32..2.0, 0.1_f32..2.0),
        at in (-5.0_f32..5.0, -5.0_f32..5.0), margin in 0.0_f32..1.0,
    ) {
        let to = (from.0 + size.0, from.1 + size.1);
        let region = Region { from: Point::new(from.0, from.1), to: Point::new(to.0, to.1) };
        let outside = |at: f32, from: f32, to: f32| {
            let (at, from, to) = (f64::from(at), f64::from(from), f64::from(to));
            (from - at).max(at - to)
        };
        let beyond = outside(at.0, from.0, to.0).max(outside(at.1, from.1, to.1)) - f64::from(margin);
        prop_assume!(is_clear(beyond, 0.0));
        prop_assert_eq!(region.contains(Point::new(at.0, at.1), Metres(margin)), beyond < 0.0);
    }

    /// Unless it is near a hypothesis or began outside of the region: by the score that it has to reach.
    #[test]
    fn a_candidate_has_to_reach_a_share_of_the_best_score(
        scores in prop::collection::vec(-50.0_f32..100.0, 0..5), x in 0.0_f32..5.9, angle in -3.1_f32..3.1,
        (start, since) in ((-1.0_f32..1.0, -1.0_f32..1.0), 0_u8..20), near in 0.1_f32..0.5, rivalry in 0.1_f32..0.9, within in 1.0_f32..80.0,
        has_region in any::<bool>(),
    ) {
        let walls = room();
        let mut search = search(&walls);
        let mut scores = scores;
        scores.sort_by(|one, other| other.total_cmp(one));
        let entries: Vec<Entry> = (0_u8..).zip(&scores).map(|(n, score)| {
            let placement = Placement {
                at: Vector::new(f32::from(n), 1.0), rotation: Vector::of_angle(0.0), bend: Bend::NONE,
            };
            Entry { score: *score, ..Entry::proposed(placement, 0.0) }
        }).collect();
        search.bank = Bank::of(&entries);
        // Forth and back: the start stays where it is.
        for _ in 0..since {
            search.odometry(Metres(0.5), Radians(0.0)).unwrap();
            search.odometry(Metres(-0.5), Radians(0.0)).unwrap();
        }
        search.odometry(Metres(-start.0), Radians(0.0)).unwrap();
        search.window.rebase();
        let region = Region { from: Point::new(1.0, 0.5), to: Point::new(3.0, 1.5) };
        if has_region {
            search.begin_within(region);
        }
        let placement = Placement {
            at: Vector::new(x, 1.0 + start.1), rotation: Vector::of_angle(angle), bend: Bend::NONE,
        };
        let ((sin, cos), (back, aside)) = (f64::from(angle).sin_cos(), (f64::from(start.0), f64::from(start.1)));
        let begun = (f64::from(x) + cos * back, 1.0 + aside + sin * back);
        let margin = 0.1 * (1.0 + f64::from(since) + back.abs());
        let outside = (1.0 - begun.0).max(begun.0 - 3.0).max(0.5 - begun.1).max(begun.1 - 1.5) - margin;
        prop_assume!(is_clear(outside, 0.0));
        let is_known = search.bank.has_near(&placement, near);
        let full = if scores.len() == 4 { scores[3] } else { 0.0 };
        let best = scores.first().copied().unwrap_or(0.0);
        let least = full.max(rivalry * best).max(best - within).max(0.0);
        search.work = Work::None;
        search.try_candidate(placement, near, (rivalry, within));
        let is_tried = !is_known && (!has_region || outside < 0.0);
        let expected =
            if is_tried { Work::Trial(Trial::of_candidate(placement, least, 0.0)) } else { Work::None };
        prop_assert_eq!(format!("{:?}", search.work), format!("{:?}", expected));
    }
}

/// An answer is refined from the place of the robot, before the hypotheses, of which it stays one.
#[test]
fn an_answer_is_refined_before_the_hypotheses() {
    for is_found in [false, true] {
        let walls = room();
        let mut search = search(&walls);
        ping(&mut search, 14);
        for x in [2.0, 4.0] {
            search.propose(Pose::new(x, 2.0, Radians(0.0))).unwrap();
        }
        search.odometry(Metres(0.5), Radians(0.0)).unwrap();
        search.is_found = is_found;
        until_end_of(&mut search, Phase::Lines);
        search.poll(1);
        let best = search.bank.entries()[0];
        assert_eq!((best.state, best.placement.at), (State::InTrial, Vector::new(2.5, 2.0)));
        let mut expected = Trial::of_entry(&best);
        expected.is_answer = is_found;
        assert_eq!(format!("{:?}", search.work), format!("{:?}", Work::Trial(expected)));
        assert!(!search.is_found);
        let mut trials = 0;
        while matches!(search.task, Task::Bank) {
            trials += u32::from(matches!(search.work, Work::None));
            search.poll(1);
        }
        assert_eq!(trials, 2 + u32::from(is_found));
    }
}

/// The refinement of an answer may not move it away from its hypothesis.
#[test]
fn an_answer_is_near_a_hypothesis() {
    let walls = room();
    for (moved, is_answer) in [(0.2, true), (0.4, false)] {
        let mut search = search(&walls);
        let placement = |x: f32| Placement {
            at: Vector::new(x, 1.0),
            rotation: Vector::of_angle(0.0),
            bend: Bend::NONE,
        };
        search.bank = Bank::of(&[Entry::proposed(placement(1.0), 0.0)]);
        search.conclude(Entry::proposed(placement(1.0 + moved), 0.0));
        assert_eq!(matches!(search.answer(), Answer::Unique(_)), is_answer, "{moved}");
    }
}
