//! A sonar with its board and its servo, on the world's side of the wires.

use sonarfix::config::{RangerId, RangerParameters};
use sonarfix_hal::config::{RangerConfig, RobotConfig};
use sonarfix_map::ServoName;
use sonarfix_pil::{EchoSignals, RangerActuators};

use super::board::{LATENCY, SonarBoard};
use super::devices;
use super::light::LightChip;
use crate::plant::servo::ServoPlant;
use crate::time::{micros, seconds};

/// By how much the pulse of a board without an echo exceeds the driver's timeout, µs: 38 ms in the
/// HC-SR04's datasheet, 32 ms in the driver.
const GIVES_UP_AFTER: u64 = 6_000;

/// A sonar.
#[derive(Debug)]
pub struct SonarDevice<'a> {
    /// Which one.
    pub ranger: RangerId,
    sonar: &'a RangerParameters,
    driver: &'a RangerConfig,
    servo: ServoPlant,
    /// A commanded bearing that the servo has not started to move to.
    ordered: Option<f64>,
    board: SonarBoard,
    /// The bus of a time-of-flight ranger.
    pub light: LightChip,
    /// The edges of the echo line since the last poll, and what the bus reads.
    signals: EchoSignals,
    /// Whether the trigger is high.
    pub is_raised: bool,
    /// Length of the board's pulse without an echo, µs.
    pub silence: u64,
}

impl<'a> SonarDevice<'a> {
    /// All sonars of a robot, on servos of this name or fixed.
    #[must_use]
    pub fn all(robot: &'a RobotConfig, name: ServoName) -> Vec<Self> {
        let rangers = robot.localizer.rangers.iter().filter_map(|(ranger, _)| {
            let (sonar, driver) = robot.ranger_of(ranger)?;
            Some(Self {
                ranger,
                sonar,
                driver,
                servo: devices::servo(sonar, name),
                ordered: None,
                board: SonarBoard::default(),
                light: LightChip::of(driver.kind),
                signals: EchoSignals::default(),
                is_raised: false,
                silence: devices::listening_time(driver) + GIVES_UP_AFTER,
            })
        });
        rangers.collect()
    }

    /// Takes the outputs of the loop; returns whether the trigger has fallen, which starts a ping.
    pub fn obey(&mut self, actuators: RangerActuators) -> bool {
        if let Some(duty) = actuators.duty {
            self.ordered = Some(devices::bearing(duty, self.sonar, self.driver));
        }
        self.is_raised = actuators.is_raised;
        actuators.has_fallen
    }

    /// Moves the servo to the commanded bearing at a time in µs, in `slowness` times the nominal time.
    pub fn turn(&mut self, now: u64, slowness: f64) {
        if let Some(bearing) = self.ordered.take() {
            self.servo.send(seconds(now), bearing, slowness);
        }
    }

    /// The bearing of the sonar, at a time in seconds.
    #[must_use]
    pub fn bearing(&self, time: f64) -> f64 {
        self.servo.bearing(time)
    }

    /// Handles a trigger that fell at `now`, µs.
    pub fn answer(&mut self, now: u64, pulse: u64) {
        self.board.answer(now, pulse);
    }

    /// Collects the edges of the echo line up to `now`, µs.
    pub fn collect_edges(&mut self, now: u64) {
        let (rose, fell) = self.board.edges(now);
        if rose.is_some() {
            self.signals.rose = rose;
        }
        if fell.is_some() {
            self.signals.fell = fell;
        }
    }

    /// Reads the bus at `now`, µs, of a ranger that responds or does not.
    pub fn read_bus(&mut self, now: u64, is_dead: bool) {
        self.signals.light = self.light.signal(now, is_dead);
    }

    /// Forgets the edges that no poll has taken.
    pub fn forget_edges(&mut self) {
        self.signals = EchoSignals::default();
    }

    /// Takes the signals since the last poll.
    pub fn take_signals(&mut self) -> EchoSignals {
        std::mem::take(&mut self.signals)
    }

