//! Rangers whose echo pulse is as long as the time of flight.
//!
//! ```text
//!   trigger ──┐▔▔▔▔▔▔▔┌─────────────────────────────────────
//!             │ 10 µs │ burst, 0.2–0.5 ms
//!   echo    ──────────────┐▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔┌─────────────
//!                         │ flight            │
//!                        sent              received
//! ```
//!
//! HC-SR04 (Elecfreaks' datasheet): trigger of at least 10 µs; eight cycles of 40 kHz; the echo
//! line goes up when they are out and down when they are back; 58 µs a centimetre; "over 60 ms
//! measurement cycle"; no echo ends the pulse after 38 ms on paper, after 16–70 ms on real
//! boards; some boards never end it until they are triggered again.
//!
//! LV-MaxSonar-EZ (datasheet PD11832): RX high for at least 20 µs; PW goes up after a burst of
//! thirteen 42 kHz waves and down at the target, 147 µs an inch; 37.5 ms if there is none; 49 ms
//! a reading. The pulse is the flight itself, not compensated for temperature.

use embedded_hal::digital::OutputPin;
use sonarfix::geometry::units::{Duration, Instant};

use super::air::Air;
use super::driver::{Ranger, TriggerError, UnsupportedKind};
use super::echo::{Echo, NoEcho, Outcome};
use super::settings::{PulseTiming, RangerKind, RangerSettings};
use crate::time::{NEVER, after, since};

/// A pulse of the echo line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulse {
    /// When the line went high.
    pub rise: Instant,
    /// When it went low again.
    pub fall: Instant,
}

/// An echo line: [`Polled`](super::Polled) or [`Captured`](super::Captured).
pub trait EchoLine {
    /// The error of a reading.
    type Error: core::fmt::Debug;

    /// Whether an edge wakes the program, so that the line need not be polled for it.
    const WAKES: bool = false;

    /// Whether the line is high.
    ///
    /// # Errors
    /// The pin's.
    fn is_high(&mut self) -> Result<bool, Self::Error>;

    /// Discards earlier edges, and waits for the first pulse that lasts `shortest` or longer. A pulse that began before
    /// this call does not count.
    ///
    /// # Errors
    /// The pin's.
    fn arm(&mut self, shortest: Duration) -> Result<(), Self::Error>;

    /// That pulse, if it has ended.
    ///
    /// # Errors
    /// The pin's.
    fn pulse(&mut self, now: Instant) -> Result<Option<Pulse>, Self::Error>;

    /// Whether the line has gone high since it was armed.
    fn has_risen(&self) -> bool;
}

/// The error of one of the two pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PulseError<T, L> {
    /// The trigger pin's.
    Trigger(T),
    /// The echo line's.
    Echo(L),
}

impl<T: core::fmt::Debug, L: core::fmt::Debug> core::fmt::Display for PulseError<T, L> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Trigger(error) => write!(f, "the trigger pin: {error:?}"),
            Self::Echo(error) => write!(f, "the echo line: {error:?}"),
        }
    }
}

impl<T: core::fmt::Debug, L: core::fmt::Debug> core::error::Error for PulseError<T, L> {}

/// The state of a ping.
///
/// ```text
///          trigger: pin high          poll, 10 µs later: pin low, line armed
///   Idle ───────────────────▶ Raised ──────────────────────────────────────▶ Listening
///    ▲                          │ error                                        │
///    └──────────────────────────┴── pulse, `listen` over, or error ────────────┘
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    Raised,
    Listening,
}

/// A ranger on two pins.
///
/// ```
/// use embedded_hal_mock::eh1::digital::{Mock, State::{High, Low}, Transaction as Pin};
/// use sonarfix::geometry::units::{Instant, Metres};
/// use sonarfix_hal::ranger::{Captured, EchoCapture, PulseRanger, Ranger};
///
/// let mut trigger = Mock::new(&[Pin::set(High), Pin::set(Low)]);
/// let capture = EchoCapture::new();
/// let line = Captured::new(&capture);
/// let mut ranger = PulseRanger::new(&mut trigger, line);
///
/// let at = Instant::from_ticks;
/// ranger.trigger(at(0))?;
/// assert_eq!(ranger.poll(at(10)), Ok(None)); // ends the trigger pulse
/// capture.rose(at(470)); // the interrupt stamps both edges
/// capture.fell(at(6_470));
/// let echo = ranger.poll(at(8_000))?.unwrap()?; // and the loop may come when it likes
/// assert_eq!(echo.reflected(), at(3_470));
/// assert!((echo.range - Metres(1.030)).abs() < Metres(0.001));
/// # drop(ranger);
/// # trigger.done();
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct PulseRanger<T, L> {
    trigger: T,
    line: L,
    timing: PulseTiming,
    /// Least time from ping to ping.
    cycle: Duration,
    air: Air,
    state: State,
    /// The last edge of the trigger pin; the module starts at its falling edge.
    triggered: Option<Instant>,
}

