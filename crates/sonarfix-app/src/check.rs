//! The check of the devices while the loop does not run. The running loop only detects faults of devices that it uses.

use sonarfix::geometry::units::{Duration, Instant, Radians};
use sonarfix_hal::config::{RobotConfig, WheelConfig};
use sonarfix_hal::encoder::Counter;
use sonarfix_hal::ranger::{NoEcho, Outcome, Ranger, TriggerError};
use sonarfix_hal::robot::{EncoderFaults, Faults, Hardware, PACE};
use sonarfix_hal::servo::PointError;
use sonarfix_link::message::{DeviceReadings, EncoderReading, ServoReading, Sweep};

use crate::time::after;

/// Period of the checks.
const PERIOD: Duration = Duration::from_ticks(1_000_000);
/// The longest time of a ranger: longer than any driver of `sonarfix-hal` takes.
const TIMEOUT: Duration = Duration::from_ticks(150_000);
/// How long the readings are shown after a command.
const SHOWN_FOR: Duration = Duration::from_ticks(60_000_000);
/// Period of the readings.
const READINGS: Duration = Duration::from_ticks(100_000);
/// Period of the checks while the readings are shown.
const SHOWN_PERIOD: Duration = Duration::from_ticks(200_000);
/// Pause between pings at a bearing that was asked for.
const POINTED_PERIOD: Duration = Duration::from_ticks(50_000);
/// Checks after which the servo turns to the next bearing: two seconds, in which a slow servo arrives and can be seen.
const CHECKS_PER_BEARING: u8 = 8;

/// A check of all devices, once a second: reads both counters, points the servo ahead, pings. Without a configuration
/// the servo is not checked.
///
/// ```text
///            due: count, point, trigger           echo, or no echo        
///   Resting ─────────────────────────▶ Pinging ────────────────────────────▶ Resting
/// ```
///
/// It cannot detect an unplugged quadrature encoder, which reads like a wheel at rest, nor a hobby servo that does not
/// turn, which has no feedback. [`Self::show`] therefore lets a person see them. For a minute the servo points ahead and to
/// both limits, one after the other, or to one bearing; [`Self::readings`] returns what the devices read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Check {
    state: State,
    has_servo_failed: bool,
    /// Since when the ranger refuses a trigger as too soon.
    refused: Option<Instant>,
    /// The result of the last ping.
    ping: Option<Outcome>,
    /// The last ping at a bearing that was asked for.
    pinged: Option<Sweep>,
    shown: Option<Shown>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Resting { until: Instant },
    Pinging { since: Instant },
}

/// The minute in which the readings are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shown {
    until: Instant,
    /// When the next readings are due.
    next: Instant,
    /// Checks since the first bearing.
    checks: u8,
    /// The bearing that was asked for.
    bearing: Option<Radians>,
}

impl Check {
    /// A check that is due at `now`.
    #[must_use]
    pub fn new(now: Instant) -> Self {
        let state = State::Resting { until: now };
        Self {
            state,
            has_servo_failed: false,
            refused: None,
            ping: None,
            pinged: None,
            shown: None,
        }
    }

    /// Shows the readings for a minute from `now` on, with the servo at `bearing`, which it can reach, or in turn ahead and at its
    /// limits.
    pub fn show(&mut self, now: Instant, bearing: Option<Radians>) {
        let (next, checks) = self.shown.map_or((now, 0), |shown| (shown.next, shown.checks));
        self.shown = Some(Shown { until: after(now, SHOWN_FOR), next, checks, bearing });
    }

    /// Handles what is due; returns the faults that were found.
    pub fn poll(
        &mut self,
        now: Instant,
        config: Option<&RobotConfig>,
        hardware: &mut impl Hardware,
    ) -> Faults {
        let mut faults = Faults::default();
        match self.state {
            State::Resting { until } if now < until => {}
            State::Resting { .. } => {
                count(hardware, &mut faults);
                let bearing = config.map_or(Radians(0.0), |config| self.next_bearing(config));
                self.has_servo_failed = has_servo_failed(now, bearing, hardware);
                faults.servo = u32::from(self.has_servo_failed);
                match self.settles_at(hardware).filter(|&at| at > now) {
                    Some(until) => self.state = State::Resting { until },
                    None => self.trigger(now, hardware, &mut faults),
                }
            }
            State::Pinging { since } => self.listen(now, since, hardware, &mut faults),
        }
        faults
    }

    /// The last ping at a bearing that was asked for, once.
    pub fn take_ping(&mut self) -> Option<Sweep> {
        self.pinged.take()
    }

    /// When it must be polled next after a poll at `now`, if no edge of the echo is stamped earlier.
    pub(crate) fn next_poll(&self, now: Instant, hardware: &mut impl Hardware) -> Instant {
        let check = match self.state {
            State::Resting { until } => until,
            State::Pinging { since } => {
                let outcome = hardware.ranger().poll_at().filter(|&at| at > now);
                outcome.unwrap_or(after(now, PACE)).min(after(since, TIMEOUT))
            }
        };
        self.shown.map_or(check, |shown| check.min(shown.next))
    }

