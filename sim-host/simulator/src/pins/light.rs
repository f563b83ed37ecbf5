//! A time-of-flight ranger at its bus: it collects light after a start, and then reports the range of the middle of that
//! time.

use sonarfix_pil::LightSignal;

/// Time from the start to the middle of the light, and to the result, µs.
const MIDDLE: u64 = 27_000;
const READY: u64 = 53_000;
/// Status of a complete range, and of one without enough light.
const COMPLETE: u8 = 9;
const NO_LIGHT: u8 = 4;
/// The sensor's correction gain, which its driver applies.
const GAIN: f64 = 2_011.0 / 2_048.0;

/// The sensor.
#[derive(Debug, Default)]
pub struct LightChip {
    /// When it was started, and whether the range is still to be measured.
    started: Option<(u64, bool)>,
    measured: LightSignal,
    signal: LightSignal,
}

impl LightChip {
    /// Starts a range at `now`, µs.
    pub fn start(&mut self, now: u64) {
        self.started = Some((now, true));
        self.signal.status = 0;
    }

    /// Whether the middle of the light has passed; true once.
    pub fn is_due(&mut self, now: u64) -> bool {
        let Some((at, is_open)) = &mut self.started else { return false };
        *is_open && now >= *at + MIDDLE && std::mem::take(is_open)
    }

    /// When something happens next, µs.
    #[must_use]
    pub fn next(&self) -> Option<u64> {
        self.started.map(|(at, is_open)| at + if is_open { MIDDLE } else { READY })
    }

    /// The range of the middle of the light, metres; `None` without an echo.
    pub fn measured(&mut self, range: Option<f64>) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few metres; saturates"
        )]
        let millimetres = range.map_or(0, |range| (1e3 * range / GAIN).round() as u16);
        let status = if range.is_some() { COMPLETE } else { NO_LIGHT };
        self.measured = LightSignal { status, millimetres, has_failed: false };
    }

    /// The signal at `now`, of a sensor that responds on its bus or does not.
    pub fn signal(&mut self, now: u64, is_dead: bool) -> LightSignal {
        if self.started.is_some_and(|(at, is_open)| !is_open && now >= at + READY) {
            self.started = None;
            self.signal = self.measured;
        }
        LightSignal { has_failed: is_dead, ..self.signal }
    }
}
