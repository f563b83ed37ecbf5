//! Measures what a call costs on the microcontroller.

/// Counts the instructions and the stack of calls, by an emulator or a cycle counter.
pub trait Meter {
    /// Makes the call; returns the number of its instructions, zero if they are not counted. The call stores its
    /// result in a variable of the caller, because returning it would be counted, too.
    fn measure(&mut self, call: impl FnOnce()) -> u32;

    /// Starts to watch the depth of the stack.
    fn watch_stack(&mut self);

    /// Bytes of stack of the deepest call since then; zero if they are not measured.
    fn deepest(&self) -> u32;
}

/// Measures nothing, on the PC.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unmetered;

impl Meter for Unmetered {
    fn measure(&mut self, call: impl FnOnce()) -> u32 {
        call();
        0
    }

    fn watch_stack(&mut self) {}

    fn deepest(&self) -> u32 {
        0
    }
}
