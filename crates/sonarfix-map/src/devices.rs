//! Presets of devices that have a name in files, each with its source. The core has those that a program without files needs as
//! well: [`EchoParameters::HC_SR04`], its default, [`EchoParameters::VL53L1X`], [`LightBeam::VL53L1X`], [`ServoTiming::SG90`] and the MPU-6050.

use sonarfix::config::{LightBeam, ServoTiming};
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix::sensor::echo::EchoParameters;

/// LEGO NXT: shares of its recorded sweeps within 20° of the normal (`docs/sonar-model.md`) from 1.1 m on, up to which hardly any
/// echo is missed. It hears walls up to 38° off the normal at 0.3 m, and up to 30° at 0.8 m. It reports 14 mm more at
/// 22° off the normal in the sweeps, and less at the smaller angles of a drive. What that leaves of the bias is common to the pings from
/// one place, like an error of the map: 5 mm below 0.6 m, more beyond.
pub const NXT_ECHO: EchoParameters = {
    let mut nxt = echo(0.24, 0.09, 0.10);
    nxt.sure_within = Metres(1.1);
    (nxt.late.0, nxt.late_per_radian.0) = (0.0, 0.020);
    (nxt.half_angle, nxt.rim) = (Radians(0.56), Radians(0.03));
    nxt.map_accuracy = Metres(0.005);
    nxt
};

/// LEGO EV3: it reports the nearest point of a cone of ±15°, which up to there is the foot of the perpendicular, so that no echo is
/// late. The angles are those of the NXT, and the shares its averages over all ranges, because those of the EV3 are not known.
pub const EV3_ECHO: EchoParameters = {
    let mut ev3 = echo(0.08, 0.04, 0.03);
    (ev3.late.0, ev3.late_per_radian.0) = (0.0, 0.0);
    (ev3.half_angle, ev3.rim) = (NXT_ECHO.half_angle, NXT_ECHO.rim);
    ev3
};

/// Devantech SRF08: assumed like the HC-SR04.
pub const SRF08_ECHO: EchoParameters = EchoParameters::HC_SR04;

/// `MaxBotix` LV-MaxSonar-EZ: assumed like the HC-SR04.
pub const LV_MAXSONAR_ECHO: EchoParameters = EchoParameters::HC_SR04;

/// Polaroid 6500: assumed like the HC-SR04, with fewer misses.
pub const POLAROID_6500_ECHO: EchoParameters = echo(0.02, 0.02, 0.02);

/// VL53L1X in a furnished room.
pub const VL53L1X_ECHO: EchoParameters = EchoParameters::VL53L1X;

/// VL53L0X: assumed like the VL53L1X.
pub const VL53L0X_ECHO: EchoParameters = VL53L1X_ECHO;

/// VL53L0X: a field of view of 25°, of which the inner half returns most of the light (assumed), on a hobby servo that is off
/// by 1.1° (assumed).
pub const VL53L0X_BEAM: LightBeam = LightBeam { spot: Radians(0.11), ..LightBeam::VL53L1X };

/// MG996R: 0.17 s/60° by its datasheet (4.8 V), pulses at 50 Hz; settling as assumed for the SG90 (`docs/hardware.md`).
pub const MG996R: ServoTiming =
    ServoTiming { sixty_degrees: Duration::from_ticks(170_000), ..ServoTiming::SG90 };

/// A servo that turns instantly, with the frame of a digital one: `servo_timing = "instant"`.
pub const INSTANT_SERVO: ServoTiming =
    ServoTiming { frame: Duration::from_ticks(1_000), ..ServoTiming::INSTANT };

/// Names of servos.
pub(crate) const SERVOS: [(&str, ServoTiming); 3] =
    [("instant", INSTANT_SERVO), ("sg90", ServoTiming::SG90), ("mg996r", MG996R)];

/// A sonar with these probabilities of a missed, a short and a long echo, among the objects of a furnished room.
const fn echo(missed: f32, short: f32, long: f32) -> EchoParameters {
    let mut echo = EchoParameters::HC_SR04;
    (echo.missed, echo.short, echo.long) = (missed, short, long);
    echo
}
