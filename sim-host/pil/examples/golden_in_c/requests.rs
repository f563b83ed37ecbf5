//! The requests of a trace, as the inputs of a C program.

use anyhow::bail;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Start;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::gyro::{Mpu6050, YawRate};
use sonarfix_hal::ranger::RangerKind;
use sonarfix_pil::{GyroSignal, Request, Sensors, Wires};

const ODOMETRY: u8 = 1;
const AIM: u8 = 2;
const FIX: u8 = 3;
const NO_ECHO: u8 = 4;
const SKIP: u8 = 5;
const ABSOLUTE: u8 = 6;
const POLL: u8 = 7;

/// The numbers of a start; zeros without one.
pub fn start(start: Option<&Start>) -> [f32; 5] {
    start.map_or([0.0; 5], |start| {
        let Start { pose, position_deviation, heading_deviation } = start;
        let heading = pose.heading.radians().0;
        [pose.x.0, pose.y.0, heading, position_deviation.0, heading_deviation.0]
    })
}

/// The records.
pub struct Records {
    pub bytes: Vec<u8>,
    /// The registers of the gyro, which a C program reads itself.
    wires: Wires,
    config: RobotConfig,
}

impl Records {
    pub fn new(config: &RobotConfig) -> anyhow::Result<Self> {
        if !config.rangers.iter().all(|(_, ranger)| matches!(ranger.kind, RangerKind::Pulse(_))) {
            bail!("a ranger of the trace is read by registers");
        }
        Ok(Self { bytes: Vec::new(), wires: Wires::default(), config: *config })
    }

    /// Adds a request; returns whether its answer counts.
    pub fn add(&mut self, request: &Request) -> anyhow::Result<bool> {
        match *request {
            Request::Odometry(at, travel, turn) => {
                self.operation(ODOMETRY, at);
                self.numbers(&[travel.right.0, travel.left.0]);
                self.bytes.push(u8::from(turn.is_some()));
                let (angle, duration) =
                    turn.map_or((0.0, 0), |turn| (turn.angle.0, turn.duration.ticks()));
                self.numbers(&[angle]);
                self.bytes.extend(u32::try_from(duration)?.to_le_bytes());
            }
            Request::Aim => self.bytes.push(AIM),
            Request::Fix(Some(range)) => {
                self.bytes.push(FIX);
                self.numbers(&[range.0]);
            }
            Request::Fix(None) => self.bytes.push(NO_ECHO),
            Request::SkipPing => self.bytes.push(SKIP),
            Request::Absolute(at, ref measurement) => self.absolute(at, measurement),
            Request::Poll(ref sensors) => self.poll(sensors)?,
            Request::End => return Ok(false),
            Request::Begin(..) => bail!("a second session"),
        }
        Ok(true)
    }

    fn operation(&mut self, operation: u8, at: Instant) {
        self.bytes.push(operation);
        self.bytes.extend(at.ticks().to_le_bytes());
    }

    fn numbers(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.bytes.extend(number.to_le_bytes());
        }
    }

    /// The kind, three numbers of the pose, six of its noise.
    fn absolute(&mut self, at: Instant, measurement: &AbsoluteMeasurement) {
        self.operation(ABSOLUTE, at);
        let (kind, numbers) = match *measurement {
            AbsoluteMeasurement::Heading { angle, deviation } => {
                (0, [0.0, 0.0, angle.0, 0.0, 0.0, 0.0, 0.0, 0.0, deviation.0])
            }
            AbsoluteMeasurement::Position { point, noise } => {
                let (x, y) = (point.x.0, point.y.0);
                (1, [x, y, 0.0, noise.xx, noise.xy, noise.yy, 0.0, 0.0, 0.0])
            }
            AbsoluteMeasurement::Pose { pose, noise } => {
                let (x, y, h) = (pose.x.0, pose.y.0, pose.heading.radians().0);
                let position = noise.position;
                let (xx, xy, yy) = (position.xx, position.xy, position.yy);
                (2, [x, y, h, xx, xy, yy, noise.xh, noise.yh, noise.hh])
            }
        };
        self.bytes.push(kind);
        self.numbers(&numbers);
    }

    fn poll(&mut self, sensors: &Sensors) -> anyhow::Result<()> {
        self.operation(POLL, sensors.at);
        for counted in [sensors.right, sensors.left] {
            self.bytes.extend(counted.ticks.to_le_bytes());
            self.bytes.extend(counted.illegal.to_le_bytes());
            self.bytes.push(u8::from(counted.has_failed));
        }
        for echo in &sensors.echoes {
            for edge in [echo.rose, echo.fell] {
                self.bytes.push(u8::from(edge.is_some()));
                self.bytes.extend(edge.map_or(0_u64, |at| at.ticks()).to_le_bytes());
            }
        }
        let rate = self.yaw_rate(sensors)?;
        self.bytes.push(u8::from(rate.is_some()));
        self.numbers(&[rate.unwrap_or(0.0)]);
        Ok(())
    }

    /// The rate as the driver of an MPU-6050 reads it; `None` if it fails or the robot has no gyro.
    fn yaw_rate(&self, sensors: &Sensors) -> anyhow::Result<Option<f32>> {
        let Some(parameters) = &self.config.localizer.gyro else { return Ok(None) };
        let mut gyro = Mpu6050::new(&self.wires.gyro);
        self.wires.apply(&Sensors { gyro: GyroSignal::default(), ..*sensors });
        if gyro.configure(parameters).is_err() {
            bail!("the gyro of the trace is no MPU-6050");
        }
        self.wires.apply(sensors);
        Ok(gyro.rate().ok().map(|rate| rate.0))
    }
}
