//! The robot: application, drivers and simulated hardware.

use std::collections::VecDeque;

use anyhow::{anyhow, bail, ensure};
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::localizer::{Localizer, Mode, Start};
use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents, Link};
use sonarfix_hal::robot::PACE;
use sonarfix_link::message::ResetCause;
use sonarfix_link::{Command, CommandResult, baked};
use sonarfix_map::{Fidelity, Follow, Scenario};
use sonarfix_pil::board::{self, WiredDevices};
use sonarfix_pil::{RamFlash, Wires};
use sonarfix_sim::pins::wires::EncoderWires;
use sonarfix_sim::plant::follower;
use sonarfix_sim::simulate::{Hardware, Simulation, start_at};
use sonarfix_sim::trace::Pose;

/// The longest time between two polls while the motors are enabled, as on the boards.
const DRIVING: Duration = Duration::from_ticks(10_000);
/// Time between two polls of a robot that searches for its pose, as on the boards.
const SEARCHING: Duration = Duration::from_ticks(1_000);
/// Bytes of telemetry that wait for the next step; what has no room is lost, as on a board.
const ROOM: usize = 1 << 16;

/// What a robot is made of.
pub struct Parts {
    simulation: Simulation,
    /// The images in its flash.
    map: Vec<u8>,
    config: Vec<u8>,
    encoders: [EncoderWires; 2],
    wires: Wires,
}

impl Parts {
    /// The robot of a scenario, which has its map and its configuration in flash. It steers by its estimate also where the
    /// scenario has `follow = "truth"`, because a commanded motion takes it off its path.
    ///
    /// # Errors
    /// If the scenario is not of the fidelity "pins", or an image cannot be made.
    pub fn new(mut scenario: Scenario) -> anyhow::Result<Self> {
        ensure!(
            scenario.fidelity == Fidelity::Pins,
            "a virtual robot has pins: it needs fidelity = \"pins\" in the scenario"
        );
        scenario.follow = Follow::Estimate;
        let simulation = Simulation::new(scenario);
        let config = simulation.robot();
        config.check()?;
        let map = simulation.baked_map()?;
        let mut buffer = [0; baked::LENGTH_MAX];
        let config = baked::write(&config, &mut buffer).map_err(|error| anyhow!("{error:?}"))?;
        let config = config.to_vec();
        Ok(Self { simulation, map, config, encoders: Default::default(), wires: Wires::default() })
    }

    /// The true pose at the start, with the deviations of the scenario; `None` for a robot that is to search for it.
    #[must_use]
    pub fn start(&self) -> Option<Start> {
        let scenario = &self.simulation.scenario;
        let pose = scenario.path.pose_at(0.0);
        (!scenario.start.is_unknown).then(|| start_at(scenario, [pose.x, pose.y, pose.heading]))
    }
}

/// A robot that is switched on.
pub struct VirtualRobot<'p> {
    app: App<'p, RamFlash>,
    devices: WiredDevices<'p>,
    wires: &'p Wires,
    hardware: Hardware<'p>,
    line: Line,
    /// Whether it stands while no motion is commanded.
    stands: bool,
    /// Whether a motion was commanded at the last poll.
    is_commanded: bool,
    /// The time of the last poll, and when the next one is due.
    polled: Instant,
    due: Instant,
}

/// The bytes of the link.
#[derive(Debug, Default)]
struct Line {
    received: VecDeque<u8>,
    sent: Vec<u8>,
}

impl Link for Line {
    fn receive(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    fn send(&mut self, frame: &[u8]) {
        if self.has_room(frame.len()) {
            self.sent.extend_from_slice(frame);
        }
    }

    fn has_room(&self, length: usize) -> bool {
        self.sent.len() + length <= ROOM
    }
}

impl<'p> VirtualRobot<'p> {
    /// Switches the robot on, at the start of its path. It waits for commands, as every robot does. While no motion is
    /// commanded, its loop runs and its motors are enabled, it drives along the path, or `stands`.
    ///
    /// # Errors
    /// If the board cannot be this robot.
    pub fn switched_on(parts: &'p Parts, seed: u64, stands: bool) -> anyhow::Result<Self> {
        let Parts { simulation, map, config, encoders, wires } = parts;
        let at = Instant::from_ticks(0);
        let flash = RamFlash::default();
        let length = u32::try_from(sonarfix_pil::ram_flash::CAPACITY)?;
        let store = Store::new(flash, 0..length).map_err(|error| anyhow!("{error:?}"))?;
        let number = |text: &str| text.parse().unwrap_or(0);
        let firmware = [
            number(env!("CARGO_PKG_VERSION_MAJOR")),
            number(env!("CARGO_PKG_VERSION_MINOR")),
            number(env!("CARGO_PKG_VERSION_PATCH")),
        ];
        let board = Board { firmware, reset: ResetCause::PowerOn, resets: 0 };
        let mut robot = Self {
            app: App::new(board, FlashContents::read(map, config), store, at),
            devices: board::devices(&simulation.robot(), wires)?,
            wires,
            hardware: Hardware::new(simulation, seed, encoders)?,
            line: Line::default(),
            stands,
            is_commanded: false,
            polled: at,
            due: at,
        };
        robot.poll();
        Ok(robot)
    }

