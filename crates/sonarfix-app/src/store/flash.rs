//! A flash that answers at once, behind the `async` traits that `sequential-storage` asks for.

use core::future::Future;
use core::pin::{Pin, pin};
use core::task::{Context, Poll, Waker};

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use embedded_storage_async::nor_flash::{NorFlash as AsyncNorFlash, ReadNorFlash as AsyncRead};

/// A flash whose every operation is over when it returns.
#[derive(Debug)]
pub(super) struct AtOnce<F>(pub F);

impl<F: ErrorType> ErrorType for AtOnce<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> AsyncRead for AtOnce<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> impl Future<Output = Done<F>> {
        Over(Some(self.0.read(offset, bytes)))
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> AsyncNorFlash for AtOnce<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Done<F>> {
        Over(Some(self.0.erase(from, to)))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Done<F>> {
        Over(Some(self.0.write(offset, bytes)))
    }
}

type Done<F> = Result<(), <F as ErrorType>::Error>;

/// A future that is over before it begins. One of the standard library, or of an `async fn`, would
/// panic if it were asked twice.
struct Over<T>(Option<T>);

impl<T> Unpin for Over<T> {}

impl<T> Future for Over<T> {
    type Output = T;

    fn poll(mut self: Pin<&mut Self>, _context: &mut Context<'_>) -> Poll<T> {
        self.0.take().map_or(Poll::Pending, Poll::Ready)
    }
}

/// The result of a future that waits for nothing; `None` if it wanted to wait after all.
pub(super) fn at_once<T>(future: impl Future<Output = T>) -> Option<T> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => Some(result),
        Poll::Pending => None,
    }
}
