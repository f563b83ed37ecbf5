//! SRF02 and SRF08 on I²C.
//!
//! Both (Devantech's technical specifications "SRF02 Ultrasonic range finder, I2C Mode" and
//! "SRF08 Ultra sonic range finder"): a command written to register 0 starts a ranging, 0x52 for
//! a result in microseconds of flight (0x51 for centimetres is not used: it is coarser, and assumes
//! the maker's temperature). A ranging lasts up to 65 ms, during which the ranger does not
//! answer on the bus: a read gives 0xFF or is not acknowledged. Register 0 then reads as the
//! software revision, and registers 2 and 3 hold the first echo, high byte first, zero if there
//! was none.
//!
//! The sound is sent when the command has arrived, so the times of the echo are early by the transfer on the bus,
//! 0.3 ms at 100 kHz.

use embedded_hal::i2c::{Error as _, ErrorKind, I2c};
use sonarfix::geometry::units::{Duration, Instant};

use super::air::Air;
use super::driver::{Ranger, TriggerError, UnsupportedKind};
use super::echo::{Echo, NoEcho, Outcome};
use super::settings::{RangerKind, RangerSettings, SRF_ADDRESS, SRF_CYCLE};
use crate::time::{NEVER, after, since};

const COMMAND: u8 = 0;
const RANGE_IN_MICROSECONDS: u8 = 0x52;
const REVISION: u8 = 0;
const REVISION_WHILE_RANGING: u8 = 0xFF;
const FIRST_ECHO: u8 = 2;

/// Duration of a ranging, during which the ranger does not respond.
const RANGING: Duration = Duration::from_ticks(65_000);
/// Time after which a ranging has failed.
const GIVE_UP: Duration = Duration::from_ticks(100_000);
/// Flight to 6 m and back at −10 °C, where sound is slow. Both are sold for 0.03–6 m (SRF02:
/// 0.15–6 m); the SRF08 would listen up to 11 m.
const LONGEST: Duration = Duration::from_ticks(37_000);

/// The driver of an SRF02 or SRF08, which have the same registers.
///
/// ```
/// use embedded_hal_mock::eh1::i2c::{Mock, Transaction as I2c};
/// use sonarfix::geometry::units::{Instant, Metres};
/// use sonarfix_hal::ranger::{Air, Ranger, Srf};
///
/// let mut bus = Mock::new(&[
///     I2c::write(0x70, vec![0x00, 0x52]),
///     I2c::write_read(0x70, vec![0x00], vec![6]), // ready again
///     I2c::write_read(0x70, vec![0x02], vec![0x17, 0x70]), // 6,000 µs
/// ]);
/// let mut ranger = Srf::new(&mut bus, Srf::DEFAULT_ADDRESS, Air::ROOM);
/// ranger.trigger(Instant::from_ticks(0))?;
/// assert_eq!(ranger.poll(Instant::from_ticks(30_000)), Ok(None)); // no acknowledgement
/// let Ok(Some(Ok(echo))) = ranger.poll(Instant::from_ticks(66_000)) else { panic!() };
/// assert!((echo.range - Metres(1.030)).abs() < Metres(0.001));
/// assert_eq!(echo.reflected(), Instant::from_ticks(3_000));
/// # drop(ranger);
/// # bus.done();
/// # Ok::<(), sonarfix_hal::ranger::TriggerError<embedded_hal::i2c::ErrorKind>>(())
/// ```
#[derive(Debug)]
pub struct Srf<I> {
    bus: I,
    address: u8,
    /// Least time from ping to ping.
    cycle: Duration,
    air: Air,
    /// The instant of the last trigger.
    triggered: Option<Instant>,
    in_flight: bool,
}

impl Srf<()> {
    /// The address it is shipped with: 0xE0 in the datasheets' eight bits.
    pub const DEFAULT_ADDRESS: u8 = SRF_ADDRESS;
}

impl<I: I2c> Srf<I> {
    /// A ranger at this seven-bit address.
    #[must_use]
    pub fn new(bus: I, address: u8, air: Air) -> Self {
        Self { bus, address, cycle: SRF_CYCLE, air, triggered: None, in_flight: false }
    }

    /// Sets the air after a change of temperature.
    pub fn set_air(&mut self, air: Air) {
        self.air = air;
    }

    /// Releases the bus.
    pub fn release(self) -> I {
        self.bus
    }

    /// Whether the ranging has ended. Until then the ranger does not acknowledge.
    fn is_awake(&mut self) -> Result<bool, I::Error> {
        let mut revision = [REVISION_WHILE_RANGING];
        let read = self.bus.write_read(self.address, &[REVISION], &mut revision);
        match read {
            Ok(()) => Ok(revision != [REVISION_WHILE_RANGING]),
            Err(error) if matches!(error.kind(), ErrorKind::NoAcknowledge(_)) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn listen(&mut self, sent: Instant, age: Duration) -> Result<Option<Outcome>, I::Error> {
        if age < RANGING {
            return Ok(None);
        }
        if !self.is_awake()? {
            return Ok((age >= GIVE_UP).then_some(Err(NoEcho::NoResponse)));
        }
        let mut result = [0; 2];
        self.bus.write_read(self.address, &[FIRST_ECHO], &mut result)?;
        let flight = Duration::from_ticks(u64::from(u16::from_be_bytes(result)));
        Ok(Some(if flight.is_zero() {
            Err(NoEcho::Nothing)
        } else if flight > LONGEST {
            Err(NoEcho::OutOfRange)
        } else {
            Ok(Echo::new(sent, flight, self.air))
        }))
    }
}

impl<I: I2c> Ranger for Srf<I> {
    type Error = I::Error;

    fn ready_at(&self) -> Instant {
        self.triggered.map_or(Instant::from_ticks(0), |at| after(at, self.cycle))
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<I::Error>> {
        // A ping that is no longer polled must not block the next one forever.
        let age = since(now, self.triggered.unwrap_or(now));
        if (self.in_flight && age < GIVE_UP) || now < self.ready_at() {
            return Err(TriggerError::TooSoon);
        }
        let command = [COMMAND, RANGE_IN_MICROSECONDS];
        let sent = self.bus.write(self.address, &command);
        sent.map_err(TriggerError::Device)?;
        self.triggered = Some(now);
        self.in_flight = true;
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, I::Error> {
        let Some(sent) = self.triggered.filter(|_| self.in_flight) else {
            return Ok(None);
        };
        let result = self.listen(sent, since(now, sent));
        self.in_flight = matches!(result, Ok(None));
        result
    }

    fn poll_at(&self) -> Option<Instant> {
        let sent = self.triggered.filter(|_| self.in_flight);
        Some(sent.map_or(NEVER, |sent| after(sent, RANGING)))
    }

    fn set_clock(&mut self, now: Instant) {
        self.triggered = self.triggered.map(|_| now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        let RangerSettings { kind: RangerKind::Srf { address }, cycle, air } = *settings else {
            return Err(UnsupportedKind);
        };
        (self.address, self.cycle, self.air) = (address, cycle.max(SRF_CYCLE), air);
        Ok(())
    }
}
