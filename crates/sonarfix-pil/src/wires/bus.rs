//! A device on a bus.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource, Operation};

/// A transaction with a device on a bus: `take` gets what is written, `next` returns each byte that is read.
pub(super) fn transact(
    has_failed: bool,
    operations: &mut [Operation<'_>],
    take: impl Fn(&[u8]),
    next: impl Fn() -> u8,
) -> Result<(), ErrorKind> {
    if has_failed {
        return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
    }
    for operation in operations {
        match operation {
            Operation::Write(bytes) => take(bytes),
            Operation::Read(bytes) => bytes.iter_mut().for_each(|byte| *byte = next()),
        }
    }
    Ok(())
}
