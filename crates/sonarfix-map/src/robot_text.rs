//! A [`RobotConfig`] as the text of a robot file, which [`robot_file`](crate::robot_file) reads back.

use sonarfix::aim::Policy;
use sonarfix::config::{LightBeam, PingSchedule, RangerId, Ranging, Sonar};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::{MotorPolicy, RangerConfig, RobotConfig, StartPose, WheelConfig};
use sonarfix_hal::ranger::{PulseTiming, RangerKind};
use sonarfix_hal::servo::MeasuredPulse;
use sonarfix_search::search::Region;

/// Writes the robot file of a configuration.
#[must_use]
pub fn text(config: &RobotConfig) -> String {
    let gyro = config.localizer.gyro.as_ref().map(gyro).unwrap_or_default();
    let tables = [drive(config), sonar(config), estimation(config), motors(&config.motors), gyro];
    format!("format = 1\n{}{}", start(config.start), tables.concat())
}

/// The keys of a robot that may start without a pose; nothing if it may not.
fn start(start: StartPose) -> String {
    let StartPose::Unknown { region } = start else { return String::new() };
    let region = region.map(|Region { from, to }| {
        let corner = |at: Point| format!(r#"["{} m", "{} m"]"#, at.x.0, at.y.0);
        format!("start_region = {{ from = {}, to = {} }}\n", corner(from), corner(to))
    });
    format!("start = \"unknown\"\n{}", region.unwrap_or_default())
}

fn gyro(gyro: &GyroParameters) -> String {
    format!(
        r#"
[gyro]
sensor = "mpu6050"
range = "{} rad/s"
noise = "{} rad/sqrt(s)"
bias = "{} rad/s"
bias_walk = "{} rad/s/sqrt(s)"
scale = {}
period = "{}"
inverted = {}
"#,
        gyro.range.0,
        gyro.noise.0.0,
        gyro.bias.0,
        gyro.bias_walk.0.0,
        gyro.scale,
        time(gyro.period),
        gyro.is_inverted,
    )
}

fn drive(config: &RobotConfig) -> String {
    let drive = &config.localizer.drive;
    format!(
        r#"
[drive]
track_width = "{} m"
wheel_noise = "{} m/sqrt(m)"
scale_walk = "{} /sqrt(m)"
track_width_walk = "{} m/sqrt(m)"
max_wheel_speed = "{} m/s"
encoder_period = "{}"
right_wheel = {}
left_wheel = {}
"#,
        drive.track_width.0,
        drive.wheel_noise.0.0,
        drive.scale_walk.0,
        drive.track_width_walk.0.0,
        config.localizer.max_wheel_speed.0,
        time(config.encoder_period),
        wheel(config.right_wheel),
        wheel(config.left_wheel),
    )
}

/// The table of the only sonar, or those of all; the first has what they share.
fn sonar(config: &RobotConfig) -> String {
    let header = if config.localizer.has_several_sonars() { "[[sonar]]" } else { "[sonar]" };
    let tables = config.localizer.sonars().filter_map(|(id, _)| {
        let (sonar, driver) = config.ranger_of(id)?;
        let shared = if id == RangerId::FIRST { shared(config) } else { String::new() };
        Some(format!("\n{header}\n{}{shared}", one_sonar(sonar, driver)))
    });
    tables.collect()
}

/// The keys that all sonars share.
fn shared(config: &RobotConfig) -> String {
    let schedule = match config.localizer.sonar.timing.schedule {
        PingSchedule::Every(period) => time(period),
        PingSchedule::AsFastAsPossible => "as fast as possible".to_owned(),
    };
    let temperature = config.ranger.temperature.0;
    format!("fix_period = \"{schedule}\"\ntemperature = \"{temperature} degC\"\n")
}

fn one_sonar(sonar: &Sonar, driver: &RangerConfig) -> String {
    format!(
        r#"mount = ["{} m", "{} m"]
{}
cone = "{} deg"
min_range = "{} m"
max_range = "{} m"
noise = "{} m"
noise_per_metre = "{} m/m"
{}{}cycle = "{}"
"#,
        sonar.mount.x.0,
        sonar.mount.y.0,
        mounting(sonar, driver),
        degrees(sonar.cone),
        sonar.min_range.0,
        sonar.max_range.0,
        sonar.noise.floor.0,
        sonar.noise.per_metre,
        ranger(driver),
        beam(sonar.ranging),
        time(sonar.timing.cycle),
    )
}

/// The keys of a servo, or the bearing without one.
fn mounting(sonar: &Sonar, driver: &RangerConfig) -> String {
    if let Some(bearing) = sonar.fixed_bearing() {
        return format!(r#"bearing = "{} deg""#, degrees(bearing));
    }
    let servo = &sonar.timing.servo;
    format!(
        r#"servo = ["{} deg", "{} deg"]
servo_pulses = [{}]
servo_timing = {{ frame = "{}", sixty_degrees = "{}", settle = "{}" }}"#,
        degrees(sonar.servo.0),
        degrees(sonar.servo.1),
        driver.servo_pulses.map(pulse).join(", "),
        time(servo.frame),
        time(servo.sixty_degrees),
        time(servo.settle),
    )
}

/// The tables of priors, gating and schedule.
fn estimation(config: &RobotConfig) -> String {
    let localizer = &config.localizer;
    let (prior, gating, weights) = (&localizer.prior, &localizer.gating, &localizer.weights);
    let echo = &localizer.echo;
    let policy = match localizer.policy {
        Policy::Nearest => "nearest",
        Policy::Informative => "informative",
    };
    format!(
        r#"
[prior]
scale_right = {}
scale_left = {}{}
track_width = "{} m"
range_scale = {}

[gating]
confidence = {}
inflation = "{} m"
max_distance_without_fix = "{} m"
max_position_deviation = "{} m"

[echo]
missed = {}
short = {}
long = {}
free_path = "{} m"
map_accuracy = "{} m"
late = "{} m"
late_per_radian = "{} m"
half_angle = "{} deg"
rim = "{} deg"

[schedule]
policy = "{policy}"
heading_weight = "{} m"
wheels_weight = "{} m"
"#,
        prior.scale_right,
        prior.scale_left,
        prior.scale_difference.map_or_else(String::new, |of| format!("\nscale_difference = {of}")),
        prior.track_width.0,
        prior.range_scale,
        gating.confidence,
        gating.inflation.0,
        gating.max_distance_without_fix.0,
        gating.max_position_deviation.0,
        echo.missed,
        echo.short,
        echo.long,
        echo.free_path.0,
        echo.map_accuracy.0,
        echo.late.0,
        echo.late_per_radian.0,
        degrees(echo.half_angle),
        degrees(echo.rim),
        weights.heading.0,
        weights.wheels.0,
    )
}

fn motors(motors: &MotorPolicy) -> String {
    let MotorPolicy { lost, dead_encoder, lost_link, link_timeout } = *motors;
    let [lost, dead_encoder, lost_link] =
        [lost, dead_encoder, lost_link].map(|is_on| if is_on { "on" } else { "off" });
    format!(
        r#"
[motors]
lost = "{lost}"
dead_encoder = "{dead_encoder}"
lost_link = "{lost_link}"
link_timeout = "{}"
"#,
        time(link_timeout)
    )
}

fn wheel(wheel: WheelConfig) -> String {
    let WheelConfig { travel_per_edge, is_mirrored } = wheel;
    let mirrored = if is_mirrored { ", mirrored = true" } else { "" };
    format!(r#"{{ travel_per_edge = "{} m"{mirrored} }}"#, travel_per_edge.0)
}

fn pulse(pulse: MeasuredPulse) -> String {
    let MeasuredPulse { width, bearing } = pulse;
    format!(r#"{{ width = "{}", bearing = "{} deg" }}"#, time(width), degrees(bearing))
}

/// The line of the beam of light; nothing of a sonar.
fn beam(ranging: Ranging) -> String {
    let Ranging::Light(LightBeam { spot, pointing }) = ranging else { return String::new() };
    let (spot, pointing) = (degrees(spot), degrees(pointing));
    format!("beam = {{ spot = \"{spot} deg\", pointing = \"{pointing} deg\" }}\n")
}

/// The line of the ranger's kind.
fn ranger(ranger: &RangerConfig) -> String {
    let kind = match ranger.kind {
        RangerKind::Pulse(timing) => pulse_ranger(&timing),
        RangerKind::Srf { address } => format!(r#"{{ kind = "srf08", address = {address} }}"#),
        RangerKind::Vl53l1x { address } => {
            format!(r#"{{ kind = "vl53l1x", address = {address} }}"#)
        }
        RangerKind::Vl53l0x { address } => {
            format!(r#"{{ kind = "vl53l0x", address = {address} }}"#)
        }
        RangerKind::Custom => r#""custom""#.to_owned(),
    };
    format!("ranger = {kind}\n")
}

fn pulse_ranger(timing: &PulseTiming) -> String {
    let PulseTiming { trigger, blanking, longest, silence, listen, stuck } = *timing;
    let times = [
        ("trigger", trigger),
        ("blanking", blanking),
        ("longest", longest),
        ("silence", silence),
        ("listen", listen),
        ("stuck", stuck),
    ];
    let times = times.map(|(key, span)| format!(r#"{key} = "{}""#, time(span)));
    format!(r#"{{ kind = "hc_sr04", {} }}"#, times.join(", "))
}

fn degrees(angle: Radians) -> f32 {
    angle.0.to_degrees()
}

fn time(span: Duration) -> String {
    format!("{} us", span.to_micros())
}
