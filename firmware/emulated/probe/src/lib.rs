//! The room and the drive of the probes.
//!
//! Each probe is a program that links only the code of its calls. A call is a function named `probe_…`, by which `cargo xtask
//! budgets` finds the code that it reaches.

#![no_std]

use emulated_board::report;
use sonarfix::aim::Aim;
use sonarfix::config::Config;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start, StartError};
use sonarfix::map::{Map, Wall, WallError};

/// Walls of the room.
pub const WALLS: usize = 8;
/// Wheel travels of the drive.
pub const STEPS: u32 = 200;
/// Wheel travels between two ranges: one range per second at ten samples per second.
pub const STEPS_A_RANGE: u32 = 10;

/// A room of 6 m × 5 m with a block of 1 m × 1 m in its middle.
///
/// # Errors
/// None: the corners are fixed.
pub fn room() -> Result<[Wall; WALLS], WallError> {
    let point = Point::new;
    let outer = [point(0.0, 0.0), point(6.0, 0.0), point(6.0, 5.0), point(0.0, 5.0)];
    let inner = [point(2.5, 2.0), point(2.5, 3.0), point(3.5, 3.0), point(3.5, 2.0)];
    let [a, b, c, d] = outer;
    let [e, f, g, h] = inner;
    Ok([
        Wall::new(a, b)?,
        Wall::new(b, c)?,
        Wall::new(c, d)?,
        Wall::new(d, a)?,
        Wall::new(e, f)?,
        Wall::new(f, g)?,
        Wall::new(g, h)?,
        Wall::new(h, e)?,
    ])
}

/// A localizer, and the result of the last call.
pub struct Robot<'a> {
    /// The localizer.
    pub localizer: Localizer<'a>,
    /// Whether it has refused nothing.
    pub all_well: bool,
    /// The wall to measure.
    pub aim: Option<Aim>,
}

impl<'a> Robot<'a> {
    /// At the start of the drive.
    ///
    /// # Errors
    /// Those of the localizer.
    pub fn new(mut config: Config, walls: &'a [Wall]) -> Result<Self, StartError> {
        config.prior.range_scale = 0.01;
        let start = Start {
            pose: Pose::new(1.2, 1.1, Radians(0.1)),
            position_deviation: Metres(0.05),
            heading_deviation: Radians(0.02),
        };
        let localizer = Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0))?;
        Ok(Self { localizer, all_well: true, aim: None })
    }
}

/// A drive of curves and a turn in place, which stays in the room.
#[must_use]
pub fn travel(step: u32) -> WheelTravel {
    match step % 50 {
        0..=19 => WheelTravel::new(0.02, 0.018),
        20..=35 => WheelTravel::new(0.02, -0.02),
        36..=44 => WheelTravel::new(0.018, 0.021),
        _ => WheelTravel::new(-0.01, -0.012),
    }
}

/// Ends the program: with success if the drive was complete and nothing was refused.
pub fn end(drive: Option<bool>) -> ! {
    match drive {
        Some(true) => report::done(),
        _ => report::fail(c"the localizer refused something"),
    }
}
