//! Deadlines and numbers of connections.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time for a request to arrive, and for a page to take what it is sent.
pub const PATIENCE: Duration = Duration::from_secs(5);
/// Most connections without the token, and whose request has not arrived yet.
pub const MOST_ARRIVING: usize = 32;
/// Most connections with the token: a page has one for its events, and one for each order.
pub const MOST_SEATS: usize = 32;

/// A connection with a deadline for all bytes together, however slowly they come or go.
#[derive(Debug)]
pub struct Timed {
    stream: TcpStream,
    until: Instant,
}

impl Timed {
    /// From now on there is [`PATIENCE`].
    ///
    /// # Errors
    /// Errors of the connection.
    pub fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        Ok(Self { stream, until: Instant::now() + PATIENCE })
    }

    /// From now on there is [`PATIENCE`] again.
    pub fn restart(&mut self) {
        self.until = Instant::now() + PATIENCE;
    }

    fn left(&self) -> io::Result<Duration> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() { Err(ErrorKind::TimedOut.into()) } else { Ok(left) }
    }
}

impl Read for Timed {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(Some(self.left()?))?;
        self.stream.read(to)
    }
}

impl Write for Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(Some(self.left()?))?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// The connections of a server. One too many without the token closes the oldest of them, so that slow clients keep nobody
/// out; one too many with the token is refused.
#[derive(Debug, Default)]
pub struct Connections {
    arriving: Mutex<VecDeque<(u64, TcpStream)>>,
    seated: AtomicUsize,
}

impl Connections {
    /// Takes a connection that has no token yet, by its number.
    ///
    /// # Errors
    /// Errors of the connection.
    pub fn arrive(&self, number: u64, stream: &TcpStream) -> io::Result<()> {
        let stream = stream.try_clone()?;
        let mut arriving = self.lock();
        arriving.push_back((number, stream));
        if arriving.len() > MOST_ARRIVING
            && let Some((_, oldest)) = arriving.pop_front()
        {
            // It may have ended by itself.
            let _ = oldest.shutdown(Shutdown::Both);
        }
        Ok(())
    }

    /// Forgets a connection that has ended.
    pub fn leave(&self, number: u64) {
        self.lock().retain(|(of, _)| *of != number);
    }

    /// Turns a connection into one with the token, until the seat is dropped; `None` if there are too many.
    pub fn seat(&self, number: u64) -> Option<Seat<'_>> {
        self.leave(number);
        let seat = Seat(&self.seated);
        (self.seated.fetch_add(1, Ordering::Relaxed) < MOST_SEATS).then_some(seat)
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        // A connection is in the list or not, also after a panic of another thread.
        self.arriving.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The place of a connection with the token.
#[derive(Debug)]
pub struct Seat<'a>(&'a AtomicUsize);

impl Drop for Seat<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
