//! Counters and limits of the verdict, at and just beyond each limit.

use super::*;
use crate::association::outcome::{AbsoluteFix, Agreement, Refusal};
use crate::geometry::units::SquareMetres;
use crate::sensor::range::Innovation;

const LIMITS: Limits =
    Limits { distance: Metres(2.0), position: Metres(0.5), heading: Radians(0.125) };
const CERTAIN: PoseUncertainty = PoseUncertainty { position: Metres(0.01), heading: Radians(0.01) };
const UNCERTAIN: PoseUncertainty = PoseUncertainty { position: Metres(1.0), heading: Radians(1.0) };
const MICROSECOND: Duration = Duration::from_ticks(1);
const NO_TIME: Duration = Duration::from_ticks(0);

/// An accepted range whose innovation is so many standard deviations.
fn accepted(deviations: f32) -> Fix {
    Fix::Accepted(Innovation { value: Metres(deviations), variance: SquareMetres(1.0) })
}

/// The verdict after a change of the default, when the limits are checked.
fn degraded(change: impl Fn(&mut Health)) -> Verdict {
    let mut health = Health::default();
    change(&mut health);
    health.degrade(&LIMITS);
    health.verdict
}

#[test]
fn a_health_that_is_lost_has_its_evidence_and_uncertainty() {
    let Health { verdict, evidence, position_deviation, heading_deviation, .. } =
        Health::lost(UNCERTAIN);
    assert_eq!((verdict, evidence.to_bits()), (Verdict::Lost, LOST_AT.to_bits()));
    assert_eq!((position_deviation, heading_deviation), (Metres(1.0), Radians(1.0)));
}

/// A hundredth of ν²/S, at most 25, enters the mean.
#[test]
fn the_mean_nis_remembers_a_hundred_ranges() {
    for (deviations, expected) in [(2.0, 1.0 + 0.01 * 3.0), (10.0, 1.0 + 0.01 * 24.0)] {
        let mut health = Health::default();
        health.record_fix(&accepted(deviations), 0.0, false, CERTAIN, &LIMITS);
        assert_eq!(health.nis.to_bits(), f32::to_bits(expected));
    }
}

/// Of a pose from outside each of the three numbers has the weight of a range.
#[test]
fn the_mean_nis_is_that_of_one_number() {
    for has_position in [true, false] {
        let mut health = Health::default();
        let fix = AbsoluteFix::Accepted(Agreement { nis: 12.0, dimensions: 3 });
        health.record_absolute(&fix, has_position, 0.0, false, CERTAIN, &LIMITS);
        assert_eq!(health.nis.to_bits(), f32::to_bits(1.0 + 0.01 * 3.0), "{has_position}");
    }
}

#[test]
fn a_limit_is_exceeded_only_beyond_it() {
    type Change = fn(&mut Health);
    let limits: [(Change, Change); 5] = [
        (|h| h.nis = 2.0, |h| h.nis = 2.000_001),
        (|h| h.rolled_since_fix = Metres(2.0), |h| h.rolled_since_fix = Metres(2.000_001)),
        (
            |h| h.time_since_fix = DEGRADED_WITHOUT_FIX,
            |h| h.time_since_fix = DEGRADED_WITHOUT_FIX + MICROSECOND,
        ),
        (|h| h.position_deviation = Metres(0.5), |h| h.position_deviation = Metres(0.500_001)),
        (|h| h.heading_deviation = Radians(0.125), |h| h.heading_deviation = Radians(0.125_001)),
    ];
    for (at, beyond) in limits {
        assert_eq!((degraded(at), degraded(beyond)), (Verdict::Tracking, Verdict::Degraded));
    }
}

