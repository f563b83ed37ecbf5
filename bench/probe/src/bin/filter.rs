//! The core alone: predict, the range expected, the gate, update.
#![no_std]
#![no_main]

use bench_board::meter::{Cost, Meter};
use bench_board::report;
use bench_probe::{STEPS, STEPS_A_RANGE, room, travel};
use sonarfix::config::Config;
use sonarfix::ekf::{Ekf, EkfError, State};
use sonarfix::map::Wall;
use sonarfix::motion::WheelTravel;
use sonarfix::pose::Point;
use sonarfix::range::ExpectedRange;
use sonarfix::units::{Metres, SquareMetres};

/// The filter, and whether it has taken everything so far.
struct Filter {
    ekf: Ekf,
    all_well: bool,
}

/// A wall and where the sonar sits.
struct Sight {
    wall: Wall,
    mount: Point,
}

/// What is expected, by the filter's state.
struct Expectation<'a> {
    ekf: &'a Ekf,
    expected: ExpectedRange,
}

/// A range that came back.
struct Heard {
    range: Metres,
    expected: ExpectedRange,
    noise: SquareMetres,
    gate: f32,
}

#[unsafe(no_mangle)]
extern "C" fn probe_predict(filter: &mut Filter, travel: &WheelTravel) {
    filter.all_well &= filter.ekf.predict(*travel).is_ok();
}

#[unsafe(no_mangle)]
extern "C" fn probe_expect(out: &mut Expectation, sight: &Sight) {
    out.expected = ExpectedRange::new(&sight.wall, sight.mount, &out.ekf.state());
}

#[unsafe(no_mangle)]
extern "C" fn probe_gate(filter: &mut Filter, heard: &Heard) {
    let innovation = filter.ekf.innovation(heard.range, &heard.expected, heard.noise);
    filter.all_well &= innovation.nis() <= heard.gate * heard.gate;
}

#[unsafe(no_mangle)]
extern "C" fn probe_update(filter: &mut Filter, heard: &Heard) {
    filter.all_well &= filter.ekf.update(heard.range, &heard.expected, heard.noise).is_ok();
}

#[bench_board::entry]
fn main() -> ! {
    match drive() {
        Ok(true) => report::done(),
        _ => report::fail(c"the filter refused something"),
    }
}

fn drive() -> Result<bool, EkfError> {
    let walls = room().map_err(|_| EkfError::NotFinite)?;
    let config = Config::for_track_width(Metres(0.16));
    let deviation = State {
        x: 0.05,
        y: 0.05,
        heading: 0.02,
        scale_right: 0.01,
        scale_left: 0.01,
        track_width_error: 0.005,
        range_scale: 0.01,
    };
    let start = State { x: 1.2, y: 1.1, heading: 0.1, ..State::default() };
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
        // In front of the robot's centre and to its left: the lever arm counts.
        let sight = Sight { wall, mount: Point::new(0.05, 0.02) };
        let nothing_yet = ExpectedRange::new(&wall, Point::default(), &State::default());
        let ekf = filter.ekf;
        let mut expectation = Expectation { ekf: &ekf, expected: nothing_yet };
        meter.measure(&mut expects, probe_expect, &mut expectation, &sight);
        let expected = expectation.expected;
        let heard = Heard {
            range: expected.range + Metres(0.004),
            expected,
            noise: config.sonar.noise.variance(expected.range),
            gate: config.trust.gate,
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
