//! Messages to test with: any, one of each with numbers to be recognised by, the largest of each.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use sonarfix::aim::{Aim, NoAim, Reason};
use sonarfix::config::{Config, Pace, Policy, Rhythm, Timing, Weights};
use sonarfix::ekf::{Innovation, State};
use sonarfix::health::{Health, Verdict};
use sonarfix::localizer::{Fix, Refusal, Start};
use sonarfix::map::WallId;
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{
    Duration, Instant, Metres, MetresPerSecond, PerRootMetre, Radians, SquareMetres,
};
use sonarfix_hal::ranger::{Echo, NoEcho};
use sonarfix_hal::robot::{EncoderFaults, Faults};
use sonarfix_link::message::{Flashed, Loop, Refused, Reset, Skip, Step};
use sonarfix_link::{Ack, Command, Counters, Estimate, Hello, Look, Outcome, Telemetry};

/// Where the numbers of a message come from.
pub trait Source {
    fn bits32(&mut self) -> u32;
    fn bits64(&mut self) -> u64;
    fn bits16(&mut self) -> u16;
    /// One of so many variants.
    fn pick(&mut self, of: u32) -> u32;

    fn choose<T: Copy>(&mut self, variants: &[T]) -> T {
        let number = self.pick(u32::try_from(variants.len()).unwrap());
        variants[usize::try_from(number).unwrap()]
    }
    fn single(&mut self) -> f32;
    fn instant(&mut self) -> Instant {
        Instant::from_ticks(self.bits64())
    }
    fn duration(&mut self) -> Duration {
        Duration::from_ticks(self.bits64())
    }
}

/// Any numbers, NaN and infinities among them.
impl Source for ChaCha8Rng {
    fn bits32(&mut self) -> u32 {
        // Short varints as often as long ones.
        self.next_u32() >> self.random_range(0..32)
    }
    fn bits64(&mut self) -> u64 {
        self.next_u64() >> self.random_range(0..64)
    }
    fn bits16(&mut self) -> u16 {
        self.random::<u16>() >> self.random_range(0..16)
    }
    fn pick(&mut self, of: u32) -> u32 {
        self.random_range(0..of)
    }
    fn single(&mut self) -> f32 {
        f32::from_bits(self.next_u32())
    }
}

/// The numbers 1, 2, 3 …, so that no two fields of a message are alike.
pub struct Counting {
    pub next: u16,
    pub variant: u32,
}

impl Source for Counting {
    fn bits32(&mut self) -> u32 {
        self.bits16().into()
    }
    fn bits64(&mut self) -> u64 {
        self.bits16().into()
    }
    fn bits16(&mut self) -> u16 {
        self.next += 1;
        self.next
    }
    fn pick(&mut self, of: u32) -> u32 {
        self.variant % of
    }
    fn single(&mut self) -> f32 {
        f32::from(self.bits16())
    }
}

/// The numbers whose varints are longest. Of the variants the first, whichever they are.
pub struct Largest {
    pub variant: u32,
}

impl Source for Largest {
    fn bits32(&mut self) -> u32 {
        u32::MAX
    }
    fn bits64(&mut self) -> u64 {
        u64::MAX
    }
    fn bits16(&mut self) -> u16 {
        u16::MAX
    }
    fn pick(&mut self, of: u32) -> u32 {
        self.variant % of
    }
    fn single(&mut self) -> f32 {
        f32::MAX
    }
}

/// How many kinds of telemetry there are, and of commands.
pub const TELEMETRY: u32 = 8;
pub const COMMANDS: u32 = 6;

pub fn any_telemetry(rng: &mut ChaCha8Rng) -> Telemetry {
    let kind = rng.pick(TELEMETRY);
    telemetry(kind, rng)
}

pub fn any_command(rng: &mut ChaCha8Rng) -> Command {
    let kind = rng.pick(COMMANDS);
    command(kind, rng)
}

