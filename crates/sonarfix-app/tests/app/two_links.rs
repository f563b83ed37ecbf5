//! A board with two links: which one is that of the PC.

use std::collections::VecDeque;

use sonarfix::geometry::units::{Duration, Instant};
use sonarfix_app::Link;
use sonarfix_app::two_links::{Pluggable, SILENCE, TwoLinks};
use sonarfix_link::{Command, Receiver, Sender, SessionCommand, frame};

/// Queues of both directions.
#[derive(Default)]
struct Wire {
    received: VecDeque<u8>,
    sent: usize,
    is_unplugged: bool,
}

impl Link for Wire {
    fn receive(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    fn send(&mut self, _: &[u8]) {
        self.sent += 1;
    }

    fn has_room(&self, _: usize) -> bool {
        !self.is_unplugged
    }
}

impl Pluggable for Wire {
    fn is_plugged(&self) -> bool {
        !self.is_unplugged
    }

    fn has_received(&self) -> bool {
        !self.received.is_empty()
    }

    fn drop_received(&mut self) {
        self.received.clear();
    }
}

/// The links, and the receiver of the application behind them.
struct Board {
    links: TwoLinks<Wire, Wire>,
    receiver: Receiver<SessionCommand>,
    now: Instant,
    sequence: u16,
}

impl Board {
    fn new() -> Self {
        let links = TwoLinks::new(Wire::default(), Wire::default());
        Self { links, receiver: Receiver::new(), now: Instant::from_ticks(1), sequence: 0 }
    }

    /// A poll after so many milliseconds; returns the number of frames.
    fn poll(&mut self, millis: u64) -> u32 {
        self.now += Duration::from_ticks(1_000 * millis);
        self.links.begin(self.now);
        let mut frames = 0;
        while let Some(byte) = self.links.receive() {
            if self.receiver.push(byte).is_some() {
                self.links.understood();
                frames += 1;
            }
        }
        frames
    }

    fn frame(&mut self) -> Vec<u8> {
        self.sequence += 1;
        let command = SessionCommand { session: 1, command: Command::Stop };
        Sender::starting_at(self.sequence).frame(&command, &mut frame::EMPTY.clone()).to_vec()
    }

    /// How many frames each link sends of one of the robot.
    fn sends(&mut self) -> (usize, usize) {
        (self.links.fixed.sent, self.links.plugged.sent) = (0, 0);
        self.links.send(&[0]);
        (self.links.fixed.sent, self.links.plugged.sent)
    }
}

#[test]
fn both_send_until_a_frame_chooses_one_and_the_other_is_not_heard() {
    let mut board = Board::new();
    board.poll(1);
    assert_eq!(board.sends(), (1, 1));
    let frame = board.frame();
    board.links.plugged.received.extend(&frame);
    assert_eq!(board.poll(1), 1);
    assert_eq!(board.sends(), (0, 1));
    // What the other one says meanwhile is not heard later, either.
    board.links.fixed.received.extend(&frame);
    assert_eq!(board.poll(1), 0);
    board.links.plugged.received.extend(&frame);
    assert_eq!(board.poll(1), 1);

    let mut board = Board::new();
    let frame = board.frame();
    board.links.fixed.received.extend(&frame);
    assert_eq!(board.poll(1), 1);
    assert_eq!(board.sends(), (1, 0));
    board.links.plugged.received.extend(&frame);
    assert_eq!(board.poll(1), 0);
}

#[test]
fn a_silent_link_is_given_up_after_its_time() {
    let mut board = Board::new();
    let frame = board.frame();
    board.links.fixed.received.extend(&frame);
    board.poll(1);
    let silence = SILENCE.to_millis();
    board.poll(silence);
    assert_eq!(board.sends(), (1, 0));
    board.poll(1);
    assert_eq!(board.sends(), (1, 1));
    board.links.plugged.received.extend(&frame);
    assert_eq!(board.poll(1), 1);
    assert_eq!(board.sends(), (0, 1));
}

/// Half of a frame stands before the next one, which is taken whole, on whichever link.
#[test]
fn a_frame_whose_cable_is_unplugged_takes_no_other_with_it() {
    for is_plugged_again in [false, true] {
        let mut board = Board::new();
        let frame = board.frame();
        board.links.plugged.received.extend(&frame);
        assert_eq!(board.poll(1), 1);
        board.links.plugged.received.extend(&frame[..frame.len() / 2]);
        assert_eq!(board.poll(1), 0);
        board.links.plugged.is_unplugged = true;
        board.poll(30);
        assert_eq!(board.sends(), (1, 1), "free at once");
        // Without the zero before it, which a frame of another program may lack.
        let next = board.frame();
        let next = &next[1..];
        if is_plugged_again {
            board.links.plugged.is_unplugged = false;
            board.links.plugged.received.extend(next);
        } else {
            board.links.fixed.received.extend(next);
        }
        assert_eq!(board.poll(1), 1, "{is_plugged_again}");
    }
}

#[test]
fn noise_on_the_fixed_link_does_not_close_the_other() {
    let mut board = Board::new();
    for byte in 0..200_u8 {
        board.links.fixed.received.extend([byte, !byte, 7]);
        board.poll(1);
    }
    assert_eq!(board.sends(), (1, 1));
    let frame = board.frame();
    let (first, rest) = frame.split_at(5);
    board.links.plugged.received.extend(first);
    board.links.fixed.received.extend([1, 2, 3]);
    assert_eq!(board.poll(1), 0);
    board.links.plugged.received.extend(rest);
    board.links.fixed.received.extend([1, 2, 3]);
    assert_eq!(board.poll(1), 1);
    assert_eq!(board.sends(), (0, 1));
}

#[test]
fn an_unplugged_link_does_not_hold_the_other_up() {
    let mut board = Board::new();
    board.links.plugged.is_unplugged = true;
    assert!(board.links.has_room(100));
    board.links.fixed.is_unplugged = true;
    assert!(!board.links.has_room(100));
}
