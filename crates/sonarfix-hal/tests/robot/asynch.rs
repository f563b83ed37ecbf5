//! The loop as a task.

use core::cell::{Cell, RefCell};
use core::future::{Future, pending};
use core::pin::pin;
use core::task::{Context, Waker};

use embedded_hal_async::delay::DelayNs;
use sonarfix::config::PingSchedule;
use sonarfix::geometry::units::{Duration, Instant, Radians};
use sonarfix::localizer::Fix;
use sonarfix_hal::asynch;
use sonarfix_hal::robot::Settings;
use sonarfix_hal::servo::ServoTiming;

use super::rig::{Drive, World, pins, robot, servo, walls};

const TICK: f32 = 1.0 / 1_024.0;
const STILL: Drive = Drive { speed: 0.0, sway: 0.0 };

/// A delay that advances the simulated time, and is pending forever at its end.
struct Until<'w>(&'w World, u64);

impl DelayNs for Until<'_> {
    async fn delay_ns(&mut self, nanos: u32) {
        let to = self.0.now.get() + u64::from(nanos / 1_000);
        if to > self.1 {
            pending::<()>().await;
        }
        self.0.advance(to);
    }
}

/// Polls a task once, which runs until the end of the simulated time.
fn poll<T>(task: impl Future<Output = T>) -> bool {
    let mut context = Context::from_waker(Waker::noop());
    pin!(task).as_mut().poll(&mut context).is_ready()
}

#[test]
fn the_loop_runs_and_sleeps_between() {
    let walls = walls();
    let world = World::new(STILL, TICK, 0);
    let schedule = PingSchedule::Every(Duration::from_ticks(500_000));
    let mut robot = robot(&walls, TICK, schedule, Settings::default());
    let mut pins = pins(&world, ServoTiming::SG90);
    let clock = || Instant::from_ticks(world.now.get());
    let reports = RefCell::new(vec![]);
    let polls = Cell::new(0);
    let counted = || {
        polls.set(polls.get() + 1);
        clock()
    };
    let step = Duration::from_ticks(500);
    let mut delay = Until(&world, 3_450_000);
    let on_report = |_: &_, report| reports.borrow_mut().push(report);
    let task = asynch::run(&mut robot, &mut pins, &counted, &mut delay, step, on_report);
    assert!(!poll(task), "it never ends");

    let reports = reports.into_inner();
    let fixes = reports.iter().filter_map(|report| report.ping_result?.fix);
    assert_eq!(fixes.filter(|fix| matches!(fix, Fix::Accepted(_))).count(), 6);
    assert_eq!(reports.iter().filter(|report| report.tick.is_some()).count(), 34);
    assert!(robot.faults().is_none(), "{:?}", robot.faults());
    // The clock is read twice per iteration. Polled at every step, the loop would take 6,900 iterations.
    assert!(polls.get() < 2 * 400, "{}", polls.get());
}

#[test]
fn a_ping_waits_for_the_servo() {
    let world = World::new(STILL, TICK, 0);
    let mut servo = servo(&world, ServoTiming::SG90);
    let clock = || Instant::from_ticks(world.now.get());
    let mut delay = Until(&world, 10_000_000);
    assert!(poll(asynch::settle(&servo, &clock, &mut delay)));
    assert_eq!(world.now.get(), 0);
    servo.point(clock(), Radians(0.5)).unwrap();
    assert!(poll(asynch::settle(&servo, &clock, &mut delay)));
    assert!(servo.is_settled(clock()) && !servo.is_settled(clock() - Duration::from_ticks(1)));
}
