//! A run through pins, drivers and the loop that a robot runs, on a virtual clock that jumps from
//! event to event.

use sonarfix::localizer::{Localizer, Start};
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_hal::robot::{Heard, Report, Robot};

use super::score::Score;
use super::{Chance, Simulation, SimulationError, micros, seconds};
use crate::angle;
use crate::observe::{self, Look};
use crate::pins::board::{LATENCY, SonarBoard};
use crate::pins::devices::{self, PinDevices, ServoSetup, SetupError};
use crate::pins::disc::EncoderDisc;
use crate::pins::faults::Faults;
use crate::pins::wires::Wires;
use crate::plant::Plant;
use crate::plant::follower::{Command, Follower};
use crate::plant::servo::ServoPlant;
use crate::statistics::RunResult;
use crate::trace::Recorder;
use crate::world::Ping;

/// How often the loop is polled while a ping is in flight, µs. The interrupt stamps the edges, so
/// this only delays what is made of them; a firmware's loop has some such period.
const LISTEN_POLL: u64 = 1_000;
/// How long the trigger is up, µs: the driver's own minimum.
const TRIGGER: u64 = 10;
/// How much longer than the driver listens a board waits that heard nothing, µs: an HC-SR04 gives
/// up after 38 ms on paper, and its driver after 32.
const GIVES_UP_AFTER: u64 = 6_000;

pub fn run(
    simulation: &Simulation,
    seed: u64,
    recorder: &mut impl Recorder,
) -> Result<RunResult, SimulationError> {
    let wires = Wires::default();
    let servo = ServoSetup::of(simulation.scenario.hardware.servo);
    let mut devices = devices::connect(&wires, &simulation.scenario, &servo)?;
    let (mut side, localizer) = WorldSide::new(simulation, seed, &wires, servo)?;
    let mut robot = robot(simulation, localizer)?;
    recorder.began(robot.localizer());
    let period = simulation.scenario.robot.encoder_period.to_micros();
    loop {
        if let Some(back_at) = side.faults.controller.power_back_at(side.now) {
            robot = side.reboot(back_at, &robot)?;
            recorder.began(robot.localizer());
            devices = devices::connect(&wires, &simulation.scenario, &servo)?;
        }
        let report = robot.poll(Instant::from_ticks(side.now), &mut devices);
        recorder.polled(&report, robot.localizer());
        side.obey();
        side.record(&report, &robot, recorder);
        // A tick may be held back by a ping, but not for as long as a period.
        let is_last = report.tick.is_some() && side.now + period > simulation.end();
        if is_last || side.now > simulation.end() + period {
            return side.score.result(robot.localizer());
        }
        let next = side.next_poll(&robot, &mut devices);
        side.advance(next);
    }
}

fn robot<'a>(
    simulation: &Simulation,
    localizer: Localizer<'a>,
) -> Result<Robot<'a>, SimulationError> {
    let settings = devices::settings(&simulation.scenario.robot, simulation.stamp);
    let wheels = devices::wheels(&simulation.scenario.robot)?;
    Ok(Robot::new(localizer, wheels, settings).map_err(SetupError::from)?)
}

/// Everything on the other side of the wires.
struct WorldSide<'a> {
    simulation: &'a Simulation,
    wires: &'a Wires,
    chance: Chance,
    plant: Plant<'a>,
    discs: [EncoderDisc<'a>; 2],
    setup: ServoSetup,
    servo: ServoPlant,
    /// A bearing that the servo is told and has not taken up yet.
    ordered: Option<f64>,
    faults: Faults,
    board: SonarBoard,
    follower: Option<Follower>,
    score: Score<'a>,
    /// How long the board's line stays up where nothing is heard, µs.
    silence: u64,
    /// The last ping, for the record.
    look: Option<Look>,
    /// Microseconds since the run began.
    now: u64,
}

impl<'a> WorldSide<'a> {
    fn new(
        simulation: &'a Simulation,
        seed: u64,
        wires: &'a Wires,
        setup: ServoSetup,
    ) -> Result<(Self, Localizer<'a>), SimulationError> {
        let scenario = &simulation.scenario;
        let mut chance = Chance::new(seed);
        let plant = simulation.plant();
        let localizer = simulation.localizer(&plant.state(), &mut chance.start)?;
        let score = Score::new(simulation, &localizer, plant.state());
        let [right, left] = devices::ticks(&scenario.robot);
        let side = Self {
            simulation,
            wires,
            chance,
            plant,
            discs: [EncoderDisc::new(&wires.right, right), EncoderDisc::new(&wires.left, left)],
            setup,
            servo: ServoPlant::new(setup.model),
            ordered: None,
            faults: Faults::new(&scenario.faults, seed),
            board: SonarBoard::default(),
            follower: simulation.follower(),
            score,
            silence: devices::timing(scenario).listen.to_micros() + GIVES_UP_AFTER,
            look: None,
            now: 0,
        };
        Ok((side, localizer))
    }

    fn time(&self) -> f64 {
        seconds(self.now)
    }

