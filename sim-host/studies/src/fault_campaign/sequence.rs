//! Plays a case: its actions, then a robot whose parts work again is started, and then one part dies and returns.

use anyhow::{Context, ensure};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Duration, Metres, MetresPerSecond, Radians};
use sonarfix::localizer::Start;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::Command;
use sonarfix_link::message::CommandResult;

use super::case::{Action, Case, Order, Part};
use super::robot::{Baked, Robot};

/// Time in which a started robot is `Tracking` at the right pose, µs.
const STARTED_WITHIN: u64 = 8_000_000;
/// Time after the return of a part in which it is so again, µs.
pub const BACK_WITHIN: u64 = 20_000_000;
/// Largest error of a right position, metres.
pub const RIGHT: f64 = 0.1;

/// Plays a case.
///
/// # Errors
/// The rule that is broken.
pub fn play(case: &Case) -> anyhow::Result<()> {
    let baked = Baked::of(case.robot)?;
    let mut robot = Robot::new(&baked, case.robot, case.seed)?;
    for (number, action) in case.actions.iter().enumerate() {
        let acted = act(robot, &baked.config, action);
        robot = acted.with_context(|| format!("at action {number}, {action:?}"))?;
    }
    robot = start_again(robot, &baked.config, case).context("with all parts in order")?;
    return_of_a_part(&mut robot, case)
}

fn act<'m>(robot: Robot<'m>, config: &RobotConfig, action: &Action) -> anyhow::Result<Robot<'m>> {
    let mut robot = robot;
    match *action {
        Action::Order(order) => {
            let command = command(&robot, config, order);
            robot.send(&command);
        }
        Action::Garbage(count, seed) => robot.garble(count, seed.into()),
        Action::Repeat(number, flips) => robot.repeat(number, flips),
        Action::Part(part, fault) => robot.set_fault(part, fault),
        Action::Mend => robot.mend(false),
        Action::PowerCut(words, resets) => robot = robot.power_cut(words, resets)?,
        Action::TornClock(power) => robot.torn_poll(1 << power.min(62))?,
        Action::BrokenClock(polls) => robot.broken_clock(polls)?,
        Action::SetClock(millis) => robot.set_clock(millis.into()),
        Action::Stall(millis) => robot.stall(1_000 * u64::from(millis))?,
        Action::Unplug(is_unplugged) => robot.unplug(is_unplugged),
        Action::Pass(millis, drives) => {
            robot.drives = drives;
            robot.pass(1_000 * u64::from(millis))?;
        }
    }
    robot.pass(1_000)?;
    Ok(robot)
}

fn command(robot: &Robot, config: &RobotConfig, order: Order) -> Command {
    let number = f32::from_bits;
    match order {
        Order::SetPose => Command::SetPose(robot.true_start()),
        Order::SetAnyPose([x, y, heading, position, turn]) => Command::SetPose(Start {
            pose: Pose::new(number(x), number(y), Radians(number(heading))),
            position_deviation: Metres(number(position)),
            heading_deviation: Radians(number(turn)),
        }),
        Order::SetConfiguration => Command::SetConfiguration(*config),
        Order::SetAnyConfiguration(field, bits) => {
            Command::SetConfiguration(changed(config, field, bits))
        }
        Order::Start => Command::Start,
        Order::Stop => Command::Stop,
        Order::ResetCalibration => Command::ResetCalibration,
        Order::Search => Command::Search,
        Order::ShowDevices => Command::ShowDevices,
        Order::AnyHeading(angle, deviation, age) => Command::Absolute {
            age: Duration::from_ticks(1_000 * u64::from(age)),
            measurement: AbsoluteMeasurement::Heading {
                angle: Radians(number(angle)),
                deviation: Radians(number(deviation)),
            },
        },
        Order::OpenSession => Command::OpenSession,
    }
}

/// The configuration with any number in one of its fields.
fn changed(config: &RobotConfig, field: u8, bits: u32) -> RobotConfig {
    let mut config = *config;
    let number = f32::from_bits(bits);
    let localizer = &mut config.localizer;
    match field {
        0 => localizer.drive.track_width = Metres(number),
        1 => localizer.prior.range_scale = number,
        2 => localizer.prior.track_width = Metres(number),
        3 => (localizer.prior.scale_left, localizer.prior.scale_right) = (number, number),
        4 => localizer.max_wheel_speed = MetresPerSecond(number),
        5 => localizer.rangers.first.servo = (Radians(-number), Radians(number)),
        6 => config.encoder_period = Duration::from_ticks(u64::from(bits % 200_000)),
        _ => config.right_wheel.travel_per_edge = Metres(number),
    }
    config
}

/// Mends the robot, sets its configuration and its pose, and starts it.
fn start_again<'m>(
    robot: Robot<'m>,
    config: &RobotConfig,
    case: &Case,
) -> anyhow::Result<Robot<'m>> {
    let mut robot = robot;
    robot.unplug(false);
    robot.mend(case.end.flash_stays);
    robot.drives = false;
    robot.pass(100_000)?;
    if case.end.power_cycle {
        robot = robot.power_cut(u16::MAX, 0)?;
    }
    robot.garble(0, 0);
    robot.open_session()?;
    let pose = Command::SetPose(robot.true_start());
    for command in [Command::Stop, Command::SetConfiguration(*config), pose, Command::Start] {
        let answer = robot.order(&command)?;
        ensure!(answer == CommandResult::Done, "{command:?} is answered by {answer:?}");
    }
    (robot.drives, robot.keeps_link) = (true, true);
    robot.accepted = 0;
    robot.pass(STARTED_WITHIN / 2)?;
    becomes_right(&mut robot, STARTED_WITHIN / 2)?;
    is_right(&robot)?;
    ensure!(robot.may_drive(), "the motors are off");
    ensure!(robot.accepted >= 2, "{} ranges are accepted", robot.accepted);
    Ok(robot)
}

/// Lets the robot drive until it knows where it is, at most for a time in µs: at some places of the room a single wrong echo makes
/// the verdict worse for a moment.
fn becomes_right(robot: &mut Robot, within: u64) -> anyhow::Result<()> {
    const STEP: u64 = 500_000;
    for _ in 0..within / STEP {
        if is_right(robot).is_ok() {
            return Ok(());
        }
        robot.pass(STEP)?;
    }
    Ok(())
}

/// Whether the robot knows where it is.
fn is_right(robot: &Robot) -> anyhow::Result<()> {
    let (error, health) = (robot.error().unwrap_or(f64::INFINITY), robot.health());
    ensure!(robot.is_tracking(), "{error:.3} m off, {health:?}");
    ensure!(error < RIGHT, "`Tracking`, {error:.3} m off");
    Ok(())
}

/// One part dies while the robot drives, and returns.
fn return_of_a_part(robot: &mut Robot, case: &Case) -> anyhow::Result<()> {
    let end = &case.end;
    let name = || format!("{:?} {:?} for {} ms", end.part, end.fault, end.millis);
    robot.set_fault(end.part, end.fault);
    robot.pass(1_000 * u64::from(end.millis)).with_context(name)?;
    robot.mend(end.part != Part::Flash && end.flash_stays);
    robot.pass(BACK_WITHIN / 2).with_context(name)?;
    becomes_right(robot, BACK_WITHIN / 2).with_context(name)?;
    if robot.searches() {
        // `docs/search.md` has how long that takes.
        return Ok(());
    }
    if case.robot.cautious && !robot.is_tracking() {
        // It stands since it was lost, and a robot confirms its pose by driving.
        return Ok(());
    }
    is_right(robot).with_context(name)
}
