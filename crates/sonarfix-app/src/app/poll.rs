//! The context of a poll, and its result.

use sonarfix::geometry::units::Instant;
use sonarfix::health::Verdict;
use sonarfix_hal::config::Unsupported;
use sonarfix_hal::robot::Faults;
use sonarfix_link::message::CommandResult;

use crate::store::StoreError;

/// What the parts of a poll share.
pub(super) struct Poll<'p, H, L> {
    pub now: Instant,
    pub hardware: &'p mut H,
    pub link: &'p mut L,
    /// The result so far.
    pub polled: Polled,
}

/// The result of one poll, without the loop's, which is [`App::report`](super::App::report).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
pub struct Polled {
    /// Faults that the device check has found, while the loop does not run.
    pub missing: Faults,
    /// The result of the command that was executed.
    pub answered: Option<CommandResult>,
    /// At the start: why the board cannot be the robot that its configuration describes.
    pub unsupported: Option<Unsupported>,
    /// The new health verdict, if it has changed.
    pub verdict: Option<Verdict>,
    /// The result of a write to the store.
    pub saved: Option<Result<(), StoreError>>,
    /// Whether this start counts as a success: a reason to set the register of [`boots`](crate::boots) to zero.
    pub is_settled: bool,
    /// Whether the loop runs.
    pub is_running: bool,
    /// Whether the motors may be enabled: while the loop runs, by the
    /// [`MotorPolicy`](sonarfix_hal::config::MotorPolicy) of the configuration.
    pub may_drive: bool,
    /// Whether the loop has been started or stopped in this poll.
    pub has_changed: bool,
    /// Whether a deadline was met, by which [`Liveness`](crate::watchdog::Liveness) decides whether the watchdog is fed.
    pub is_on_time: bool,
}
