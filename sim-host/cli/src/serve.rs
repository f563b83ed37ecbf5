//! `--serve`: a page that shows what runs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sonarfix_hal::config::RobotConfig;
use sonarfix_live::paced::Paced;
use sonarfix_live::ring::Ring;
use sonarfix_live::server::Server;
use sonarfix_map::{Floor, MapFile, robot_file};
use sonarfix_sim::trace::Trace;
use sonarfix_telemetry::feed::{Feed, Scene};
use sonarfix_telemetry::order::Orders;

use crate::recorded::{Run, Sources};

/// The page.
#[derive(Debug, clap::Args)]
pub struct ServeArgs {
    /// Shows it on a page of this computer, and prints the page's address; `--serve=PORT` takes a port, by default any free one
    /// (docs/live.md).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub serve: Option<u16>,
    /// Shows another run beside this one, at the same time since its start: a log, a trace or a scenario, as for `compare`.
    #[arg(long, value_name = "RUN", requires = "serve")]
    beside: Option<PathBuf>,
}

/// The speed of what has run before, or is simulated.
#[derive(Debug, clap::Args)]
pub struct PacedArgs {
    #[command(flatten)]
    pub page: ServeArgs,
    /// The speed on the page: 1 for real time.
    #[arg(long, value_name = "FACTOR", requires = "serve", default_value_t = 1.0)]
    pub speed: f64,
}

impl ServeArgs {
    /// Starts the server, if it was asked for; otherwise events go nowhere. A run to be shown beside has these files, if they are
    /// not beside it.
    ///
    /// # Errors
    /// If the port is taken, or the run beside cannot be read.
    pub fn start(&self, sources: Sources<'_>) -> anyhow::Result<(Feed, Option<Orders>)> {
        let Some(port) = self.serve else {
            return Ok((Feed::nowhere(), None));
        };
        let beside =
            self.beside.as_deref().map(|file| Run::read(file, unless_beside(file, sources)));
        let beside = beside.transpose()?;
        let ring = Arc::new(Ring::default());
        let (server, orders) = Server::start(port, Arc::clone(&ring))?;
        eprintln!("open {}", server.address());
        let feed = Feed::new(ring);
        if let Some(run) = beside {
            feed.beside(&run.name, &run.trace)?;
        }
        Ok((feed, Some(orders)))
    }
}

impl PacedArgs {
    /// Starts the server and a recorder that publishes at the speed; `None` if it was not asked for. A run to be shown beside has
    /// these files, if they are not beside it.
    ///
    /// # Errors
    /// If the port is taken, for a wrong speed, or if the run beside cannot be read.
    pub fn start(&self, scene: &Scene, sources: Sources<'_>) -> anyhow::Result<Option<Paced>> {
        let (feed, Some(orders)) = self.page.start(sources)? else {
            return Ok(None);
        };
        feed.scene(scene);
        Paced::new(feed, orders, self.speed).map(Some)
    }
}

/// The files of the page's own run, where a run has none beside itself.
fn unless_beside<'a>(run: &Path, own: Sources<'a>) -> Sources<'a> {
    let is_beside = |name: &str| run.with_file_name(name).exists();
    Sources {
        map: own.map.filter(|_| !is_beside("map.toml")),
        robot: own.robot.filter(|_| !is_beside("robot.toml")),
    }
}

/// What a page shows of a run on a floor.
pub fn scene(title: String, source: &'static str, floor: &Floor, robot: &RobotConfig) -> Scene {
    let trace = Trace::of(floor, robot.localizer.rangers.first.cone);
    let track = f64::from(robot.localizer.drive.track_width.0);
    Scene {
        title,
        source,
        commands: false,
        cone: trace.cone,
        track,
        walls: trace.walls,
        obstacles: Vec::new(),
        prior: robot.localizer.prior,
    }
}

/// What a page shows of a robot: as far as its map and its robot file are given.
///
/// # Errors
/// If a file cannot be read.
pub fn scene_of_robot(
    title: String,
    map: Option<&Path>,
    robot: Option<&Path>,
) -> anyhow::Result<(Scene, [f64; 2])> {
    let robot = robot.map(robot_file::read).transpose()?;
    let floor = map.map(|map| MapFile::read(map, None)).transpose()?.map(|file| file.floor);
    Ok(Scene::of_robot(title, floor.as_ref(), robot.as_ref()))
}
