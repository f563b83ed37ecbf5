//! The counts and time stamps of the state machines of Pico and Pico 2: their programs on an interpreter
//! of the instructions that they use, written from the data sheets (RP2040: section 3.4, RP2350: section
//! 11.4). Neither the assembler nor the chip is part of this test.

#![expect(clippy::panic, reason = "a test should stop")]

use std::collections::{HashMap, VecDeque};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const QUADRATURE: &str = include_str!("../../firmware/pico2/src/quadrature.pio");
const ECHO: &str = include_str!("../../firmware/pico2/src/echo.pio");
const QUADRATURE_RP2040: &str = include_str!("../../firmware/pico/src/quadrature.pio");
const ECHO_RP2040: &str = include_str!("../../firmware/pico/src/echo.pio");

/// A state machine whose shift registers shift to the left, with a receive queue, or four registers in its
/// place. Every instruction takes a clock cycle and those of its delay.
struct Machine {
    code: Vec<Vec<&'static str>>,
    labels: HashMap<&'static str, usize>,
    pc: usize,
    x: u32,
    y: u32,
    isr: u32,
    osr: u32,
    registers: [u32; 4],
    queue: VecDeque<u32>,
    /// Room in the queue.
    depth: usize,
    /// Clock cycles of a delay that remain.
    delay: u32,
}

impl Machine {
    fn new(program: &'static str) -> Self {
        let (mut code, mut labels) = (Vec::new(), HashMap::new());
        for line in program.lines() {
            let line = line.split(';').next().unwrap_or_default().trim();
            if let Some(label) = line.strip_suffix(':') {
                labels.insert(label, code.len());
            } else if line.starts_with('.') {
                labels.insert(line, code.len());
            } else if !line.is_empty() {
                let words = line.split([' ', ',']).filter(|word| !word.is_empty());
                code.push(words.collect());
            }
        }
        Self {
            code,
            labels,
            pc: 0,
            x: 0,
            y: 0,
            isr: 0,
            osr: 0,
            registers: [0; 4],
            queue: VecDeque::new(),
            depth: 4,
            delay: 0,
        }
    }

    /// Runs a number of clock cycles with these levels at the pins; the first is also the jump pin.
    fn run(&mut self, clocks: u32, pins: u32) {
        for _ in 0..clocks {
            self.step(pins);
        }
    }

    fn step(&mut self, pins: u32) {
        if self.delay > 0 {
            self.delay -= 1;
            return;
        }
        let words = self.code[self.pc].clone();
        self.pc += 1;
        if self.pc == self.labels[".wrap"] {
            self.pc = self.labels[".wrap_target"];
        }
        match words[..] {
            ["jmp", label] => self.pc = self.labels[label],
            ["jmp", condition, label] => {
                if self.jumps(condition, pins) {
                    self.pc = self.labels[label];
                }
            }
            ["nop", "[1]"] => self.delay = 1,
            ["set", "y", "1"] => self.y = 1,
            ["in", source, bits] => {
                let bits: u32 = bits.parse().unwrap_or(0);
                let low = (1 << bits) - 1;
                self.isr = self.isr << bits | self.value(source, pins) & low;
            }
            // A full queue drops what is pushed; the shift register is cleared in both cases.
            ["push", "noblock"] => {
                if self.queue.len() < self.depth {
                    self.queue.push_back(self.isr);
                }
                self.isr = 0;
            }
            ["mov", destination, source] => {
                let value = self.value(source, pins);
                match destination {
                    "y" => self.y = value,
                    "isr" => self.isr = value,
                    "osr" => self.osr = value,
                    "pc" => self.pc = value as usize & 31,
                    "rxfifo[0]" => self.registers[0] = value,
                    "rxfifo[1]" => self.registers[1] = value,
                    "rxfifo[2]" => self.registers[2] = value,
                    other => panic!("`{other}` is not known here"),
                }
            }
            _ => panic!("`{words:?}` is not known here"),
        }
    }

    fn is_queued(&self) -> bool {
        self.code.iter().any(|words| words[0] == "push")
    }

    /// The count as the driver reads it: from the register; or what comes after the old contents of the queue.
    fn count(&mut self, pins: u32) -> i32 {
        if !self.is_queued() {
            return self.registers[0].cast_signed();
        }
        for _ in 0..self.queue.len() {
            self.queue.pop_front();
            self.step(pins);
        }
        let fresh = (0..100).find_map(|_| {
            self.step(pins);
            self.queue.pop_front()
        });
        fresh.map_or(i32::MIN, u32::cast_signed)
    }

    /// Whether a jump is taken. `x--` and `y--` count down in both cases.
    fn jumps(&mut self, condition: &str, pins: u32) -> bool {
        let counted = |register: &mut u32| {
            let before = *register;
            *register = before.wrapping_sub(1);
            before != 0
        };
        match condition {
            "x--" => counted(&mut self.x),
            "y--" => counted(&mut self.y),
            "pin" => pins & 1 == 1,
            other => panic!("`{other}` is not known here"),
        }
    }

