//! `sonarfix config`: a robot's configuration as the bytes that it reads from its flash.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonarfix::config::{Config, Policy, Rhythm};
use sonarfix::units::{Duration, Radians};
use sonarfix_link::baked;
use sonarfix_map::Robot;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Writes the bytes of a robot file's configuration.
    Bake {
        /// The robot file (docs/formats.md).
        robot: PathBuf,
        /// Where to.
        #[arg(long, value_name = "CONFIG.bin")]
        out: PathBuf,
    },
    /// Says whether bytes are a configuration that a robot takes.
    Check {
        /// The bytes: what `bake` wrote, or what was read from flash.
        config: PathBuf,
    },
    /// Prints the configuration that bytes hold.
    Show {
        /// The bytes: what `bake` wrote, or what was read from flash.
        config: PathBuf,
    },
}

pub fn execute(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Bake { robot, out } => {
            let config = Robot::read(robot)?.config;
            let mut buffer = [0; baked::LENGTH_MAX];
            let bytes = baked::write(&config, &mut buffer)?;
            fs::write(out, bytes).with_context(|| format!("cannot write {}", out.display()))?;
            println!("{}: {} bytes, {}", out.display(), bytes.len(), checksum(&config));
        }
        What::Check { config: file } => {
            println!("{}: a configuration, {}", file.display(), checksum(&read(file)?));
        }
        What::Show { config: file } => {
            let config = read(file)?;
            println!("# {}, {}\n{}", file.display(), checksum(&config), text(&config));
        }
    }
    Ok(())
}

fn read(file: &Path) -> anyhow::Result<Config> {
    let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    baked::read(&bytes).with_context(|| file.display().to_string())
}

/// By which a robot says that it has this one.
fn checksum(config: &Config) -> String {
    format!("checksum {:08x}", baked::checksum(config))
}

/// The configuration under the keys of a robot file.
fn text(config: &Config) -> String {
    let Config { drive, max_wheel_speed, sonar, prior, trust, policy, weights } = config;
    let timing = &sonar.timing;
    let (rightmost, leftmost) = sonar.servo;
    let degrees = |angle: Radians| angle.0.to_degrees();
    let time = |span: Duration| format!("{} us", span.to_micros());
    let rhythm = match timing.rhythm {
        Rhythm::Every(period) => time(period),
        Rhythm::AsFastAsPossible => "as fast as possible".to_owned(),
    };
    let policy = match policy {
        Policy::Nearest => "nearest",
        Policy::Informative => "informative",
    };
    format!(
        r#"format = 1
[drive]
track_width = "{} m"
wheel_noise = "{} m/sqrt(m)"
scale_walk = "{} /sqrt(m)"
track_width_walk = "{} m/sqrt(m)"
max_wheel_speed = "{} m/s"
[sonar]
mount = ["{} m", "{} m"]
servo = ["{} deg", "{} deg"]
cone = "{} deg"
min_range = "{} m"
max_range = "{} m"
noise = "{} m"
noise_per_metre = "{} m/m"
fix_period = "{rhythm}"
servo_pace = {{ frame = "{}", sixty_degrees = "{}", settle = "{}" }}
cycle = "{}"
[prior]
scale_right = {}
scale_left = {}
track_width = "{} m"
range_scale = {}
[trust]
gate = {}
confidence = {}
outer_gate = {}
short = {}
reopen = "{} m"
stale = "{} m"
doubtful = "{} m"
[schedule]
policy = "{policy}"
heading_weight = "{} m"
wheels_weight = "{} m""#,
        drive.track_width.0,
        drive.wheel_noise.0.0,
        drive.scale_walk.0,
        drive.track_width_walk.0.0,
        max_wheel_speed.0,
        sonar.mount.x.0,
        sonar.mount.y.0,
        degrees(rightmost),
        degrees(leftmost),
        degrees(sonar.cone),
        sonar.min_range.0,
        sonar.max_range.0,
        sonar.noise.floor.0,
        sonar.noise.per_metre,
        time(timing.servo.frame),
        time(timing.servo.sixty_degrees),
        time(timing.servo.settle),
        time(timing.cycle),
        prior.scale_right,
        prior.scale_left,
        prior.track_width.0,
        prior.range_scale,
        trust.gate,
        trust.confidence,
        trust.outer_gate,
        trust.short,
        trust.reopen.0,
        trust.stale.0,
        trust.doubtful.0,
        weights.heading.0,
        weights.wheels.0,
    )
}