/// Telemetry of the `kind`-th kind.
pub fn telemetry(kind: u32, source: &mut impl Source) -> Telemetry {
    match kind {
        0 => Telemetry::Hello(Hello {
            firmware: [7, 8, 9].map(|of| u8::try_from(source.pick(of)).unwrap()),
            map: flashed(source),
            configuration: flashed(source),
            reset: reset(source),
        }),
        1 => Telemetry::Began(estimate(source)),
        2 => Telemetry::Step(Step {
            at: source.instant(),
            right_metres: source.single().into(),
            left_metres: source.single().into(),
        }),
        3 => Telemetry::Look(look(source)),
        4 => Telemetry::Skip(Skip {
            at: source.instant(),
            reason: if source.pick(2) == 0 { NoAim::HeadingUncertain } else { NoAim::NoWall },
        }),
        5 => Telemetry::Estimate(estimate(source)),
        6 => Telemetry::Loop(state_of_loop(source)),
        _ => Telemetry::Ack(Ack { sequence: source.bits16(), outcome: outcome(source) }),
    }
}

/// A command of the `kind`-th kind.
pub fn command(kind: u32, source: &mut impl Source) -> Command {
    match kind {
        0 => {
            let (x, y) = (source.single(), source.single());
            let heading = Radians(source.single());
            // A heading is wrapped, so only a finite one comes through bit for bit.
            let heading = if heading.is_finite() { heading } else { Radians(1.0) };
            Command::SetPose(Start {
                pose: Pose::new(x, y, heading),
                position_deviation: Metres(source.single()),
                heading_deviation: Radians(source.single()),
            })
        }
        1 => Command::SetConfiguration(config(source)),
        2 => Command::Start,
        3 => Command::Stop,
        4 => Command::ResetCalibration,
        _ => Command::MapChecksum,
    }
}

fn state(source: &mut impl Source) -> State {
    State {
        x: source.single(),
        y: source.single(),
        heading: source.single(),
        scale_right: source.single(),
        scale_left: source.single(),
        track_width_error: source.single(),
        range_scale: source.single(),
    }
}

fn estimate(source: &mut impl Source) -> Estimate {
    Estimate {
        at: source.instant(),
        state: state(source),
        deviation: state(source),
        health: Health {
            verdict: source.choose(&[Verdict::Tracking, Verdict::Degraded, Verdict::Lost]),
            evidence: source.single(),
            nis: source.single(),
            accepted_in_a_row: source.bits16(),
            gated_in_a_row: source.bits16(),
            silent_in_a_row: source.bits16(),
            reopened: source.bits16(),
            rolled_since_fix: Metres(source.single()),
            time_since_fix: source.duration(),
            position_deviation: Metres(source.single()),
            heading_deviation: Radians(source.single()),
        },
    }
}

pub const NO_ECHO: [NoEcho; 6] = [
    NoEcho::Nothing,
    NoEcho::OutOfRange,
    NoEcho::StuckHigh,
    NoEcho::NoResponse,
    NoEcho::Failed,
    NoEcho::Mistimed,
];

pub const REFUSALS: [Refusal; 6] = [
    Refusal::NotFinite,
    Refusal::NoEcho,
    Refusal::OutOfRange,
    Refusal::FootOffWall,
    Refusal::NotSquare,
    Refusal::UnknownWall,
];

fn look(source: &mut impl Source) -> Look {
    let at = source.instant();
    let aim = Aim {
        wall: WallId(source.bits32()),
        bearing: Radians(source.single()),
        range: Metres(source.single()),
        why: Reason {
            gain: SquareMetres(source.single()),
            success: source.single(),
            time: source.duration(),
            candidates: source.bits16(),
        },
    };
    let outcome = match source.pick(4) {
        1 => Err(source.choose(&NO_ECHO)),
        _ => Ok(Echo {
            sent: source.instant(),
            heard: source.instant(),
            range: Metres(source.single()),
        }),
    };
    let innovation =
        Innovation { value: Metres(source.single()), variance: SquareMetres(source.single()) };
    let fix = match source.pick(4) {
        0 => Fix::Accepted(innovation),
        1 => Fix::Weakened(innovation),
        2 => Fix::Gated(innovation),
        _ => Fix::Refused(source.choose(&REFUSALS)),
    };
    Look { at, aim, outcome, fix }
}

