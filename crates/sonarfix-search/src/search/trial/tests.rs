//! A trial against its rules, with the scores and steps that the tests of both test.

use std::vec::Vec;

use proptest::prelude::*;

use super::super::window::Bend;
use super::*;
use sonarfix::config::Config;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::{Map, Wall};
use sonarfix::sensor::echo::EchoParameters;

/// A room of 5 m × 4 m.
fn walls() -> Vec<Wall> {
    let corners = [(0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
    let wall = |ends: &[(f32, f32)]| {
        Wall::new(Point::new(ends[0].0, ends[0].1), Point::new(ends[1].0, ends[1].1)).unwrap()
    };
    corners.windows(2).map(wall).collect()
}

/// A robot drives on an arc from (2, 1.5) and pings the walls; the placement of the window.
fn drive(turn: f32, pings: usize, noise: &[f32]) -> (Window<32>, Placement) {
    let mut window = Window::new(Vector::new(0.05, 0.02));
    for (n, noise) in noise.iter().cycle().take(pings).enumerate() {
        window.drive(0.05, turn);
        let heading = window.heading();
        let sonar = window.robot().at.plus(Vector::new(2.05, 1.52));
        // Square to one of the walls.
        let (axis, range) = match n % 4 {
            0 => (0.0, 5.0 - sonar.x),
            1 => (core::f32::consts::FRAC_PI_2, 4.0 - sonar.y),
            2 => (core::f32::consts::PI, sonar.x),
            _ => (-core::f32::consts::FRAC_PI_2, sonar.y),
        };
        let range = (n % 7 != 3).then_some(range + noise);
        window.ping(axis - heading + 0.5 * noise, range, [Radians(0.0); 2]);
    }
    let reference = window.rebase();
    let at = reference.at.plus(Vector::new(2.0, 1.5));
    (window, Placement { at, rotation: Vector::new(1.0, 0.0), bend: Bend::NONE })
}

/// What a whole stage adds up to.
struct Sum {
    score: f32,
    echoes: u16,
    equations: Equations,
    /// The sums after each ping, and the evaluations so far.
    running: Vec<(f32, usize)>,
}

/// Evaluations of a ping: what may answer it is found in the first, and up to four of that are looked at in each later one.
fn evaluations(echoes: &EchoModel, beam: &Beam, sharpness: Sharpness) -> usize {
    let mut hearing = echoes.listen(beam, sharpness);
    let mut most = hearing.at_first();
    for evaluations in 1..4 {
        if echoes.hear(&mut hearing, (beam, sharpness), most).is_some() {
            return evaluations;
        }
        most = 4;
    }
    panic!("more than six reflectors");
}

fn stage(
    echoes: &EchoModel,
    window: &Window<32>,
    odometry: &Odometry,
    placement: &Placement,
    deviation: f32,
) -> Sum {
    let mut chain = Chain::new(Vector::default());
    let mut sum =
        Sum { score: 0.0, echoes: 0, equations: Equations::default(), running: Vec::new() };
    for ping in window.pings().iter().rev() {
        chain.add(&window.link(ping, placement.bend.minus(window.bend())));
        let placed = Placed::new(ping, placement, &chain);
        let sharpness = Sharpness::new(deviation, odometry.per_metre * ping.station.travelled);
        let explanation = echoes.explain(&placed.beam, sharpness);
        let gain = explanation.score - echoes.nothing(ping.range().is_some());
        sum.score += ping.weight() * gain;
        sum.echoes += u16::from(ping.range().is_some());
        if let Some(target) = explanation.target {
            let by = Tolerance { deviation: sharpness.deviation, by_beam: echoes.by_beam };
            sum.equations.add(&placed, &target, by);
        }
        let before = sum.running.last().map_or(0, |(_, evaluations)| *evaluations);
        sum.running.push((sum.score, before + evaluations(echoes, &placed.beam, sharpness)));
    }
    sum
}

/// Runs a trial to its end; returns the evaluations, too.
fn run(
    mut trial: Trial,
    echoes: &EchoModel,
    window: &Window<32>,
    odometry: &Odometry,
) -> (usize, Verdict) {
    for evaluations in 1..1_000 {
        let verdict = trial.advance(echoes, window, odometry);
        if verdict != Verdict::Running {
            return (evaluations, verdict);
        }
    }
    panic!("the trial does not end");
}

proptest! {
    /// Stages of 15 and 8 cm and of the score with a step after each, and a final one; an answer has two steps at its deviation more.
    #[test]
    fn a_trial_refines_a_placement_and_scores_it(
        turn in -0.1_f32..0.1, pings in 5_usize..32, noise in prop::collection::vec(-0.06_f32..0.06, 5),
        (dx, dy, angle) in (-0.2_f32..0.2, -0.2_f32..0.2, -0.1_f32..0.1), wanted in prop::option::of(0.0_f32..80.0),
        kind in 0_u8..3, past in 0.0_f32..50.0, per_metre in 0.0_f32..0.05,
    ) {
        let walls = walls();
        let config = Config::for_track_width(Metres(0.2));
        let echoes = EchoModel::new(Map::new(&walls), &config.rangers.first, &EchoParameters::HC_SR04);
        let prior = Prior { drift: 0.05, turn_scale: 0.03 };
        let odometry = Odometry { prior, per_metre };
        let (window, placement) = drive(turn, pings, &noise);
        // Fewer than were sent, if two axes are equal.
        let pings = window.pings().len();
        let placement = Placement {
            at: placement.at.plus(Vector::new(dx, dy)),
            rotation: placement.rotation.turned(Vector::of_angle(angle)),
            ..placement
        };
        let entry = Entry::proposed(placement, past);
        // Deviation of each stage, share of the wanted mean and slack.
        let coarse = (0.15, 0.5, 0.0);
        let (fine, sharp) = (echoes.fine(), echoes.sharp());
        let steps = [(0.08, 0.7, 0.0), (fine, 0.9, 0.1), (sharp, 0.9, 0.1), (sharp, 0.9, 0.1)];
        let least = if kind == 0 { wanted.unwrap_or(f32::NEG_INFINITY) } else { f32::NEG_INFINITY };
        let (trial, stages) = match kind {
            0 => (Trial::of_candidate(placement, least, past), Vec::from([coarse, steps[0], steps[1]])),
            1 => (Trial::of_entry(&entry), Vec::from([steps[0], steps[1]])),
            _ => (Trial { is_answer: true, ..Trial::of_entry(&entry) }, Vec::from(steps)),
        };
        let last = if kind == 2 { steps[3] } else { steps[1] };
        prop_assert_eq!(trial.is_answer, kind == 2);
        let (mut at, mut evaluations) = (placement, 0);
        let mut expected = None;
        let mut evidence = f64::NAN;
        let number = stages.len();
        for (n, (deviation, share, slack)) in stages.into_iter().chain([last]).enumerate() {
            let sum = stage(&echoes, &window, &odometry, &at, deviation);
            // The mean that is wanted, less the slack and a lead of 8.
            let mut rejected = None;
            for (seen, (running, evaluations)) in (1_u16..).zip(&sum.running) {
                let rate = share * f64::from(least) / f64::from(u16::try_from(pings).unwrap()) - slack;
                let limit = rate * f64::from(seen) - 8.0;
                prop_assume!((f64::from(*running) - limit).abs() > 1e-3);
                if f64::from(*running) < limit {
                    rejected = Some(*evaluations);
                    break;
                }
            }
            if let Some(until) = rejected {
                expected = Some((evaluations + until, Verdict::Rejected));
                break;
            }
            evaluations += sum.running.last().unwrap().1 + 1;
            if n < number {
                at = sum.equations.step(&at, prior).unwrap();
                continue;
            }
            evidence = f64::from(past)
                + (1.0 - f64::from(u16::try_from(pings).unwrap()) / (2.0 * 32.0)) * f64::from(sum.score);
            let entry = Entry {
                placement: at,
                score: sum.score,
                pings: u8::try_from(pings).unwrap(),
                echoes: u8::try_from(sum.echoes).unwrap(),
                explained: u8::try_from(sum.equations.count).unwrap(),
                spread: sum.equations.spread(prior),
                past,
                evidence: 0.0,
                state: State::Fresh,
            };
            expected = Some((evaluations, Verdict::Scored(entry)));
        }
        let (evaluations, mut verdict) = run(trial, &echoes, &window, &odometry);
        if let Verdict::Scored(entry) = &mut verdict {
            prop_assert!((f64::from(entry.evidence) - evidence).abs() < 1e-3, "{entry:?} {evidence}");
            entry.evidence = 0.0;
        }
        let is = (evaluations, verdict);
        prop_assert_eq!(Some(is), expected);
    }
}

#[test]
fn a_count_is_a_number() {
    assert_eq!((count(0).to_bits(), count(96).to_bits()), (0.0_f32.to_bits(), 96.0_f32.to_bits()));
}
