//! The kind of a ranger, and the settings of its driver.

use sonarfix::geometry::units::Duration;

use super::air::Air;

/// The address that an SRF02 or SRF08 is shipped with: 0xE0 in the datasheets' eight bits.
pub(super) const SRF_ADDRESS: u8 = 0x70;
/// The address of a VL53L1X after a reset: 0x52 in the datasheet's eight bits.
pub(super) const VL53L1X_ADDRESS: u8 = 0x29;
/// That of a VL53L0X, which is the same.
pub(super) const VL53L0X_ADDRESS: u8 = 0x29;
/// Least time from ping to ping: the ranging, and 5 ms for the ranger to get ready.
pub(super) const SRF_CYCLE: Duration = Duration::from_ticks(70_000);

/// The kind of a ranger, which determines its driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RangerKind {
    /// A trigger pin, and an echo pin that is high while the sound flies: [`PulseRanger`](super::PulseRanger).
    Pulse(PulseTiming),
    /// SRF02 or SRF08 on an I²C bus: [`Srf`](super::Srf).
    Srf {
        /// Address in seven bits.
        address: u8,
    },
    /// Another one, for which the board has a driver of its own.
    Custom,
    /// VL53L1X, a time-of-flight ranger on an I²C bus: [`Vl53l1x`](super::Vl53l1x).
    Vl53l1x {
        /// Address in seven bits.
        address: u8,
    },
    /// VL53L0X, a time-of-flight ranger on an I²C bus: [`Vl53l0x`](super::Vl53l0x).
    Vl53l0x {
        /// Address in seven bits.
        address: u8,
    },
}

/// The settings of a ranger's driver.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RangerSettings {
    /// The ranger.
    pub kind: RangerKind,
    /// Least time between two pings, so that late echoes are not attributed to the next ping.
    pub cycle: Duration,
    /// The air that the sound crosses.
    pub air: Air,
}

impl RangerSettings {
    /// HC-SR04 and compatible ones, in the air of a room. "Over 60 ms measurement cycle" (its datasheet).
    pub const HC_SR04: Self = Self {
        kind: RangerKind::Pulse(PulseTiming::HC_SR04),
        cycle: Duration::from_ticks(60_000),
        air: Air::ROOM,
    };

    /// LV-MaxSonar-EZ by pulse width, in the air of a room; 49 ms a reading (datasheet PD11832).
    pub const LV_MAXSONAR: Self = Self {
        kind: RangerKind::Pulse(PulseTiming::LV_MAXSONAR),
        cycle: Duration::from_ticks(50_000),
        air: Air::ROOM,
    };

    /// SRF02 or SRF08 at the address that it is shipped with, in the air of a room.
    pub const SRF: Self =
        Self { kind: RangerKind::Srf { address: SRF_ADDRESS }, cycle: SRF_CYCLE, air: Air::ROOM };
}

impl RangerSettings {
    /// VL53L1X at the address that it has after a reset. It collects light for the cycle less 10 ms, up to 50 ms
    /// (`docs/hardware.md`).
    pub const VL53L1X: Self = Self {
        kind: RangerKind::Vl53l1x { address: VL53L1X_ADDRESS },
        cycle: Duration::from_ticks(60_000),
        air: Air::ROOM,
    };

    /// VL53L0X at the address that it has after a reset. A range takes 50 ms (`docs/hardware.md`).
    pub const VL53L0X: Self = Self {
        kind: RangerKind::Vl53l0x { address: VL53L0X_ADDRESS },
        cycle: Duration::from_ticks(60_000),
        air: Air::ROOM,
    };
}

/// The timing of a ranger with a trigger and an echo pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PulseTiming {
    /// Shortest trigger pulse.
    pub trigger: Duration,
    /// Echo pulses shorter than this are the direct burst, or cross-talk between the wires, and are ignored.
    pub blanking: Duration,
    /// Longest reliable time of flight. A longer pulse is [`NoEcho::OutOfRange`](super::NoEcho::OutOfRange).
    pub longest: Duration,
    /// Width from which on a pulse means that there was no echo. It is measured without an obstacle: a module that
    /// ends its pulse at 16 ms cannot distinguish a wall beyond 2.7 m from none, so that both `longest` and this must
    /// be below 16 ms.
    pub silence: Duration,
    /// Time to wait for the echo after the end of the trigger pulse.
    pub listen: Duration,
    /// Time after a trigger from which on a high line counts as stuck; it is then triggered again to reset it.
    pub stuck: Duration,
}

impl PulseTiming {
    /// HC-SR04 and compatible ones: 4 m (23.3 ms at 20 °C). The bleed-through is 100 µs (1.7 cm);
    /// `stuck` is beyond the slowest real board (70 ms).
    pub const HC_SR04: Self = Self {
        trigger: Duration::from_ticks(10),
        blanking: Duration::from_ticks(100),
        longest: Duration::from_ticks(23_500),
        silence: Duration::from_ticks(30_000),
        listen: Duration::from_ticks(32_000),
        stuck: Duration::from_ticks(100_000),
    };

    /// LV-MaxSonar-EZ by pulse width: 254 inches of 147 µs. Its shortest report is 6 inches, so
    /// 100 µs of blanking remove no echo.
    pub const LV_MAXSONAR: Self = Self {
        trigger: Duration::from_ticks(20),
        blanking: Duration::from_ticks(100),
        longest: Duration::from_ticks(37_400),
        silence: Duration::from_ticks(37_400),
        listen: Duration::from_ticks(42_000),
        stuck: Duration::from_ticks(100_000),
    };
}
