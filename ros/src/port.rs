//! The robot's port in a thread of its own, opened again after a failure.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use sonarfix_monitor::port::Port;

/// Time between two attempts to open the port.
const PAUSE: Duration = Duration::from_secs(1);

/// A port; dropping it ends its thread.
pub struct Link {
    commands: Sender<Vec<u8>>,
    is_open: Arc<AtomicBool>,
}

impl Link {
    /// Opens a port by its name. `take` takes the bytes that arrive, `None` when the port fails, and returns whether it wants
    /// more.
    #[must_use]
    pub fn open(
        name: String,
        baud: u32,
        take: impl Fn(Option<Vec<u8>>) -> bool + Send + 'static,
    ) -> Self {
        let (commands, to_send) = channel();
        let is_open = Arc::new(AtomicBool::new(true));
        let thread = Reader { name, baud, to_send, is_open: Arc::clone(&is_open) };
        thread::spawn(move || thread.run(take));
        Self { commands, is_open }
    }

    /// Sends bytes.
    pub fn send(&self, bytes: Vec<u8>) {
        // The thread ends with this link.
        _ = self.commands.send(bytes);
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.is_open.store(false, Ordering::Relaxed);
    }
}

struct Reader {
    name: String,
    baud: u32,
    to_send: Receiver<Vec<u8>>,
    is_open: Arc<AtomicBool>,
}

impl Reader {
    fn run(&self, take: impl Fn(Option<Vec<u8>>) -> bool) {
        while self.is_open.load(Ordering::Relaxed) {
            if let Err(error) = self.read(&take) {
                eprintln!("{}: {error:#}", self.name);
            }
            if !take(None) {
                return;
            }
            thread::sleep(PAUSE);
        }
    }

    /// Reads until the port fails; between two reads it sends.
    fn read(&self, take: &impl Fn(Option<Vec<u8>>) -> bool) -> anyhow::Result<()> {
        let mut port = Port::open(&self.name, self.baud)?;
        loop {
            let next = port.read(|bytes| {
                let wants_more = bytes.is_empty() || take(Some(bytes.to_vec()));
                let is_over = !wants_more || !self.is_open.load(Ordering::Relaxed);
                Ok(match (is_over, self.to_send.try_recv()) {
                    (true, _) => ControlFlow::Break(None),
                    (false, Ok(bytes)) => ControlFlow::Break(Some(bytes)),
                    (false, Err(_)) => ControlFlow::Continue(()),
                })
            })?;
            match next {
                Some(Some(bytes)) => port.send(&bytes)?,
                // The end of the bytes, or of the link.
                Some(None) | None => return Ok(()),
            }
        }
    }
}
