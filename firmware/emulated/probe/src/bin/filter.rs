//! The filter alone: predict, expected range, gate, update.
#![no_std]
#![no_main]

use emulated_board::meter::{Cost, Meter};
use emulated_board::report;
use emulated_probe::{STEPS, STEPS_A_RANGE, room, travel};
use sonarfix::config::Config;
use sonarfix::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

/// The filter, and whether it has accepted every input.
struct Filter {
    ekf: Ekf,
    all_well: bool,
}

/// A wall and the mount of the sonar.
struct Sight {
    wall: Wall,
    mount: Point,
}

/// The expected range at the filter's state.
struct Expectation<'a> {
    ekf: &'a Ekf,
    expected: ExpectedRange,
}

/// A measured range.
struct Heard {
    range: Metres,
    expected: ExpectedRange,
    noise: SquareMetres,
    /// Limit of the normalised innovation that the probe compares with, in standard deviations.
    gate: f32,
}

#[unsafe(no_mangle)]
extern "C" fn probe_predict(filter: &mut Filter, travel: &WheelTravel) {
    if filter.ekf.predict(*travel).is_err() {
        filter.all_well = false;
    }
}

#[unsafe(no_mangle)]
extern "C" fn probe_expect(out: &mut Expectation, sight: &Sight) {
    out.expected = ExpectedRange::new(&sight.wall, sight.mount, &out.ekf.state());
}

#[unsafe(no_mangle)]
extern "C" fn probe_gate(filter: &mut Filter, heard: &Heard) {
    let innovation = filter.ekf.innovation(heard.range, &heard.expected, heard.noise);
    if innovation.nis() > heard.gate * heard.gate {
        filter.all_well = false;
    }
}

#[unsafe(no_mangle)]
extern "C" fn probe_update(filter: &mut Filter, heard: &Heard) {
    if filter.ekf.update(heard.range, &heard.expected, heard.noise).is_err() {
        filter.all_well = false;
    }
}

#[emulated_board::entry]
fn main() -> ! {
    match drive() {
        Ok(true) => report::done(),
        _ => report::fail(c"the filter refused something"),
    }
}

fn drive() -> Result<bool, EkfError> {
    let walls = room().map_err(|_| EkfError::NotFinite)?;
    let config = Config::for_track_width(Metres(0.16));
    let deviation = StandardDeviations::from_array([0.05, 0.05, 0.02, 0.01, 0.01, 0.005, 0.01]);
    let start = StateEstimate::at_pose(Pose::new(1.2, 1.1, Radians(0.1)));
    let ekf = Ekf::new(config.drive, start, deviation)?;
    let mut filter = Filter { ekf, all_well: true };

    let mut meter = Meter::start();
    let [mut predicts, mut expects, mut gates, mut updates] = [Cost::default(); 4];
    let mut turns = walls.iter().cycle();
    for step in 0..STEPS {
        meter.measure(&mut predicts, probe_predict, &mut filter, &travel(step));
        if !(step + 1).is_multiple_of(STEPS_A_RANGE) {
            continue;
        }
        let Some(&wall) = turns.next() else { continue };
        // Ahead of the robot's centre and to its left, so that the lever arm matters.
        let sight = Sight { wall, mount: Point::new(0.05, 0.02) };
        let nothing_yet = ExpectedRange::new(&wall, Point::default(), &StateEstimate::default());
        let ekf = filter.ekf;
        let mut expectation = Expectation { ekf: &ekf, expected: nothing_yet };
        meter.measure(&mut expects, probe_expect, &mut expectation, &sight);
        let expected = expectation.expected;
        let heard = Heard {
            range: expected.range + Metres(0.004),
            expected,
            noise: config.rangers.first.noise.variance(expected.range),
            gate: 4.0,
        };
        meter.measure(&mut gates, probe_gate, &mut filter, &heard);
        meter.measure(&mut updates, probe_update, &mut filter, &heard);
    }
    report::cost(c"predict", &predicts);
    report::cost(c"expect", &expects);
    report::cost(c"gate", &gates);
    report::cost(c"update", &updates);
    report::line(c"object", u32::try_from(size_of::<Ekf>()).unwrap_or(u32::MAX));
    Ok(filter.all_well)
}
