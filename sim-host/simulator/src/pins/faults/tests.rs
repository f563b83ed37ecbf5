use super::*;

fn faults(kinds: &[FaultKind]) -> Faults {
    let fault = |&kind| Fault { kind, from: 1.0, to: 2.0 };
    Faults::new(&kinds.iter().map(fault).collect::<Vec<_>>(), 7)
}

const BEFORE: u64 = 999_999;
const DURING: u64 = 1_500_000;
const AFTER: u64 = 2_000_000;

#[test]
fn an_echo_fault_has_an_effect_only_while_it_lasts() {
    let pulse = |kind, now| faults(&[kind]).sonar.pulse(now, 9_000, 38_000);
    for now in [BEFORE, AFTER] {
        for kind in [FaultKind::LostEchoes(1.0), FaultKind::CrossTalk(1.0), FaultKind::StuckEcho] {
            assert_eq!(pulse(kind, now), 9_000, "{kind:?}");
        }
    }
    assert_eq!(pulse(FaultKind::LostEchoes(1.0), DURING), 38_000);
    assert_eq!(pulse(FaultKind::StuckEcho, DURING), 500_000);
    let mut cross_talk = faults(&[FaultKind::CrossTalk(1.0)]).sonar;
    let pulses: Vec<u64> = (0..200).map(|_| cross_talk.pulse(DURING, 9_000, 38_000)).collect();
    assert!(pulses.iter().all(|pulse| (NEAREST_FLIGHT..=9_000).contains(pulse)));
    // Cross-talk is earlier in (9,000 − 300) of (38,000 − 300) pings: 46 ± 4 deviations of 6.
    let first = pulses.iter().filter(|&&pulse| pulse < 9_000).count();
    assert!((20..75).contains(&first), "{first}");
}

/// 5 cm.
const NEAREST_FLIGHT: u64 = 300;

#[test]
fn faults_compose_and_their_shares_are_kept() {
    let kinds = [FaultKind::LostEchoes(0.5), FaultKind::LostEchoes(0.5)];
    let mut sonar = faults(&kinds).sonar;
    let lost = (0..1_000).filter(|_| sonar.pulse(DURING, 9_000, 38_000) == 38_000).count();
    // Three quarters, ± 4 deviations of 14.
    assert!((690..810).contains(&lost), "{lost}");
}

#[test]
fn an_encoder_is_wrong_on_its_own_wheel() {
    let kinds = [FaultKind::DeadEncoder(Wheel::Right), FaultKind::ReversedEncoder(Wheel::Left)];
    let [mut right, mut left] = faults(&kinds).encoders;
    assert_eq!(right.edge(DURING, (true, true)).levels, (false, true));
    assert_eq!(left.edge(DURING, (true, false)).levels, (false, true));
    assert_eq!(right.edge(AFTER, (true, true)).levels, (true, true));
    let [mut right, mut left] = faults(&[FaultKind::MissingTicks(Wheel::Left, 1.0)]).encoders;
    assert!(right.edge(DURING, (true, true)).is_served);
    assert!(!left.edge(DURING, (true, true)).is_served);
}

#[test]
fn the_controller_suffers_while_the_fault_lasts() {
    let mut late = faults(&[FaultKind::ClockJitter(0.01)]).controller;
    assert_eq!(late.poll_at(BEFORE, 5), 5);
    let polls: Vec<u64> = (0..100).map(|_| late.poll_at(DURING, 5)).collect();
    assert!(polls.iter().all(|at| (5..=10_005).contains(at)));
    assert!(polls.iter().any(|&at| at > 5_000));
    let servo = |kinds: &[FaultKind], now| faults(kinds).controller.servo_slowness(now);
    assert_eq!(servo(&[FaultKind::StuckServo], DURING), None);
    assert_eq!(servo(&[FaultKind::StuckServo], AFTER), Some(1.0));
    assert_eq!(servo(&[FaultKind::SlowServo(2.0), FaultKind::SlowServo(3.0)], DURING), Some(6.0));
    let power = faults(&[FaultKind::BrownOut]).controller;
    assert_eq!(power.power_back_at(DURING), Some(AFTER));
    assert_eq!(power.power_back_at(AFTER), None);
}

#[test]
fn a_counter_cannot_be_read_while_the_fault_lasts() {
    let kinds = [FaultKind::ReadErrors(Wheel::Right, 1.0), FaultKind::ReadErrors(Wheel::Left, 0.5)];
    let [mut right, mut left] = faults(&kinds).encoders;
    for now in [BEFORE, AFTER] {
        assert!(!right.read_fails(now) && !left.read_fails(now));
    }
    assert!((0..100).all(|_| right.read_fails(DURING)));
    // Half, ± 4 deviations of 16; the edges are not disturbed.
    let failed = (0..1_000).filter(|_| left.read_fails(DURING)).count();
    assert!((436..564).contains(&failed), "{failed}");
    let whole = Edge { levels: (true, false), is_served: true };
    assert_eq!(right.edge(DURING, whole.levels), whole);
}

#[test]
fn a_dead_sonar_does_not_answer() {
    let sonar = faults(&[FaultKind::DeadSonar]).sonar;
    let dead = [BEFORE, DURING, AFTER].map(|now| sonar.is_dead(now));
    assert_eq!(dead, [false, true, false]);
}
