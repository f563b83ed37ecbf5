//! A robot: its telemetry as events, the commands of pages to it, and its recording. The time is that since any fixed moment.

use std::collections::VecDeque;
use std::io;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use anyhow::Context;
use sonarfix::geometry::units::{MetresPerSecond, RadiansPerSecond};
use sonarfix_hal::robot::AbsoluteResult;
use sonarfix_link::message::Odometry;
use sonarfix_link::{CommandResult, Estimate, Motion, Telemetry};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::observe;

use crate::conversation::{Conversation, Due, Outcome};
use crate::feed::{Feed, Scene, Status};
use crate::order::{Order, Ordered, Orders, Reply};
use crate::recording::Recording;
use crate::signs::Signs;
use crate::{Monitor, Received, hints, view};
use records::Geometry;

mod records;

/// Period of the status, µs of the robot's clock.
const EVERY: u64 = 500_000;

/// A motion of a page ends this long after its last order: three of its periods.
const HELD: Duration = Duration::from_millis(300);

/// A motion that a page holds.
#[derive(Debug, Clone, Copy)]
struct Held {
    motion: Motion,
    until: Duration,
    is_refused: bool,
}

/// A robot on a page.
pub struct Robot {
    feed: Feed,
    scene: Scene,
    names: Vec<String>,
    geometry: Geometry,
    monitor: Monitor,
    conversation: Conversation,
    /// The orders whose commands wait, in their order.
    waiting: VecDeque<Ordered>,
    held: Option<Held>,
    signs: Signs,
    /// Whether the robot has sent the readings of its devices.
    shows_devices: bool,
    recording: Option<Recording>,
    /// Makes the recording that a page orders.
    new_recording: Box<dyn Fn() -> Recording>,
    /// What was recorded, in words.
    recorded: Vec<String>,
    notice: String,
    /// The pose by the encoders alone.
    odometry: records::DeadReckoning,
    /// The time of the last estimate, and when the next status is due.
    last: u64,
    next_status: u64,
}

impl Robot {
    /// A robot of which nothing was received, with the place of its sonar, the commands to it, and what makes the recording that a page
    /// orders.
    #[must_use]
    pub fn new(
        feed: Feed,
        scene: Scene,
        mount: [f64; 2],
        conversation: Conversation,
        new_recording: impl Fn() -> Recording + 'static,
    ) -> Self {
        feed.scene(&scene);
        Self {
            feed,
            names: scene.walls.iter().map(|wall| wall.name.clone()).collect(),
            geometry: Geometry { mount, track: scene.track, ..Geometry::default() },
            monitor: Monitor::of(scene.prior),
            scene,
            conversation,
            waiting: VecDeque::new(),
            held: None,
            signs: Signs::default(),
            shows_devices: false,
            recording: None,
            new_recording: Box::new(new_recording),
            recorded: Vec::new(),
            notice: String::new(),
            odometry: records::DeadReckoning::default(),
            last: 0,
            next_status: 0,
        }
    }

    /// Its telemetry.
    #[must_use]
    pub fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// Takes received bytes: each message that they complete is published, and passed to `show`, before this returns.
    ///
    /// # Errors
    /// If a recording cannot be written.
    pub fn take(
        &mut self,
        bytes: &[u8],
        mut show: impl FnMut(&Monitor, &Received),
    ) -> anyhow::Result<()> {
        for &byte in bytes {
            let Some(received) = self.monitor.push(byte) else { continue };
            if let Some(recording) = &mut self.recording {
                let taken = recording.take(&received);
                taken.with_context(|| format!("cannot write {}", recording.name()))?;
            }
            self.publish(&received);
            show(&self.monitor, &received);
        }
        Ok(())
    }

    /// Takes the orders of pages, and returns the bytes to send to the robot now.
    pub fn obey(&mut self, orders: Option<&Orders>, now: Duration) -> Option<Vec<u8>> {
        while let Some(ordered) = orders.and_then(Orders::next) {
            self.take_order(ordered, now);
        }
        if let Some(held) = self.held.take_if(|held| now >= held.until)
            && !held.is_refused
        {
            // As after a key of the terminal: the robot is commanded to stand.
            self.drive(Some(Motion::default()));
        }
        match self.conversation.poll(now) {
            Due::Send(bytes) => Some(bytes),
            Due::End(outcome) => {
                self.answer(outcome);
                None
            }
            Due::Nothing => None,
        }
    }

    /// Begins a recording.
    pub fn record(&mut self, recording: Recording) {
        self.recording = Some(recording);
    }

    /// Ends a recording, if there is one; the name of its first log, and how many there are, or why the last one is not whole.
    pub fn end_recording(&mut self) -> Option<(String, io::Result<u32>)> {
        let recording = self.recording.take()?;
        Some((recording.name(), recording.end()))
    }

