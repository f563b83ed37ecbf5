//! A run through pins, drivers and the shipped loop, as a discrete-event simulation.

use sonarfix::localizer::{Localizer, Start};
use sonarfix::navigator::Mode;
use sonarfix::search::Search;
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_hal::robot::{PingResult, Report};
use sonarfix_map::Scenario;
use sonarfix_pil::{Actuators, GyroSignal, Sensors, Wires};

use super::computer::{Computer, Controller};
use super::error::SimulationError;
use super::score::Score;
use super::simulation::{Carried, PutDown, Simulation};
use super::streams::RandomStreams;
use crate::angle;
use crate::observe::{self, Measurement};
use crate::pins::board::{LATENCY, SonarBoard};
use crate::pins::devices;
use crate::pins::disc::EncoderDisc;
use crate::pins::faults::Faults;
use crate::pins::gyro::GyroChip;
use crate::pins::wires::EncoderWires;
use crate::plant::Plant;
use crate::plant::absolute::Absolute;
use crate::plant::follower::{Command, Follower};
use crate::plant::servo::ServoPlant;
use crate::statistics::RunResult;
use crate::time::{micros, seconds};
use crate::trace::Recorder;
use crate::world::Ping;

/// Step of the simulated hardware while a ping is in flight, µs: by up to this much a ping without an echo ends later than on a
/// board.
const LISTEN_STEP: u64 = 1_000;
/// Poll period of a robot that searches for its pose, µs.
const SEARCH_POLL: u64 = 1_000;
/// Length of the trigger pulse, µs: the driver's minimum.
const TRIGGER: u64 = 10;
/// By how much the pulse of a board without an echo exceeds the driver's timeout, µs: 38 ms in the
/// HC-SR04's datasheet, 32 ms in the driver.
const GIVES_UP_AFTER: u64 = 6_000;

pub fn run(
    simulation: &Simulation,
    seed: u64,
    recorder: &mut impl Recorder,
    computer: &mut impl Computer,
) -> Result<RunResult, SimulationError> {
    let encoders = Default::default();
    let (mut hardware, mut start) = SimulatedHardware::new(simulation, seed, &encoders)?;
    loop {
        // The state at power-on.
        let wires = Wires::default();
        let now = Instant::from_ticks(hardware.now);
        let (mut controller, actuators) = computer.controller(&wires, start, now)?;
        hardware.obey(actuators);
        recorder.began(controller.localizer()?);
        hardware.score.started(controller.localizer()?, &hardware.plant, recorder);
        let Some(back_at) = hardware.live(&mut controller, recorder)? else {
            return hardware.score.result(controller.localizer()?);
        };
        start = hardware.reboot(back_at, controller.localizer()?);
    }
}

/// The simulated hardware behind the wires.
struct SimulatedHardware<'a> {
    simulation: &'a Simulation,
    encoders: &'a [EncoderWires; 2],
    streams: RandomStreams,
    plant: Plant<'a>,
    discs: [EncoderDisc<'a>; 2],
    servo: ServoPlant,
    /// A commanded bearing that the servo has not started to move to.
    ordered: Option<f64>,
    faults: Faults,
    board: SonarBoard,
    /// Times of the rising and the falling edge of the echo line since the last poll.
    edges: (Option<Instant>, Option<Instant>),
    /// Whether the trigger of the sonar is high.
    is_raised: bool,
    follower: Option<Follower>,
    score: Score<'a>,
    /// Length of the board's pulse without an echo, µs.
    silence: u64,
    /// When the search was recorded last, µs.
    search_recorded_at: u64,
    /// When the robot will be carried, and how far.
    carried: Option<Carried>,
    /// Where the robot will be kidnapped to, and when.
    put_down: &'a [PutDown],
    /// What determines the robot's pose.
    mode: Mode,
    /// The last ping, for the trace.
    measurement: Option<Measurement>,
    /// The gyro, if the robot has one.
    gyro: Option<GyroChip>,
    absolute: Absolute,
    /// Microseconds since the run began.
    now: u64,
}

impl<'a> SimulatedHardware<'a> {
    fn new(
        simulation: &'a Simulation,
        seed: u64,
        encoders: &'a [EncoderWires; 2],
    ) -> Result<(Self, Option<Start>), SimulationError> {
        let scenario = &simulation.scenario;
        let mut streams = RandomStreams::new(seed);
        let plant = simulation.plant();
        let start = simulation.start(&plant.state(), &mut streams.start);
        let score = Score::new(simulation, start, plant.state())?;
        let gyro = simulation.gyro(&mut streams.gyro).zip(scenario.robot.localizer.gyro);
        let gyro = gyro.map(|(gyro, assumed)| GyroChip::new(gyro, &assumed));
        let [right, left] = encoders;
        let [right_tick, left_tick] = devices::ticks(&scenario.robot);
        let hardware = Self {
            simulation,
            encoders,
            streams,
            plant,
            discs: [EncoderDisc::new(right, right_tick), EncoderDisc::new(left, left_tick)],
            servo: ServoPlant::new(devices::servo_model(scenario.hardware.servo)),
            ordered: None,
            faults: Faults::new(&scenario.faults, seed),
            board: SonarBoard::default(),
            edges: (None, None),
            is_raised: false,
            follower: simulation.follower(),
            score,
            silence: devices::listening_time(&scenario.robot) + GIVES_UP_AFTER,
            search_recorded_at: 0,
            carried: simulation.carried,
            put_down: &simulation.put_down,
            mode: Mode::Tracking,
            measurement: None,
            gyro,
            absolute: Absolute::new(scenario.absolute),
            now: 0,
        };
        Ok((hardware, start))
    }

