//! The line through the two measured pulses of a servo.

use sonarfix_hal::servo::MeasuredPulse;

/// The bearing to which a pulse of a width in µs turns a servo, radians: the line through its two measured pulses.
#[must_use]
pub fn bearing_of(pulses: [MeasuredPulse; 2], width: f64) -> f64 {
    let [(shorter, from), (longer, to)] = pulses.map(point);
    from + (to - from) * (width - shorter) / (longer - shorter)
}

/// The width in µs of the pulse that turns a servo to a bearing in radians.
#[must_use]
pub fn width_of(pulses: [MeasuredPulse; 2], bearing: f64) -> f64 {
    let [(shorter, from), (longer, to)] = pulses.map(point);
    shorter + (longer - shorter) * (bearing - from) / (to - from)
}

/// Width in µs and bearing in radians.
#[expect(clippy::cast_precision_loss, reason = "a pulse has some thousand µs")]
fn point(pulse: MeasuredPulse) -> (f64, f64) {
    (pulse.width.to_micros() as f64, pulse.bearing.0.into())
}
