//! The verdict's transitions, as drawn in `health.rs`.

use proptest::prelude::*;
use sonarfix::config::{Config, Trust};
use sonarfix::health::Verdict::{self, Degraded, Lost, Tracking};
use sonarfix::localizer::Start;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix::map::{Map, Wall};
use sonarfix::motion::WheelTravel;
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Instant, Metres, Radians};

use crate::strategies::config_for_rooms;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Accepted,
    TooLong,
    TooShort,
    NoEcho,
    Skipped,
}
use Outcome::{Accepted, NoEcho, Skipped, TooLong, TooShort};

fn one_wall() -> [Wall; 1] {
    [Wall::new(Point::new(2.0, -5.0), Point::new(2.0, 5.0)).unwrap()]
}

fn started(walls: &[Wall]) -> Localizer<'_> {
    let start = Start {
        pose: Pose::default(),
        position_deviation: Metres(0.03),
        heading_deviation: Radians(0.01),
    };
    let mut config = config_for_rooms(Point::new(0.0, 0.0));
    // The doubt of a lost robot stays, so that what is to be gated is.
    config.trust.reopen = Metres(0.0);
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

fn meet(localizer: &mut Localizer, outcome: Outcome) -> Verdict {
    let aim = localizer.aim().unwrap();
    let range = match outcome {
        Accepted => Some(aim.range),
        TooLong => Some(aim.range + Metres(1.0)),
        TooShort => Some(aim.range - Metres(1.0)),
        NoEcho => None,
        Skipped => {
            localizer.skip();
            return localizer.health().verdict;
        }
    };
    let fix = localizer.fix(&aim, range);
    let as_meant = match outcome {
        Accepted => matches!(fix, Fix::Accepted(_)),
        TooLong | TooShort => matches!(fix, Fix::Gated(_)),
        NoEcho | Skipped => matches!(fix, Fix::Refused(_)),
    };
    assert!(as_meant, "{outcome:?} became {fix:?}");
    localizer.health().verdict
}

/// The verdicts that a sequence leads through.
fn verdicts(outcomes: &[Outcome]) -> Vec<Verdict> {
    let walls = one_wall();
    let mut localizer = started(&walls);
    outcomes.iter().map(|&o| meet(&mut localizer, o)).collect()
}

/// After how many turns of the same outcome the verdict is first this.
fn turns_until(verdict: Verdict, outcome: Outcome) -> Option<usize> {
    verdicts(&[outcome; 90]).iter().position(|v| *v == verdict).map(|turn| turn + 1)
}

#[test]
fn the_drawn_ways_are_taken() {
    assert_eq!(turns_until(Degraded, TooLong), Some(1));
    // 1 and 5 · 0.7.
    assert_eq!(turns_until(Lost, TooLong), Some(6));
    // 0.5 once: what stands before a wall says no more than that, however often.
    assert_eq!(turns_until(Degraded, TooShort), None);
    // 0.6 and 2 · 0.3; 0.6 and 12 · 0.3.
    assert_eq!(turns_until(Degraded, NoEcho), Some(3));
    assert_eq!(turns_until(Lost, NoEcho), Some(13));
    // A turn that says nothing of the pose does not make it lost, however often.
    assert_eq!(turns_until(Degraded, Skipped), Some(10));
    assert_eq!(turns_until(Lost, Skipped), None);
    // Lost → Degraded → Tracking by three ranges taken each: 4 − 3 · 1.2 is below 0.5.
    let mut recovery = vec![TooLong; 6];
    recovery.extend([Accepted; 20]);
    let recovery = verdicts(&recovery);
    let first = |verdict| recovery[6..].iter().position(|v| *v == verdict).unwrap() + 1;
    assert_eq!((first(Degraded), first(Tracking)), (3, 6));
}

#[test]
fn what_a_room_does_to_a_good_estimate_is_not_called_lost() {
    // Every third range shortened by furniture; every third one long; every other one missed.
    for pattern in
        [[TooShort, Accepted, Accepted], [TooLong, Accepted, Accepted], [NoEcho, Accepted, NoEcho]]
    {
        let turns = pattern.repeat(40);
        assert!(!verdicts(&turns).contains(&Lost), "{pattern:?}");
    }
}

/// The drawing again, in `f64` and from the whole history.
#[derive(Default)]
struct Model {
    verdict: Verdict,
    history: Vec<Outcome>,
    /// Where the current verdict's row of accepted ranges may begin.
    since: usize,
}

impl Model {
    /// How many of the latest turns count, until one of those that end the row.
    fn row(&self, counts: &[Outcome], ends: &[Outcome]) -> usize {
        let latest = self.history.iter().rev().take_while(|o| !ends.contains(o));
        latest.filter(|o| counts.contains(o)).count()
    }

    /// All turns are of the one wall.
    fn evidence(&self) -> f64 {
        let mut again = false;
        self.history.iter().fold(0.0, |sum, outcome| {
            let (weight, contradicts) = match (outcome, again) {
                (Accepted, _) => (-1.2, false),
                (TooLong, false) => (1.0, true),
                (TooLong, true) => (0.7, true),
                (TooShort, true) => (0.0, true),
                (NoEcho, false) => (0.6, true),
                (TooShort, false) => (0.5, true),
                (NoEcho, true) => (0.3, true),
                (Skipped, again) => (0.0, again),
            };
            again = contradicts;
            (sum + weight).clamp(0.0_f64, 4.0)
        })
    }

