//! The search for the pose: one evaluation, while a robot drives through the room and sweeps with its sonar.
#![no_std]
#![no_main]

use core::hint::black_box;

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{STEPS, room, travel};
use sonarfix::config::Config;
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix_search::search::{Search, SearchParameters};

/// Evaluations after each ping.
const EVALUATIONS: u32 = 150;

/// One evaluation.
#[unsafe(no_mangle)]
extern "C" fn probe_slice(search: &mut Search, _: &()) {
    search.poll(1);
}

/// A ping that is passed to the search.
struct Ping {
    bearing: Radians,
    range: Option<Metres>,
}

#[unsafe(no_mangle)]
extern "C" fn probe_ping(search: &mut Search, ping: &Ping) {
    let _ = black_box(search.ping(ping.bearing, ping.range));
}

#[emulated_board::entry]
fn main() -> ! {
    match drive() {
        Some(()) => report::done(),
        None => report::fail(c"the search or the localizer refused something"),
    }
}

fn drive() -> Option<()> {
    let walls = room().ok()?;
    let map = Map::new(&walls);
    let config = Config::for_track_width(Metres(0.16));
    let start = Start {
        pose: Pose::new(1.2, 1.1, Radians(0.1)),
        position_deviation: Metres(0.0),
        heading_deviation: Radians(0.0),
    };
    // Without noise and fixes it is the truth.
    let mut truth = Localizer::new(config, map, start, Instant::from_ticks(0)).ok()?;
    let mut search: Search = Search::new(&config.rangers.first, map, SearchParameters::default());

    let mut meter = Meter::start();
    let [mut slices, mut pings] = [Cost::default(); 2];
    for step in 0..STEPS {
        let before = truth.pose().heading;
        let travel = travel(step);
        truth.odometry(Instant::from_ticks(u64::from(step + 1) * 100_000), travel).ok()?;
        let turn = truth.pose().heading.from(before);
        search.odometry(Metres(0.5 * (travel.right.0 + travel.left.0)), turn).ok()?;
        let bearing = search.aim();
        let range = truth.aim_at(bearing).ok().map(|aim| aim.range);
        meter.measure(&mut pings, probe_ping, &mut search, &Ping { bearing, range });
        for _ in 0..EVALUATIONS {
            meter.measure(&mut slices, probe_slice, &mut search, &());
        }
    }
    report::cost(c"slice", &slices);
    report::cost(c"ping", &pings);
    report::line(c"slice_mean", slices.instructions / slices.calls);
    report::line(c"object", u32::try_from(size_of::<Search>()).unwrap_or(u32::MAX));
    black_box(search.answer());
    (search.cycles() > 0).then_some(())
}
