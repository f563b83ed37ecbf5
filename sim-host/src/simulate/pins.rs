//! A run through pins, drivers and the loop that a robot runs, on a virtual clock that jumps from
//! event to event.

use sonarfix::localizer::{Localizer, Start};
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_hal::robot::{Heard, Report};
use sonarfix_pil::{Actuators, Sensors, Wires};

use super::computer::{Computer, Controller};
use super::score::Score;
use super::{Chance, Simulation, SimulationError, micros, seconds};
use crate::angle;
use crate::observe::{self, Look};
use crate::pins::board::{LATENCY, SonarBoard};
use crate::pins::devices::{self, ServoSetup};
use crate::pins::disc::EncoderDisc;
use crate::pins::faults::Faults;
use crate::pins::wires::EncoderWires;
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
    computer: &mut impl Computer,
) -> Result<RunResult, SimulationError> {
    let encoders = Default::default();
    let (mut side, mut start) = WorldSide::new(simulation, seed, &encoders)?;
    loop {
        // As the power comes.
        let wires = Wires::default();
        let now = Instant::from_ticks(side.now);
        let (mut controller, actuators) = computer.controller(&wires, start, now)?;
        side.obey(actuators);
        recorder.began(controller.localizer()?);
        let Some(back_at) = side.live(&mut controller, recorder)? else {
            return side.score.result(controller.localizer()?);
        };
        start = side.reboot(back_at, controller.localizer()?);
    }
}

/// Everything on the other side of the wires.
struct WorldSide<'a> {
    simulation: &'a Simulation,
    encoders: &'a [EncoderWires; 2],
    chance: Chance,
    plant: Plant<'a>,
    discs: [EncoderDisc<'a>; 2],
    setup: ServoSetup,
    servo: ServoPlant,
    /// A bearing that the servo is told and has not taken up yet.
    ordered: Option<f64>,
    faults: Faults,
    board: SonarBoard,
    /// When the echo line rose and when it fell, since the loop was last polled.
    edges: (Option<Instant>, Option<Instant>),
    /// Whether the sonar's trigger is high.
    is_raised: bool,
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
        encoders: &'a [EncoderWires; 2],
    ) -> Result<(Self, Start), SimulationError> {
        let scenario = &simulation.scenario;
        let mut chance = Chance::new(seed);
        let plant = simulation.plant();
        let start = simulation.start(&plant.state(), &mut chance.start);
        let score = Score::new(simulation, start, plant.state())?;
        let [right, left] = encoders;
        let [right_tick, left_tick] = devices::ticks(&scenario.robot);
        let setup = ServoSetup::of(scenario.hardware.servo);
        let side = Self {
            simulation,
            encoders,
            chance,
            plant,
            discs: [EncoderDisc::new(right, right_tick), EncoderDisc::new(left, left_tick)],
            setup,
            servo: ServoPlant::new(setup.model),
            ordered: None,
            faults: Faults::new(&scenario.faults, seed),
            board: SonarBoard::default(),
            edges: (None, None),
            is_raised: false,
            follower: simulation.follower(),
            score,
            silence: devices::timing(scenario).listen.to_micros() + GIVES_UP_AFTER,
            look: None,
            now: 0,
        };
        Ok((side, start))
    }

    /// Goes on until the run is over, or the power fails: then until when, µs.
    fn live(
        &mut self,
        controller: &mut impl Controller,
        recorder: &mut impl Recorder,
    ) -> Result<Option<u64>, SimulationError> {
        let period = self.simulation.scenario.robot.encoder_period.to_micros();
        let end = self.simulation.end();
        loop {
            if let Some(back_at) = self.faults.controller.power_back_at(self.now) {
                return Ok(Some(back_at));
            }
            let sensors = self.sensors();
            let (report, actuators) = controller.poll(&sensors)?;
            let localizer = controller.localizer()?;
            recorder.polled(&report, localizer);
            self.obey(actuators);
            self.record(&report, localizer, recorder);
            // A tick may be held back by a ping, but not for as long as a period.
            let is_last = report.tick.is_some() && self.now + period > end;
            if is_last || self.now > end + period {
                return Ok(None);
            }
            let next = self.next_poll(controller);
            self.advance(next);
        }
    }

    /// What the devices have seen since the loop was last polled.
    fn sensors(&mut self) -> Sensors {
        let [right, left] = self.encoders.each_ref().map(EncoderWires::counted);
        let (rose, fell) = std::mem::take(&mut self.edges);
        Sensors { at: Instant::from_ticks(self.now), right, left, rose, fell }
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
        self.edges = self.board.edges(now);
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
    fn reboot(&mut self, back_at: u64, localizer: &Localizer) -> Start {
        let start = self.simulation.scenario.start;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let start = Start {
            pose: localizer.pose(),
            position_deviation: Metres(start.position as f32),
            heading_deviation: Radians(start.heading as f32),
        };
        self.plant.steer(Command::default());
        self.look = None;
        self.advance(back_at);
        start
    }

    /// Does what the robot did to its wires.
    fn obey(&mut self, actuators: Actuators) {
        if let Some(duty) = actuators.duty {
            self.ordered = Some(self.setup.bearing(duty, &self.simulation.scenario.robot.config));
            self.turn_servo();
        }
        self.is_raised = actuators.is_raised;
        if actuators.has_fallen {
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

    fn record(&mut self, report: &Report, localizer: &Localizer, recorder: &mut impl Recorder) {
        self.score.faults(report.faults);
        if report.tick.is_some() || report.heard.is_some() {
            self.score.arrive(self.plant.state());
        }
        if let Some(heard) = &report.heard {
            self.record_fix(heard, recorder);
        }
        if report.tick.is_some() {
            self.score.tick(self.time(), localizer, &self.plant, recorder);
            self.steer(localizer);
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

    fn steer(&mut self, localizer: &Localizer) {
        if let Some(follower) = &mut self.follower {
            let command = follower.command(&observe::estimate(localizer).pose);
            self.plant.steer(command);
        }
    }

    /// When the loop is to be polled next: when it says, or while it listens as often as a
    /// firmware would, and when its interrupt wakes it up.
    fn next_poll(&mut self, controller: &mut impl Controller) -> u64 {
        let at = match controller.idle_until() {
            Some(idle_until) => idle_until.ticks(),
            None if self.is_raised => self.now + TRIGGER,
            None => {
                let edge = self.board.next_edge().unwrap_or(u64::MAX);
                edge.min(self.now + LISTEN_POLL)
            }
        };
        self.faults.controller.poll_at(self.now, at.max(self.now + 1))
    }
}
