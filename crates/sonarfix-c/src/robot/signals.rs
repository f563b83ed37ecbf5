//! What a C program passes into a poll, and what it gets out of it.

use sonarfix::config::MAX_RANGERS;
use sonarfix::geometry::units::{Instant, Metres};
use sonarfix_link::Motion;
use sonarfix_pil::wires::{Actuators, Counted, EchoSignals, FULL_DUTY, GyroSignal, Sensors};

use super::commands::sonarfix_command_result_t;
use super::devices::{Reading, Signals};
use crate::aim::sonarfix_aim_t;
use crate::config::SONARFIX_RANGERS;
use crate::fix::sonarfix_fix_t;
use crate::state::{finite, instant, sonarfix_mode_t, sonarfix_pose_t, sonarfix_verdict_t};
use crate::status::{Result, sonarfix_status_t};

/// What the program has read from a ranger that it reads itself.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_reading_t {
    /// Nothing since the last poll.
    SONARFIX_READING_NONE = 0,
    /// A range.
    SONARFIX_READING_RANGE = 1,
    /// No echo, or too little light.
    SONARFIX_READING_NO_ECHO = 2,
    /// The ranger has failed.
    SONARFIX_READING_FAILED = 3,
}

/// The counter of an encoder.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sonarfix_encoder_input_t {
    /// Its count, which wraps around after 2^32.
    pub count: u32,
    /// Illegal transitions that it has counted, which wraps around; 0 if it does not.
    pub illegal: u32,
    /// Not zero if it could not be read.
    pub has_failed: u8,
}

/// What a ranger has reported since the last poll.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_ranger_input_t {
    /// Pulse: when the echo line went high, microseconds.
    pub rose_us: u64,
    /// Pulse: when it went low after that, microseconds.
    pub fell_us: u64,
    /// Other: the instant to which range_m belongs, microseconds, between the start and now: of sound its reflection, of light the
    /// middle of the time in which it was collected.
    pub measured_us: u64,
    /// Other: a sonarfix_reading_t.
    pub reading: i32,
    /// Other: the range, metres.
    pub range_m: f32,
    /// Pulse: not zero if the echo line went high since the last poll.
    pub has_risen: u8,
    /// Pulse: not zero if it went low after that.
    pub has_fallen: u8,
}

/// What was sensed and received since the last poll. All zero except for the time and the counts: nothing new.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_inputs_t {
    /// The time, microseconds.
    pub now_us: u64,
    /// The right wheel.
    pub right: sonarfix_encoder_input_t,
    /// The left wheel.
    pub left: sonarfix_encoder_input_t,
    /// The rangers.
    pub rangers: [sonarfix_ranger_input_t; SONARFIX_RANGERS],
    /// The yaw rate now, radians per second, counter-clockwise.
    pub yaw_rate_rad_per_s: f32,
    /// Not zero if yaw_rate_rad_per_s was read; zero of a robot with a gyro: the gyro has failed.
    pub has_yaw_rate: u8,
    /// Bytes that were received over the link; NULL if there are none.
    pub received: *const u8,
    /// Their number. A poll takes some of them: pass the others again.
    pub received_length: usize,
    /// Memory for bytes to be sent over the link; NULL without a link.
    pub to_send: *mut u8,
    /// Its length. A poll builds no telemetry while less than 600 bytes are free.
    pub to_send_length: usize,
}

impl sonarfix_encoder_input_t {
    fn counted(self) -> Counted {
        let Self { count, illegal, has_failed } = self;
        Counted { ticks: count, illegal, has_failed: has_failed != 0 }
    }
}

impl sonarfix_ranger_input_t {
    fn echo(&self) -> Result<EchoSignals> {
        let at = |is_new: u8, us: u64| (is_new != 0).then(|| instant(us)).transpose();
        let rose = at(self.has_risen, self.rose_us)?;
        let fell = at(self.has_fallen, self.fell_us)?;
        Ok(EchoSignals { rose, fell, ..EchoSignals::default() })
    }

    fn reading(&self) -> Result<Option<Reading>> {
        Ok(match self.reading {
            0 => None,
            1 => {
                let range = Metres(finite(self.range_m)?);
                Some(Reading::Range(instant(self.measured_us)?, range))
            }
            2 => Some(Reading::NoEcho),
            3 => Some(Reading::Failed),
            _ => return Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
        })
    }
}

impl sonarfix_inputs_t {
    /// Checks all inputs, and applies them.
    pub(super) fn apply(&self, signals: &Signals) -> Result<Instant> {
        let now = instant(self.now_us)?;
        let yaw_rate = (self.has_yaw_rate != 0).then(|| finite(self.yaw_rate_rad_per_s));
        let yaw_rate = yaw_rate.transpose()?;
        let mut echoes = [EchoSignals::default(); MAX_RANGERS];
        let mut readings = [None; MAX_RANGERS];
        for ((echo, reading), input) in echoes.iter_mut().zip(&mut readings).zip(&self.rangers) {
            (*echo, *reading) = (input.echo()?, input.reading()?);
        }
        signals.wires.apply(&Sensors {
            at: now,
            right: self.right.counted(),
            left: self.left.counted(),
            echoes,
            gyro: GyroSignal::default(),
        });
        for (wire, reading) in signals.readings.iter().zip(readings) {
            if reading.is_some() {
                wire.reading.set(reading);
            }
        }
        signals.yaw_rate.set(yaw_rate);
        Ok(now)
    }
}

