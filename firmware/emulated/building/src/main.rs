//! The cost of an aim by the number of walls of a building: rooms of 4 m × 5 m with four walls each, in a square, with a baked map
//! that is read in place. The number of poses is the same in each building.
#![no_std]
#![no_main]

use core::ffi::CStr;

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use sonarfix::aim::Aim;
use sonarfix::config::{Config, Policy};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;

/// Tested rooms.
const ROOMS: u32 = 40;
/// Poses in each room: this number along x and along y, each with another heading.
const PLACES: u16 = 4;

/// A building.
struct Building {
    /// Keys of the reports of the policies `informative` and `nearest`.
    keys: [&'static CStr; 2],
    image: &'static [u8],
    /// Rooms along each side.
    side: u32,
}

macro_rules! building {
    ($walls:literal, $side:literal) => {
        Building {
            keys: [
                match CStr::from_bytes_with_nul(concat!("aim_", $walls, "_walls\0").as_bytes()) {
                    Ok(key) => key,
                    Err(_) => c"",
                },
                match CStr::from_bytes_with_nul(concat!("nearest_", $walls, "_walls\0").as_bytes())
                {
                    Ok(key) => key,
                    Err(_) => c"",
                },
            ],
            image: include_bytes!(concat!(env!("OUT_DIR"), "/", $walls, ".map")),
            side: $side,
        }
    };
}

static BUILDINGS: [Building; 4] =
    [building!("100", 5), building!("1000", 16), building!("10000", 50), building!("100000", 159)];

/// A localizer with its aim.
struct Robot<'a> {
    localizer: Localizer<'a>,
    aim: Option<Aim>,
}

extern "C" fn probe_aim(robot: &mut Robot, _: &()) {
    robot.aim = robot.localizer.aim().ok();
}

#[emulated_board::entry]
fn main() -> ! {
    let mut meter = Meter::start();
    for building in &BUILDINGS {
        for (key, policy) in building.keys.iter().zip([Policy::Informative, Policy::Nearest]) {
            match aims(&mut meter, building, policy) {
                Some(cost) => report::cost(key, &cost),
                None => report::fail(c"a building or a localizer was refused"),
            }
        }
    }
    report::done()
}

/// The cost of the aims from all poses in the building; some have no wall in reach.
fn aims(meter: &mut Meter, building: &Building, policy: Policy) -> Option<Cost> {
    let map = Map::read(building.image).ok()?;
    let mut config = Config::for_track_width(Metres(0.16));
    config.policy = policy;
    let mut cost = Cost::default();
    let rooms = building.side * building.side;
    for i in 0..ROOMS {
        // Spread over the building: the step and the number of rooms are coprime.
        let room = i * 7_919 % rooms;
        let corner = (room % building.side, room / building.side);
        for place in 0..PLACES * PLACES {
            let offset = |place: u16| 0.6 + 0.9 * f32::from(place);
            let (x, y) = (offset(place % PLACES), 1.1 * offset(place / PLACES));
            let start = Start {
                pose: Pose::new(
                    4.0 * metres(corner.0)? + x,
                    5.0 * metres(corner.1)? + y,
                    Radians(0.4 * f32::from(place)),
                ),
                position_deviation: Metres(0.05),
                heading_deviation: Radians(0.02),
            };
            let localizer = Localizer::new(config, map, start, Instant::from_ticks(0)).ok()?;
            let mut robot = Robot { localizer, aim: None };
            meter.measure(&mut cost, probe_aim, &mut robot, &());
        }
    }
    Some(cost)
}

fn metres(rooms: u32) -> Option<f32> {
    u16::try_from(rooms).ok().map(f32::from)
}
