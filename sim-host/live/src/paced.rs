//! Plays a simulation or a replay at a chosen speed: publishes each record at its time.

use std::time::{Duration, Instant};

use sonarfix_sim::trace::{AbsoluteRecord, FixRecord, Recorder, SearchRecord, Tick};

use sonarfix_telemetry::feed::Feed;
use sonarfix_telemetry::order::{Order, Ordered, Orders, Reply};

/// The least and the largest speed.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.01..=10_000.0;
/// Period of looking for orders after the end.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest wait before orders are looked at.
const WAIT: Duration = Duration::from_millis(50);

/// A recorder that publishes records at a speed.
#[derive(Debug)]
pub struct Paced {
    feed: Feed,
    orders: Orders,
    speed: f64,
    is_paused: bool,
    /// When the clock was last set, and to which time of the run.
    clock: Option<(Instant, f64)>,
}

impl Paced {
    /// At this speed: the time of the run over real time.
    ///
    /// # Errors
    /// If the speed is not between 0.01 and 10,000.
    pub fn new(feed: Feed, orders: Orders, speed: f64) -> anyhow::Result<Self> {
        anyhow::ensure!(SPEEDS.contains(&speed), "--speed must be between 0.01 and 10,000");
        Ok(Self { feed, orders, speed, is_paused: false, clock: None })
    }

    /// Publishes that the run has ended, and answers orders from now on.
    pub fn end(self) -> ! {
        self.feed.notice("the end");
        self.feed.end();
        loop {
            if let Some(ordered) = self.orders.wait(PATIENCE) {
                ordered.answer(Reply::refused("it has ended"));
            }
        }
    }

    /// Waits until a time of the run has come.
    fn wait_for(&mut self, time: f64) {
        loop {
            let (since, from) = *self.clock.get_or_insert((Instant::now(), time));
            let due = Duration::try_from_secs_f64((time - from) / self.speed).unwrap_or_default();
            let missing = due.saturating_sub(since.elapsed());
            if missing.is_zero() && !self.is_paused {
                // Orders are taken also where the run is slower than its speed.
                if let Some(ordered) = self.orders.next() {
                    self.obey(ordered, time);
                }
                return;
            }
            let patience = if self.is_paused { WAIT } else { missing.min(WAIT) };
            if let Some(ordered) = self.orders.wait(patience) {
                let now = if self.is_paused { from } else { self.now(since, from) };
                self.obey(ordered, now);
            }
        }
    }

    /// The time of the run now.
    fn now(&self, since: Instant, from: f64) -> f64 {
        from + since.elapsed().as_secs_f64() * self.speed
    }

    fn obey(&mut self, ordered: Ordered, now: f64) {
        let reply = match ordered.order {
            Order::Pause { on } => {
                self.is_paused = on;
                Reply::done(if on { "paused" } else { "continued" })
            }
            Order::Speed { factor } if SPEEDS.contains(&factor) => {
                self.speed = factor;
                Reply::done("speed set")
            }
            Order::Speed { .. } => Reply::refused("the speed must be between 0.01 and 10,000"),
            _ => Reply::refused("only a robot takes this command"),
        };
        self.clock = Some((Instant::now(), now));
        ordered.answer(reply);
    }
}

impl Recorder for Paced {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let tick = make();
        self.wait_for(tick.time);
        self.feed.tick(&tick);
    }

    fn fix(&mut self, make: impl FnOnce() -> FixRecord) {
        let fix = make();
        self.wait_for(fix.time);
        self.feed.fix(&fix);
    }

    fn absolute(&mut self, make: impl FnOnce() -> AbsoluteRecord) {
        let absolute = make();
        self.wait_for(absolute.time);
        self.feed.absolute(&absolute);
    }

    fn search(&mut self, make: impl FnOnce() -> SearchRecord) {
        let record = make();
        let text = if record.is_provisional { "pose provisional" } else { "searching" };
        self.feed.search(&record, text);
    }
}