    /// The verdict after a turn; `None` if the evidence is too near a bound for `f32` to tell.
    fn meet(&mut self, outcome: Outcome) -> Option<Verdict> {
        let before = self.evidence();
        self.history.push(outcome);
        let evidence = self.evidence();
        // At the most it is clamped, to the same number.
        let is_near = |bound: &f64| (evidence - bound).abs() < 1e-4;
        // The first range that is too long adds 1 to 0, exactly.
        let is_exact = outcome == TooLong && before <= 0.0;
        if (!is_exact && [0.5, 1.0].iter().any(is_near)) || (is_near(&4.0) && evidence < 4.0) {
            return None;
        }
        let silent = self.row(&[NoEcho, Skipped], &[Accepted, TooLong, TooShort]);
        let accepted = self.row(&[Accepted], &[TooLong, TooShort, NoEcho, Skipped]);
        let better = accepted.min(self.history.len() - self.since) >= 3 && evidence < 0.5;
        self.verdict = match (self.verdict, outcome) {
            (Lost, Accepted) if better => {
                self.since = self.history.len();
                Degraded
            }
            (Degraded, Accepted) if better => Tracking,
            (verdict, Accepted) => verdict,
            _ if evidence >= 4.0 => Lost,
            (Tracking, _) if evidence >= 1.0 || silent >= 10 => Degraded,
            (verdict, _) => verdict,
        };
        Some(self.verdict)
    }
}

proptest! {
    /// Any sequence of outcomes leads where the drawing says. Rows, not single outcomes, are
    /// drawn: else gated ones would hardly ever come together.
    #[test]
    fn any_sequence_leads_where_it_is_drawn(
        rows in proptest::collection::vec(
            (prop_oneof![Just(Accepted), Just(TooLong), Just(TooShort), Just(NoEcho), Just(Skipped)],
             1_usize..25), 1..20),
    ) {
        let walls = one_wall();
        let mut localizer = started(&walls);
        let mut model = Model::default();
        for (outcome, times) in rows {
            for _ in 0..times {
                let Some(expected) = model.meet(outcome) else { return Ok(()) };
                prop_assert_eq!(meet(&mut localizer, outcome), expected);
            }
        }
    }
}

/// A robot of this trust before one wall.
fn trusting(trust: Trust, walls: &[Wall], heading_deviation: f32) -> Localizer<'_> {
    let start = Start {
        pose: Pose::default(),
        position_deviation: Metres(0.03),
        heading_deviation: Radians(heading_deviation),
    };
    let config = Config { trust, ..config_for_rooms(Point::new(0.0, 0.0)) };
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

/// The trust of a robot that nothing but the ranges can degrade.
fn easy() -> Trust {
    Trust { stale: Metres(1e3), doubtful: Metres(1e3), ..config_for_rooms(Point::default()).trust }
}

#[test]
fn a_way_without_a_range_degrades() {
    let walls = one_wall();
    let mut localizer = trusting(Trust { stale: Metres(0.1), ..easy() }, &walls, 0.01);
    let mut after = |tenths: u64, way| {
        let now = Instant::from_ticks(100_000 * tenths);
        localizer.odometry(now, WheelTravel::new(way, way)).unwrap();
        localizer.health().verdict
    };
    assert_eq!((after(1, 0.09), after(2, 0.02)), (Tracking, Degraded));
}

#[test]
fn doubt_of_position_or_heading_degrades() {
    let walls = one_wall();
    let skipped = |trust, heading| {
        let mut localizer = trusting(trust, &walls, heading);
        localizer.skip();
        localizer.health().verdict
    };
    // The position's deviation is 0.03 m.
    let doubtful = |limit| Trust { doubtful: Metres(limit), ..easy() };
    assert_eq!(
        (skipped(doubtful(0.031), 0.01), skipped(doubtful(0.029), 0.01)),
        (Tracking, Degraded)
    );
    // The heading's limit is a quarter of the cone.
    let limit = 0.25 * config_for_rooms(Point::default()).sonar.cone.0;
    assert_eq!(
        (skipped(easy(), 0.99 * limit), skipped(easy(), 1.01 * limit)),
        (Tracking, Degraded)
    );
}

/// Ranges that are all inside the gate, but all too far out.
#[test]
fn ranges_too_far_out_on_average_degrade() {
    let walls = one_wall();
    let mut localizer = trusting(easy(), &walls, 0.01);
    let mut degraded = false;
    for _ in 0..20 {
        let aim = localizer.aim().unwrap();
        let Fix::Accepted(expected) = localizer.clone().fix(&aim, Some(aim.range)) else {
            panic!()
        };
        let out = 2.4 * expected.variance.0.sqrt();
        let fix = localizer.fix(&aim, Some(aim.range + Metres(out)));
        assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
        degraded |= localizer.health().nis > 3.0;
        assert_eq!(localizer.health().verdict, if degraded { Degraded } else { Tracking });
    }
    assert!(degraded);
}
