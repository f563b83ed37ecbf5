//! A robot's telemetry and the commands to it, as state: bytes and the time are arguments, and bytes to send are results. The same
//! code runs in `sonarfix monitor` and, as WebAssembly, in a page that a robot is connected to.
//!
//! | module | what |
//! |---|---|
//! | this one | [`Monitor`]: the latest telemetry |
//! | [`view`] | the latest telemetry as text |
//! | [`recording`] | telemetry as a log |
//! | [`sealed`] | a log with checksums and an end |
//! | [`conversation`] | the commands of a session, repeated until they are acknowledged |
//! | [`wheels`] | the travel of the wheels |
//! | [`hints`] | what the telemetry suggests to check |
//! | [`signs`] | signs of life: the devices of a robot on the bench, with hints |
//! | [`feed`] | records of a run as events of a page |
//! | [`order`] | what a page may ask for |
//! | [`robot`] | a robot's telemetry as events of pages; their commands to it |

pub mod conversation;
pub mod feed;
pub mod hints;
pub mod order;
pub mod recording;
pub mod robot;
pub mod sealed;
pub mod signs;
pub mod view;
pub mod wheels;

use sonarfix::config::CalibrationPrior;
use sonarfix::health::Mismatch;
use sonarfix::localizer::Fix;
use sonarfix_hal::robot::AbsoluteResult;
use sonarfix_link::message::{GyroState, LoopStatus, RankedHypothesis, SearchStatus, Telemetry};
use sonarfix_link::{Estimate, Gaps, Hello, Ping, Receiver, ReceiverCounters};
use sonarfix_search::navigator::Mode;

use sonarfix_sim::statistics::FixCounts;

use crate::wheels::Wheels;

/// The latest telemetry of a robot.
#[derive(Debug, Default)]
pub struct Monitor {
    receiver: Receiver<Telemetry>,
    gaps: Gaps,
    hello: Option<Hello>,
    estimate: Option<Estimate>,
    ping: Option<Ping>,
    fixes: FixCounts,
    state: Option<LoopStatus>,
    gyro: Option<GyroState>,
    absolute: Option<AbsoluteResult>,
    mode: Mode,
    search: Option<SearchStatus>,
    hypotheses: Vec<RankedHypothesis>,
    wheels: Wheels,
    prior: CalibrationPrior,
}

/// The most hypotheses that are shown.
const MOST_HYPOTHESES: usize = 8;

/// A telemetry message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Received {
    /// Number of frames lost before it.
    pub lost: u32,
    /// The message.
    pub telemetry: Telemetry,
}

impl Monitor {
    /// Before the first message of a robot whose file has this prior.
    #[must_use]
    pub fn of(prior: CalibrationPrior) -> Self {
        Self { prior, ..Self::default() }
    }

    /// What of the robot file is probably wrong, as far as the latest estimate tells: telemetry has no mount.
    #[must_use]
    pub fn mismatch(&self) -> Option<Mismatch> {
        let Estimate { health, state, .. } = self.estimate.as_ref()?;
        let noise_factor = self.state.as_ref().map_or(1.0, |status| status.noise_factor);
        Mismatch::of(health, noise_factor, state, &self.prior)
    }

    /// Processes a received byte; returns the message that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Received> {
        let frame = self.receiver.push(byte)?;
        let lost = self.gaps.take(frame.sequence);
        match frame.message {
            Telemetry::Hello(hello) => self.hello = Some(hello),
            Telemetry::Initialized(estimate) => {
                self.estimate = Some(estimate);
                self.ping = None;
                self.mode = Mode::Tracking;
                self.search = None;
                self.hypotheses.clear();
                self.fixes = FixCounts::default();
            }
            Telemetry::Estimate(estimate) => self.estimate = Some(estimate),
            Telemetry::PoseSet(estimate) => {
                self.estimate = Some(estimate);
                self.mode = Mode::Tracking;
            }
            Telemetry::Ping(ping) => {
                let fixes = &mut self.fixes;
                *match ping.fix {
                    Fix::Accepted(_) | Fix::Downweighted(_) => &mut fixes.accepted,
                    Fix::Gated(_) => &mut fixes.gated,
                    _ => &mut fixes.refused,
                } += 1;
                self.ping = Some(ping);
            }
            Telemetry::LoopStatus(state) => self.state = Some(state),
            Telemetry::ModeChanged(change) => {
                self.estimate = Some(change.estimate);
                self.mode = change.mode;
                self.hypotheses.clear();
            }
            Telemetry::Search(status) => {
                self.mode = status.mode;
                self.search = Some(status);
            }
            Telemetry::Hypothesis(hypothesis) => self.rank(hypothesis),
            Telemetry::Odometry(step) => self.wheels.take(&step),
            Telemetry::Gyro(gyro) => self.gyro = Some(gyro),
            Telemetry::Absolute(result) => self.absolute = Some(result),
            Telemetry::SkippedPing(_)
            | Telemetry::Turn(_)
            | Telemetry::Sweep(_)
            | Telemetry::Devices(_)
            | Telemetry::Ack(_) => {}
        }
        Some(Received { lost, telemetry: frame.message })
    }

    /// Puts a hypothesis in its place; those behind the best one are of the round before until theirs arrive.
    fn rank(&mut self, hypothesis: RankedHypothesis) {
        let rank = usize::from(hypothesis.rank);
        if let Some(place) = self.hypotheses.get_mut(rank) {
            *place = hypothesis;
        } else if rank < MOST_HYPOTHESES {
            self.hypotheses.push(hypothesis);
        }
    }

    /// Counters of the receiver.
    #[must_use]
    pub fn counters(&self) -> ReceiverCounters {
        self.receiver.counters()
    }

    /// Counters of lost frames.
    #[must_use]
    pub fn gaps(&self) -> Gaps {
        self.gaps
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// The identification of the robot.
    #[must_use]
    pub fn hello(&self) -> Option<&Hello> {
        self.hello.as_ref()
    }

    /// The last ping.
    #[must_use]
    pub fn ping(&self) -> Option<&Ping> {
        self.ping.as_ref()
    }

    /// The last status of the loop.
    #[must_use]
    pub fn loop_status(&self) -> Option<&LoopStatus> {
        self.state.as_ref()
    }

    /// What determines the pose.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The last status of the search.
    #[must_use]
    pub fn search(&self) -> Option<&SearchStatus> {
        self.search.as_ref()
    }

    /// The hypotheses of the search, best first.
    #[must_use]
    pub fn hypotheses(&self) -> &[RankedHypothesis] {
        &self.hypotheses
    }

    /// The travel of the wheels.
    #[must_use]
    pub fn wheels(&self) -> Wheels {
        self.wheels
    }
}
