//! A run that passes travel and ranges directly and on time to the localizer.

use sonarfix::aim::Aim;
use sonarfix::config::RangerId;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::sensor::gyro::MeasuredTurn;
use sonarfix_map::servo::{bearing_of, width_of};

use super::computer::{Computer, LocalizerInputs};
use super::error::SimulationError;
use super::score::Score;
use super::simulation::Simulation;
use super::streams::RandomStreams;
use crate::angle;
use crate::observe::{self, Measurement};
use crate::plant::absolute::Absolute;
use crate::plant::follower::Follower;
use crate::plant::gyro::Gyro;
use crate::plant::{Plant, Travel};
use crate::statistics::RunResult;
use crate::time::seconds;
use crate::trace::Recorder;
use crate::world::segment::Point;
use crate::world::sensor::SensorModel;
use crate::world::{Echo, Ping};

pub fn run(
    simulation: &Simulation,
    seed: u64,
    recorder: &mut impl Recorder,
    computer: &mut impl Computer,
) -> Result<RunResult, SimulationError> {
    let mut streams = RandomStreams::new(seed);
    let plant = simulation.plant();
    let start = simulation.start(&plant.state(), &mut streams.start);
    let start = start.ok_or(SimulationError::NoPose)?;
    let localizer = computer.localizer(start, Instant::from_ticks(0))?;
    let score = Score::new(simulation, Some(start), plant.state())?;
    // At this fidelity the time of flight is zero.
    let sensor = SensorModel { scale: simulation.range_scale, ..simulation.sensor.clone() };
    let follower = simulation.follower();
    let gyro = simulation.gyro(&mut streams.gyro);
    let mut run = Run {
        simulation,
        sensor,
        streams,
        plant,
        localizer,
        follower,
        score,
        gyro,
        absolute: Absolute::new(simulation.scenario.absolute),
        rolled: Travel::default(),
        turned: 0.0,
        passed: 0,
        now: 0,
    };
    let tick_period = simulation.scenario.robot.encoder_period.to_micros();
    let fix_period = simulation.ideal_period().to_micros();
    let (mut next_tick, mut next_fix) = (tick_period, fix_period);
    run.score.started(run.localizer.localizer()?, &run.plant, recorder);
    while next_tick.min(next_fix) <= simulation.end() {
        let now = next_tick.min(next_fix);
        while run.absolute.next(run.now) < now {
            run.drive_plant_to(run.absolute.next(run.now));
            run.take_absolutes(recorder)?;
        }
        run.drive_to(now, recorder)?;
        if now == next_fix {
            run.take_fix(recorder)?;
            next_fix += fix_period;
        }
        if now == next_tick {
            run.end_tick(recorder)?;
            next_tick += tick_period;
        }
    }
    run.score.result(run.localizer.localizer()?)
}

/// A run in progress.
struct Run<'a, T> {
    simulation: &'a Simulation,
    /// The scenario's sonar, with the range error of the speed of sound as a scale error.
    sensor: SensorModel,
    streams: RandomStreams,
    plant: Plant<'a>,
    localizer: T,
    follower: Option<Follower>,
    score: Score<'a>,
    gyro: Option<Gyro>,
    absolute: Absolute,
    /// Travel since the last wheel travel that was passed to the localizer, the turn by the gyro, and its time, µs.
    rolled: Travel,
    turned: f64,
    passed: u64,
    /// Microseconds since the run began.
    now: u64,
}