fn state_of_loop(source: &mut impl Source) -> Loop {
    let at = source.instant();
    let running = source.pick(2) == 1;
    let mut encoder = || EncoderFaults { errors: source.bits32(), illegal: source.bits32() };
    let (right, left) = (encoder(), encoder());
    Loop {
        at,
        running,
        faults: Faults {
            right,
            left,
            servo: source.bits32(),
            ranger: source.bits32(),
            travel: source.bits32(),
            deadlines: source.bits32(),
            clock: source.bits32(),
        },
        worst_poll: source.duration(),
        commands: Counters {
            frames: source.bits32(),
            corrupt: source.bits32(),
            too_long: source.bits32(),
            foreign: source.bits32(),
            undecodable: source.bits32(),
        },
    }
}

fn flashed(source: &mut impl Source) -> Flashed {
    match source.pick(3) {
        0 => Flashed::Valid(source.bits32()),
        1 => Flashed::Missing,
        _ => Flashed::Corrupt,
    }
}

pub const RESETS: [Reset; 6] =
    [Reset::PowerOn, Reset::BrownOut, Reset::Pin, Reset::Watchdog, Reset::Software, Reset::Unknown];

fn reset(source: &mut impl Source) -> Reset {
    source.choose(&RESETS)
}

pub const REFUSED: [Refused; 6] = [
    Refused::Configuration,
    Refused::Pose,
    Refused::NoMap,
    Refused::NoConfiguration,
    Refused::Storage,
    Refused::NoPose,
];

fn outcome(source: &mut impl Source) -> Outcome {
    match source.pick(3) {
        0 => Outcome::Map(flashed(source)),
        1 => Outcome::Done,
        _ => Outcome::Refused(source.choose(&REFUSED)),
    }
}

pub fn config(source: &mut impl Source) -> Config {
    let mut config = Config::for_track_width(Metres(source.single()));
    config.drive.wheel_noise = PerRootMetre(Metres(source.single()));
    config.drive.scale_walk = PerRootMetre(source.single());
    config.drive.track_width_walk = PerRootMetre(Metres(source.single()));
    config.max_wheel_speed = MetresPerSecond(source.single());
    config.sonar.mount = Point::new(source.single(), source.single());
    config.sonar.servo = (Radians(source.single()), Radians(source.single()));
    config.sonar.cone = Radians(source.single());
    config.sonar.min_range = Metres(source.single());
    config.sonar.max_range = Metres(source.single());
    config.sonar.noise.floor = Metres(source.single());
    config.sonar.noise.per_metre = source.single();
    config.sonar.timing = Timing {
        rhythm: match source.pick(2) {
            0 => Rhythm::Every(source.duration()),
            _ => Rhythm::AsFastAsPossible,
        },
        servo: Pace {
            frame: source.duration(),
            sixty_degrees: source.duration(),
            settle: source.duration(),
        },
        cycle: source.duration(),
    };
    config.prior.scale_right = source.single();
    config.prior.scale_left = source.single();
    config.prior.track_width = Metres(source.single());
    config.prior.range_scale = source.single();
    config.trust.gate = source.single();
    config.trust.confidence = source.single();
    config.trust.outer_gate = source.single();
    config.trust.short = source.single();
    config.trust.reopen = Metres(source.single());
    config.trust.stale = Metres(source.single());
    config.trust.doubtful = Metres(source.single());
    config.policy = if source.pick(2) == 0 { Policy::Nearest } else { Policy::Informative };
    config.weights = Weights { heading: Metres(source.single()), wheels: Metres(source.single()) };
    config
}
