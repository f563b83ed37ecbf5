//! The I²C master on two pins, against a device that is simulated at its lines.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal::i2c::{ErrorKind, I2c, NoAcknowledgeSource, Operation};
use proptest::prelude::*;
use sonarfix::geometry::units::Instant;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::bus::{MOST_STRETCHES, SharedBus, TwoWire};
use sonarfix_hal::gyro::{Mpu6050, Unreadable, YawRate};
use sonarfix_hal::ranger::{
    Ranger, RangerKind, RangerSettings, TriggerError, Vl53l0x, Vl53l0xError,
};

const ADDRESS: u8 = 0x68;

/// What the device does with the next clock.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Not addressed.
    Idle,
    /// Takes bits: those so far, and how many.
    Takes(u8, u8),
    /// Acknowledges; then it sends.
    Acknowledges { sends: bool },
    /// Sends a byte, of which so many bits are sent.
    Sends(u8, u8),
    /// Waits for the acknowledgement of the master.
    Asks,
}

/// The two lines, and a device with 256 registers.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "levels of lines")]
struct Bus {
    /// Whether the master releases clock and data.
    clock: bool,
    data: bool,
    phase: Phase,
    /// Whether the device pulls the data line, and holds the clock.
    pulls: bool,
    holds_clock: bool,
    is_addressed: bool,
    /// Whether the next byte is the register.
    wants_register: bool,
    register: u8,
    registers: [u8; 256],
    /// Nanoseconds that the master has waited.
    waited: u64,
}

impl Bus {
    fn new(registers: [u8; 256]) -> Rc<RefCell<Self>> {
        Rc::new(RefCell::new(Self {
            clock: true,
            data: true,
            phase: Phase::Idle,
            pulls: false,
            holds_clock: false,
            is_addressed: false,
            wants_register: false,
            register: 0,
            registers,
            waited: 0,
        }))
    }

    fn line(&self) -> bool {
        self.data && !self.pulls
    }

    fn set_data(&mut self, is_high: bool) {
        let before = self.line();
        self.data = is_high;
        match (self.clock, before, self.line()) {
            (true, true, false) => {
                (self.phase, self.is_addressed) = (Phase::Takes(0, 0), false);
            }
            (true, false, true) => self.phase = Phase::Idle,
            _ => {}
        }
    }

    fn set_clock(&mut self, is_high: bool) {
        let (before, line) = (self.clock, self.line());
        self.clock = is_high;
        match (before, is_high, self.phase) {
            // The device samples at the rising edge.
            (false, true, Phase::Takes(bits, count)) => {
                self.phase = Phase::Takes(bits << 1 | u8::from(line), count + 1);
            }
            (false, true, Phase::Asks) => {
                self.phase = if line { Phase::Idle } else { Phase::Sends(self.next(), 0) };
            }
            // It changes its line at the falling edge.
            (true, false, Phase::Takes(byte, 8)) => self.taken(byte),
            (true, false, Phase::Acknowledges { sends }) => {
                self.phase = if sends { Phase::Sends(self.next(), 0) } else { Phase::Takes(0, 0) };
                self.pulls = false;
                self.send();
            }
            (true, false, Phase::Sends(..)) => self.send(),
            _ => {}
        }
    }

    fn next(&mut self) -> u8 {
        let byte = self.registers[usize::from(self.register)];
        self.register = self.register.wrapping_add(1);
        byte
    }

    /// Sets the line to the next bit of a byte.
    fn send(&mut self) {
        match self.phase {
            Phase::Sends(_, 8) => (self.phase, self.pulls) = (Phase::Asks, false),
            Phase::Sends(byte, sent) => {
                self.pulls = byte << sent & 0x80 == 0;
                self.phase = Phase::Sends(byte, sent + 1);
            }
            _ => {}
        }
    }

    fn taken(&mut self, byte: u8) {
        if self.is_addressed {
            if self.wants_register {
                (self.register, self.wants_register) = (byte, false);
            } else {
                self.registers[usize::from(self.register)] = byte;
                self.register = self.register.wrapping_add(1);
            }
            self.phase = Phase::Acknowledges { sends: false };
        } else if byte >> 1 == ADDRESS {
            (self.is_addressed, self.wants_register) = (true, true);
            self.phase = Phase::Acknowledges { sends: byte & 1 == 1 };
        } else {
            self.phase = Phase::Idle;
            return;
        }
        self.pulls = true;
    }
}

struct Clock(Rc<RefCell<Bus>>);
struct Data(Rc<RefCell<Bus>>);
struct Wait(Rc<RefCell<Bus>>);

impl ErrorType for Clock {
    type Error = Infallible;
}

impl OutputPin for Clock {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_clock(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_clock(true);
        Ok(())
    }
}

impl InputPin for Clock {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let bus = self.0.borrow();
        Ok(bus.clock && !bus.holds_clock)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl ErrorType for Data {
    type Error = Infallible;
}

impl OutputPin for Data {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_data(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_data(true);
        Ok(())
    }
}

impl InputPin for Data {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.borrow().line())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl DelayNs for Wait {
    fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().waited += u64::from(ns);
    }
}

