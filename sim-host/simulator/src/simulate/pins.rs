//! A run through pins, drivers and the shipped loop, as a discrete-event simulation.

pub mod hardware;

use sonarfix::config::{MAX_RANGERS, RangerId};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix_hal::robot::{PingResult, Report};
use sonarfix_map::Scenario;
use sonarfix_pil::{Actuators, EchoSignals, GyroSignal, Sensors, Wires};
use sonarfix_search::navigator::Mode;
use sonarfix_search::search::Search;

use super::computer::{Computer, Controller};
use super::error::SimulationError;
use super::score::Score;
use super::simulation::{Carried, PutDown, Simulation, Slipped};
use super::streams::RandomStreams;
use crate::angle;
use crate::observe::{self, Measurement};
use crate::pins::board::LATENCY;
use crate::pins::devices;
use crate::pins::disc::EncoderDisc;
use crate::pins::faults::Faults;
use crate::pins::gyro::GyroChip;
use crate::pins::sonar::{SonarDevice, cross_talk};
use crate::pins::wires::EncoderWires;
use crate::plant::Plant;
use crate::plant::absolute::Absolute;
use crate::plant::follower::{Command, Follower};
use crate::statistics::RunResult;
use crate::time::{micros, seconds};
use crate::trace::Recorder;
use crate::world::{Echo, Ping};