/// Time counts since the last range that was used, whether the robot moves or its wheels cannot be observed.
#[test]
fn a_minute_without_a_used_range_degrades() {
    let travel = |health: &mut Health, time| health.record_travel(Metres(0.0), time, &LIMITS);
    let unseen =
        |health: &mut Health, time| health.record_unseen(MICROSECOND, time, UNCERTAIN, &LIMITS);
    let verdicts = |record: &dyn Fn(&mut Health, Duration)| {
        let mut health = Health::default();
        [DEGRADED_WITHOUT_FIX, MICROSECOND, MICROSECOND].map(|time| {
            record(&mut health, time);
            health.verdict
        })
    };
    let expected = [Verdict::Tracking, Verdict::Degraded, Verdict::Degraded];
    assert_eq!(verdicts(&travel), expected);
    // The deviations exceed their limits, but a short period without odometry does not confirm them.
    assert_eq!(verdicts(&unseen), expected);
    let mut health = Health::default();
    health.record_unseen(MICROSECOND, DEGRADED_WITHOUT_FIX + MICROSECOND, CERTAIN, &LIMITS);
    assert_eq!(health.verdict, Verdict::Degraded);
    health.record_fix(&accepted(0.0), 0.0, false, CERTAIN, &LIMITS);
    assert_eq!(health.time_since_fix, NO_TIME);
}

#[test]
fn the_verdict_without_odometry_is_that_of_the_stated_times() {
    let after = |unseen| {
        let mut health = Health::default();
        health.record_unseen(unseen, NO_TIME, UNCERTAIN, &LIMITS);
        health.verdict
    };
    for (limit, verdicts) in [
        (DEGRADED_WITHOUT_ODOMETRY, (Verdict::Tracking, Verdict::Degraded)),
        (LOST_WITHOUT_ODOMETRY, (Verdict::Degraded, Verdict::Lost)),
    ] {
        assert_eq!((after(limit), after(limit + MICROSECOND)), verdicts);
    }
}

/// Improves from `Degraded` at the third accepted range in a row, with little evidence and few inflations.
#[test]
fn an_improvement_has_each_of_its_conditions() {
    let improved = |evidence, inflations, ranges| {
        let mut health =
            Health { verdict: Verdict::Degraded, evidence, inflations, ..Health::default() };
        (0..ranges).for_each(|_| health.record_fix(&accepted(1.0), 0.0, false, CERTAIN, &LIMITS));
        health.verdict == Verdict::Tracking
    };
    assert!(improved(0.499, 1, 3));
    assert!(!improved(BETTER_BELOW, 0, 3));
    assert!(!improved(0.0, 2, 3));
    assert!(!improved(0.0, 0, 2));
}

/// Without an accepted range the verdict is `Degraded` from the eighth ping on.
#[test]
fn eight_pings_without_a_range_degrade() {
    let mut health = Health::default();
    let first = (1..=40).find(|_| {
        health.record_fix(&Fix::Refused(Refusal::NoEcho), 0.0, false, CERTAIN, &LIMITS);
        health.verdict == Verdict::Degraded
    });
    assert_eq!((first, health.verdict), (Some(8), Verdict::Degraded));
}

/// The ping at which the verdict is `Lost` if those for which `is_accepted` are accepted, and the others have no echo.
fn lost_at(uncertainty: PoseUncertainty, is_accepted: fn(u32) -> bool) -> Option<u32> {
    let mut health = Health::default();
    (1..=1000).find(|&ping| {
        let fix = if is_accepted(ping) { accepted(1.0) } else { Fix::Refused(Refusal::NoEcho) };
        health.record_fix(&fix, 0.0, false, uncertainty, &LIMITS);
        health.verdict == Verdict::Lost
    })
}

#[test]
fn thirty_pings_that_are_not_accepted_lose_an_uncertain_pose() {
    let lost_at = |uncertainty| lost_at(uncertainty, |_| false);
    let moved = |position| PoseUncertainty { position: Metres(position), ..CERTAIN };
    let turned = |heading| PoseUncertainty { heading: Radians(heading), ..CERTAIN };
    assert_eq!((lost_at(moved(0.15)), lost_at(moved(0.151))), (None, Some(30)));
    let limit = 2.0 * LIMITS.heading.0;
    assert_eq!((lost_at(turned(limit)), lost_at(turned(1.01 * limit))), (None, Some(30)));
}

/// If half of the pings are accepted the pose is not lost. Of three, two count, and the accepted one takes back one.
#[test]
fn an_accepted_ping_outweighs_another_one() {
    assert_eq!(lost_at(UNCERTAIN, |ping| ping % 2 == 0), None);
    assert_eq!(lost_at(UNCERTAIN, |ping| ping % 3 == 0), Some(86));
}