    /// Publishes that the robot is gone, with the reason.
    pub fn end(&mut self, reason: &str) {
        self.status(self.last);
        self.feed.notice(reason);
        self.feed.end();
        while let Some(ordered) = self.waiting.pop_front() {
            ordered.answer(Reply::refused(reason));
        }
    }

    /// Takes an order of this program; its answer is the next [`Self::notice`].
    pub fn ask(&mut self, order: Order, now: Duration) {
        let (nobody, _) = sync_channel(1);
        self.take_order(Ordered::new(order, nobody), now);
    }

    /// The answer to the last order, in words; empty before the first.
    #[must_use]
    pub fn notice(&self) -> &str {
        &self.notice
    }

    /// The name of the first log of the recording, if there is one.
    #[must_use]
    pub fn recording(&self) -> Option<String> {
        self.recording.as_ref().map(Recording::name)
    }

    /// Takes an order of a page.
    pub fn take_order(&mut self, ordered: Ordered, now: Duration) {
        let reply = match (ordered.order, ordered.order.command()) {
            (_, Some(_)) | (Order::Drive { .. } | Order::Leave, _) if !self.scene.commands => {
                Reply::refused("this connection can only be read")
            }
            (Order::Drive { speed, turn }, _) => {
                let (speed, turn) = (MetresPerSecond(speed), RadiansPerSecond(turn));
                return ordered.answer(self.hold(Motion { speed, turn }, now));
            }
            (Order::Leave, _) => {
                self.held = None;
                self.drive(None);
                Reply::done("no motion is commanded")
            }
            (_, Some(command)) if self.conversation.add(command) => {
                self.waiting.push_back(ordered);
                return;
            }
            (Order::Record { on: true }, _) if self.recording.is_some() => {
                Reply::refused("it is recorded already")
            }
            (Order::Record { on: true }, _) => {
                let recording = (self.new_recording)();
                let text = format!("recording {}", recording.name());
                self.record(recording);
                Reply::done(&text)
            }
            (Order::Record { on: false }, _) => match self.end_recording() {
                Some((name, Ok(1..))) => {
                    let text = format!("recorded {name}");
                    self.recorded.push(text.clone());
                    Reply::done(&text)
                }
                Some((name, Err(error))) => {
                    Reply::refused(&format!("cannot write {name}: {error}"))
                }
                Some((_, Ok(0))) => Reply::done("nothing was recorded: no estimate came"),
                None => Reply::refused("nothing is recorded"),
            },
            _ => Reply::refused("a robot does not take this order now"),
        };
        self.note(&reply.text);
        self.status(self.last);
        ordered.answer(reply);
    }

    fn answer(&mut self, outcome: Outcome) {
        if let Outcome::Driven(result) = outcome {
            return self.driven(result);
        }
        let Some(ordered) = self.waiting.pop_front() else { return };
        let reply = match outcome {
            Outcome::Answered(CommandResult::Refused(reason)) => {
                Reply::refused(&format!("the robot refuses: {reason}"))
            }
            Outcome::Answered(_) => Reply::done("done"),
            Outcome::Silence | Outcome::Driven(_) => Reply::refused("the robot does not answer"),
        };
        self.note(&format!("{}: {}", ordered.order.name(), reply.text));
        ordered.answer(reply);
    }

    /// Drives with a motion as long as a page repeats it.
    fn hold(&mut self, motion: Motion, now: Duration) -> Reply {
        let until = now + HELD;
        match &mut self.held {
            Some(held) if held.motion == motion => held.until = until,
            _ => {
                self.held = Some(Held { motion, until, is_refused: false });
                self.drive(Some(motion));
            }
        }
        let is_refused = self.held.is_some_and(|held| held.is_refused);
        if is_refused { Reply::refused(&self.notice) } else { Reply::done("") }
    }

    /// The answer to a motion: another one than done ends the motion.
    fn driven(&mut self, result: Option<CommandResult>) {
        match result {
            Some(CommandResult::Refused(reason)) => {
                self.drive(None);
                if let Some(held) = &mut self.held {
                    held.is_refused = true;
                }
                self.note(&format!("drive: the robot refuses: {reason}"));
            }
            Some(_) => {}
            None => self.note("drive: the robot does not answer"),
        }
    }

    /// Whether it takes commands at all.
    #[must_use]
    pub fn can_be_commanded(&self) -> bool {
        self.scene.commands
    }

    /// Drives with this motion, which is renewed until another call; `None` renews it no more. Without effect on a
    /// connection that can only be read.
    pub fn drive(&mut self, motion: Option<Motion>) {
        self.conversation.drive(motion.filter(|_| self.scene.commands));
    }