/// Step of the simulated hardware while a ping is in flight, µs: by up to this much a ping without an echo ends later than on a
/// board.
const LISTEN_STEP: u64 = 1_000;
/// Poll period of a robot that searches for its pose, µs.
const SEARCH_POLL: u64 = 1_000;
/// Length of the trigger pulse, µs: the driver's minimum.
const TRIGGER: u64 = 10;
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
    sonars: Vec<SonarDevice<'a>>,
    faults: Faults,
    follower: Option<Follower>,
    score: Score<'a>,
    /// When the search was recorded last, µs.
    search_recorded_at: u64,
    /// When the robot will be carried, and how far.
    carried: Option<Carried>,
    /// When a wheel will slip, and how far.
    slipped: Option<Slipped>,
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
            sonars: SonarDevice::all(&simulation.built, scenario.hardware.servo),
            faults: Faults::new(&scenario.faults, seed),
            follower: simulation.follower(),
            score,
            search_recorded_at: 0,
            carried: simulation.carried,
            slipped: simulation.slipped,
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
        let mut report = Report::default();
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
            if self.now < next_poll && !self.has_edges() && !has_arrived {
                recorder.polled(&Report::default(), controller.localizer()?);
                let next = self.next_step(controller.idle_until());
                self.advance(next);
                continue;
            }
            let sensors = self.sensors(has_failed);
            let actuators = controller.poll(&sensors, &mut report)?;
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
            let next = self.next_step(controller.idle_until());
            self.advance(next);
        }
    }

    /// Whether a reading of each encoder fails now.
    fn read_fails(&mut self) -> [bool; 2] {
        let now = self.now;
        let [right, left] = &mut self.faults.encoders;
        [right.read_fails(now), left.read_fails(now)]
    }

    /// The inputs of the devices since the last poll.
    fn sensors(&mut self, failed: [bool; 2]) -> Sensors {
        let [right, left] = self.encoders;
        let [right, left] = [(right, failed[0]), (left, failed[1])]
            .map(|(wires, has_failed)| wires.counted(has_failed));
        let gyro = self.gyro.as_ref().map_or_else(GyroSignal::default, GyroChip::signal);
        let mut echoes = [EchoSignals::default(); MAX_RANGERS];
        for (signals, sonar) in echoes.iter_mut().zip(&mut self.sonars) {
            let is_dead = sonar.ranger == RangerId::FIRST && self.faults.sonar.is_dead(self.now);
            sonar.read_bus(self.now, is_dead);
            *signals = sonar.take_signals();
        }
        Sensors { at: Instant::from_ticks(self.now), right, left, echoes, gyro }
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
        if let Some(slipped) = self.slipped.take_if(|slipped| slipped.at <= now) {
            self.plant.begin_slip(slipped.wheel, slipped.turn);
        }
        let RandomStreams { wheels, slips, .. } = &mut self.streams;
        let travel = self.plant.drive_to(seconds(now), wheels, slips);
        while let Some((next, later)) =
            self.put_down.split_first().filter(|(next, _)| next.at <= now)
        {
            self.plant.put_down(next.pose);
            self.put_down = later;
        }
        if self.absolute.is_due(now) {
            self.absolute.measure(now, &self.plant.pose(), &mut self.streams.absolute);
        }
        self.score.rolled(travel);
        if let Some(gyro) = &mut self.gyro {
            gyro.turn(now, &travel, &mut self.faults.gyro, &mut self.streams.gyro);
        }
        let encoders = self.discs.iter_mut().zip(&mut self.faults.encoders);
        for ((disc, faults), metres) in encoders.zip(travel.measured) {
            disc.roll(metres, now, faults);
        }
        for sonar in &mut self.sonars {
            sonar.collect_edges(now);
        }
        self.turn_servos();
        for number in 0..self.sonars.len() {
            self.collect_light(number);
        }
    }

    /// Whether an echo line has had an edge since the last poll.
    fn has_edges(&self) -> bool {
        self.sonars.iter().any(SonarDevice::has_edges)
    }

    /// Moves the servos to the commanded bearings, the first unless it is stuck.
    fn turn_servos(&mut self) {
        let mut slowness = self.faults.controller.servo_slowness(self.now);
        for sonar in &mut self.sonars {
            if let Some(slowness) = slowness {
                sonar.turn(self.now, slowness);
            }
            slowness = Some(1.0);
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
        self.sonars.iter_mut().for_each(SonarDevice::forget_edges);
        self.advance(back_at);
        (!robot.start.is_unknown()).then_some(start)
    }

    /// Applies the outputs of the loop.
    fn obey(&mut self, actuators: Actuators) {
        let mut has_pinged = [false; MAX_RANGERS];
        let sonars = self.sonars.iter_mut().zip(&actuators.rangers);
        for ((sonar, actuators), has_pinged) in sonars.zip(&mut has_pinged) {
            *has_pinged = sonar.obey(*actuators);
        }
        self.turn_servos();
        for (number, has_pinged) in has_pinged.iter().enumerate() {
            if *has_pinged {
                self.trigger(number);
            }
        }
    }

    /// Measures in the middle of the light of a time-of-flight ranger.
    fn collect_light(&mut self, number: usize) {
        let now = self.now;
        let Some(sonar) = self.sonars.get_mut(number) else { return };
        if !sonar.light.is_due(now) {
            return;
        }
        let is_first = sonar.ranger == RangerId::FIRST;
        let range = self.ping(number, 0).map(|echo| echo.range);
        let is_lost = is_first && self.faults.sonar.pulse(now, 1, u64::MAX) == u64::MAX;
        if let Some(sonar) = self.sonars.get_mut(number) {
            sonar.light.measured(range.filter(|_| !is_lost));
        }
    }

    /// Handles the trigger of a ranger. The faults of a sonar are those of the first.
    fn trigger(&mut self, number: usize) {
        let now = self.now;
        let Some(sonar) = self.sonars.get_mut(number) else { return };
        if self.simulation.sensor.light.is_some() {
            sonar.light.start(now);
            return;
        }
        let (ranger, silence) = (sonar.ranger, sonar.silence);
        let speed_of_sound = self.simulation.world.speed_of_sound();
        let flight = |echo: Echo| micros(2.0 * echo.range.max(0.0) / speed_of_sound);
        let mut pulse = self.ping(number, LATENCY).map_or(silence, flight);
        if ranger == RangerId::FIRST {
            pulse = self.faults.sonar.pulse(now, pulse, silence);
            if self.faults.sonar.is_dead(now) {
                return;
            }
        }
        let pulse = cross_talk(ranger, &mut self.sonars, self.now, pulse, speed_of_sound);
        if let Some(sonar) = self.sonars.get_mut(number) {
            sonar.answer(self.now, pulse);
        }
    }

    /// Sends a ping so many µs from now.
    fn ping(&mut self, number: usize, latency: u64) -> Option<Echo> {
        let Simulation { world, sensor, .. } = self.simulation;
        let device = self.sonars.get(number)?;
        let latency = seconds(latency);
        let time = self.time() + latency;
        let pose = self.plant.pose_after(latency);
        let sonar_after = |after: f64| {
            self.simulation.ranger_at(device.ranger, &self.plant.pose_after(latency + after))
        };
        let direction = angle::wrap(pose.heading + device.bearing(time));
        let ping = Ping { time, sonar_after: &sonar_after, direction };
        let RandomStreams { ranges, echoes, .. } = &mut self.streams;
        let echo = world.echo(&ping, sensor, ranges, echoes);
        self.measurement = Some(Measurement {
            time,
            sonar: self.simulation.ranger_at(device.ranger, &pose),
            heading: pose.heading,
            range: None,
            source: echo.map(|echo| echo.source),
        });
        echo
    }

    fn record(&mut self, report: &Report, localizer: &Localizer, recorder: &mut impl Recorder) {
        self.score.faults(report.faults);
        let has_heard = report.reached.is_some() || report.ping_result.is_some();
        if report.tick.is_some() || has_heard || report.swept.is_some() {
            self.score.arrive(self.plant.state());
        }
        if let Some(result) = &report.absolute {
            self.score.absolute(result.measured_at, &result.measurement, &result.fix, recorder);
        }
        if let Some(heard) = &report.ping_result {
            self.record_fix(heard, localizer, recorder);
        }
        if report.tick.is_some() {
            self.score.biased(self.gyro.as_ref().map(GyroChip::bias));
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
                _ => observe::pose(localizer),
            };
            let command = follower.command(&pose);
            self.plant.steer(command);
        }
    }

    /// Time of the next step of the simulated hardware: the next deadline of the loop; while it listens, the next interrupt or
    /// [`LISTEN_STEP`].
    fn next_step(&mut self, idle_until: Option<Instant>) -> u64 {
        let at = match idle_until {
            Some(idle_until) => idle_until.ticks(),
            None if self.sonars.iter().any(|sonar| sonar.is_raised) => self.now + TRIGGER,
            None => {
                let next = |sonar: &SonarDevice| sonar.next_event(self.now);
                let event = self.sonars.iter().filter_map(next).min().unwrap_or(u64::MAX);
                event.min(self.now + LISTEN_STEP)
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
