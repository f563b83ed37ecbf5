//! The wires between an encoder disc and the controller.

use std::cell::Cell;
use std::convert::Infallible;

use embedded_hal::digital::{ErrorType, InputPin};
use sonarfix_hal::encoder::{Counter, TickCount};
use sonarfix_pil::Counted;

/// The two channels of an encoder, and the decoder's count.
#[derive(Debug, Default)]
pub struct EncoderWires {
    /// Level of channel A.
    pub a: Cell<bool>,
    /// Level of channel B.
    pub b: Cell<bool>,
    /// The count of the decoder.
    pub count: TickCount,
    /// Ticks of whole periods that the decoder was not shown.
    pub skipped: Cell<i64>,
}

impl EncoderWires {
    /// The counter reading, which may fail.
    #[must_use]
    pub fn counted(&self, has_failed: bool) -> Counted {
        let mut counter = &self.count;
        let Ok(ticks) = counter.count();
        #[expect(clippy::cast_possible_truncation, reason = "the count wraps as the decoder's")]
        let ticks = ticks.wrapping_add_signed(self.skipped.get() as i32);
        Counted { ticks, illegal: counter.illegal(), has_failed }
    }
}

/// The controller pin of an encoder channel.
#[derive(Debug)]
pub struct ChannelPin<'w>(pub &'w Cell<bool>);

impl ErrorType for ChannelPin<'_> {
    type Error = Infallible;
}

impl InputPin for ChannelPin<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}
