//! What the readings of a device mean: one pure function for each kind of device.

use std::fmt;

use sonarfix_hal::ranger::{NoEcho, Outcome};
use sonarfix_link::message::{ImageStatus, ResetCause, ServoReading};
use sonarfix_link::{Hello, ReceiverCounters};

/// How a device is, and what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hint {
    /// How it is.
    pub state: State,
    /// What to do, or the probable causes.
    pub text: &'static str,
}

/// How a device is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It works.
    Good,
    /// A person has to do something before that is known.
    Try,
    /// It does not work.
    Wrong,
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match self.state {
            State::Good => "good ",
            State::Try => "try  ",
            State::Wrong => "WRONG",
        };
        write!(f, "{state} {}", self.text)
    }
}

impl Hint {
    const fn good(text: &'static str) -> Self {
        Self { state: State::Good, text }
    }

    const fn attempt(text: &'static str) -> Self {
        Self { state: State::Try, text }
    }

    const fn wrong(text: &'static str) -> Self {
        Self { state: State::Wrong, text }
    }

    /// Nothing has been read.
    #[must_use]
    pub const fn wait() -> Self {
        Self::attempt("wait for the first reading")
    }
}

/// What the link has received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board {
    /// The last identification.
    pub hello: Option<Hello>,
    /// Frames, and what was skipped.
    pub counters: ReceiverCounters,
}

/// The board, its link and the images in its flash.
#[must_use]
pub fn of_board(board: &Board) -> Hint {
    let Board { hello, counters } = board;
    let is_valid = |image| matches!(image, ImageStatus::Valid(_));
    match hello {
        Some(hello) if !is_valid(hello.configuration) => Hint::wrong(
            "no valid configuration: bake robot.toml and write config.bin to its address",
        ),
        Some(hello) if !is_valid(hello.map) => {
            Hint::wrong("no valid map: bake map.toml and write map.bin to its address")
        }
        Some(_) => Hint::good("the program runs, and has a map and a configuration"),
        None if counters.frames > 0 => Hint::attempt("wait: a Hello comes every 10 s"),
        None if counters.foreign > 0 => {
            Hint::wrong("frames of another version: flash the program of this version")
        }
        None if counters.skipped() > 0 => Hint::wrong(
            "bytes, but no frame: 115,200 baud? a common ground? another program's output?",
        ),
        None => {
            Hint::wrong("no bytes: swap TX and RX; connect the grounds; is the program flashed?")
        }
    }
}

/// How often the board was started, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Supply {
    /// The cause of the last reset, if it is known.
    pub reset: Option<ResetCause>,
    /// Restarts while the devices were watched.
    pub restarts: u32,
}

/// The supply. No board measures its voltages; a supply that breaks down shows as a restart.
#[must_use]
pub fn of_supply(supply: Supply) -> Hint {
    const WEAK: Hint = Hint::wrong(
        "the supply breaks down, often when the servo starts: 470 µF at the servo, a regulator of 3 A",
    );
    match (supply.reset, supply.restarts) {
        (Some(ResetCause::BrownOut), _) | (Some(ResetCause::PowerOn), 1..) => WEAK,
        (Some(ResetCause::Watchdog), _) => {
            Hint::wrong("the program was restarted by its watchdog: remove your own code")
        }
        (_, 1..) => Hint::wrong("the board was restarted: a loose supply wire, or its reset pin"),
        (None, 0) => Hint::wait(),
        (Some(_), 0) => Hint::good("no restart while the servo turned (voltages are not measured)"),
    }
}

/// What an encoder has counted since the first reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counted {
    /// Whether the last reading was successful.
    pub is_readable: bool,
    /// Edges counted up and down.
    pub up: u64,
    /// Edges counted down.
    pub down: u64,
    /// The difference of the highest and the lowest count.
    pub span: i64,
    /// Readings that differed from the one before.
    pub changes: u32,
    /// Illegal transitions.
    pub illegal: u32,
    /// Travel of the wheel for a count of one more: negative for a mirrored wheel, zero without a configuration.
    pub metres_per_edge: f32,
    /// Whether the wheel turned backwards by [`STEP`] before it turned forwards by as much.
    pub is_backwards_first: bool,
}

/// A travel of the wheel that a person makes on purpose, metres.
pub const STEP: f32 = 0.02;
/// The same in edges, without a configuration.
const STEP_EDGES: f32 = 50.0;

impl Counted {
    /// After a further reading: the edges since the one before, and the difference of the highest and the lowest count.
    #[must_use]
    pub fn then(self, moved: i64, span: i64) -> Self {
        let mut next = Self { span, changes: self.changes + u32::from(moved != 0), ..self };
        let edges = moved.unsigned_abs();
        if moved > 0 {
            next.up += edges;
        } else {
            next.down += edges;
        }
        let (was_moved, [forwards, backwards]) = (self.directions(), next.directions());
        if was_moved == [false; 2] {
            next.is_backwards_first = backwards && !forwards;
        }
        next
    }

    /// Whether the wheel has turned forwards, and backwards, by a step.
    #[expect(clippy::cast_precision_loss, reason = "compared with a step")]
    fn directions(&self) -> [bool; 2] {
        let travel = |edges: u64| edges as f32 * self.metres_per_edge.abs();
        let is_step = |edges: u64| {
            if self.metres_per_edge == 0.0 {
                edges as f32 >= STEP_EDGES
            } else {
                travel(edges) >= STEP
            }
        };
        let [up, down] = [is_step(self.up), is_step(self.down)];
        if self.metres_per_edge < 0.0 { [down, up] } else { [up, down] }
    }
}

