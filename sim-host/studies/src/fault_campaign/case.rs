//! A case of the campaign: a robot, what happens to it, and how it is mended; as data, so that it can be shortened and kept.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// What a robot is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "independent parts, each with a name")]
pub struct Composition {
    /// Rangers, from one to three.
    pub rangers: u8,
    /// Whether the first ranger measures with light.
    pub light: bool,
    /// Whether the rangers after the first are at fixed bearings.
    pub fixed: bool,
    /// Whether it has a gyro.
    pub gyro: bool,
    /// Whether a source outside measures its position once a second.
    pub absolute: bool,
    /// Whether it searches for its pose.
    pub search: bool,
    /// Whether it measures the most informative wall, and not the nearest.
    pub informative: bool,
    /// Whether its motors stop when it is lost and when the link is.
    pub cautious: bool,
}

/// A part that can fail. A number is that of a ranger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Part {
    /// The right encoder.
    Right,
    /// The left encoder.
    Left,
    /// The servo of a ranger.
    Servo(u8),
    /// A ranger.
    Ranger(u8),
    /// The gyro.
    Gyro,
    /// The source of positions.
    Absolute,
    /// The flash.
    Flash,
}

/// How a part fails. Each part has a meaning for each of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
pub enum Fault {
    /// It works.
    #[default]
    None,
    /// Each access fails.
    Dead,
    /// It answers, without a measurement: no echo, no edge, no position.
    Silent,
    /// It stays as it is: an echo line at high, a servo that does not turn, a rate or bits that do not change.
    Stuck,
    /// It repeats its last measurement.
    Frozen,
    /// Its measurements are wrong.
    Lying,
    /// It never answers; of the flash: each access takes long.
    Hanging,
}

const FAULTS: [Fault; 6] =
    [Fault::Dead, Fault::Silent, Fault::Stuck, Fault::Frozen, Fault::Lying, Fault::Hanging];

/// A number of a command that may be anything, by its bits.
type Bits = u32;

/// A command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Order {
    /// The true pose.
    SetPose,
    /// Any pose: x, y, heading, and two deviations.
    SetAnyPose([Bits; 5]),
    /// The robot's configuration.
    SetConfiguration,
    /// The same with a field replaced by any number.
    SetAnyConfiguration(u8, Bits),
    /// Starts the loop.
    Start,
    /// Stops it.
    Stop,
    /// Forgets the calibration.
    ResetCalibration,
    /// Declares the pose unknown.
    Search,
    /// Shows the readings of the devices.
    ShowDevices,
    /// Any heading of any age: angle, deviation, age in milliseconds.
    AnyHeading(Bits, Bits, u32),
    /// Begins a new session.
    OpenSession,
}

/// What happens to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// A command arrives.
    Order(Order),
    /// Random bytes arrive, so many, from a seed.
    Garbage(u16, u32),
    /// A frame that was sent earlier arrives again, with so many of its bits flipped.
    Repeat(u8, u8),
    /// A part fails, or works again.
    Part(Part, Fault),
    /// All parts work again.
    Mend,
    /// The power is cut, in a write to the flash after so many steps if there is one; the robot starts after so many resets in
    /// a row.
    PowerCut(u16, u8),
    /// The clock of one poll is ahead by 2 to this power, microseconds.
    TornClock(u8),
    /// In so many polls the clock has any time.
    BrokenClock(u8),
    /// The clock is set ahead by so many milliseconds, or back if negative.
    SetClock(i32),
    /// The program is not polled for so many milliseconds.
    Stall(u16),
    /// The link is unplugged, or plugged.
    Unplug(bool),
    /// So many milliseconds pass, in which the robot drives while its motors are enabled, or stands.
    Pass(u32, bool),
}

/// How a case ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct End {
    /// Whether the power is cycled before the robot is started again.
    pub power_cycle: bool,
    /// Whether the flash stays as it is.
    pub flash_stays: bool,
    /// The part that dies while the robot drives, and returns.
    pub part: Part,
    /// How it dies.
    pub fault: Fault,
    /// For how many milliseconds.
    pub millis: u32,
}

/// A case.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Case {
    /// The seed of its noise.
    pub seed: u64,
    /// The robot.
    pub robot: Composition,
    /// What happens to it.
    pub actions: Vec<Action>,
    /// How it ends.
    pub end: End,
}

