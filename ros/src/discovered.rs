//! The readers that DDS has found. A service must know the reader of its client before it responds: DDS loses a response to a
//! reader that it finds later, and a client asks as soon as it has found the service.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use ros2_client::gid::Gid;
use rustdds::{DomainParticipant, DomainParticipantStatusEvent, GUID, StatusEvented};
use smol::{LocalExecutor, Timer};

/// How long a response waits for the reader of its client at most.
const PATIENCE: Duration = Duration::from_secs(3);
/// Time between two checks.
const PERIOD: Duration = Duration::from_millis(5);

/// The first half of a reader's or writer's number, which names its participant.
type Half = [u8; 8];

#[derive(Debug, Default)]
struct Found {
    topics: HashMap<GUID, String>,
    matched: HashSet<GUID>,
}

/// The readers of others, as they come and go.
#[derive(Debug, Clone, Default)]
pub struct Discovered(Rc<RefCell<Found>>);

fn half(bytes: &[u8; 16]) -> Half {
    let mut half = [0; 8];
    for (place, byte) in half.iter_mut().zip(bytes) {
        *place = *byte;
    }
    half
}

impl Discovered {
    /// Begins to watch a participant.
    #[must_use]
    pub fn watch(participant: &DomainParticipant, executor: &LocalExecutor<'static>) -> Self {
        let (found, listener) = (Self::default(), participant.status_listener());
        let kept = found.clone();
        let watch = async move {
            let mut events = std::pin::pin!(listener.as_async_status_stream());
            while let Some(event) = events.next().await {
                kept.take(event);
            }
        };
        executor.spawn(watch).detach();
        found
    }

    fn take(&self, event: DomainParticipantStatusEvent) {
        let mut found = self.0.borrow_mut();
        match event {
            DomainParticipantStatusEvent::ReaderDetected { reader } => {
                found.topics.insert(reader.guid, reader.topic_name);
            }
            DomainParticipantStatusEvent::RemoteReaderMatched { remote_reader, .. } => {
                found.matched.insert(remote_reader);
            }
            DomainParticipantStatusEvent::ReaderLost { guid, .. } => {
                found.topics.remove(&guid);
                found.matched.remove(&guid);
            }
            DomainParticipantStatusEvent::ParticipantLost { id, .. } => {
                found.topics.retain(|guid, _| guid.prefix != id);
                found.matched.retain(|guid| guid.prefix != id);
            }
            _ => {}
        }
    }

    fn has(&self, topic: &str, client: Half) -> bool {
        let found = self.0.borrow();
        let is_reader = |guid: &&GUID| {
            let of = found.topics.get(guid);
            of.is_some_and(|of| of == topic) && half(&guid.to_bytes()) == client
        };
        found.matched.iter().any(|guid| is_reader(&guid))
    }

    /// Waits until a reader of this topic is known that belongs to the program of this client, but not for long: a client without
    /// a reader gets no response anyway.
    pub async fn reader_of(&self, topic: &str, client: Gid) {
        let (client, begin) = (half(&client.to_bytes16()), Instant::now());
        while !self.has(topic, client) && begin.elapsed() < PATIENCE {
            Timer::after(PERIOD).await;
        }
    }
}
