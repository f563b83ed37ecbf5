//! What takes a quarter of an hour: many drives, and robots whose power is cut again and again.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::Radians;
use sonarfix::localizer::Start;
use sonarfix_link::message::ResetCause;
use sonarfix_link::{Command, Telemetry};

use crate::pico::{Pico, Polls, World};
use crate::results::{Table, polls, row};
use crate::{Drive, ELF, configuration, done, drive, image, map, start, world};

/// The error of a stored pose, metres: from power-on to the first estimate a robot drives that far.
const RESUMED_WITHIN: f32 = 0.01;

/// Numbers from 0 to 1 that are the same in each run: the fractions of the multiples of an irrational number.
fn spread(n: u32, of: f64) -> f64 {
    (f64::from(n) * of).fract()
}

/// From other places, in other directions, with other noise of the sonar.
#[test]
#[ignore = "cargo xtask chips --long"]
#[expect(clippy::cast_possible_truncation, reason = "a pose has f32")]
fn twenty_drives_stay_within_15_mm() {
    let mut counted = Polls::default();
    for seed in 1..=20 {
        let x = 0.9 + 0.4 * spread(seed, 0.618_034);
        let y = 1.1 + 0.4 * spread(seed, 0.754_878);
        let heading = std::f64::consts::TAU * (spread(seed, 0.414_214) - 0.5);
        let world = World { pose: [x as f32, y as f32, heading as f32], seed, ..world() };
        let Drive { worst, turn, travelled, pings, polls, .. } = drive(&world);
        row(
            Table::Drives,
            &[
                &seed,
                &format!("{x:.2} m, {y:.2} m, {:.0}°", heading.to_degrees()),
                &format!("{travelled:.1} m"),
                &pings,
                &format!("{:.1} mm", 1e3 * worst),
                &format!("{:.2}°", turn.to_degrees()),
            ],
        );
        counted = counted.and(polls);
    }
    polls("twenty drives", counted);
}

/// Each robot keeps its flash from cut to cut: after each, it has the pose before or the new one.
#[test]
#[ignore = "cargo xtask chips --long"]
fn a_hundred_power_cuts_lose_no_pose() {
    let mut counted = Polls::default();
    for seed in 1..=5 {
        let mut robot = Cut::new(seed);
        let mut rounds = 0;
        while robot.before + robot.after + robot.lost < 20 {
            rounds += 1;
            robot.round(rounds);
        }
        let Cut { mut pico, before, after, lost } = robot;
        let counters = pico.counters();
        row(
            Table::Cuts,
            &[&seed, &rounds, &(before + after + lost), &before, &after, &lost, &counters.erased],
        );
        assert_eq!(lost, 0);
        counted = counted.and(pico.polls());
    }
    polls("a hundred power cuts", counted);
}

/// A robot whose power is cut while it stores poses.
struct Cut {
    pico: Pico,
    /// Cuts after which it had the pose before, and those after which it had the new one.
    before: u32,
    after: u32,
    /// Those after which it had neither.
    lost: u32,
}

impl Cut {
    fn new(seed: u32) -> Self {
        let world = World { seed, ..world() };
        let mut pico = Pico::switched_on(ELF, &world, &map(), &image(&configuration()));
        pico.hello();
        Self { pico, before: 0, after: 0, lost: 0 }
    }

    /// Sets a pose, and another one, which a cut interrupts at some step of its record.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a pose has f32, and a step is a small number"
    )]
    fn round(&mut self, round: u32) {
        let pico = &mut self.pico;
        let seed = pico.seed;
        let [known, next] =
            [0.7, 1.7].map(|from| from + 0.6 * spread(100 * seed + round, 0.618_034));
        let set = |x: f64| {
            Command::SetPose(Start { pose: Pose::new(x as f32, 1.3, Radians(0.0)), ..start() })
        };
        done(pico.order(&set(known)));
        pico.run(100, &[]);
        // A record takes between 91 and 96 steps, and more with a change of the sector.
        let step = 1 + (96.0 * spread(100 * seed + round, 0.414_214)) as u32;
        pico.ask(&format!("cut {step}"));
        // The answer comes at once or not at all.
        pico.patience = 200;
        let answer = pico.order(&set(next));
        pico.ask("cut Infinity");
        if pico.events().iter().all(|event| event.what != "reset-by-power") {
            return done(answer);
        }
        pico.forget_session();
        assert_eq!(pico.hello().reset, ResetCause::PowerOn);
        done(pico.order(&Command::Start));
        let resumed = pico
            .wait_for(|it| if let Telemetry::Estimate(it) = it { Some(*it) } else { None })
            .expect("no estimate");
        let x = resumed.state.pose().x.0;
        let has = |pose: f64| (x - pose as f32).abs() <= RESUMED_WITHIN;
        match (has(known), has(next)) {
            (true, _) => self.before += 1,
            (false, true) => self.after += 1,
            (false, false) => self.lost += 1,
        }
        done(pico.order(&Command::Stop));
        assert_eq!(pico.loop_status().flash.failures, 0);
        // What the loop has enabled and disabled.
        pico.events();
    }
}