impl<T: LocalizerInputs> Run<'_, T> {
    fn time(&self) -> f64 {
        seconds(self.now)
    }

    /// Drives on; what is measured from outside is measured at the end.
    fn drive_plant_to(&mut self, now: u64) {
        self.now = now;
        let RandomStreams { wheels, slips, gyro, absolute, .. } = &mut self.streams;
        let travel = self.plant.drive_to(seconds(now), wheels, slips);
        if let Some(measured) = &mut self.gyro {
            self.turned += measured.integral(travel.turn, travel.seconds, gyro);
        }
        self.rolled = self.rolled.plus(&travel);
        self.absolute.measure(now, &self.plant.pose(), absolute);
    }

    fn drive_to(&mut self, now: u64, recorder: &mut impl Recorder) -> Result<(), SimulationError> {
        self.drive_plant_to(now);
        let time = seconds(now);
        let (travel, turned) = (std::mem::take(&mut self.rolled), std::mem::take(&mut self.turned));
        let elapsed = Duration::from_ticks(now - std::mem::replace(&mut self.passed, now));
        let turn = self.gyro.is_some().then(|| {
            #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
            let angle = Radians(turned as f32);
            MeasuredTurn { angle, duration: elapsed }
        });
        self.score.rolled(travel);
        self.score.arrive(self.plant.state());
        #[expect(clippy::cast_possible_truncation, reason = "the robot counts in f32")]
        let [right, left] = travel.measured.map(|metres| metres as f32);
        self.localizer
            .odometry(Instant::from_ticks(now), WheelTravel::new(right, left), turn)?
            .map_err(|error| SimulationError::Odometry { time, error })?;
        self.take_absolutes(recorder)
    }

    /// Passes what has arrived and was measured up to the time of the localizer.
    fn take_absolutes(&mut self, recorder: &mut impl Recorder) -> Result<(), SimulationError> {
        while let Some((at, measurement)) = self.absolute.arrived(self.now, self.passed) {
            let fix = self.localizer.absolute(at, &measurement)?;
            self.score.absolute(at, &measurement, &fix, recorder);
        }
        Ok(())
    }

    fn take_fix(&mut self, recorder: &mut impl Recorder) -> Result<(), SimulationError> {
        let truth = self.plant.pose();
        let sonar = self.simulation.sonar_at(&truth);
        let mut measurement = Measurement {
            time: self.time(),
            sonar,
            heading: truth.heading,
            range: None,
            source: None,
        };
        let aim = match self.localizer.aim()? {
            Ok(aim) => aim,
            Err(no_aim) => {
                self.localizer.skip()?;
                self.score.no_aim();
                recorder.fix(|| observe::no_aim_record(measurement, no_aim));
                return Ok(());
            }
        };
        measurement.sonar = self.simulation.ranger_at(aim.ranger, &truth);
        let echo = self.ping(measurement.sonar, truth.heading, &aim);
        measurement.range = echo.map(|echo| echo.range);
        measurement.source = echo.map(|echo| echo.source);
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let fix = self.localizer.fix(&aim, measurement.range.map(|range| Metres(range as f32)))?;
        self.score.fix(&aim, &fix);
        let localizer = self.localizer.localizer()?;
        recorder.fix(|| observe::fix_record(measurement, &aim, &fix, localizer));
        Ok(())
    }

    fn ping(&mut self, from: Point, heading: f64, aim: &Aim) -> Option<Echo> {
        let ping = Ping {
            time: self.time(),
            sonar_after: &|_| from,
            direction: angle::wrap(heading + self.bearing(aim)),
        };
        let RandomStreams { ranges, echoes, .. } = &mut self.streams;
        self.simulation.world.echo(&ping, &self.sensor, ranges, echoes)
    }

    /// The true bearing of a ping.
    fn bearing(&self, aim: &Aim) -> f64 {
        let Simulation { scenario, built, .. } = self.simulation;
        let commanded = f64::from(aim.bearing.0);
        let [driver, servo] =
            [&scenario.robot, built].map(|robot| robot.rangers.first.servo_pulses);
        if aim.ranger == RangerId::FIRST && servo != driver {
            bearing_of(servo, width_of(driver, commanded))
        } else {
            commanded
        }
    }

    fn end_tick(&mut self, recorder: &mut impl Recorder) -> Result<(), SimulationError> {
        let localizer = self.localizer.localizer()?;
        self.score.biased(self.gyro.as_ref().map(Gyro::bias));
        self.score.tick(self.time(), localizer, &self.plant, recorder);
        if let Some(follower) = &mut self.follower {
            let command = follower.command(&observe::pose(localizer));
            self.plant.steer(command);
        }
        Ok(())
    }
}
