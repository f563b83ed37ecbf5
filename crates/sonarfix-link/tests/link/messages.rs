//! Messages for tests: random ones, one of each kind with distinct numbers, the largest of each kind.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use sonarfix::aim::{Aim, NoAim, Reason};
use sonarfix::config::{
    Config, LightBeam, MAX_RANGERS, PingSchedule, PingTiming, Policy, RangerId, Rangers, Ranging,
    ServoTiming,
};
use sonarfix::filter::ekf::{EkfError, Innovation, STATES, StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{
    Duration, Instant, Metres, MetresPerSecond, PerRootMetre, PerRootSecond, Radians,
    RadiansPerSecond, SquareMetres,
};
use sonarfix::health::{Health, Verdict};
use sonarfix::localizer::{
    AbsoluteFix, AbsoluteRefusal, Agreement, Fix, GyroStatus, Refusal, Start, TurnUse,
};
use sonarfix::map::WallId;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix::sensor::gyro::{GyroParameters, TurnReading, TurnRefusal};
use sonarfix_hal::config::{
    MotorPolicy, RangerConfig, RobotConfig, SearchMotion, SearchMotionKind, StartPose, Unsupported,
};
use sonarfix_hal::ranger::{Celsius, Echo, NoEcho, Outcome, PulseTiming, RangerKind};
use sonarfix_hal::robot::{AbsoluteResult, EncoderFaults, Faults};
use sonarfix_hal::servo::{MeasuredPulse, SettingError};
use sonarfix_link::message::{
    CommandError, DeviceReadings, EncoderReading, FlashStatus, GyroState, ImageStatus, LoopStatus,
    ModeChanged, Odometry, RankedHypothesis, ResetCause, SearchAnswer, SearchStatus, ServoReading,
    SkippedPing, Sweep,
};
use sonarfix_link::{
    Ack, Command, CommandResult, Estimate, Hello, Motion, Ping, ReceiverCounters, SessionCommand,
    Telemetry,
};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Region;

/// The source of the numbers of a message.
pub trait Source {
    fn bits32(&mut self) -> u32;
    fn bits64(&mut self) -> u64;
    fn bits16(&mut self) -> u16;
    /// Selects one of this number of variants.
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

/// The numbers 1, 2, 3 …, so that the fields of a message differ.
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

/// The numbers with the longest varints, and a fixed variant.
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

/// The numbers of kinds of telemetry and of commands.
pub const TELEMETRY: u32 = 17;
pub const COMMANDS: u32 = 12;

pub fn any_telemetry(rng: &mut ChaCha8Rng) -> Telemetry {
    let kind = rng.pick(TELEMETRY);
    telemetry(kind, rng)
}

pub fn any_command(rng: &mut ChaCha8Rng) -> SessionCommand {
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
        1 => Telemetry::Initialized(estimate(source)),
        2 => Telemetry::Odometry(Odometry {
            at: source.instant(),
            right_metres: source.single().into(),
            left_metres: source.single().into(),
        }),
        3 => Telemetry::Ping(look(source)),
        4 => Telemetry::SkippedPing(SkippedPing { at: source.instant(), reason: NoAim::NoWall }),
        5 => Telemetry::Estimate(estimate(source)),
        6 => Telemetry::LoopStatus(state_of_loop(source)),
        7 => Telemetry::Ack(Ack { sequence: source.bits16(), result: command_result(source) }),
        8 => Telemetry::PoseSet(estimate(source)),
        9 => Telemetry::ModeChanged(ModeChanged {
            mode: source.choose(&MODES),
            estimate: estimate(source),
        }),
        10 => Telemetry::Sweep(Sweep {
            at: source.instant(),
            bearing: Radians(source.single()),
            outcome: outcome(source),
        }),
        11 => Telemetry::Search(SearchStatus {
            at: source.instant(),
            mode: source.choose(&MODES),
            answer: source.choose(&ANSWERS),
            pings: source.bits16(),
            cycles: source.bits32(),
        }),
        12 => Telemetry::Hypothesis(RankedHypothesis {
            at: source.instant(),
            rank: source.bits16().to_le_bytes()[0],
            pose: {
                let (x, y, heading) = (source.single(), source.single(), source.single());
                // A heading is wrapped, so only a finite one is transmitted bit for bit.
                Pose::new(x, y, Radians(if heading.is_finite() { heading } else { 1.0 }))
            },
            position_deviation: Metres(source.single()),
            heading_deviation: Radians(source.single()),
            fit: source.single(),
            explained: source.single(),
        }),
        14 => Telemetry::Turn(turn(source)),
        15 => Telemetry::Gyro(gyro(source)),
        16 => Telemetry::Absolute(absolute_result(source)),
        _ => Telemetry::Devices(DeviceReadings {
            at: source.instant(),
            right: encoder(source),
            left: encoder(source),
            servo: (source.pick(2) == 0).then(|| ServoReading {
                bearing: Radians(source.single()),
                micros: source.single(),
            }),
            ping: (source.pick(2) == 0).then(|| outcome(source)),
        }),
    }
}

fn encoder(source: &mut impl Source) -> EncoderReading {
    EncoderReading {
        count: (source.pick(2) == 0).then(|| source.bits32()),
        bits: source.bits16().to_le_bytes()[0],
        illegal: source.bits32(),
        metres_per_edge: source.single(),
    }
}

/// A command of the `kind`-th kind.
pub fn command(kind: u32, source: &mut impl Source) -> SessionCommand {
    let command = match kind {
        0 => {
            let (x, y) = (source.single(), source.single());
            let heading = Radians(source.single());
            // A heading is wrapped, so only a finite one is transmitted bit for bit.
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
        5 => Command::MapChecksum,
        6 => Command::OpenSession,
        7 => Command::Search,
        8 => Command::ShowDevices,
        9 => Command::Absolute { age: source.duration(), measurement: absolute(source) },
        10 => Command::Point(Radians(source.single())),
        _ => Command::Drive(Motion {
            speed: MetresPerSecond(source.single()),
            turn: RadiansPerSecond(source.single()),
        }),
    };
    SessionCommand { session: source.bits32(), command }
}

fn gyro(source: &mut impl Source) -> GyroState {
    let refusals = [TurnRefusal::NotFinite, TurnRefusal::WrongDuration, TurnRefusal::TooFast];
    let refused = TurnUse::Refused(source.choose(&refusals));
    GyroState {
        at: source.instant(),
        status: GyroStatus {
            bias: RadiansPerSecond(source.single()),
            deviation: RadiansPerSecond(source.single()),
            latest: source.choose(&[
                TurnUse::Missing,
                refused,
                TurnUse::Standing,
                TurnUse::Combined,
                TurnUse::WheelSlip,
            ]),
            slips: source.bits32(),
            conflicts: source.bits32(),
        },
    }
}

fn absolute(source: &mut impl Source) -> AbsoluteMeasurement {
    let kind = source.pick(3);
    if kind == 2 {
        let (angle, deviation) = (Radians(source.single()), Radians(source.single()));
        return AbsoluteMeasurement::Heading { angle, deviation };
    }
    let (x, y) = (source.single(), source.single());
    let heading = source.single();
    let position = PositionNoise { xx: source.single(), xy: source.single(), yy: source.single() };
    if kind == 1 {
        return AbsoluteMeasurement::Position { point: Point::new(x, y), noise: position };
    }
    // A heading is wrapped, so only a finite one is transmitted bit for bit.
    let pose = Pose::new(x, y, Radians(if heading.is_finite() { heading } else { 1.0 }));
    let (xh, yh, hh) = (source.single(), source.single(), source.single());
    AbsoluteMeasurement::Pose { pose, noise: PoseNoise { position, xh, yh, hh } }
}

fn absolute_result(source: &mut impl Source) -> AbsoluteResult {
    let (at, measured_at, measurement) = (source.instant(), source.instant(), absolute(source));
    let agreement =
        Agreement { nis: source.single(), dimensions: source.bits16().to_le_bytes()[0] };
    let refused = AbsoluteFix::Refused(source.choose(&ABSOLUTE_REFUSALS));
    let fix = source.choose(&[
        AbsoluteFix::Accepted(agreement),
        AbsoluteFix::Downweighted(agreement),
        AbsoluteFix::Gated(agreement),
        refused,
    ]);
    AbsoluteResult { at, measured_at, measurement, fix }
}

/// Every reason for which an absolute measurement is refused, in the order of their numbers.
pub const ABSOLUTE_REFUSALS: [AbsoluteRefusal; 6] = [
    AbsoluteRefusal::NotFinite,
    AbsoluteRefusal::NotPositiveDefinite,
    AbsoluteRefusal::BeforeLastStep,
    AbsoluteRefusal::AfterLastStep,
    AbsoluteRefusal::NoPose,
    AbsoluteRefusal::Filter(EkfError::NotFinite),
];

fn turn(source: &mut impl Source) -> TurnReading {
    let (at, angle) = (source.instant(), source.bits64().cast_signed());
    TurnReading::new(at, angle, (source.pick(2) == 0).then(|| source.bits32()))
}

fn numbers(source: &mut impl Source) -> [f32; STATES] {
    core::array::from_fn(|_| source.single())
}

fn estimate(source: &mut impl Source) -> Estimate {
    Estimate {
        at: source.instant(),
        state: StateEstimate::from_array(numbers(source)),
        deviation: StandardDeviations::from_array(numbers(source)),
        health: Health {
            verdict: source.choose(&[Verdict::Tracking, Verdict::Degraded, Verdict::Lost]),
            evidence: source.single(),
            nis: source.single(),
            accepted_in_a_row: source.bits16(),
            gated_in_a_row: source.bits16(),
            silent_in_a_row: source.bits16(),
            unaided: 0,
            inflations: source.bits16(),
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

pub const MODES: [Mode; 3] = [Mode::Tracking, Mode::Searching, Mode::Provisional];

pub const ANSWERS: [SearchAnswer; 5] = [
    SearchAnswer::Searching,
    SearchAnswer::Several(u8::MAX),
    SearchAnswer::Along(WallId(u32::MAX)),
    SearchAnswer::Nowhere,
    SearchAnswer::Unique,
];

fn outcome(source: &mut impl Source) -> Outcome {
    match source.pick(4) {
        1 => Err(source.choose(&NO_ECHO)),
        _ => Ok(Echo {
            sent: source.instant(),
            heard: source.instant(),
            range: Metres(source.single()),
        }),
    }
}

fn look(source: &mut impl Source) -> Ping {
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
        ranger: RangerId(source.bits16().to_le_bytes()[0]),
    };
    let outcome = outcome(source);
    let innovation =
        Innovation { value: Metres(source.single()), variance: SquareMetres(source.single()) };
    let fix = match source.pick(4) {
        0 => Fix::Accepted(innovation),
        1 => Fix::Downweighted(innovation),
        2 => Fix::Gated(innovation),
        _ => Fix::Refused(source.choose(&REFUSALS)),
    };
    Ping { at, aim, outcome, fix }
}

fn state_of_loop(source: &mut impl Source) -> LoopStatus {
    let at = source.instant();
    let running = source.pick(2) == 1;
    let mut encoder = || EncoderFaults { errors: source.bits32(), illegal: source.bits32() };
    let (right, left) = (encoder(), encoder());
    LoopStatus {
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
            gyro: source.bits32(),
        },
        worst_poll: source.duration(),
        commands: ReceiverCounters {
            frames: source.bits32(),
            corrupt: source.bits32(),
            too_long: source.bits32(),
            foreign: source.bits32(),
            undecodable: source.bits32(),
        },
        flash: FlashStatus { writes: source.bits32(), failures: source.bits32() },
        noise_factor: source.single(),
    }
}

fn flashed(source: &mut impl Source) -> ImageStatus {
    match source.pick(4) {
        0 => ImageStatus::Valid(source.bits32()),
        1 => ImageStatus::Missing,
        2 => ImageStatus::Corrupt,
        _ => ImageStatus::Version(source.bits16()),
    }
}

pub const RESETS: [ResetCause; 6] = [
    ResetCause::PowerOn,
    ResetCause::BrownOut,
    ResetCause::Pin,
    ResetCause::Watchdog,
    ResetCause::Software,
    ResetCause::Unknown,
];

fn reset(source: &mut impl Source) -> ResetCause {
    source.choose(&RESETS)
}

pub const REFUSED: [CommandError; 13] = [
    CommandError::Configuration,
    CommandError::Pose,
    CommandError::NoMap,
    CommandError::NoConfiguration,
    CommandError::NoPose,
    CommandError::Unsupported(Unsupported::Servo(SettingError::Frame)),
    CommandError::Session,
    CommandError::NoSearch,
    CommandError::Running,
    CommandError::Waiting,
    CommandError::Occupied,
    CommandError::OutOfReach,
    CommandError::Motion,
];

fn command_result(source: &mut impl Source) -> CommandResult {
    match source.pick(4) {
        0 => CommandResult::Map(flashed(source)),
        1 => CommandResult::Done,
        2 => CommandResult::Session(source.bits32()),
        _ => CommandResult::Refused(source.choose(&REFUSED)),
    }
}

pub fn config(source: &mut impl Source) -> RobotConfig {
    let mut config = RobotConfig::with_common_parts(localizer(source));
    for wheel in [&mut config.right_wheel, &mut config.left_wheel] {
        wheel.travel_per_edge = Metres(source.single());
        wheel.is_mirrored = source.pick(2) == 0;
    }
    config.encoder_period = source.duration();
    config.rangers = Rangers::one(ranger(source));
    for _ in config.localizer.rangers.iter().skip(1) {
        config.rangers.push(ranger(source)).unwrap();
    }
    let [lost, dead_encoder, lost_link] = [0; 3].map(|_| source.pick(2) == 0);
    config.motors = MotorPolicy { lost, dead_encoder, lost_link, link_timeout: source.duration() };
    let mut corner = || Point::new(source.single(), source.single());
    let region = Region { from: corner(), to: corner() };
    config.start = match source.pick(4) {
        0 => StartPose::Unknown { region: Some(region) },
        1 => StartPose::Unknown { region: None },
        2 => StartPose::Exploring {
            region: Some(region),
            motion: SearchMotion { kind: SearchMotionKind::Ahead, bumper: Metres(source.single()) },
        },
        _ => StartPose::Known,
    };
    config
}

fn ranger(source: &mut impl Source) -> RangerConfig {
    RangerConfig {
        servo_pulses: [0; 2]
            .map(|_| MeasuredPulse { width: source.duration(), bearing: Radians(source.single()) }),
        kind: match source.pick(5) {
            0 => RangerKind::Pulse(PulseTiming {
                trigger: source.duration(),
                blanking: source.duration(),
                longest: source.duration(),
                silence: source.duration(),
                listen: source.duration(),
                stuck: source.duration(),
            }),
            1 => RangerKind::Srf { address: source.bits16().to_le_bytes()[0] },
            2 => RangerKind::Vl53l1x { address: source.bits16().to_le_bytes()[0] },
            3 => RangerKind::Vl53l0x { address: source.bits16().to_le_bytes()[0] },
            _ => RangerKind::Custom,
        },
        temperature: Celsius(source.single()),
    }
}

fn localizer(source: &mut impl Source) -> Config {
    let mut config = Config::for_track_width(Metres(source.single()));
    config.drive.wheel_noise = PerRootMetre(Metres(source.single()));
    config.drive.scale_walk = PerRootMetre(source.single());
    config.drive.track_width_walk = PerRootMetre(Metres(source.single()));
    config.max_wheel_speed = MetresPerSecond(source.single());
    config.rangers.first.mount = Point::new(source.single(), source.single());
    config.rangers.first.servo = (Radians(source.single()), Radians(source.single()));
    config.rangers.first.cone = Radians(source.single());
    config.rangers.first.min_range = Metres(source.single());
    config.rangers.first.max_range = Metres(source.single());
    config.rangers.first.noise.floor = Metres(source.single());
    config.rangers.first.noise.per_metre = source.single();
    if source.pick(2) == 0 {
        let (spot, pointing) = (Radians(source.single()), Radians(source.single()));
        config.rangers.first.ranging =
            Ranging::Light(LightBeam { spot, pointing, ..LightBeam::VL53L1X });
    }
    config.rangers.first.timing = PingTiming {
        schedule: match source.pick(2) {
            0 => PingSchedule::Every(source.duration()),
            _ => PingSchedule::AsFastAsPossible,
        },
        servo: ServoTiming {
            frame: source.duration(),
            sixty_degrees: source.duration(),
            settle: source.duration(),
        },
        cycle: source.duration(),
    };
    let has_several = source.pick(2) == 0;
    for _ in 1..if has_several { MAX_RANGERS } else { 1 } {
        config.rangers.push(config.rangers.first).unwrap();
    }
    config.prior.scale_right = source.single();
    config.prior.scale_left = source.single();
    config.prior.scale_difference = Some(source.single());
    config.prior.track_width = Metres(source.single());
    config.prior.range_scale = source.single();
    config.gating.confidence = source.single();
    config.gating.inflation = Metres(source.single());
    config.gating.max_distance_without_fix = Metres(source.single());
    config.gating.max_position_deviation = Metres(source.single());
    config.echo.missed = source.single();
    config.echo.short = source.single();
    config.echo.long = source.single();
    config.echo.free_path = Metres(source.single());
    config.echo.map_accuracy = Metres(source.single());
    config.echo.late = Metres(source.single());
    config.echo.late_per_radian = Metres(source.single());
    config.echo.half_angle = Radians(source.single());
    config.echo.rim = Radians(source.single());
    config.echo.sure_within = Metres(source.single());
    config.prior.mount = Metres(source.single());
    config.policy = if source.pick(2) == 0 { Policy::Nearest } else { Policy::Informative };
    config.weights.heading = Metres(source.single());
    config.weights.wheels = Metres(source.single());
    let gyro = GyroParameters {
        range: RadiansPerSecond(source.single()),
        noise: PerRootSecond(Radians(source.single())),
        bias: RadiansPerSecond(source.single()),
        bias_walk: PerRootSecond(RadiansPerSecond(source.single())),
        scale: source.single(),
        period: source.duration(),
        is_inverted: source.pick(2) == 0,
        ..GyroParameters::MPU_6050
    };
    config.gyro = (source.pick(2) == 0).then_some(gyro);
    config
}