    /// Runs to the end, or until the power fails; then returns when it is back, µs.
    fn live(
        &mut self,
        controller: &mut impl Controller,
        recorder: &mut impl Recorder,
    ) -> Result<Option<u64>, SimulationError> {
        let period = self.simulation.scenario.robot.encoder_period.to_micros();
        let end = self.simulation.end();
        let mut next_poll = self.now;
        loop {
            if let Some(back_at) = self.faults.controller.power_back_at(self.now) {
                return Ok(Some(back_at));
            }
            let mut has_arrived = false;
            while let Some((at, measurement)) = self.absolute.arrived(self.now, self.now) {
                has_arrived = true;
                if !controller.absolute(at, &measurement)? {
                    self.score.refused_absolute();
                }
            }
            let has_failed = self.read_fails();
            if self.now < next_poll && self.edges == (None, None) && !has_arrived {
                recorder.polled(&Report::default(), controller.localizer()?);
                let next = self.next_step(controller);
                self.advance(next);
                continue;
            }
            let sensors = self.sensors(has_failed);
            let (report, actuators) = controller.poll(&sensors)?;
            let localizer = controller.localizer()?;
            recorder.polled(&report, localizer);
            self.obey(actuators);
            self.mode = controller.mode()?;
            self.record(&report, localizer, recorder);
            self.record_search(&report, controller.search(), recorder);
            // A ping may delay a tick, but by less than a period.
            let is_last = report.tick.is_some() && self.now + period > end;
            if is_last || self.now > end + period {
                return Ok(None);
            }
            next_poll = controller.next_poll().ticks();
            let next = self.next_step(controller);
            self.advance(next);
        }
    }

    /// Whether a reading of each encoder fails now.
    fn read_fails(&mut self) -> [bool; 2] {
        let now = self.now;
        self.faults.encoders.each_mut().map(|faults| faults.read_fails(now))
    }

    /// The inputs of the devices since the last poll.
    fn sensors(&mut self, failed: [bool; 2]) -> Sensors {
        let [right, left] = self.encoders;
        let [right, left] = [(right, failed[0]), (left, failed[1])]
            .map(|(wires, has_failed)| wires.counted(has_failed));
        let (rose, fell) = std::mem::take(&mut self.edges);
        let gyro = self.gyro.as_ref().map_or_else(GyroSignal::default, GyroChip::signal);
        Sensors { at: Instant::from_ticks(self.now), right, left, rose, fell, gyro }
    }

    fn time(&self) -> f64 {
        seconds(self.now)
    }

    /// Advances the simulated hardware; its edges interrupt the robot.
    fn advance(&mut self, now: u64) {
        self.now = now;
        if let Some(carried) = self.carried.take_if(|carried| carried.at <= now) {
            self.plant.carry(carried.by);
        }
        let RandomStreams { wheels, slips, .. } = &mut self.streams;
        let travel = self.plant.drive_to(seconds(now), wheels, slips);
        while let Some((next, later)) =
            self.put_down.split_first().filter(|(next, _)| next.at <= now)
        {
            self.plant.put_down(next.pose);
            self.put_down = later;
        }
        self.absolute.measure(now, &self.plant.pose(), &mut self.streams.absolute);
        self.score.rolled(travel);
        if let Some(gyro) = &mut self.gyro {
            gyro.turn(now, &travel, &mut self.faults.gyro, &mut self.streams.gyro);
        }
        let encoders = self.discs.iter_mut().zip(&mut self.faults.encoders);
        for ((disc, faults), metres) in encoders.zip(travel.measured) {
            disc.roll(metres, now, faults);
        }
        let (rose, fell) = self.board.edges(now);
        self.edges = (rose.or(self.edges.0), fell.or(self.edges.1));
        self.turn_servo();
    }

    /// Moves the servo to the commanded bearing unless it is stuck.
    fn turn_servo(&mut self) {
        if let Some(slowness) = self.faults.controller.servo_slowness(self.now)
            && let Some(bearing) = self.ordered.take()
        {
            self.servo.send(seconds(self.now), bearing, slowness);
        }
    }

    /// Restarts after a power failure that ends at `back_at`: the motors stop, and the robot starts
    /// again from its stored pose, with the deviations of its first start and the prior calibration. A robot that can
    /// search starts without a pose: it may have rolled on.
    fn reboot(&mut self, back_at: u64, localizer: &Localizer) -> Option<Start> {
        let Scenario { start, robot, .. } = &self.simulation.scenario;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let start = Start {
            pose: localizer.pose(),
            position_deviation: Metres(start.position as f32),
            heading_deviation: Radians(start.heading as f32),
        };
        self.plant.steer(Command::default());
        self.measurement = None;
        self.edges = (None, None);
        self.advance(back_at);
        (!robot.start.is_unknown()).then_some(start)
    }

