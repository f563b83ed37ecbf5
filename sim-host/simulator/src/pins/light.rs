//! A time-of-flight ranger at its bus: it collects light after a start, and then reports the range of the middle of that
//! time.

use sonarfix_hal::ranger::RangerKind;
use sonarfix_pil::LightSignal;

/// What its kind determines.
#[derive(Debug)]
struct Kind {
    /// Time from the start to the middle of the light, and to the result, µs.
    middle: u64,
    ready: u64,
    /// Status of a complete range, and of one without enough light.
    complete: u8,
    no_light: u8,
    /// The sensor's correction gain, which its driver applies.
    gain: f64,
}

const VL53L1X: Kind =
    Kind { middle: 27_000, ready: 53_000, complete: 9, no_light: 4, gain: 2_011.0 / 2_048.0 };
/// The light of the fine range ends 1 ms before the result, and has 32 of the 50 ms.
const VL53L0X: Kind =
    Kind { middle: 33_000, ready: 50_000, complete: 11 << 3, no_light: 4 << 3, gain: 1.0 };

/// The sensor.
#[derive(Debug)]
pub struct LightChip {
    kind: Kind,
    /// When it was started, and whether the range is still to be measured.
    started: Option<(u64, bool)>,
    measured: LightSignal,
    signal: LightSignal,
}

impl LightChip {
    /// The sensor of a ranger of this kind; of one that measures with sound, any.
    #[must_use]
    pub fn of(kind: RangerKind) -> Self {
        let kind = match kind {
            RangerKind::Vl53l0x { .. } => VL53L0X,
            _ => VL53L1X,
        };
        let signal = LightSignal::default();
        Self { kind, started: None, measured: signal, signal }
    }

    /// Starts a range at `now`, µs.
    pub fn start(&mut self, now: u64) {
        self.started = Some((now, true));
        self.signal.status = 0;
    }

    /// Whether the middle of the light has passed; true once.
    pub fn is_due(&mut self, now: u64) -> bool {
        let Some((at, is_open)) = &mut self.started else { return false };
        *is_open && now >= *at + self.kind.middle && std::mem::take(is_open)
    }

    /// When something happens next, µs.
    #[must_use]
    pub fn next(&self) -> Option<u64> {
        self.started
            .map(|(at, is_open)| at + if is_open { self.kind.middle } else { self.kind.ready })
    }

    /// The range of the middle of the light, metres; `None` without an echo.
    pub fn measured(&mut self, range: Option<f64>) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few metres; saturates"
        )]
        let millimetres = range.map_or(0, |range| (1e3 * range / self.kind.gain).round() as u16);
        let status = if range.is_some() { self.kind.complete } else { self.kind.no_light };
        self.measured = LightSignal { status, millimetres, has_failed: false };
    }

    /// The signal at `now`, of a sensor that responds on its bus or does not.
    pub fn signal(&mut self, now: u64, is_dead: bool) -> LightSignal {
        if self.started.is_some_and(|(at, is_open)| !is_open && now >= at + self.kind.ready) {
            self.started = None;
            self.signal = self.measured;
        }
        LightSignal { has_failed: is_dead, ..self.signal }
    }
}
