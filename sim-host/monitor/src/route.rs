//! Driving a robot along a route, by its telemetry: the controllers of `sonarfix-drive` on the PC.
//!
//! It reads neither port nor clock: telemetry and the time are arguments.
//!
//! - [`RouteDriver`]: the motion that follows from an estimate;
//! - [`Trip`]: the same with the time, until the robot has arrived or the program gives up.

use std::time::{Duration, Instant};

use sonarfix::config::{RangerParameters, Rangers};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::health::Verdict;
use sonarfix::map::{Map, Wall};
use sonarfix_drive::obstacles::{self, Obstacles};
use sonarfix_drive::pursuit::{Limits, Progress, Pursuit, Reason, RouteError, Situation};
use sonarfix_hal::ranger::NoEcho;
use sonarfix_link::{Estimate, Motion, Ping, Telemetry};
use sonarfix_search::navigator::Mode;

use crate::request::Control;

/// A motion without a newer estimate ends after this time: some encoder samples.
const MOTION_TIMEOUT: Duration = Duration::from_millis(500);
/// After this time without an estimate the loop has stopped, or the link is cut.
const ESTIMATE_TIMEOUT: Duration = Duration::from_secs(3);

/// The robot's map and rangers, by which objects that are not on the map are recognized.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// The walls.
    pub walls: Vec<Wall>,
    /// The rangers of the robot file.
    pub rangers: Rangers<RangerParameters>,
    /// What counts as an object.
    pub settings: obstacles::Settings,
}

/// A robot on a route.
#[derive(Debug)]
pub struct RouteDriver<'r> {
    pursuit: Pursuit<'r>,
    surroundings: Option<&'r Surroundings>,
    obstacles: Obstacles,
    estimate: Option<Estimate>,
    mode: Mode,
}

impl<'r> RouteDriver<'r> {
    /// A robot that is to drive along a route. Without its surroundings it stops for no object.
    ///
    /// # Errors
    /// [`RouteError`].
    pub fn new(
        route: &'r [Point],
        limits: Limits,
        surroundings: Option<&'r Surroundings>,
    ) -> Result<Self, RouteError> {
        let settings = surroundings.map_or(obstacles::Settings::SMALL, |all| all.settings);
        Ok(Self {
            pursuit: Pursuit::new(route, limits)?,
            surroundings,
            obstacles: Obstacles::new(settings),
            estimate: None,
            mode: Mode::Tracking,
        })
    }

    /// Takes a message of the robot; the motion that follows from an estimate.
    pub fn take(&mut self, telemetry: &Telemetry) -> Option<(Progress, Motion)> {
        match telemetry {
            Telemetry::Ping(ping) => {
                self.take_ping(ping);
                None
            }
            Telemetry::ModeChanged(change) => {
                self.mode = change.mode;
                None
            }
            Telemetry::Estimate(estimate) => {
                self.estimate = Some(*estimate);
                Some(self.pursuit.drive(&self.situation(estimate)))
            }
            _ => None,
        }
    }

    fn situation(&self, estimate: &Estimate) -> Situation {
        let pose = estimate.state.pose();
        let (x, y) = (estimate.deviation.x, estimate.deviation.y);
        // A robot that searches has no pose, and a provisional one may be another place.
        let verdict = match self.mode {
            Mode::Tracking => estimate.health.verdict,
            Mode::Searching | Mode::Provisional => Verdict::Lost,
        };
        let deviation = if x > y { x } else { y };
        Situation { pose, deviation, verdict, ahead: self.obstacles.ahead(estimate.at, pose) }
    }

    /// Takes a ping, at the pose of the last estimate. The ping of a failed ranger is ignored.
    fn take_ping(&mut self, ping: &Ping) {
        let (Some(surroundings), Some(estimate)) = (self.surroundings, &self.estimate) else {
            return;
        };
        let range: Option<Metres> = match ping.outcome {
            Ok(echo) => Some(echo.range),
            Err(NoEcho::Nothing | NoEcho::OutOfRange) => None,
            Err(_) => return,
        };
        let Some(ranger) = surroundings.rangers.get(ping.aim.ranger) else { return };
        let ping = obstacles::Ping {
            at: ping.at,
            pose: estimate.state.pose(),
            mount: ranger.mount,
            bearing: ping.aim.bearing,
            half_cone: ranger.cone,
            range,
        };
        self.obstacles.take(&Map::new(&surroundings.walls), &ping);
    }
}

/// How a trip has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The robot is at the end of its route.
    Arrived,
    /// It stood for this reason for longer than permitted.
    Stopped(Reason),
    /// It sends no estimates.
    Silent,
    /// The program has ended it.
    Interrupted,
}

/// A robot on a route, and the time.
#[derive(Debug)]
pub struct Trip<'r> {
    driver: RouteDriver<'r>,
    /// For how long the robot may stand for a reason.
    patience: Duration,
    /// When the last estimate came, or the trip began.
    heard: Instant,
    /// Whether the motion of the last estimate is still commanded.
    is_commanded: bool,
    progress: Progress,
    /// Since when the progress is what it is.
    since: Instant,
    end: Option<End>,
}

impl<'r> Trip<'r> {
    /// A trip that begins at `now`; a robot that stands for a reason for longer than `patience` ends it.
    #[must_use]
    pub fn new(driver: RouteDriver<'r>, patience: Duration, now: Instant) -> Self {
        let (heard, since) = (now, now);
        Self {
            driver,
            patience,
            heard,
            is_commanded: true,
            progress: Progress::Driving,
            since,
            end: None,
        }
    }

    /// What the program does next: with each message of the robot, and without one at least every 100 ms.
    pub fn control(&mut self, telemetry: Option<&Telemetry>, now: Instant) -> Control {
        let Some((progress, motion)) = telemetry.and_then(|message| self.driver.take(message))
        else {
            return self.wait(now);
        };
        self.heard = now;
        self.is_commanded = true;
        if progress != self.progress {
            (self.progress, self.since) = (progress, now);
        }
        match progress {
            Progress::Arrived => self.stop(End::Arrived),
            Progress::Stopped(reason) if now.duration_since(self.since) > self.patience => {
                self.stop(End::Stopped(reason))
            }
            Progress::Driving | Progress::Stopped(_) => Control::Drive(motion),
        }
    }

    /// Without a new estimate the robot is commanded to stand after [`MOTION_TIMEOUT`].
    fn wait(&mut self, now: Instant) -> Control {
        let age = now.saturating_duration_since(self.heard);
        if age > ESTIMATE_TIMEOUT {
            return self.stop(End::Silent);
        }
        if age > MOTION_TIMEOUT && self.is_commanded {
            self.is_commanded = false;
            return Control::Drive(Motion::default());
        }
        Control::Keep
    }

    /// Ends the trip.
    pub fn stop(&mut self, end: End) -> Control {
        self.end.get_or_insert(end);
        Control::Stop
    }

    /// How it has ended.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// What the robot does.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress
    }
}