    /// Applies the outputs of the loop.
    fn obey(&mut self, actuators: Actuators) {
        if let Some(duty) = actuators.duty {
            self.ordered = Some(devices::bearing(duty, &self.simulation.scenario.robot));
            self.turn_servo();
        }
        self.is_raised = actuators.is_raised;
        if actuators.has_fallen {
            let undisturbed = self.ping();
            let pulse = self.faults.sonar.pulse(self.now, undisturbed, self.silence);
            if !self.faults.sonar.is_dead(self.now) {
                self.board.answer(self.now, pulse);
            }
        }
    }

    /// Sends a ping; returns the length of its echo pulse, µs.
    fn ping(&mut self) -> u64 {
        let Simulation { world, sensor, .. } = self.simulation;
        let latency = seconds(LATENCY);
        let time = self.time() + latency;
        let pose = self.plant.pose_after(latency);
        let sonar_after =
            |after: f64| self.simulation.sonar_at(&self.plant.pose_after(latency + after));
        let direction = angle::wrap(pose.heading + self.servo.bearing(time));
        let ping = Ping { time, sonar_after: &sonar_after, direction };
        let RandomStreams { ranges, echoes, .. } = &mut self.streams;
        let echo = world.echo(&ping, sensor, ranges, echoes);
        self.measurement = Some(Measurement {
            time,
            sonar: sonar_after(0.0),
            heading: pose.heading,
            range: None,
            source: echo.map(|echo| echo.source),
        });
        let flight = |range: f64| micros(2.0 * range.max(0.0) / world.speed_of_sound());
        echo.map_or(self.silence, |echo| flight(echo.range))
    }

    fn record(&mut self, report: &Report, localizer: &Localizer, recorder: &mut impl Recorder) {
        self.score.faults(report.faults);
        if report.tick.is_some() || report.ping_result.is_some() || report.swept.is_some() {
            self.score.arrive(self.plant.state());
        }
        for result in report.absolutes() {
            self.score.absolute(&result.measurement, &result.fix);
        }
        if let Some(heard) = &report.ping_result {
            self.record_fix(heard, localizer, recorder);
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
                let measurement =
                    Measurement { time: self.time(), sonar, heading, range: None, source: None };
                observe::no_aim_record(measurement, no_aim)
            });
        }
    }

    /// Records the search twice a second, and at every change of the mode.
    fn record_search(
        &mut self,
        report: &Report,
        search: Option<&Search>,
        recorder: &mut impl Recorder,
    ) {
        const PERIOD: u64 = 500_000;
        let is_due = report.mode.is_some() || self.now >= self.search_recorded_at + PERIOD;
        let Some(search) = search.filter(|_| is_due && self.mode != Mode::Tracking) else {
            return;
        };
        self.search_recorded_at = self.now;
        let is_provisional = self.mode == Mode::Provisional;
        recorder.search(|| observe::search_record(self.time(), is_provisional, search));
    }

    fn record_fix(
        &mut self,
        heard: &PingResult,
        localizer: &Localizer,
        recorder: &mut impl Recorder,
    ) {
        let (Some(measurement), Some(fix)) = (self.measurement.take(), &heard.fix) else {
            return;
        };
        self.score.fix(&heard.aim, fix);
        let range = heard.outcome.ok().map(|echo| echo.range.0.into());
        let measurement = Measurement { range, ..measurement };
        recorder.fix(|| observe::fix_record(measurement, &heard.aim, fix, localizer));
    }

    /// Steers by the estimate. While the robot has none, a person steers it along the path. The wheels stand while the
    /// motor policy of the robot disables the motors; the link is never lost.
    fn steer(&mut self, localizer: &Localizer) {
        let now = Instant::from_ticks(self.now);
        let motors = &self.simulation.scenario.robot.motors;
        if let Some(follower) = &mut self.follower {
            if !motors.permits(localizer, now, now) {
                self.plant.steer(Command::default());
                return;
            }
            let pose = match self.mode {
                Mode::Searching => self.plant.pose(),
                _ => observe::estimate(localizer).pose,
            };
            let command = follower.command(&pose);
            self.plant.steer(command);
        }
    }

    /// Time of the next step of the simulated hardware: the next deadline of the loop; while it listens, the next interrupt or
    /// [`LISTEN_STEP`].
    fn next_step(&mut self, controller: &mut impl Controller) -> u64 {
        let at = match controller.idle_until() {
            Some(idle_until) => idle_until.ticks(),
            None if self.is_raised => self.now + TRIGGER,
            None => {
                let edge = self.board.next_edge().unwrap_or(u64::MAX);
                edge.min(self.now + LISTEN_STEP)
            }
        };
        let at = match self.mode {
            Mode::Tracking => at,
            _ => at.min(self.now + SEARCH_POLL),
        };
        let at = at.min(self.absolute.next(self.now));
        self.faults.controller.poll_at(self.now, at.max(self.now + 1))
    }
}
