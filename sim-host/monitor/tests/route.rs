//! A trip by telemetry and time, without a port.

use std::time::{Duration, Instant};

use sonarfix::filter::ekf::{StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{self, Metres};
use sonarfix_drive::pursuit::{Limits, Progress, Reason};
use sonarfix_link::message::ModeChanged;
use sonarfix_link::{Estimate, Motion, Reporter, Telemetry};
use sonarfix_monitor::request::Control;
use sonarfix_monitor::route::{End, RouteDriver, Trip};
use sonarfix_search::navigator::Mode;

const PATIENCE: Duration = Duration::from_secs(2);

/// The estimate of a robot that faces along x.
fn estimate(x: f32, deviation: f32) -> Estimate {
    let at = units::Instant::from_ticks(0);
    let state = StateEstimate { x: Metres(x), ..StateEstimate::default() };
    let deviation = StandardDeviations {
        x: Metres(deviation),
        y: Metres(0.01),
        ..StandardDeviations::default()
    };
    let Telemetry::Initialized(estimate) = Reporter::resume(at, state, deviation).1 else {
        unreachable!("a report begins with the state")
    };
    estimate
}

fn at(millis: u64, began: Instant) -> Instant {
    began + Duration::from_millis(millis)
}

fn drives(control: Control) -> bool {
    matches!(control, Control::Drive(motion) if motion.speed.0 > 0.1)
}

const STANDS: Control = Control::Drive(Motion {
    speed: units::MetresPerSecond(0.0),
    turn: units::RadiansPerSecond(0.0),
});

#[test]
fn a_robot_without_estimates_stands_and_then_ends_the_trip() {
    let (route, began) = ([Point::new(2.0, 0.0)], Instant::now());
    let driver = RouteDriver::new(&route, Limits::SMALL, None).unwrap();
    let mut trip = Trip::new(driver, PATIENCE, began);
    let message = Telemetry::Estimate(estimate(0.0, 0.01));
    assert!(drives(trip.control(Some(&message), at(100, began))));
    assert_eq!(trip.control(None, at(550, began)), Control::Keep);
    assert_eq!(trip.control(None, at(650, began)), STANDS);
    assert_eq!(trip.control(None, at(750, began)), Control::Keep);
    // It goes on with the next estimate.
    assert!(drives(trip.control(Some(&message), at(900, began))));
    assert_eq!(trip.control(None, at(1_500, began)), STANDS);
    assert_eq!(trip.control(None, at(4_000, began)), Control::Stop);
    assert_eq!(trip.end(), Some(End::Silent));
}

#[test]
fn a_trip_ends_at_its_end_or_when_patience_is_over() {
    let (route, began) = ([Point::new(2.0, 0.0)], Instant::now());
    let trip = |route| {
        let driver = RouteDriver::new(route, Limits::SMALL, None).unwrap();
        Trip::new(driver, PATIENCE, began)
    };
    let mut arrives = trip(&route);
    let there = Telemetry::Estimate(estimate(1.99, 0.01));
    assert_eq!(arrives.control(Some(&there), began), Control::Stop);
    assert_eq!(arrives.end(), Some(End::Arrived));
    let mut waits = trip(&route);
    let uncertain = Telemetry::Estimate(estimate(0.0, 0.2));
    for millis in (0..=2_000).step_by(100) {
        assert_eq!(waits.control(Some(&uncertain), at(millis, began)), STANDS, "{millis}");
        assert_eq!(waits.progress(), Progress::Stopped(Reason::Uncertain));
    }
    assert_eq!(waits.control(Some(&uncertain), at(2_100, began)), Control::Stop);
    assert_eq!(waits.end(), Some(End::Stopped(Reason::Uncertain)));
}

#[test]
fn a_robot_that_searches_for_its_pose_stands() {
    let route = [Point::new(2.0, 0.0)];
    let mut driver = RouteDriver::new(&route, Limits::SMALL, None).unwrap();
    let estimate = estimate(0.0, 0.01);
    for (mode, progress) in [
        (Mode::Searching, Progress::Stopped(Reason::Lost)),
        (Mode::Provisional, Progress::Stopped(Reason::Lost)),
        (Mode::Tracking, Progress::Driving),
    ] {
        assert_eq!(driver.take(&Telemetry::ModeChanged(ModeChanged { mode, estimate })), None);
        let (now, _) = driver.take(&Telemetry::Estimate(estimate)).unwrap();
        assert_eq!(now, progress, "{mode:?}");
    }
}
