//! What a robot of the campaign is made of: its configuration, and its parts.

use anyhow::anyhow;
use sonarfix::aim::Policy;
use sonarfix::config::{Config, LightBeam, PingSchedule, RangerParameters, Ranging, ServoTiming};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents};
use sonarfix_hal::config::{RangerConfig, RobotConfig, StartPose, WheelConfig};
use sonarfix_hal::ranger::RangerKind;
use sonarfix_hal::robot::{Devices, WithGyro, WithRangers};
use sonarfix_hal::servo::{PwmFrame, Servo};
use sonarfix_link::baked;
use sonarfix_link::message::ResetCause;

use crate::fault_campaign::case::Composition;
use crate::fault_campaign::flash::{self, Flash};
use crate::fault_campaign::parts::{Channel, Encoder, Gyro, SimRanger};
use crate::fault_campaign::room;

/// Longest time between two polls while nothing stalls the program, µs.
pub const POLL: u64 = 20_000;
/// How far each ranger is mounted ahead of the axle, metres.
pub const MOUNTS: [f32; 3] = [0.0, 0.03, -0.03];

pub type Hardware = WithGyro<WithRangers<Devices<Encoder, Encoder, Channel, SimRanger>, 2>, Gyro>;

/// What is flashed beside the store.
#[derive(Debug)]
pub struct Baked {
    /// The configuration.
    pub config: RobotConfig,
    map: Vec<u8>,
    image: Vec<u8>,
}

impl Baked {
    /// Of a robot.
    ///
    /// # Errors
    /// Never: the configuration is valid.
    pub fn of(robot: Composition) -> anyhow::Result<Self> {
        let config = config(robot)?;
        let image = baked::write(&config, &mut [0; baked::LENGTH_MAX])?.to_vec();
        Ok(Self { config, map: room::map()?, image })
    }
}

fn config(robot: Composition) -> anyhow::Result<RobotConfig> {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.prior.range_scale = 0.02;
    localizer.gyro = robot.gyro.then_some(GyroParameters::MPU_6050);
    localizer.policy = if robot.informative { Policy::Informative } else { Policy::Nearest };
    let mut sonar = RangerParameters::default();
    sonar.servo = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
    sonar.timing.servo = ServoTiming::SG90;
    sonar.timing.schedule = PingSchedule::AsFastAsPossible;
    sonar.timing.cycle = Duration::from_ticks(60_000);
    localizer.rangers.first = sonar;
    let wheel = WheelConfig::of_diameter(Metres(0.065), 1_024.0);
    let mut config = RobotConfig::with_common_parts(localizer);
    (config.right_wheel, config.left_wheel) = (wheel, wheel);
    let common = config.rangers.first;
    for (number, mount) in (1..robot.rangers).zip(MOUNTS.into_iter().skip(1)) {
        let mut further = sonar;
        further.mount = Point::new(mount, 0.0);
        let mut driver = common;
        if robot.fixed {
            let side = if number == 1 { Radians(1.5) } else { Radians(-1.5) };
            further.servo = (side, side);
            driver.servo_pulses = RangerConfig::NO_PULSES;
        }
        config.localizer.rangers.push(further).map_err(|_| anyhow!("too many"))?;
        config.rangers.push(driver).map_err(|_| anyhow!("too many"))?;
    }
    if robot.light {
        config.localizer.rangers.first.ranging = Ranging::Light(LightBeam::VL53L1X);
        config.localizer.rangers.first.cone = Radians(1.0);
        config.rangers.first.kind = RangerKind::Vl53l1x { address: 0x29 };
    }
    if robot.search {
        config.start = StartPose::Unknown { region: None };
    }
    if robot.cautious {
        (config.motors.lost, config.motors.lost_link) = (false, false);
    }
    config.check().map_err(|error| anyhow!("{error}"))?;
    Ok(config)
}

/// The application of a robot, after so many resets in a row.
///
/// # Errors
/// Never: the flash is large enough.
pub fn app(baked: &Baked, flash: Flash, resets: u8) -> anyhow::Result<App<'_, Flash>> {
    let board = Board { firmware: [1, 2, 3], reset: ResetCause::PowerOn, resets };
    let store = Store::new(flash, 0..flash::SIZE).map_err(|error| anyhow!("{error:?}"))?;
    let contents = FlashContents::read(&baked.map, &baked.image);
    Ok(App::new(board, contents, store, Instant::from_ticks(0)))
}

/// The servo at a channel.
pub fn servo(channel: &Channel) -> Servo<Channel> {
    let micros = Duration::from_ticks;
    let frame = PwmFrame { period: micros(20_000), shortest: micros(400), longest: micros(2_600) };
    Servo::new(channel.clone(), frame)
}

/// The parts of a robot.
pub fn hardware(channels: &[Channel; 3], seed: u64) -> Hardware {
    let [first, second, third] = channels;
    let devices = Devices {
        right: Encoder::default(),
        left: Encoder::default(),
        servo: servo(first),
        ranger: SimRanger::new(seed ^ 1),
    };
    let rangers = [SimRanger::new(seed ^ 2), SimRanger::new(seed ^ 3)];
    let devices = WithRangers { devices, servos: [servo(second), servo(third)], rangers };
    WithGyro { devices, gyro: Gyro::new(seed ^ 4) }
}
