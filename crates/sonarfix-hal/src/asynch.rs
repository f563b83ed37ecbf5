//! `embedded-hal-async` functions over the same drivers, for executors.
//!
//! Nothing is implemented twice: each function sleeps until there is something to do, and then polls the driver.
//! Dropping a future is safe; the driver aborts a dropped ping with the next trigger.
//!
//! # Non-finite policy
//! That of the polled drivers.

use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use sonarfix::geometry::units::{Duration, Instant};

use crate::encoder::Quadrature;
use crate::ranger::{Outcome, Polled, PulseError, PulseRanger, Ranger, TriggerError};
use crate::robot::{Hardware, Report, Robot};
use crate::servo::Servo;
use crate::time::{after, since};

/// The clock of a robot, common to all of its devices.
pub trait Clock {
    /// The present time.
    fn now(&self) -> Instant;
}

impl<F: Fn() -> Instant> Clock for F {
    fn now(&self) -> Instant {
        self()
    }
}

/// Pings, and sleeps until an edge of the echo line. An edge has the time at which the executor wakes this future, so
/// that its latency enters the range: 100 µs are 17 mm.
///
/// ```
/// use embedded_hal::digital::{InputPin, OutputPin};
/// use embedded_hal_async::{delay::DelayNs, digital::Wait};
/// use sonarfix::geometry::units::Metres;
/// use sonarfix_hal::asynch::{Clock, ping};
/// use sonarfix_hal::ranger::{Polled, PulseRanger};
///
/// /// The distance to the nearest obstacle ahead, if there is one.
/// async fn clearance<T: OutputPin, P: InputPin + Wait>(
///     ranger: &mut PulseRanger<T, Polled<P>>,
///     clock: &impl Clock,
///     delay: &mut impl DelayNs,
/// ) -> Option<Metres> {
///     let outcome = ping(ranger, clock, delay).await.ok()?;
///     outcome.ok().map(|echo| echo.range)
/// }
/// ```
///
/// # Errors
/// [`TriggerError`]; the ping is over.
pub async fn ping<T: OutputPin, P: InputPin + Wait>(
    ranger: &mut PulseRanger<T, Polled<P>>,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
) -> Result<Outcome, TriggerError<PulseError<T::Error, P::Error>>> {
    let start = clock.now();
    ranger.trigger(start)?;
    let timing = *ranger.timing();
    sleep(delay, timing.trigger).await;
    loop {
        let now = clock.now();
        if let Some(outcome) = ranger.poll(now).map_err(TriggerError::Device)? {
            return Ok(outcome);
        }
        let left = since(after(start, timing.listen), now);
        let (pin, is_high) = ranger.line().pin();
        // Levels instead of edges: an edge between poll and wait is not missed.
        let edge =
            async { if is_high { pin.wait_for_low().await } else { pin.wait_for_high().await } };
        if let Some(Err(error)) = unless(edge, sleep(delay, left)).await {
            return Err(TriggerError::Device(PulseError::Echo(error)));
        }
    }
}

/// Pings with any ranger, and polls the outcome every `step`: for rangers on a bus, and for those whose edges are
/// stamped by an interrupt.
///
/// # Errors
/// [`TriggerError`]; the ping is over.
pub async fn measure<R: Ranger>(
    ranger: &mut R,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
    step: Duration,
) -> Result<Outcome, TriggerError<R::Error>> {
    ranger.trigger(clock.now())?;
    loop {
        sleep(delay, step).await;
        let outcome = ranger.poll(clock.now()).map_err(TriggerError::Device)?;
        if let Some(outcome) = outcome {
            return Ok(outcome);
        }
    }
}

/// Sleeps until the servo has settled; not at all before its first command.
pub async fn settle<P: SetDutyCycle>(
    servo: &Servo<P>,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
) {
    if servo.target().is_some() {
        sleep(delay, since(servo.settles_at(), clock.now())).await;
    }
}

/// Decodes an encoder forever: sleeps until an edge of either channel, and counts it.
///
/// # Errors
/// A pin's. A further call continues; an edge missed in between counts as illegal.
pub async fn count<A, B>(decoder: &mut Quadrature<'_, A, B>) -> Result<Infallible, A::Error>
where
    A: InputPin + Wait,
    B: InputPin + Wait + ErrorType<Error = A::Error>,
{
    loop {
        let (a, b) = decoder.pins();
        match either(a.wait_for_any_edge(), b.wait_for_any_edge()).await {
            Either::First(woken) | Either::Second(woken) => woken?,
        }
        decoder.update()?;
    }
}

/// Runs the loop forever: polls it every `step` while a ping is in flight, and otherwise sleeps until something is due.
/// `on_report` receives every report that is not empty.
pub async fn run<'m>(
    robot: &mut Robot<'m>,
    hardware: &mut impl Hardware,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
    step: Duration,
    mut on_report: impl FnMut(&Robot<'m>, Report),
) -> Infallible {
    loop {
        let report = robot.poll(clock.now(), hardware);
        if !report.is_empty() {
            on_report(robot, report);
        }
        let now = clock.now();
        let idle = robot.idle_until(hardware).map_or(step, |until| since(until, now).max(step));
        sleep(delay, idle).await;
    }
}

async fn sleep(delay: &mut impl DelayNs, span: Duration) {
    let micros = u32::try_from(span.ticks()).unwrap_or(u32::MAX);
    delay.delay_us(micros).await;
}

/// The future of two that was ready.
enum Either<A, B> {
    First(A),
    Second(B),
}

/// The first of two futures to be ready; the other is dropped.
async fn either<A, B>(
    first: impl Future<Output = A>,
    second: impl Future<Output = B>,
) -> Either<A, B> {
    let (mut first, mut second) = (pin!(first), pin!(second));
    poll_fn(|context| {
        if let Poll::Ready(value) = first.as_mut().poll(context) {
            return Poll::Ready(Either::First(value));
        }
        second.as_mut().poll(context).map(Either::Second)
    })
    .await
}

/// The output of `future`, if it is ready before `limit`.
async fn unless<A>(future: impl Future<Output = A>, limit: impl Future<Output = ()>) -> Option<A> {
    match either(future, limit).await {
        Either::First(value) => Some(value),
        Either::Second(()) => None,
    }
}