impl Case {
    /// The case of a seed.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let robot = random.composition();
        let actions = (0..random.0.random_range(0..40)).map(|_| random.action(robot)).collect();
        let end = random.end(robot);
        Self { seed, robot, actions, end }
    }
}

struct Random(ChaCha8Rng);

impl Random {
    fn coin(&mut self) -> bool {
        self.0.random()
    }

    fn below(&mut self, end: u32) -> u32 {
        self.0.random_range(0..end)
    }

    fn one_of<T: Copy>(&mut self, all: &[T], other: T) -> T {
        let at = self.0.random_range(0..all.len().max(1));
        all.get(at).copied().unwrap_or(other)
    }

    fn composition(&mut self) -> Composition {
        Composition {
            rangers: self.0.random_range(1..=3),
            light: self.below(4) == 0,
            fixed: self.coin(),
            gyro: self.coin(),
            absolute: self.below(4) == 0,
            search: self.below(4) == 0,
            informative: self.coin(),
            cautious: self.below(4) == 0,
        }
    }

    /// An arbitrary number, often a usual one.
    fn bits(&mut self) -> Bits {
        match self.below(8) {
            0 => self.0.random(),
            1 => 0.0_f32.to_bits(),
            2 => (-1.0_f32).to_bits(),
            3 => f32::NAN.to_bits(),
            4 => 1e7_f32.to_bits(),
            _ => (0.01 * self.0.random_range(0.0_f32..100.0).floor()).to_bits(),
        }
    }

    fn order(&mut self) -> Order {
        match self.below(14) {
            0..=2 => Order::SetPose,
            3 => Order::SetAnyPose(std::array::from_fn(|_| self.bits())),
            4 => Order::SetConfiguration,
            5 => Order::SetAnyConfiguration(self.0.random_range(0..8), self.bits()),
            6..=8 => Order::Start,
            9 => Order::Stop,
            10 => Order::ResetCalibration,
            11 => self.one_of(&[Order::Search, Order::ShowDevices], Order::Start),
            12 => Order::AnyHeading(self.bits(), self.bits(), self.below(5_000)),
            _ => Order::OpenSession,
        }
    }

    fn part(&mut self, robot: Composition) -> Part {
        let ranger = self.0.random_range(0..robot.rangers);
        let all = [
            Part::Right,
            Part::Left,
            Part::Servo(ranger),
            Part::Ranger(ranger),
            Part::Ranger(ranger),
            Part::Gyro,
            Part::Absolute,
            Part::Flash,
        ];
        self.one_of(&all, Part::Right)
    }

    fn action(&mut self, robot: Composition) -> Action {
        match self.below(25) {
            0..=6 => Action::Order(self.order()),
            7 => Action::Garbage(self.0.random_range(0..300), self.0.random()),
            8 => Action::Repeat(self.0.random(), self.0.random_range(0..3)),
            9..=11 => Action::Part(self.part(robot), self.one_of(&FAULTS, Fault::Dead)),
            12 => Action::Mend,
            13 => Action::PowerCut(self.0.random_range(0..120), self.0.random_range(0..5)),
            14 => Action::TornClock(self.0.random_range(16..=60)),
            15 => Action::SetClock(self.0.random_range(-100_000..100_000)),
            16 => Action::Stall(self.0.random_range(0..3_000)),
            17 => Action::Unplug(self.coin()),
            24 => Action::BrokenClock(self.0.random_range(2..200)),
            18 if self.below(30) == 0 => Action::Pass(self.0.random_range(60_000..90_000), false),
            _ => Action::Pass(self.below(2_000), self.coin()),
        }
    }

    fn end(&mut self, robot: Composition) -> End {
        let ranger = self.0.random_range(0..robot.rangers);
        let parts = [
            (Part::Right, Fault::Dead),
            (Part::Left, Fault::Dead),
            (Part::Servo(ranger), Fault::Dead),
            (Part::Ranger(ranger), Fault::Dead),
            (Part::Ranger(ranger), Fault::Silent),
            (Part::Ranger(ranger), Fault::Stuck),
            (Part::Ranger(ranger), Fault::Hanging),
            (Part::Gyro, Fault::Dead),
            (Part::Gyro, Fault::Stuck),
            (Part::Absolute, Fault::Silent),
            (Part::Flash, Fault::Dead),
        ];
        let (part, fault) = self.one_of(&parts, (Part::Right, Fault::Dead));
        End {
            power_cycle: self.coin(),
            flash_stays: self.coin(),
            part,
            fault,
            millis: self.0.random_range(500..30_000),
        }
    }
}