    /// Lets the world go on, and its edges interrupt the robot.
    fn advance(&mut self, now: u64) {
        self.now = now;
        let travel = self.plant.drive_to(seconds(now), &mut self.chance.wheels);
        self.score.rolled(travel);
        let encoders = self.discs.iter_mut().zip(&mut self.faults.encoders);
        for ((disc, faults), metres) in encoders.zip(travel.measured) {
            disc.roll(metres, now, faults);
        }
        self.board.deliver(now, &self.wires.echo);
        self.turn_servo();
    }

    /// The servo takes up what its pulses say, over and over, unless it is stuck.
    fn turn_servo(&mut self) {
        if let Some(slowness) = self.faults.controller.servo_slowness(self.now)
            && let Some(bearing) = self.ordered.take()
        {
            self.servo.send(seconds(self.now), bearing, slowness);
        }
    }

    /// The power is gone, and comes back at `back_at`: the motors stop, and the robot starts again
    /// from the pose that it kept, as sure of it as at its start, and of its calibration as new.
    fn reboot(&mut self, back_at: u64, robot: &Robot) -> Result<Robot<'a>, SimulationError> {
        let start = self.simulation.scenario.start;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let start = Start {
            pose: robot.localizer().pose(),
            position_deviation: Metres(start.position as f32),
            heading_deviation: Radians(start.heading as f32),
        };
        self.plant.steer(Command::default());
        self.wires.trigger.set(false);
        self.look = None;
        self.advance(back_at);
        let localizer = self.simulation.localizer_from(start, back_at)?;
        self::robot(self.simulation, localizer)
    }

    /// Does what the robot did to its wires.
    fn obey(&mut self) {
        if let Some(duty) = self.wires.duty.take() {
            self.ordered = Some(self.setup.bearing(duty, &self.simulation.scenario.robot.config));
            self.turn_servo();
        }
        if self.wires.triggered.take() {
            let honest = self.ping();
            let pulse = self.faults.sonar.pulse(self.now, honest, self.silence);
            self.board.answer(self.now, pulse);
        }
    }

    /// Sends a ping; returns how long its echo's pulse is, µs.
    fn ping(&mut self) -> u64 {
        let Simulation { world, sensor, .. } = self.simulation;
        let latency = seconds(LATENCY);
        let time = self.time() + latency;
        let pose = self.plant.pose_after(latency);
        let sonar_after =
            |after: f64| self.simulation.sonar_at(&self.plant.pose_after(latency + after));
        let direction = angle::wrap(pose.heading + self.servo.bearing(time));
        let ping = Ping { time, sonar_after: &sonar_after, direction };
        let Chance { ranges, echoes, .. } = &mut self.chance;
        let echo = world.echo(&ping, sensor, ranges, echoes);
        self.look = Some(Look {
            time,
            sonar: sonar_after(0.0),
            heading: pose.heading,
            range: None,
            met: echo.map(|echo| echo.source),
        });
        let flight = |range: f64| micros(2.0 * range.max(0.0) / world.speed_of_sound());
        echo.map_or(self.silence, |echo| flight(echo.range))
    }

    fn record(&mut self, report: &Report, robot: &Robot, recorder: &mut impl Recorder) {
        self.score.faults(report.faults);
        if report.tick.is_some() || report.heard.is_some() {
            self.score.arrive(self.plant.state());
        }
        if let Some(heard) = &report.heard {
            self.record_fix(heard, recorder);
        }
        if report.tick.is_some() {
            self.score.tick(self.time(), robot.localizer(), &self.plant, recorder);
            self.steer(robot);
        }
        if let Some(Err(no_aim)) = report.aimed {
            self.score.no_aim();
            recorder.fix(|| {
                let pose = self.plant.pose();
                let sonar = self.simulation.sonar_at(&pose);
                let heading = pose.heading;
                let look = Look { time: self.time(), sonar, heading, range: None, met: None };
                observe::no_aim_record(look, no_aim)
            });
        }
    }

    fn record_fix(&mut self, heard: &Heard, recorder: &mut impl Recorder) {
        let (Some(look), Some(fix)) = (self.look.take(), &heard.fix) else {
            return;
        };
        self.score.fix(&heard.aim, fix);
        let range = heard.outcome.ok().map(|echo| echo.range.0.into());
        recorder.fix(|| observe::fix_record(Look { range, ..look }, &heard.aim, fix));
    }

    fn steer(&mut self, robot: &Robot) {
        if let Some(follower) = &mut self.follower {
            let command = follower.command(&observe::estimate(robot.localizer()).pose);
            self.plant.steer(command);
        }
    }

    /// When the loop is to be polled next: when it says, or while it listens as often as a
    /// firmware would, and when its interrupt wakes it up.
    fn next_poll(&mut self, robot: &Robot, devices: &mut PinDevices) -> u64 {
        let at = match robot.idle_until(devices) {
            Some(idle_until) => idle_until.ticks(),
            None if self.wires.trigger.get() => self.now + TRIGGER,
            None => {
                let edge = self.board.next_edge().unwrap_or(u64::MAX);
                edge.min(self.now + LISTEN_POLL)
            }
        };
        self.faults.controller.poll_at(self.now, at.max(self.now + 1))
    }
}