    fn note(&mut self, text: &str) {
        self.feed.notice(text);
        text.clone_into(&mut self.notice);
    }

    fn publish(&mut self, received: &Received) {
        if received.lost > 0 {
            self.feed.notice(&format!("{} frames were lost", received.lost));
        }
        self.signs.take(received);
        match &received.telemetry {
            Telemetry::Devices(readings) => {
                self.shows_devices = true;
                if readings.at.ticks() >= self.next_status {
                    self.status(readings.at.ticks());
                }
            }
            Telemetry::Ack(ack) => {
                if let Some(outcome) = self.conversation.take(ack) {
                    self.answer(outcome);
                }
            }
            Telemetry::Initialized(estimate) => self.begin(estimate),
            Telemetry::PoseSet(estimate) => {
                self.odometry.place(estimate);
                self.estimate(estimate);
            }
            Telemetry::ModeChanged(change) => {
                self.odometry.place(&change.estimate);
                self.feed.notice(match change.mode {
                    Mode::Tracking => "the pose is confirmed",
                    Mode::Searching => "the pose is unknown: the search begins",
                    Mode::Provisional => "the search has a pose, which is provisional",
                });
                self.estimate(&change.estimate);
            }
            Telemetry::Estimate(estimate) => self.estimate(estimate),
            Telemetry::Odometry(step) => self.wheels(step),
            Telemetry::Ping(ping) => self.feed.fix(&records::ping(ping, &self.geometry)),
            Telemetry::Sweep(sweep) => self.feed.fix(&records::sweep(sweep, &self.geometry)),
            Telemetry::SkippedPing(skip) => self.feed.fix(&records::skip(*skip, &self.geometry)),
            Telemetry::Search(status) => {
                let record = records::search(status, self.monitor.hypotheses());
                self.feed.search(&record, &view::search(status, &self.names));
            }
            Telemetry::Hello(_) | Telemetry::LoopStatus(_) => self.status(self.last),
            Telemetry::Gyro(gyro) => {
                self.feed.gyro(records::seconds(gyro.at), &observe::gyro(&gyro.status));
            }
            Telemetry::Absolute(AbsoluteResult { measured_at, measurement, fix, .. }) => {
                self.feed.absolute(&observe::absolute_record(*measured_at, measurement, fix));
            }
            Telemetry::Hypothesis(_) | Telemetry::Turn(_) => {}
        }
    }

    /// The robot has started: its clock and its path begin again.
    fn begin(&mut self, estimate: &Estimate) {
        self.feed.scene(&self.scene);
        self.last = 0;
        self.next_status = 0;
        self.odometry = records::DeadReckoning::default();
        self.odometry.place(estimate);
        self.estimate(estimate);
    }

    fn estimate(&mut self, estimate: &Estimate) {
        let at = estimate.at.ticks();
        if at < self.last {
            // The frame that reports the restart was lost.
            self.feed.scene(&self.scene);
            self.next_status = 0;
        }
        self.last = at;
        let tick = records::tick(estimate, self.geometry.track, self.odometry.pose());
        self.geometry.pose = tick.estimate.pose;
        self.feed.tick(&tick);
        if at >= self.next_status {
            self.status(at);
        }
    }

    fn wheels(&mut self, step: &Odometry) {
        self.odometry.take(step, self.geometry.track);
        self.feed.wheels(records::seconds(step.at), step.right_metres, step.left_metres);
    }

    fn status(&mut self, at: u64) {
        self.next_status = at.saturating_add(EVERY);
        let status = self.monitor.loop_status();
        #[expect(clippy::cast_precision_loss, reason = "a duration far below 2^53 µs")]
        let longest_poll = status.map(|status| status.worst_poll.to_micros() as f64 * 1e-6);
        self.feed.status(&Status {
            time: records::seconds(sonarfix::geometry::units::Instant::from_ticks(at)),
            longest_poll,
            deadlines: status.map(|status| status.faults.deadlines),
            lines: self.lines(),
            hints: hints::hints(&self.monitor),
            recording: self.recording(),
        });
    }

    /// All telemetry, and the devices of a robot that shows them.
    fn lines(&self) -> Vec<String> {
        let page = view::page(&self.monitor, &self.names);
        let mut lines: Vec<_> = page.lines().map(str::to_owned).collect();
        if self.shows_devices {
            let rows = self.signs.rows(&self.monitor.counters());
            lines.extend(rows.iter().map(ToString::to_string));
        }
        lines
    }

    /// What was recorded at the order of a page, in words.
    #[must_use]
    pub fn recorded(&self) -> &[String] {
        &self.recorded
    }
}
