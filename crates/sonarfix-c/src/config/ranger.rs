//! A ranger of a configuration.

use sonarfix::config::{
    LightBeam, PingSchedule, PingTiming, RangerParameters, Ranging, ServoTiming,
};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Duration, Metres, Radians};

use crate::state::micros;
use crate::status::{Result, sonarfix_status_t};

/// What a ranger measures with.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_ranging_t {
    /// Sound: the first echo comes from the foot of the perpendicular on a wall.
    SONARFIX_RANGING_SOUND = 0,
    /// Light: the range is along the beam, to the wall that it meets first.
    SONARFIX_RANGING_LIGHT = 1,
}

/// A ranger on its servo, or at a fixed bearing.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_ranger_config_t {
    /// Position of the axis of the servo ahead of the midpoint between the wheels, metres.
    pub mount_x_m: f32,
    /// Position of that axis to the left, metres.
    pub mount_y_m: f32,
    /// Rightmost bearing of the servo, radians, counter-clockwise from the robot's heading; -pi without limits.
    pub servo_right_rad: f32,
    /// Leftmost bearing, radians; pi without limits. Equal to the rightmost: the ranger is fixed there.
    pub servo_left_rad: f32,
    /// Largest angle between beam and perpendicular at which a wall is measured, radians: half of a sonar's cone.
    pub cone_rad: f32,
    /// Shortest range that it reports, metres.
    pub min_range_m: f32,
    /// Longest range that it reports, metres.
    pub max_range_m: f32,
    /// Standard deviation of a range of zero, metres.
    pub noise_floor_m: f32,
    /// Standard deviation per metre of range, besides.
    pub noise_per_metre: f32,
    /// Time from ping to ping, microseconds; zero: as fast as servo and ranger allow. All rangers have the same.
    pub ping_period_us: u32,
    /// Least time between two pings, microseconds, so that echoes of the first have decayed.
    pub ping_cycle_us: u32,
    /// Period of the pulses of the servo, microseconds.
    pub servo_frame_us: u32,
    /// Time of a turn of 60 degrees, microseconds.
    pub servo_sixty_degrees_us: u32,
    /// Time from arrival until the servo has settled, microseconds.
    pub servo_settle_us: u32,
    /// A sonarfix_ranging_t.
    pub ranging: i32,
    /// Light: half of the angle of the spot, radians.
    pub spot_rad: f32,
    /// Light: standard deviation of the direction of the beam, radians.
    pub pointing_rad: f32,
}

impl From<&RangerParameters> for sonarfix_ranger_config_t {
    fn from(ranger: &RangerParameters) -> Self {
        let PingTiming { schedule, servo, cycle } = ranger.timing;
        let (ranging, [spot_rad, pointing_rad]) = match ranger.ranging {
            Ranging::Sound => (sonarfix_ranging_t::SONARFIX_RANGING_SOUND, [0.0; 2]),
            Ranging::Light(LightBeam { spot, pointing, .. }) => {
                (sonarfix_ranging_t::SONARFIX_RANGING_LIGHT, [spot.0, pointing.0])
            }
        };
        Self {
            mount_x_m: ranger.mount.x.0,
            mount_y_m: ranger.mount.y.0,
            servo_right_rad: ranger.servo.0.0,
            servo_left_rad: ranger.servo.1.0,
            cone_rad: ranger.cone.0,
            min_range_m: ranger.min_range.0,
            max_range_m: ranger.max_range.0,
            noise_floor_m: ranger.noise.floor.0,
            noise_per_metre: ranger.noise.per_metre,
            ping_period_us: match schedule {
                PingSchedule::Every(period) => micros(period),
                PingSchedule::AsFastAsPossible => 0,
            },
            ping_cycle_us: micros(cycle),
            servo_frame_us: micros(servo.frame),
            servo_sixty_degrees_us: micros(servo.sixty_degrees),
            servo_settle_us: micros(servo.settle),
            ranging: ranging as i32,
            spot_rad,
            pointing_rad,
        }
    }
}

impl sonarfix_ranger_config_t {
    pub(crate) fn parameters(&self) -> Result<RangerParameters> {
        let mut ranger = RangerParameters::default();
        ranger.mount = Point::new(self.mount_x_m, self.mount_y_m);
        ranger.servo = (Radians(self.servo_right_rad), Radians(self.servo_left_rad));
        ranger.cone = Radians(self.cone_rad);
        (ranger.min_range, ranger.max_range) = (Metres(self.min_range_m), Metres(self.max_range_m));
        ranger.noise.floor = Metres(self.noise_floor_m);
        ranger.noise.per_metre = self.noise_per_metre;
        ranger.timing = self.timing();
        ranger.ranging = self.ranging()?;
        Ok(ranger)
    }

    fn timing(&self) -> PingTiming {
        let schedule = match self.ping_period_us {
            0 => PingSchedule::AsFastAsPossible,
            period => PingSchedule::Every(duration(period)),
        };
        let servo = ServoTiming {
            frame: duration(self.servo_frame_us),
            sixty_degrees: duration(self.servo_sixty_degrees_us),
            settle: duration(self.servo_settle_us),
        };
        PingTiming { schedule, servo, cycle: duration(self.ping_cycle_us) }
    }

    fn ranging(&self) -> Result<Ranging> {
        match self.ranging {
            0 => Ok(Ranging::Sound),
            1 => light(Radians(self.spot_rad), Radians(self.pointing_rad)),
            _ => Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
        }
    }

    pub(super) fn set_servo(&mut self, timing: &ServoTiming, right_rad: f32, left_rad: f32) {
        (self.servo_right_rad, self.servo_left_rad) = (right_rad, left_rad);
        self.servo_frame_us = micros(timing.frame);
        self.servo_sixty_degrees_us = micros(timing.sixty_degrees);
        self.servo_settle_us = micros(timing.settle);
    }
}

fn duration(us: u32) -> Duration {
    Duration::from_ticks(u64::from(us))
}

#[cfg(feature = "light")]
#[expect(clippy::unnecessary_wraps, reason = "a library without light returns an error")]
fn light(spot: Radians, pointing: Radians) -> Result<Ranging> {
    let linked = sonarfix::config::LightLinked;
    Ok(Ranging::Light(LightBeam { spot, pointing, linked }))
}

#[cfg(not(feature = "light"))]
fn light(_: Radians, _: Radians) -> Result<Ranging> {
    Err(sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)
}
