//! The same drivers behind the waits of `embedded-hal-async`, for executors.
//!
//! Nothing is implemented twice: each function here sleeps until there is something to do, and
//! then polls the driver that is polled without it. Dropping one of its futures is safe; a ping
//! dropped in flight is given up by the driver with the next trigger.
//!
//! # Non-finite policy
//! That of the polled drivers: nothing is computed here.

use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use sonarfix::units::{Duration, Instant};

use crate::encoder::Quadrature;
use crate::ranger::{Outcome, Polled, PulseError, PulseRanger, Ranger, TriggerError};
use crate::robot::{Hardware, Report, Robot};
use crate::servo::Servo;
use crate::time::{after, since};

/// A clock to read: the same for all of a robot.
pub trait Clock {
    /// The time now.
    fn now(&self) -> Instant;
}

impl<F: Fn() -> Instant> Clock for F {
    fn now(&self) -> Instant {
        self()
    }
}

/// Pings, and sleeps until the echo line moves. The edges get the time at which the executor
/// woke this future, so its latency enters the range: 100 µs are 17 mm.
///
/// ```
/// use embedded_hal::digital::{InputPin, OutputPin};
/// use embedded_hal_async::{delay::DelayNs, digital::Wait};
/// use sonarfix::units::Metres;
/// use sonarfix_hal::asynch::{Clock, ping};
/// use sonarfix_hal::ranger::{Polled, PulseRanger};
///
/// /// How far it is to whatever is ahead, if anything.
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
        // Levels, not edges: one that came between poll and wait is not slept through.
        let edge =
            async { if is_high { pin.wait_for_low().await } else { pin.wait_for_high().await } };
        if let Some(Err(error)) = unless(edge, sleep(delay, left)).await {
            return Err(TriggerError::Device(PulseError::Echo(error)));
        }
    }
}

/// Pings with any ranger, and asks for the outcome every `step`: for those on a bus, and those
/// whose edges an interrupt stamps.
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

/// Sleeps until the servo stands still. At once for one that was never pointed.
pub async fn settle<P: SetDutyCycle>(
    servo: &Servo<P>,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
) {
    if servo.target().is_some() {
        sleep(delay, since(servo.settles_at(), clock.now())).await;
    }
}

/// Counts an encoder, for ever: sleeps until either channel moves, and decodes.
///
/// # Errors
/// A pin's. Call it again to go on; an edge missed in between shows as illegal.
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

/// Runs the loop, for ever: polls it every `step` while a ping is in flight and sleeps until
/// something is due otherwise. `tell` gets every report that says anything.
pub async fn run<'m>(
    robot: &mut Robot<'m>,
    hardware: &mut impl Hardware,
    clock: &impl Clock,
    delay: &mut impl DelayNs,
    step: Duration,
    mut tell: impl FnMut(&Robot<'m>, Report),
) -> Infallible {
    loop {
        let report = robot.poll(clock.now(), hardware);
        if !report.is_empty() {
            tell(robot, report);
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

/// Which of two futures was ready.
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

/// The output of `future`, unless `limit` is over before.
async fn unless<A>(future: impl Future<Output = A>, limit: impl Future<Output = ()>) -> Option<A> {
    match either(future, limit).await {
        Either::First(value) => Some(value),
        Either::Second(()) => None,
    }
}