/// What to do with a ranger and its servo.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_ranger_output_t {
    /// Width of the pulse to which the servo is to be set, microseconds, if has_servo_pulse is not zero.
    pub servo_pulse_us: f32,
    /// Not zero if the servo is to be set.
    pub has_servo_pulse: u8,
    /// Pulse: the level of the trigger pin from now on.
    pub trigger: u8,
    /// Not zero if a ping begins with this poll: the trigger has fallen, or another ranger is to be started now.
    pub starts: u8,
}

/// How a robot is to move.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_motion_t {
    /// Speed ahead, metres per second; negative: backwards.
    pub speed_m_per_s: f32,
    /// Turn rate, counter-clockwise, radians per second.
    pub turn_rad_per_s: f32,
    /// The speed of the right wheel at this motion, metres per second.
    pub right_m_per_s: f32,
    /// The speed of the left wheel at this motion, metres per second.
    pub left_m_per_s: f32,
}

impl sonarfix_motion_t {
    const NONE: Self =
        Self { speed_m_per_s: 0.0, turn_rad_per_s: 0.0, right_m_per_s: 0.0, left_m_per_s: 0.0 };

    /// The motion of a robot with this track width; at rest without one.
    pub(super) fn of(motion: Option<Motion>, track_width: Metres) -> Self {
        motion.map_or(Self::NONE, |motion| {
            let [right, left] = motion.wheels(track_width);
            Self {
                speed_m_per_s: motion.speed.0,
                turn_rad_per_s: motion.turn.0,
                right_m_per_s: right.0,
                left_m_per_s: left.0,
            }
        })
    }
}

/// What to do after a poll.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_outputs_t {
    /// When to poll next, microseconds, unless a byte or an edge of an echo arrives earlier.
    pub next_poll_us: u64,
    /// The rangers and their servos.
    pub rangers: [sonarfix_ranger_output_t; SONARFIX_RANGERS],
    /// The estimated pose in the map frame, while the loop runs.
    pub pose: sonarfix_pose_t,
    /// The verdict, while the loop runs; otherwise Lost.
    pub verdict: sonarfix_verdict_t,
    /// What determines the pose.
    pub mode: sonarfix_mode_t,
    /// The result of the command that was waiting.
    pub command: sonarfix_command_result_t,
    /// The ping that this poll has started or ended, if has_pinged or has_fix is not zero.
    pub aim: sonarfix_aim_t,
    /// What the localizer did with the ping that this poll has ended, if has_fix is not zero.
    pub fix: sonarfix_fix_t,
    /// The motion that was commanded over the link, else that of a robot that searches, if has_motion is not zero; otherwise at rest.
    pub motion: sonarfix_motion_t,
    /// How many of the received bytes were taken.
    pub received_taken: usize,
    /// How many bytes are to be sent.
    pub to_send: usize,
    /// Not zero while the loop runs.
    pub is_running: u8,
    /// Not zero if the motors may be enabled.
    pub may_drive: u8,
    /// Not zero if the robot is to move by motion. Zero: it stands, or drives by the rules of the program.
    pub has_motion: u8,
    /// Not zero if a deadline was met: the condition for feeding a watchdog.
    pub is_on_time: u8,
    /// Not zero if the poll has done anything in the loop: the estimate may have changed.
    pub has_worked: u8,
    /// Not zero if a ping was started: aim.
    pub has_pinged: u8,
    /// Not zero if a ping along an aim has ended: aim and fix.
    pub has_fix: u8,
    /// Not zero if the store has changed: save it.
    pub store_has_changed: u8,
}

/// What to do with the rangers. `frames`: the periods of their servos, microseconds.
pub(super) fn rangers(
    signals: &Signals,
    frames: [f32; MAX_RANGERS],
) -> [sonarfix_ranger_output_t; SONARFIX_RANGERS] {
    let Actuators { rangers } = signals.wires.take();
    let mut outputs = [sonarfix_ranger_output_t::NONE; SONARFIX_RANGERS];
    let wires = rangers.iter().zip(&signals.readings).zip(frames);
    for (output, ((actuators, reading), frame)) in outputs.iter_mut().zip(wires) {
        let pulse = actuators.duty.map(|duty| f32::from(duty) * frame / f32::from(FULL_DUTY));
        *output = sonarfix_ranger_output_t {
            servo_pulse_us: pulse.unwrap_or(0.0),
            has_servo_pulse: u8::from(pulse.is_some()),
            trigger: u8::from(actuators.is_raised),
            starts: u8::from(actuators.has_fallen | reading.take_start()),
        };
    }
    outputs
}

impl sonarfix_ranger_output_t {
    const NONE: Self = Self { servo_pulse_us: 0.0, has_servo_pulse: 0, trigger: 0, starts: 0 };
}