    fn value(&self, source: &str, pins: u32) -> u32 {
        match source {
            "null" => 0,
            "pins" => pins,
            "x" => self.x,
            "y" => self.y,
            "isr" => self.isr,
            "osr" => self.osr,
            "~x" => !self.x,
            "~y" => !self.y,
            other => panic!("`{other}` is not known here"),
        }
    }
}

/// The longest loop, clock cycles of the state machine.
const SLOWEST: u32 = 12;

/// For any motion of a wheel, with each level held at least long enough to be sampled, no edge is
/// lost, and after a second loop the count can be read. The channels are a Gray code, A below B.
#[test]
fn every_edge_of_an_encoder_is_counted() {
    for program in [QUADRATURE, QUADRATURE_RP2040] {
        every_edge_is_counted_by(program);
    }
}

fn every_edge_is_counted_by(program: &'static str) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut machine = Machine::new(program);
    let mut position = 0_i32;
    let (mut lowest, mut highest) = (0, 0);
    for _ in 0..10_000 {
        let step = if random.random() { 1 } else { -1 };
        let held = random.random_range(SLOWEST..2 * SLOWEST);
        for _ in 0..random.random_range(1..40) {
            position += step;
            machine.run(held, levels(position));
        }
        machine.run(SLOWEST, levels(position));
        assert_eq!(machine.count(levels(position)), position);
        (lowest, highest) = (lowest.min(position), highest.max(position));
    }
    assert!(lowest < 0 && highest > 0, "{lowest} to {highest}: the walk kept to one side");
}

fn levels(position: i32) -> u32 {
    [0b00, 0b01, 0b11, 0b10][position.rem_euclid(4) as usize]
}

/// An edge of both channels at once is illegal: it counts nothing, and counting continues from there.
#[test]
fn both_channels_at_once_count_nothing() {
    let of = |program| (0..4).map(move |start| (program, start));
    for (program, start) in of(QUADRATURE).chain(of(QUADRATURE_RP2040)) {
        let mut machine = Machine::new(program);
        machine.run(2 * SLOWEST, levels(start));
        let before = machine.count(levels(start));
        machine.run(2 * SLOWEST, levels(start + 2));
        assert_eq!(machine.count(levels(start + 2)), before);
        machine.run(2 * SLOWEST, levels(start + 3));
        assert_eq!(machine.count(levels(start + 3)), before.wrapping_add(1));
    }
}

/// Clock cycles of the state machine per microsecond.
const MICROSECOND: u32 = 5;

/// For pulses of any length at any time, the counter keeps the time, and the stamps give the start
/// and the width of the pulse.
#[test]
fn both_edges_of_an_echo_are_stamped() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut machine = Machine::new(ECHO);
    let mut clocks = 0;
    for _ in 0..10_000 {
        let [quiet, pulse, after] = [(); 3].map(|()| random.random_range(10..2_000));
        machine.run(quiet, 0);
        machine.run(pulse, 1);
        machine.run(after, 0);
        clocks += quiet + pulse + after;
        let [count, rise, fall, _] = machine.registers;
        // It starts at −1.
        let in_clocks = |micros: u32| micros * MICROSECOND;
        assert!(in_clocks(count.wrapping_add(1)).abs_diff(clocks) < 2 * MICROSECOND);
        assert!(in_clocks(fall.wrapping_sub(rise)).abs_diff(pulse) < MICROSECOND);
        assert!(in_clocks(count.wrapping_sub(fall)).abs_diff(after) < 2 * MICROSECOND);
    }
}

/// As above, with the edges from a queue: 31 bits of the counter, which counts down, and the level after the edge.
#[test]
fn edges_in_a_queue_have_their_stamps() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut machine = Machine::new(ECHO_RP2040);
    machine.depth = 8;
    let mut clocks = 0;
    let stamp = |edge: u32| (!(edge >> 1) & (u32::MAX >> 1), edge & 1);
    for _ in 0..2_000 {
        let mut edges = Vec::new();
        // As many pulses as the queue holds.
        for _ in 0..4 {
            let [quiet, pulse] = [(); 2].map(|()| random.random_range(10..2_000));
            machine.run(quiet, 0);
            edges.push((clocks + quiet, 1));
            machine.run(pulse, 1);
            edges.push((clocks + quiet + pulse, 0));
            clocks += quiet + pulse;
        }
        machine.run(10, 0);
        clocks += 10;
        assert_eq!(machine.queue.len(), edges.len());
        for (at, level) in edges {
            let (counted, is_high) = machine.queue.pop_front().map_or((0, 9), stamp);
            assert_eq!(is_high, level);
            assert!((counted * MICROSECOND).abs_diff(at) < 2 * MICROSECOND, "{counted}, {at}");
        }
    }
}
