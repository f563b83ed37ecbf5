//! The poll of a robot.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::Localizer;
use sonarfix_app::{Link, Polled};
use sonarfix_hal::robot::Report;
use sonarfix_link::Motion;
use sonarfix_link::frame::TELEMETRY_FRAME_MAX;

use super::commands::sonarfix_command_result_t;
use super::devices::Signals;
use super::held::{Core, parts, sonarfix_robot_t};
use super::signals::{self, sonarfix_inputs_t, sonarfix_motion_t, sonarfix_outputs_t};
use crate::aim::sonarfix_aim_t;
use crate::fix::{sonarfix_fix_t, sonarfix_outcome_t};
use crate::memory::{give, slice, slice_mut, value};
use crate::state::{instant, sonarfix_verdict_t};
use crate::status::{Result, sonarfix_status_t, status_of};

/// The link of a poll: bytes that were received, and memory for those to be sent.
struct Bytes<'a> {
    received: &'a [u8],
    taken: usize,
    to_send: &'a mut [u8],
    length: usize,
}

impl<'a> Bytes<'a> {
    /// # Safety
    /// The pointers are NULL or lead to so many bytes, which nothing else uses for `'a`.
    unsafe fn of(inputs: &sonarfix_inputs_t) -> Result<Self> {
        let sonarfix_inputs_t { received, received_length, to_send, to_send_length, .. } = *inputs;
        let received: &'a [u8] = match received_length {
            0 => &[],
            // SAFETY: by the caller.
            length => unsafe { slice(received, length) }?,
        };
        let to_send: &'a mut [u8] = match to_send_length {
            0 => &mut [],
            // SAFETY: by the caller.
            length => unsafe { slice_mut(to_send, length) }?,
        };
        Ok(Self { received, taken: 0, to_send, length: 0 })
    }
}

impl Link for Bytes<'_> {
    fn receive(&mut self) -> Option<u8> {
        let byte = self.received.get(self.taken).copied()?;
        self.taken += 1;
        Some(byte)
    }

    fn send(&mut self, frame: &[u8]) {
        let end = self.length.saturating_add(frame.len());
        if let Some(room) = self.to_send.get_mut(self.length..end) {
            room.copy_from_slice(frame);
            self.length = end;
        }
    }

    fn has_room(&self, length: usize) -> bool {
        self.to_send.len() - self.length >= length
    }
}

const _: () = assert!(TELEMETRY_FRAME_MAX <= 600, "the comment on to_send_length");

/// Handles what is due: at most one command, one poll of the loop, and telemetry. It never waits. A poll at any other time does
/// nothing, so that a program may poll as often as it likes.
///
/// @param robot  an open robot
/// @param inputs  what was sensed and received since the last poll
/// @param outputs  gets what to do and to send
/// @return SONARFIX_OK; SONARFIX_ERROR_TIME, SONARFIX_ERROR_NOT_FINITE, SONARFIX_ERROR_VALUE or SONARFIX_ERROR_LENGTH by a wrong input;
///   or an error of a pointer or the handle. After an error the poll has not taken place
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_poll(
    robot: *mut sonarfix_robot_t,
    inputs: *const sonarfix_inputs_t,
    outputs: *mut sonarfix_outputs_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        give(outputs, || {
            let (signals, core) = parts(robot)?;
            let inputs = value(inputs)?;
            let mut link = Bytes::of(&inputs)?;
            let now = inputs.apply(signals)?;
            Ok(core.poll(now, signals, &mut link))
        })
    }
}

/// Works on the search for the pose in time that is left after a poll: 39 slices, each less than 0.1 ms on a Cortex-M4F at
/// 168 MHz. Nothing happens while the robot does not search.
///
/// @param robot  an open robot
/// @param now_us  the time of the latest poll, microseconds
/// @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_work(
    robot: *mut sonarfix_robot_t,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    let parts = unsafe { parts(robot) };
    status_of(parts.and_then(|(_, core)| {
        let now = instant(now_us)?;
        core.app.work(now, || now);
        Ok(())
    }))
}

impl Core {
    /// The motion of the robot, if there is one.
    #[cfg(feature = "drive")]
    fn motion(&self) -> Option<Motion> {
        self.app.motion()
    }

    /// Without the feature no motion is commanded, and a robot that searches stands.
    #[cfg(not(feature = "drive"))]
    #[expect(clippy::unused_self, reason = "as with the feature")]
    fn motion(&self) -> Option<Motion> {
        None
    }

    fn poll(&mut self, now: Instant, signals: &Signals, link: &mut Bytes) -> sonarfix_outputs_t {
        let polled = self.app.poll(now, &mut self.devices, link);
        let report = self.app.report().copied().unwrap_or_default();
        let command = self.pending.take().map(|pending| {
            self.app.command(now, &mut self.devices, link, &pending.command()).into()
        });
        let command = command.unwrap_or(sonarfix_command_result_t::SONARFIX_COMMAND_NONE);
        let outputs = self.outputs(signals, polled, &report);
        sonarfix_outputs_t { command, received_taken: link.taken, to_send: link.length, ..outputs }
    }

    fn outputs(
        &mut self,
        signals: &Signals,
        polled: Polled,
        report: &Report,
    ) -> sonarfix_outputs_t {
        let localizer = self.app.localizer();
        let nowhere = Pose::new(0.0, 0.0, Radians(0.0));
        let verdict = localizer.map(|localizer| localizer.health().verdict.into());
        let ended = report.ping_result.and_then(|ping| Some((ping.aim, ping.fix?)));
        let aim = ended.map(|(aim, _)| aim).or(report.pinged);
        let fix = ended.map(|(_, fix)| fix.into());
        let (is_running, may_drive) = (self.app.is_running(), polled.may_drive);
        let motion = self.motion();
        let configuration = self.app.configuration();
        let track_width =
            configuration.map_or(Metres(0.0), |config| config.localizer.drive.track_width);
        sonarfix_outputs_t {
            pose: localizer.map_or(nowhere, Localizer::pose).into(),
            verdict: verdict.unwrap_or(sonarfix_verdict_t::SONARFIX_VERDICT_LOST),
            mode: self.app.navigation_mode().unwrap_or_default().into(),
            command: sonarfix_command_result_t::SONARFIX_COMMAND_NONE,
            aim: aim.map_or(sonarfix_aim_t::of_sweep(Radians(0.0)), Into::into),
            fix: fix.unwrap_or(sonarfix_fix_t::of(sonarfix_outcome_t::SONARFIX_OUTCOME_OTHER)),
            motion: sonarfix_motion_t::of(motion, track_width),
            received_taken: 0,
            to_send: 0,
            is_running: u8::from(is_running),
            may_drive: u8::from(may_drive && is_running),
            has_motion: u8::from(motion.is_some()),
            is_on_time: u8::from(polled.is_on_time),
            has_worked: u8::from(!report.is_empty()),
            has_pinged: u8::from(report.pinged.is_some()),
            has_fix: u8::from(ended.is_some()),
            store_has_changed: u8::from(self.app.store_mut().flash_mut().take_change()),
            rangers: signals::rangers(signals, self.frames),
            next_poll_us: self.app.next_poll(&mut self.devices).ticks(),
        }
    }
}