    /// Whether there are edges since the last poll.
    #[must_use]
    pub fn has_edges(&self) -> bool {
        self.signals.rose.is_some() || self.signals.fell.is_some()
    }

    /// When an edge comes next, or something happens in a time-of-flight ranger, after `now`, µs.
    #[must_use]
    pub fn next_event(&self, now: u64) -> Option<u64> {
        let light = self.light.next().filter(|&at| at > now);
        self.board.next_edge().into_iter().chain(light).min()
    }
}

/// Cross-talk between the ping that one sonar sends at a trigger at `now`, µs, and those of the others that are in flight: each hears
/// what arrives first, the burst of the other one over the distance between them, or the echo of the other. Returns the pulse of the new
/// ping, of which `pulse` is the undisturbed one.
pub fn cross_talk(
    sender: RangerId,
    others: &mut [SonarDevice<'_>],
    now: u64,
    pulse: u64,
    speed_of_sound: f64,
) -> u64 {
    let sent = now + LATENCY;
    let Some(from) = others.iter().find(|other| other.ranger == sender) else { return pulse };
    let from = from.sonar;
    let mut pulse = pulse;
    for other in others.iter_mut().filter(|other| other.ranger != sender) {
        if !(from.hears(other.sonar) && other.sonar.hears(from)) {
            continue;
        }
        let Some(falls) = other.board.falls_at().filter(|falls| *falls > sent) else { continue };
        let apart =
            (from.mount.x.0 - other.sonar.mount.x.0, from.mount.y.0 - other.sonar.mount.y.0);
        let apart = libm::hypot(apart.0.into(), apart.1.into());
        pulse = pulse.min(falls - sent);
        other.board.ends_by(sent + micros(apart / speed_of_sound));
    }
    pulse
}

#[cfg(test)]
mod tests {
    use sonarfix_map::{CLASSROOM, Scenario};

    use super::*;

    /// Two sonars, 20 cm apart.
    fn robot() -> RobotConfig {
        let mut robot = Scenario::parse(CLASSROOM, "classroom.toml", "".as_ref()).unwrap().robot;
        let mut other = robot.localizer.rangers.first;
        other.mount.y.0 += 0.2;
        robot.localizer.rangers.push(other).unwrap();
        robot.rangers.push(robot.rangers.first).unwrap();
        robot
    }

    /// A ping while another one is in flight: the first hears the burst of the second, the second the echo of the first.
    #[test]
    fn overlapping_pings_disturb_each_other() {
        let robot = robot();
        let mut sonars = SonarDevice::all(&robot, ServoName::Ideal);
        let [first, second] = [RangerId(0), RangerId(1)];
        assert_eq!(cross_talk(first, &mut sonars, 0, 10_000, 340.0), 10_000);
        sonars[0].answer(0, 10_000);
        // The echo of the first falls at 10,460; the second has sent at 5,460.
        assert_eq!(cross_talk(second, &mut sonars, 5_000, 9_000, 340.0), 5_000);
        sonars[0].collect_edges(20_000);
        let fell = sonars[0].take_signals().fell.unwrap().ticks();
        assert!((5_460 + 587..=5_460 + 589).contains(&fell), "{fell}");
    }

    /// After the echo of the first there is nothing to hear, and light hears nothing.
    #[test]
    fn pings_that_do_not_overlap_are_undisturbed() {
        let mut robot = robot();
        {
            let mut sonars = SonarDevice::all(&robot, ServoName::Ideal);
            sonars[0].answer(0, 10_000);
            assert_eq!(cross_talk(RangerId(1), &mut sonars, 10_000, 9_000, 340.0), 9_000);
        }
        robot.localizer.rangers.first.ranging =
            sonarfix::config::Ranging::Light(sonarfix::config::LightBeam::VL53L1X);
        let mut sonars = SonarDevice::all(&robot, ServoName::Ideal);
        sonars[0].answer(0, 10_000);
        assert_eq!(cross_talk(RangerId(1), &mut sonars, 5_000, 9_000, 340.0), 9_000);
    }
}