    /// What the devices read, when that is due to be shown.
    pub fn readings(
        &mut self,
        now: Instant,
        config: Option<&RobotConfig>,
        hardware: &mut impl Hardware,
    ) -> Option<DeviceReadings> {
        self.shown = self.shown.filter(|shown| now < shown.until);
        let shown = self.shown.as_mut().filter(|shown| now >= shown.next)?;
        shown.next = after(now, READINGS);
        let [right, left] =
            [config.map(|config| &config.right_wheel), config.map(|config| &config.left_wheel)];
        Some(DeviceReadings {
            at: now,
            right: encoder(hardware.right(), right),
            left: encoder(hardware.left(), left),
            servo: if self.has_servo_failed { None } else { servo(hardware) },
            ping: self.ping,
        })
    }

    /// The bearing that was asked for.
    fn asked(&self) -> Option<Radians> {
        self.shown.and_then(|shown| shown.bearing)
    }

    /// When a ping at a bearing that was asked for may begin; other pings do not wait for the servo.
    fn settles_at(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        let servo = hardware.servo();
        self.asked().and(servo.target()).map(|_| servo.settles_at())
    }

    /// Ahead; while the readings are shown, the bearing that was asked for, or ahead, to the right, ahead and to the left in
    /// turn.
    fn next_bearing(&mut self, config: &RobotConfig) -> Radians {
        if let Some(bearing) = self.asked() {
            return bearing;
        }
        let Some(shown) = &mut self.shown else { return Radians(0.0) };
        let turn = shown.checks / CHECKS_PER_BEARING;
        shown.checks = (shown.checks + 1) % (4 * CHECKS_PER_BEARING);
        let (rightmost, leftmost) = config.localizer.rangers.first.servo;
        match turn {
            1 => rightmost,
            3 => leftmost,
            _ => Radians(0.0),
        }
    }

    fn trigger(&mut self, now: Instant, hardware: &mut impl Hardware, faults: &mut Faults) {
        match hardware.ranger().trigger(now) {
            Ok(()) => {
                self.refused = None;
                self.state = State::Pinging { since: now };
            }
            // The echoes of the loop's last ping have not decayed, or the ranger is being set up.
            Err(TriggerError::TooSoon)
                if now < after(*self.refused.get_or_insert(now), TIMEOUT) =>
            {
                let until = after(now, PACE).max(hardware.ranger().ready_at());
                self.state = State::Resting { until };
            }
            Err(_) => self.end(now, Err(NoEcho::Failed), faults),
        }
    }

    fn listen(
        &mut self,
        now: Instant,
        since: Instant,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
    ) {
        match hardware.ranger().poll(now) {
            Ok(Some(outcome)) => {
                self.end(now, outcome, faults);
                let bearing = self.asked().and(hardware.servo().target());
                self.pinged = bearing.map(|bearing| Sweep { at: now, bearing, outcome });
            }
            Ok(None) if now < after(since, TIMEOUT) => {}
            Ok(None) | Err(_) => self.end(now, Err(NoEcho::Failed), faults),
        }
    }

    fn end(&mut self, now: Instant, outcome: Outcome, faults: &mut Faults) {
        faults.ranger = u32::from(outcome.is_err_and(NoEcho::is_fault));
        self.refused = None;
        self.ping = Some(outcome);
        let period = match self.shown {
            Some(Shown { bearing: Some(_), .. }) => POINTED_PERIOD,
            Some(_) => SHOWN_PERIOD,
            None => PERIOD,
        };
        self.state = State::Resting { until: after(now, period) };
    }
}

fn count(hardware: &mut impl Hardware, faults: &mut Faults) {
    let fault = |has_failed| EncoderFaults { errors: u32::from(has_failed), illegal: 0 };
    faults.right = fault(hardware.right().count().is_err());
    faults.left = fault(hardware.left().count().is_err());
}

fn has_servo_failed(now: Instant, bearing: Radians, hardware: &mut impl Hardware) -> bool {
    // A servo whose limits exclude straight ahead has not failed.
    matches!(hardware.servo().point(now, bearing), Err(PointError::Pwm(_)))
}

fn encoder<C: Counter>(counter: &mut C, wheel: Option<&WheelConfig>) -> EncoderReading {
    let metres_per_edge = wheel.map_or(0.0, |wheel| {
        let travel = wheel.travel_per_edge.0;
        if wheel.is_mirrored { -travel } else { travel }
    });
    EncoderReading {
        count: counter.count().ok(),
        bits: u8::try_from(C::BITS).unwrap_or(u8::MAX),
        illegal: counter.illegal(),
        metres_per_edge,
    }
}

fn servo(hardware: &mut impl Hardware) -> Option<ServoReading> {
    let servo = hardware.servo();
    Some(ServoReading { bearing: servo.target()?, micros: servo.pulse().unwrap_or(0.0) })
}