type Master = TwoWire<Clock, Data, Wait>;

fn master(bus: &Rc<RefCell<Bus>>) -> Master {
    TwoWire::new(Clock(bus.clone()), Data(bus.clone()), Wait(bus.clone()))
}

proptest! {
    /// What is written to registers is there, nothing else has changed, and it is read back in one or more parts.
    #[test]
    fn registers_are_written_and_read(
        register in any::<u8>(), bytes in prop::collection::vec(any::<u8>(), 1..6), split in 0_usize..8,
    ) {
        let mut before = [0_u8; 256];
        before.iter_mut().zip(0_u8..=255).for_each(|(value, n)| *value = n.wrapping_mul(37));
        let bus = Bus::new(before);
        let mut master = master(&bus);
        master.transaction(ADDRESS, &mut [Operation::Write(&[register]), Operation::Write(&bytes)]).unwrap();
        for n in 0..=255_u8 {
            let at = usize::from(n.wrapping_sub(register));
            let expected = bytes.get(at).copied().unwrap_or(before[usize::from(n)]);
            prop_assert_eq!(bus.borrow().registers[usize::from(n)], expected);
        }
        let mut read = vec![0; bytes.len()];
        let (first, second) = read.split_at_mut(split.min(bytes.len()));
        let mut operations = [Operation::Write(&[register]), Operation::Read(first), Operation::Read(second)];
        master.transaction(ADDRESS, &mut operations).unwrap();
        prop_assert_eq!(read, bytes);
        let bus = bus.borrow();
        prop_assert!(bus.clock && bus.line() && bus.phase == Phase::Idle, "the bus is not free");
    }
}

/// The whole driver on it: identity, configuration, and a rate of 1°/s.
#[test]
fn a_gyro_is_configured_and_read() {
    let mut registers = [0; 256];
    (registers[0x75], registers[0x48]) = (0x68, 0x83);
    let bus = Bus::new(registers);
    let mut gyro = Mpu6050::new(master(&bus));
    gyro.configure(&GyroParameters::MPU_6050).unwrap();
    assert_eq!([0x6b, 0x19, 0x1a, 0x1b].map(|n: usize| bus.borrow().registers[n]), [1, 0, 2, 0]);
    bus.borrow_mut().waited = 0;
    assert!((gyro.rate().unwrap().to_degrees() - 1.0).abs() < 1e-3);
    let waited = bus.borrow().waited;
    assert!((100_000..300_000).contains(&waited), "{waited} ns");
}

/// A gyro and a ranger in turn on one bus, each with its own address.
#[test]
fn two_drivers_share_a_bus() {
    let mut registers = [0; 256];
    (registers[0x75], registers[0xC0]) = (0x68, 0xEE);
    let bus = Bus::new(registers);
    let shared = SharedBus::new(master(&bus));
    let mut gyro = Mpu6050::new(&shared);
    let mut ranger = Vl53l0x::new(&shared);
    let kind = RangerKind::Vl53l0x { address: ADDRESS };
    ranger.configure(&RangerSettings { kind, ..RangerSettings::VL53L0X }).unwrap();
    gyro.configure(&GyroParameters::MPU_6050).unwrap();
    let now = Instant::from_ticks(0);
    assert_eq!(ranger.trigger(now), Err(TriggerError::TooSoon), "the set-up has begun");
    assert!(gyro.rate().is_ok());
    let missing = Vl53l0xError::Bus(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
    assert_eq!(Vl53l0x::new(&shared).trigger(now), Err(TriggerError::Device(missing)));
}

#[test]
fn a_missing_device_is_an_error() {
    let bus = Bus::new([0; 256]);
    let missing = master(&bus).read(ADDRESS + 1, &mut [0; 2]);
    assert_eq!(missing, Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)));
    assert!(bus.borrow().line() && bus.borrow().clock);
}

/// A device that holds the clock: each transfer ends, and the next one after it has let go works.
#[test]
fn a_clock_that_is_held_ends_the_transfer() {
    let bus = Bus::new([7; 256]);
    let mut gyro = Mpu6050::new(master(&bus));
    bus.borrow_mut().holds_clock = true;
    assert_eq!(gyro.rate(), Err(Unreadable));
    let longest = 2_000 * u64::from(MOST_STRETCHES) + 50_000;
    assert!(bus.borrow().waited < longest, "{} ns", bus.borrow().waited);
    bus.borrow_mut().holds_clock = false;
    assert!(gyro.rate().is_ok());
}

/// A controller that was reset in the middle of a byte finds the data line low, and frees it.
#[test]
fn a_device_that_holds_the_data_line_is_freed() {
    for clocks in 0..8 {
        let bus = Bus::new([0; 256]);
        {
            let mut bus = bus.borrow_mut();
            (bus.phase, bus.is_addressed) = (Phase::Sends(0, 1), true);
            bus.pulls = true;
            for _ in 0..clocks {
                bus.set_clock(false);
                bus.set_clock(true);
            }
        }
        let mut bytes = [9];
        master(&bus).write_read(ADDRESS, &[3], &mut bytes).unwrap();
        assert_eq!(bytes, [0], "{clocks} clocks");
    }
}
