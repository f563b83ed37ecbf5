//! Numbers from bytes: mostly usual ones, sometimes hostile ones.

/// The rest of the input; zeros after its end.
pub struct Bytes<'a>(&'a [u8]);

/// Hostile numbers.
const HOSTILE: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    0.0,
    -0.0,
    1e19,
    -1e-20,
    core::f32::consts::PI,
];

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])
    }

    /// Usually a number in ±`size`; one of 16 is hostile, another has arbitrary bits.
    pub fn number(&mut self, size: f32) -> f32 {
        match self.byte() {
            0..16 => HOSTILE[usize::from(self.byte()) % HOSTILE.len()],
            16..32 => f32::from_bits(self.word()),
            _ => self.share() * size,
        }
    }

    /// Usually a number from `low` to `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        match self.byte() {
            0..8 => HOSTILE[usize::from(self.byte()) % HOSTILE.len()],
            8..12 => f32::from_bits(self.word()),
            _ => low + (high - low) * (0.5 + 0.5 * self.share()),
        }
    }

    /// From −1 to 1.
    fn share(&mut self) -> f32 {
        f32::from(i16::from_le_bytes([self.byte(), self.byte()])) / 32_768.0
    }
}