/// An encoder.
#[must_use]
pub fn of_encoder(counted: &Counted) -> Hint {
    let [forwards, backwards] = counted.directions();
    let edges = counted.up + counted.down;
    if !counted.is_readable {
        Hint::wrong("its counter does not run: a program for another board, or other pins")
    } else if edges == 0 {
        Hint::attempt(
            "roll the robot forwards by hand; nothing counted: 3.3 V and ground of the encoder, A and B, pull-ups",
        )
    } else if counted.changes >= 6 && counted.span <= 1 {
        Hint::wrong("counts one edge to and fro: only one of A and B arrives")
    } else if u64::from(counted.illegal) * 20 > edges {
        Hint::wrong(
            "A and B change at once: pull-ups of 10 kΩ, shorter wires, away from the motor's",
        )
    } else if counted.is_backwards_first {
        Hint::wrong(
            "counts backwards: if the robot rolled forwards, swap A and B of this wheel, or change its `mirrored`",
        )
    } else if !forwards {
        Hint::attempt("roll the robot further forwards")
    } else if !backwards {
        Hint::attempt(
            "now roll it backwards; if the count does not change its direction: swap A and B, check both",
        )
    } else {
        Hint::good("counts in both directions")
    }
}

/// The state of the servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Servo {
    /// Not known before the first reading.
    #[default]
    Unread,
    /// It cannot be commanded.
    Failing,
    /// Commanded to this bearing.
    Commanded(ServoReading),
}

impl From<Option<ServoReading>> for Servo {
    fn from(reading: Option<ServoReading>) -> Self {
        reading.map_or(Self::Failing, Self::Commanded)
    }
}

/// The servo, of which nothing is measured: a person has to look.
#[must_use]
pub fn of_servo(servo: Servo, configuration: Option<ImageStatus>) -> Hint {
    match servo {
        Servo::Unread => Hint::wait(),
        Servo::Failing if matches!(configuration, Some(ImageStatus::Valid(_))) => Hint::wrong(
            "its PWM channel refuses the pulses: a program for another board, or limits too wide",
        ),
        Servo::Failing => Hint::wrong("without a configuration its pulses are not known"),
        Servo::Commanded(ServoReading { micros, .. }) if micros <= 0.0 => {
            Hint::good("the sonar has a fixed bearing and no servo")
        }
        Servo::Commanded(ServoReading { bearing, .. }) => {
            Hint::attempt(match bearing.to_degrees() {
                right if right < -5.0 => {
                    "must point to the right; if to the left, swap the bearings of servo_pulses"
                }
                left if left > 5.0 => {
                    "must point to the left; if it hums at a stop, narrow the limits `servo`"
                }
                _ => {
                    "must point ahead, and turn every 2 s; if it stands still: signal wire, 5 V, ground"
                }
            })
        }
    }
}

/// The pings since the first reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Heard {
    /// The result of the last ping.
    pub last: Option<Outcome>,
    /// Readings since the first ping.
    pub readings: u32,
    /// Whether any ping had an echo.
    pub has_echo: bool,
}

impl Heard {
    /// After a further reading.
    #[must_use]
    pub fn then(self, ping: Option<Outcome>) -> Self {
        let readings = self.readings + u32::from(ping.is_some());
        let has_echo = self.has_echo || matches!(ping, Some(Ok(_)));
        Self { last: ping.or(self.last), readings, has_echo }
    }
}

impl fmt::Display for Heard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.last {
            None => f.write_str("no ping yet"),
            Some(Ok(echo)) => {
                let flight = echo.heard.ticks().saturating_sub(echo.sent.ticks());
                write!(f, "echo after {flight} µs: {:.3} m", echo.range.0)
            }
            Some(Err(reason)) => write!(f, "{reason}"),
        }
    }
}

/// Readings after which a sonar without an echo has had its chance: 5 s.
const PATIENCE: u32 = 50;

/// The sonar.
#[must_use]
pub fn of_sonar(heard: &Heard) -> Hint {
    match heard.last {
        None => Hint::wait(),
        Some(Ok(_)) => Hint::good("hold a book 50 cm ahead: the range must agree with a tape"),
        Some(Err(NoEcho::StuckHigh)) => Hint::wrong(
            "the echo line is high: no divider? its lower resistor not at ground? trigger and echo swapped?",
        ),
        Some(Err(NoEcho::NoResponse)) if heard.has_echo => Hint::wrong(
            "answered before: a loose wire, or its 5 V breaks down when the servo turns",
        ),
        Some(Err(NoEcho::NoResponse)) => Hint::wrong(
            "no pulse on the echo line: 5 V and ground of the sonar? trigger and echo swapped? upper resistor?",
        ),
        Some(Err(NoEcho::Failed | NoEcho::Mistimed)) => Hint::wrong(
            "its driver fails: no sensor on its bus (3.3 V? SDA and SCL swapped?), or another ranger or board",
        ),
        Some(Err(NoEcho::Nothing | NoEcho::OutOfRange)) if heard.has_echo => {
            Hint::good("no wall within its range at present")
        }
        Some(Err(NoEcho::Nothing | NoEcho::OutOfRange)) if heard.readings < PATIENCE => {
            Hint::attempt("it answers: hold a book 50 cm ahead of it")
        }
        Some(Err(NoEcho::Nothing | NoEcho::OutOfRange)) => Hint::wrong(
            "no echo ever: with a book 50 cm ahead, something covers it, or its supply is below 5 V",
        ),
    }
}