    /// Sets this pose, if there is one, and starts the loop, as the commands `set-pose` and `start` do.
    ///
    /// # Errors
    /// If the robot refuses.
    pub fn start(&mut self, start: Option<&Start>) -> anyhow::Result<()> {
        let set_pose = start.map(|start| Command::SetPose(*start));
        for command in set_pose.into_iter().chain([Command::Start]) {
            let at = Instant::from_ticks(self.now());
            let result = self.app.command(at, &mut self.devices, &mut self.line, &command);
            if let CommandResult::Refused(reason) = result {
                bail!("the robot does not start: {reason}");
            }
        }
        self.due = self.polled;
        Ok(())
    }

    /// The time since it was switched on, µs.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.hardware.now()
    }

    /// Where it is in truth.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.hardware.pose()
    }

    /// What determines its pose, while its loop runs.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        self.app.navigation_mode()
    }

    /// Its localizer, while its loop runs.
    #[must_use]
    pub fn localizer(&self) -> Option<&Localizer<'p>> {
        self.app.localizer()
    }

    /// Takes bytes from its link.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.line.received.extend(bytes);
    }

    /// What it has sent since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.line.sent)
    }

    /// Lives until this time, µs.
    pub fn run_to(&mut self, until: u64) {
        while self.now() < until {
            while let Some((at, measurement)) = self.hardware.arrived() {
                // A robot whose loop does not run has no use for it.
                let _ = self.app.absolute(at, &measurement);
                self.due = self.polled;
            }
            if self.is_due() {
                self.poll();
            }
            let idle_until = self.app.idle_until(&mut self.devices);
            let next = self.hardware.next_step(idle_until).min(self.next_poll().ticks());
            self.hardware.advance(next.clamp(self.now() + 1, until));
        }
    }

    /// When it is polled, if no edge comes earlier. Bytes wait until several can be read together.
    fn next_poll(&self) -> Instant {
        let has_bytes = !self.line.received.is_empty();
        let with_bytes = self.polled + PACE;
        if has_bytes { self.due.min(with_bytes) } else { self.due }
    }

    fn is_due(&self) -> bool {
        self.now() >= self.next_poll().ticks() || self.hardware.has_edges()
    }

    fn poll(&mut self) {
        let sensors = self.hardware.sensors();
        self.wires.apply(&sensors);
        let polled = self.app.poll(sensors.at, &mut self.devices, &mut self.line);
        self.app.work(sensors.at, || sensors.at);
        let mode = self.app.navigation_mode();
        self.hardware.obey(self.wires.take(), mode.unwrap_or_default());
        self.drive(polled.may_drive);
        self.polled = sensors.at;
        self.due = self.app.next_poll(&mut self.devices);
        if polled.may_drive {
            self.due = self.due.min(self.polled + DRIVING);
        }
        if mode.is_some_and(|mode| mode != Mode::Tracking) {
            self.due = self.due.min(self.polled + SEARCHING);
        }
    }

    /// The motor code: it obeys the commanded motion, else it follows the path.
    fn drive(&mut self, may_drive: bool) {
        let localizer = self.app.localizer().filter(|_| may_drive);
        let motion = self.app.motion();
        let has_ended = std::mem::replace(&mut self.is_commanded, motion.is_some());
        match (motion, localizer) {
            (Some(motion), _) => self.hardware.steer(follower::Command {
                speed: motion.speed.0.into(),
                turn_rate: motion.turn.0.into(),
            }),
            (None, Some(localizer)) if !self.stands && !has_ended => {
                // The path follower gives a command for the time of an encoder sample.
                if self.app.report().is_some_and(|report| report.tick.is_some()) {
                    self.hardware.follow(localizer);
                }
            }
            _ => self.hardware.steer(follower::Command::default()),
        }
    }
}