impl<T: OutputPin, L: EchoLine> PulseRanger<T, L> {
    /// A ranger whose trigger pin is low. Until it is [configured](Ranger::configure), it has the timing of an HC-SR04 at
    /// room temperature.
    #[must_use]
    pub fn new(trigger: T, line: L) -> Self {
        let RangerSettings { cycle, air, .. } = RangerSettings::HC_SR04;
        let timing = PulseTiming::HC_SR04;
        Self { trigger, line, timing, cycle, air, state: State::Idle, triggered: None }
    }

    /// Sets the air after a change of temperature.
    pub fn set_air(&mut self, air: Air) {
        self.air = air;
    }

    /// The timing.
    #[must_use]
    pub fn timing(&self) -> &PulseTiming {
        &self.timing
    }

    /// The echo line, to wait for its edges.
    #[cfg(feature = "async")]
    pub(crate) fn line(&mut self) -> &mut L {
        &mut self.line
    }

    /// Releases pin and line.
    pub fn release(self) -> (T, L) {
        (self.trigger, self.line)
    }

    fn age(&self, now: Instant) -> Duration {
        since(now, self.triggered.unwrap_or(now))
    }

    /// Ends the trigger pulse; the module starts at its falling edge.
    fn lower(&mut self) -> Result<(), PulseError<T::Error, L::Error>> {
        // Armed first, so that no edge of the echo is missed.
        let armed = self.line.arm(self.timing.blanking);
        self.trigger.set_low().map_err(PulseError::Trigger)?;
        armed.map_err(PulseError::Echo)
    }

    fn listen(&mut self, now: Instant) -> Result<Option<Outcome>, L::Error> {
        if let Some(pulse) = self.line.pulse(now)? {
            return Ok(Some(self.outcome_of(pulse)));
        }
        if self.age(now) < self.timing.listen {
            return Ok(None);
        }
        let reason = if self.line.has_risen() {
            NoEcho::Nothing
        } else if self.line.is_high()? {
            NoEcho::StuckHigh
        } else {
            NoEcho::NoResponse
        };
        Ok(Some(Err(reason)))
    }

    fn outcome_of(&self, pulse: Pulse) -> Outcome {
        let flight = since(pulse.fall, pulse.rise);
        if flight >= self.timing.silence {
            Err(NoEcho::Nothing)
        } else if flight > self.timing.longest {
            Err(NoEcho::OutOfRange)
        } else {
            Ok(Echo::new(pulse.rise, flight, self.air))
        }
    }
}

impl<T: OutputPin, L: EchoLine> Ranger for PulseRanger<T, L> {
    type Error = PulseError<T::Error, L::Error>;

    fn ready_at(&self) -> Instant {
        self.triggered.map_or(Instant::from_ticks(0), |at| after(at, self.cycle))
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Self::Error>> {
        // A ping that is no longer polled must not block the next one forever.
        let in_flight = self.state != State::Idle && self.age(now) < self.timing.listen;
        if in_flight || now < self.ready_at() {
            return Err(TriggerError::TooSoon);
        }
        let device = TriggerError::Device;
        let is_high = self.line.is_high();
        let is_high = is_high.map_err(|e| device(PulseError::Echo(e)))?;
        if is_high && self.triggered.is_some() && self.age(now) < self.timing.stuck {
            return Err(TriggerError::TooSoon);
        }
        let raised = self.trigger.set_high();
        raised.map_err(|e| device(PulseError::Trigger(e)))?;
        self.state = State::Raised;
        self.triggered = Some(now);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Self::Error> {
        let result = match self.state {
            State::Idle => return Ok(None),
            State::Raised if self.age(now) < self.timing.trigger => return Ok(None),
            State::Raised => {
                self.state = State::Listening;
                self.triggered = Some(now);
                self.lower().map(|()| None)
            }
            State::Listening => self.listen(now).map_err(PulseError::Echo),
        };
        if !matches!(result, Ok(None)) {
            self.state = State::Idle;
        }
        result
    }

    fn poll_at(&self) -> Option<Instant> {
        let since_edge = |span| after(self.triggered.unwrap_or(NEVER), span);
        match self.state {
            State::Idle => Some(NEVER),
            State::Raised => Some(since_edge(self.timing.trigger)),
            State::Listening => L::WAKES.then(|| since_edge(self.timing.listen)),
        }
    }

    fn set_clock(&mut self, now: Instant) {
        self.triggered = self.triggered.map(|_| now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let RangerSettings { kind: RangerKind::Pulse(timing), cycle, air } = *settings else {
            return Err(UnsupportedKind);
        };
        (self.timing, self.cycle, self.air) = (timing, cycle, air);
        Ok(())
    }
}
