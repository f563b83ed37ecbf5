//! `sonarfix command goto`: drives a robot along a route.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, MetresPerSecond, RadiansPerSecond};
use sonarfix_drive::obstacles::Settings;
use sonarfix_drive::pursuit::{Limits, Progress};
use sonarfix_link::CommandResult;
use sonarfix_map::{MapFile, robot_file};
use sonarfix_monitor::port::Port;
use sonarfix_monitor::request;
use sonarfix_monitor::route::{End, RouteDriver, Surroundings, Trip};
use sonarfix_terminal::progress::{catch_interrupt, is_interrupted};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// x and y of each point of the route in turn, metres.
    #[arg(required = true, num_args = 2.., value_names = ["X", "Y"])]
    coordinates: Vec<f32>,
    /// Speed on a straight line, metres per second.
    #[arg(long, default_value_t = Limits::SMALL.speed.0)]
    speed: f32,
    /// The fastest turn, degrees per second.
    #[arg(long, default_value_t = Limits::SMALL.turn.0.to_degrees().round())]
    turn: f32,
    /// The robot stands while the standard deviation of its position is larger, metres.
    #[arg(long, value_name = "METRES", default_value_t = Limits::SMALL.max_deviation.0)]
    max_deviation: f32,
    /// The robot has arrived with at most this standard deviation of its position, metres. Until then it stands at the end, and
    /// its ranges correct the pose.
    #[arg(long, value_name = "METRES", default_value_t = Limits::SMALL.end_deviation.0)]
    end_deviation: f32,
    /// The robot stands while an object that is not on the map is nearer than this ahead of its axle, metres. Needs `--map` and `--robot`.
    #[arg(long, value_name = "METRES", default_value_t = Limits::SMALL.clearance.0)]
    clearance: f32,
    /// The robot's map, to recognize objects that are not on it.
    #[arg(long, value_name = "MAP", requires = "robot")]
    map: Option<PathBuf>,
    /// The robot file, for the places and cones of its rangers.
    #[arg(long, value_name = "ROBOT.toml", requires = "map")]
    robot: Option<PathBuf>,
    /// Gives up after the robot has stood for so many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0)]
    patience: f64,
    /// Ends after this time; the robot then stands where it is.
    #[arg(long)]
    seconds: Option<f64>,
}

impl Args {
    /// The points.
    pub fn route(&self) -> anyhow::Result<Vec<Point>> {
        let pairs = self.coordinates.chunks_exact(2);
        ensure!(pairs.remainder().is_empty(), "the last point has no y");
        Ok(pairs.filter_map(|pair| Some(Point::new(*pair.first()?, *pair.last()?))).collect())
    }

    fn limits(&self) -> Limits {
        Limits {
            speed: MetresPerSecond(self.speed),
            turn: RadiansPerSecond(self.turn.to_radians()),
            max_deviation: Metres(self.max_deviation),
            end_deviation: Metres(self.end_deviation),
            clearance: Metres(self.clearance),
            ..Limits::SMALL
        }
    }

    fn surroundings(&self) -> anyhow::Result<Option<Surroundings>> {
        let read = |map: &Path, robot: &Path| -> anyhow::Result<Surroundings> {
            let walls = MapFile::read(map, None)?.floor.walls();
            let rangers = robot_file::read(robot)?.localizer.rangers;
            Ok(Surroundings { walls, rangers, settings: Settings::SMALL })
        };
        let files = self.map.as_deref().zip(self.robot.as_deref());
        files.map(|(map, robot)| read(map, robot)).transpose()
    }
}

/// How the robot is driven, and until when.
pub struct Journey {
    limits: Limits,
    surroundings: Option<Surroundings>,
    patience: Duration,
    limit: Option<Duration>,
    began: Instant,
}

impl Journey {
    /// One that begins now.
    pub fn new(args: &Args) -> anyhow::Result<Self> {
        let limit = args.seconds.map(|limit| seconds(limit, "--seconds")).transpose()?;
        catch_interrupt();
        Ok(Self {
            limits: args.limits(),
            surroundings: args.surroundings()?,
            patience: seconds(args.patience, "--patience")?,
            limit,
            began: Instant::now(),
        })
    }

    /// Whether it is to end: Ctrl-C, or its time.
    pub fn is_over(&self) -> bool {
        is_interrupted() || self.limit.is_some_and(|limit| self.began.elapsed() >= limit)
    }

    /// Drives along a route until the robot has arrived or the trip is given up.
    pub fn drive(&self, route: &[Point], port: &mut Port) -> anyhow::Result<End> {
        let driver = RouteDriver::new(route, self.limits, self.surroundings.as_ref())?;
        let mut trip = Trip::new(driver, self.patience, Instant::now());
        let mut shown = Progress::Driving;
        let result = request::steer(port, |telemetry| {
            if self.is_over() {
                return trip.stop(End::Interrupted);
            }
            let control = trip.control(telemetry, Instant::now());
            show(trip.progress(), &mut shown);
            control
        })?;
        match (result, trip.end()) {
            (CommandResult::Refused(reason), _) => bail!("the robot refuses: {reason}"),
            (_, Some(End::Silent)) => bail!("the robot sends no estimates: does its loop run?"),
            (_, end) => Ok(end.unwrap_or(End::Interrupted)),
        }
    }
}

/// A time in seconds.
pub fn seconds(seconds: f64, option: &str) -> anyhow::Result<Duration> {
    Duration::try_from_secs_f64(seconds).with_context(|| format!("{option}: not a duration"))
}

/// Drives until the robot has arrived or the trip is given up.
pub fn execute(args: &Args, port: &mut Port) -> anyhow::Result<()> {
    let route = args.route()?;
    match Journey::new(args)?.drive(&route, port)? {
        End::Arrived => println!("arrived"),
        End::Stopped(reason) => bail!("the robot has not arrived: {reason}"),
        End::Silent | End::Interrupted => println!("ended before the end of the route"),
    }
    Ok(())
}

/// Prints why the robot stands, and that it goes on.
fn show(progress: Progress, shown: &mut Progress) {
    if progress == std::mem::replace(shown, progress) {
        return;
    }
    match progress {
        Progress::Stopped(reason) => println!("stands: {reason}"),
        Progress::Driving => println!("drives"),
        Progress::Arrived => {}
    }
}
