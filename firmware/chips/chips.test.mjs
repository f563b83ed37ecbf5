// The parts that the emulator lacks, against the figures of the data sheets. `node --test`
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import test from 'node:test';
import { ahead } from './board.mjs';
import { Calls } from './calls.mjs';
import { Chip } from './chip.mjs';
import { Flash, PowerCut, TIMES } from './flash.mjs';
import { Gyro } from './gyro.mjs';
import { attach } from './pio.mjs';
import { crc32 } from './rom.mjs';
import { Room, STEP, numbers } from './room.mjs';
import { peripherals } from './stm32.mjs';
import { access } from './thumb.mjs';
import { Uart } from './uart.mjs';
import { UsbHost, pipes } from './usb.mjs';
import { WIRINGS } from './wirings.mjs';

const { FIFO, RP2040 } = createRequire(import.meta.url)('rp2040js');

const quiet = (rp2040) => Object.assign(rp2040, { logger: { debug() {}, info() {}, warn() {}, error() {} } });

/** A block with one machine that runs this program, and what runs it to a clock. */
function machine(program, { divider = 1, shift = 0b11 << 18, wrap = program.length - 1 } = {}) {
  const rp2040 = quiet(new RP2040());
  const pio = rp2040.pio[0];
  let now = 0;
  const run = attach(pio, () => now, FIFO);
  const write = (at, value) => pio.writeUint32Atomic(at, value, 0);
  program.forEach((code, i) => write(0x48 + 4 * i, code));
  write(0xc8, divider << 16);
  write(0xcc, wrap << 12);
  write(0xd0, shift);
  write(0x00, 1);
  const until = (clock) => { now = clock; run(); };
  return { rp2040, pio, state: pio.machines[0], until, read: (at) => pio.readUint32(at) };
}

const JMP_X_DECREMENT = (to) => 0x0040 | to;
const NOP = (delay) => 0xa042 | (delay << 8);
const PUSH_NOBLOCK = 0x8000;
const MOV_ISR_X = 0xa0c1;

test('a machine takes a clock an instruction, and one more for each of its delay', () => {
  // Two instructions and three clocks of delay: five clocks a round.
  const { state, until } = machine([JMP_X_DECREMENT(1), NOP(3)]);
  for (const [clock, rounds] of [[5, 1], [50, 10], [500, 100], [5_000_000, 1_000_000]]) {
    until(clock);
    assert.equal(-state.x >>> 0, rounds, `${clock} clocks`);
  }
});

test('the divider counts clocks, and a machine sees an input as long as it lasts', () => {
  const { state, until } = machine([JMP_X_DECREMENT(1), NOP(3)], { divider: 25 });
  until(125_000_000);
  assert.equal(-state.x >>> 0, 1_000_000);
});

test('a count is the same in one leap and in many', () => {
  const [leap, steps] = [0, 1].map(() => machine([JMP_X_DECREMENT(1), NOP(2), MOV_ISR_X, PUSH_NOBLOCK]));
  leap.until(1_000_003);
  for (let clock = 0; clock < 1_000_003; clock += 17) steps.until(clock);
  steps.until(1_000_003);
  assert.equal(leap.state.x, steps.state.x);
  assert.equal(leap.state.pc, steps.state.pc);
});

test('a queue has four places, and eight if it is joined', () => {
  for (const [shift, places] of [[0b11 << 18, 4], [(0b11 << 18) | (1 << 31), 8]]) {
    const { until, read } = machine([MOV_ISR_X, PUSH_NOBLOCK], { shift });
    until(10_000);
    assert.equal((read(0x0c) >> 4) & 15, places);
    // It keeps what it has.
    for (let i = 0; i < places; i++) assert.equal(read(0x20), 0);
  }
});

/** A UART of a chip at 125 MHz and 115,200 baud. */
function uart() {
  const rp2040 = quiet(new RP2040());
  const sent = [];
  const interrupts = [];
  rp2040.setInterrupt = (_, value) => interrupts.push([rp2040.clock.nanos, value]);
  const port = new Uart({ rp2040, clock: rp2040.clock, sent: (byte) => sent.push(byte) }, rp2040.uart[0]);
  const write = (at, value) => rp2040.uart[0].writeUint32Atomic(at, value, 0);
  write(0x24, 67);
  write(0x28, 52);
  return { port, sent, interrupts, write, read: (at) => rp2040.uart[0].readUint32(at), pass: (nanos) => rp2040.clock.tick(nanos) };
}

test('a byte takes ten bits of 115,200 baud, and 32 wait', () => {
  const { sent, write, read, pass } = uart();
  for (let i = 0; i < 40; i++) if (!(read(0x18) & (1 << 5))) write(0x00, i);
  // One is on the line.
  assert.equal(sent.length, 33);
  pass(86_800);
  assert.equal(read(0x18) & (1 << 5), 1 << 5);
  pass(100);
  assert.equal(read(0x18) & (1 << 5), 0);
});

test('half a queue, or the time of 32 bits, interrupts; the 33rd byte is an overrun', () => {
  const { port, interrupts, write, read, pass } = uart();
  write(0x38, (1 << 4) | (1 << 6));
  const isPending = () => interrupts.at(-1)[1];
  port.receive(1);
  assert.equal(isPending(), false);
  pass(277_000);
  assert.equal(isPending(), false);
  pass(1_000);
  assert.equal(isPending(), true);
  assert.equal(read(0x00), 1);
  assert.equal(isPending(), false);
  for (let i = 0; i < 15; i++) port.receive(i);
  assert.equal(isPending(), false);
  port.receive(15);
  assert.equal(isPending(), true);
  for (let i = 16; i < 32; i++) port.receive(i);
  assert.equal(port.overruns, 0);
  port.receive(32);
  assert.equal(port.overruns, 1);
  assert.equal(read(0x00), 1 << 11);
  assert.equal(read(0x00), 1);
});

test('a page clears bits, a sector sets them, and both take their time', () => {
  const flash = new Flash(numbers(1));
  let time = 0;
  flash.wait = (nanos) => { time += nanos; };
  flash.program(0x1000, () => 0x0f, 256);
  flash.program(0x1000, () => 0xf3, 256);
  assert.equal(flash.bytes[0x1000], 0x03);
  assert.equal(time, 2 * TIMES.typical.page);
  flash.erase(0x1000, 4096);
  assert.equal(time, 2 * TIMES.typical.page + TIMES.typical.erase);
  assert.ok(flash.bytes.subarray(0x1000, 0x2000).every((byte) => byte === 0xff));
  assert.throws(() => flash.erase(0x1100, 4096));
  assert.throws(() => flash.program(0x10, () => 0, 256));
});

test('a cut leaves whole bytes before it, and none behind it', () => {
  const flash = new Flash(numbers(1));
  flash.steps.left = 10;
  assert.throws(() => flash.program(0, () => 0, 256), PowerCut);
  assert.ok(flash.bytes.subarray(0, 9).every((byte) => byte === 0));
  assert.ok(flash.bytes.subarray(10, 256).every((byte) => byte === 0xff));
});

test('the checksum of a second stage is that of CRC-32/MPEG-2', () => {
  assert.equal(crc32(Buffer.from('123456789')), 0x0376e6e7);
});

test('a call lasts from its first instruction to the return to its caller', () => {
  const calls = new Calls();
  calls.at = 0x100;
  let instructions = 0;
  const at = (PC, SP, LR = 0) => calls.follow({ PC, SP, LR }, instructions++);
  // The function calls itself, and each call returns to the same place.
  for (const [PC, SP, LR] of [[0x10, 64], [0x100, 64, 0x13], [0x102, 48], [0x100, 48, 0x13], [0x12, 48], [0x104, 48]]) at(PC, SP, LR);
  assert.equal(calls.returned, 0);
  at(0x12, 64);
  assert.deepEqual([calls.returned, calls.waiting, calls.driving], [1, 5, 0]);
  // One that a reset ends does not count.
  calls.isDriving = true;
  for (const [PC, LR] of [[0x100, 0x13], [0x102], [0x12], [0x100, 0x13]]) at(PC, 64, LR);
  calls.leave();
  at(0x12, 64);
  assert.deepEqual([calls.returned, calls.waiting, calls.driving], [2, 5, 2]);
});

test('an event that the program has sent itself ends its next sleep', () => {
  const flash = new Flash(numbers(1));
  // A second stage: SEV; WFE; WFE; a loop.
  const stage = new DataView(flash.bytes.buffer);
  [0xbf40, 0xbf20, 0xbf20, 0xe7fe].forEach((code, i) => stage.setUint16(2 * i, code, true));
  stage.setUint32(252, crc32(flash.bytes.subarray(0, 252)), true);
  const chip = new Chip(flash, {}, new Calls());
  const { core } = chip.rp2040;
  const start = core.PC;
  for (let i = 0; i < 2; i++) chip.step(core);
  assert.deepEqual([core.PC - start, core.waiting], [4, false]);
  chip.step(core);
  assert.equal(core.waiting, true);
});

test('a robot drives as its wheels do, and a wall answers square to it only', () => {
  const room = new Room([[3, -1, 3, 1]], [0, 0, 0], numbers(1));
  const drive = (voltages, seconds) => { for (let t = 0; t < seconds * 1e9; t += STEP) room.move(voltages, 0); };
  drive([0.5, 0.5], 4);
  // 0.25 m/s, reached with a lag of 80 ms.
  assert.ok(Math.abs(room.x - 0.98) < 0.001 && Math.abs(room.y) < 1e-9, `${room.x}`);
  assert.ok(Math.abs(room.sonars[0].range() - (3 - room.x - 0.06)) < 1e-9);
  room.bearing = (11.9 * Math.PI) / 180;
  assert.notEqual(room.sonars[0].range(), null);
  room.bearing = (12.1 * Math.PI) / 180;
  assert.equal(room.sonars[0].range(), null);
  // Right forwards and left backwards is a turn to the left.
  drive([0.2, -0.2], 1);
  assert.ok(room.heading > 1);
});

test('a wall behind another is not heard', () => {
  const room = new Room([[3, -1, 3, 1], [2, -1, 2, 1]], [0, 0, 0], numbers(1));
  assert.equal(room.sonars[0].range(), 2 - 0.06);
  room.walls[1] = [2, 0.1, 2, 1];
  assert.equal(room.sonars[0].range(), 3 - 0.06);
});

test('a right-angled corner answers from within it, and no other end of a wall', () => {
  const room = new Room([[2, -1, 2, 1], [2, 1, -1, 1]], [0, 0, 0], numbers(1));
  const corner = Math.atan2(1, 2 - 0.06);
  room.bearing = corner;
  assert.ok(Math.abs(room.sonars[0].range() - Math.hypot(1, 2 - 0.06)) < 1e-9);
  // Seen from outside it is an edge.
  Object.assign(room, { x: 3, y: 2, bearing: Math.atan2(1 - 2, 2 - 3.06) });
  assert.equal(room.sonars[0].range(), null);
  // At 60 degrees sound does not return.
  Object.assign(room, { x: 0, y: 0, bearing: corner, walls: [[2, -1, 2, 1], [2, 1, 0.268, 2]] });
  assert.equal(room.sonars[0].range(), null);
});

test('a second sonar has its own place and bearing, and does not turn', () => {
  const walls = [[3, -1, 3, 1], [-1, 2, 1, 2]];
  const room = new Room(walls, [0, 0, 0], numbers(1), {}, { mount: [0.05, 0.04], bearing: Math.PI / 2 });
  assert.equal(room.sonars[0].range(), 3 - 0.06);
  assert.ok(Math.abs(room.sonars[1].range() - (2 - 0.04)) < 1e-9);
  room.bearing = 1;
  assert.ok(Math.abs(room.sonars[1].range() - (2 - 0.04)) < 1e-9);
});

/** A master of a bus, by the figures of UM10204, 3.1. */
class Master {
  constructor(device) { this.device = device; }

  bit(level) {
    for (const [clock, data] of [[false, level], [true, level]]) this.device.set(clock, data);
    const { data } = this.device;
    this.device.set(false, level);
    return data;
  }

  start() {
    for (const [clock, data] of [[false, true], [true, true], [true, false], [false, false]]) this.device.set(clock, data);
  }

  stop() {
    for (const [clock, data] of [[false, false], [true, false], [true, true]]) this.device.set(clock, data);
  }

  /** Sends a byte; returns whether it was acknowledged. */
  write(byte) {
    for (let i = 7; i >= 0; i--) this.bit(Boolean((byte >> i) & 1));
    return !this.bit(true);
  }

  read(isLast) {
    let byte = 0;
    for (let i = 0; i < 8; i++) byte = (byte << 1) | Number(this.bit(true));
    this.bit(isLast);
    return byte;
  }
}

test('a gyro answers at its address only, and a count is 8.75 thousandths of a degree per second in the smallest range', () => {
  let rate = 0;
  const gyro = new Gyro(() => rate, () => 0);
  const master = new Master(gyro.device);
  const read = (register, count) => {
    master.start();
    assert.deepEqual([0xd6, register].map((byte) => master.write(byte)), [true, true]);
    master.start();
    assert.ok(master.write(0xd7));
    const bytes = Array.from({ length: count }, (_, i) => master.read(i + 1 === count));
    master.stop();
    return bytes;
  };
  const write = (...bytes) => {
    master.start();
    assert.ok([0xd6, ...bytes].every((byte) => master.write(byte)));
    master.stop();
  };
  master.start();
  assert.equal(master.write(0xd4), false);
  master.stop();
  assert.deepEqual(read(0x0f, 1), [0x6c]);
  // It is off after power-on.
  assert.deepEqual(read(0x26, 2), [0, 0]);
  write(0x12, 0x44);
  for (const [range, degrees] of [[0, 100], [0, -100], [3, 1000]]) {
    write(0x11, 0x60 | (range << 2));
    rate = (degrees * Math.PI) / 180;
    const [low, high] = read(0x26, 2);
    const count = ((high << 24) >> 16) | low;
    // The bias is 0.6°/s.
    assert.ok(Math.abs(count * 8.75e-3 * 2 ** range - degrees - 0.6) < 0.1, `${count}`);
  }
});

test('the inputs of an XRP are phase and enable, and its motors are mirror images', () => {
  const channels = Object.fromEntries([0, 3, 7].map((slice) => [slice, { csr: 1, cc: 0, top: 99 }]));
  const chip = { rp2040: { pwm: { channels } } };
  const set = (slice, a, b) => { channels[slice].cc = a | (b << 16); };
  set(7, 0, 50);
  set(3, 100, 25);
  assert.deepEqual(WIRINGS.xrp.voltages(chip), [0.5, 0.25]);
  set(7, 100, 100);
  set(3, 0, 100);
  assert.deepEqual(WIRINGS.xrp.voltages(chip), [-1, -1]);
});

test('a life of the chip that began at any time reaches every event', () => {
  const random = numbers(7);
  for (let n = 0; n < 100_000; n++) {
    const began = 1e10 * random(), event = began + 1e10 * random();
    let nanos = event - began - 1e-6 * random(), steps = 0;
    while (began + nanos < event && steps < 3) {
      nanos += ahead(began, nanos, event);
      steps++;
    }
    assert.ok(began + nanos >= event && nanos <= event - began + 1e-5, `${began} ${event}`);
  }
});

test('a load or store of Thumb-2 has its register, address, size and length (ARMv7-M, A7.7)', () => {
  const registers = Array.from({ length: 16 }, (_, i) => 0x1000 * i);
  const at = (first, second = 0) => access(first, second, registers);
  // ldr r2, [r1, #36]; str r3, [r0, #4]; strh r5, [r4, #6]; ldrb r6, [r7, #1]; str r1, [r2, r3]
  assert.deepEqual(at(0x6a4a), { base: null, isLoad: true, register: 2, address: 0x1024, size: 4, length: 2 });
  assert.deepEqual(at(0x6043), { base: null, isLoad: false, register: 3, address: 4, size: 4, length: 2 });
  assert.deepEqual(at(0x80e5), { base: null, isLoad: false, register: 5, address: 0x4006, size: 2, length: 2 });
  assert.deepEqual(at(0x787e), { base: null, isLoad: true, register: 6, address: 0x7001, size: 1, length: 2 });
  assert.deepEqual(at(0x50d1), { base: null, isLoad: false, register: 1, address: 0x5000, size: 4, length: 2 });
  // str.w r0, [r10, #20]; ldrh.w r1, [r2, #0x424]; str r3, [r4], #8; ldr.w r5, [r6, r7, lsl #2]
  assert.deepEqual(at(0xf8ca, 0x0014), { base: null, isLoad: false, register: 0, address: 0xa014, size: 4, length: 4 });
  assert.deepEqual(at(0xf8b2, 0x1424), { base: null, isLoad: true, register: 1, address: 0x2424, size: 2, length: 4 });
  assert.deepEqual(at(0xf844, 0x3b08), { base: { number: 4, value: 0x4008 }, isLoad: false, register: 3, address: 0x4000, size: 4, length: 4 });
  assert.deepEqual(at(0xf856, 0x5027), { base: null, isLoad: true, register: 5, address: 0x22000, size: 4, length: 4 });
  assert.throws(() => at(0xbf00), /no load or store/);
});

/** The parts of an STM32F4 around a board that only has a time. */
function stm32() {
  const board = {
    room: { counts: [-3, 7] },
    sonar: { trigger() {} },
    now: 0,
    erased: [],
    setEnabled(isEnabled) { this.isEnabled = isEnabled; },
    erase(sector) { this.erased.push(sector); },
  };
  return { board, parts: peripherals(board) };
}

test('a timer counts edges in encoder mode 3 while it is enabled, in 16 bits (RM0090, 17.4)', () => {
  const { parts: { right, left } } = stm32();
  assert.equal(right.read(0x24), 0);
  right.write(0x08, 3);
  right.write(0x00, 1);
  assert.equal(right.read(0x24), 0xfffd);
  left.write(0x00, 1);
  assert.equal(left.read(0x24), 0);
});

test('the flash is locked until both keys come, and erases by SER with STRT only (RM0090, 3.6)', async () => {
  const { board, parts: { flash } } = stm32();
  const [KEYR, CR] = [0x04, 0x10];
  const erase = async (lock) => {
    await flash.write(CR, 0x212 | lock);
    await flash.write(CR, 0x10212 | lock);
  };
  await erase(0);
  assert.deepEqual(board.erased, []);
  for (const key of [0x45670123, 0xcdef89ab]) await flash.write(KEYR, key);
  // A write that sets LOCK locks it: what follows has no effect.
  await erase(0x80000000);
  assert.deepEqual(board.erased, []);
  for (const key of [0x45670123, 0xcdef89ab]) await flash.write(KEYR, key);
  await erase(0);
  assert.deepEqual(board.erased, [2]);
  assert.equal(flash.isProgramming, false);
  await flash.write(CR, 0x201);
  assert.equal(flash.isProgramming, true);
});

test('the watchdog expires after its window at the slowest oscillator (STM32F405 data sheet, f_LSI)', () => {
  const { board, parts: { watchdog } } = stm32();
  for (const [offset, value] of [[0, 0xcccc], [0, 0x5555], [4, 3], [8, 120], [0, 0xaaaa]]) watchdog.write(offset, value);
  assert.equal(Math.round(watchdog.expiresAt / 1e6), 226);
  board.now = 1e9;
  watchdog.write(0, 0xaaaa);
  assert.equal(Math.round(watchdog.expiresAt / 1e6), 1226);
});

/** Configuration of a serial port: control interface with its notifications, data interface with both pipes. */
const CONFIGURATION = Uint8Array.of(
  9, 2, 39, 0, 2, 1, 0, 0xc0, 50, 9, 4, 0, 0, 1, 2, 2, 0, 0, 7, 5, 0x81, 3, 8, 0, 255,
  9, 4, 1, 0, 2, 10, 0, 0, 0, 7, 5, 0x02, 2, 64, 0, 0, 7, 5, 0x83, 2, 64, 0, 0,
);
/** Registers of the buffers of the pipes above, their controls, and where their buffers lie. */
const [IN_BUFFER, OUT_BUFFER] = [0x80 + 8 * 3, 0x84 + 8 * 2];
const [IN_CONTROL, OUT_CONTROL] = [0x8 + 8 * 2, 0xc + 8];
const [IN_BYTES, OUT_BYTES] = [0x200, 0x240];
const USB_AVAILABLE = 1 << 10;

/** A host whose serial port is open, at a device with buffers. */
function openPort() {
  const rp2040 = quiet(new RP2040());
  const heard = [];
  const host = new UsbHost({ rp2040, clock: rp2040.clock }, (bytes) => heard.push(...bytes));
  Object.assign(host, { isPlugged: true, isOpen: true, pipes: pipes(CONFIGURATION) });
  const view = rp2040.usbDPRAMView;
  view.setUint32(IN_CONTROL, IN_BYTES, true);
  view.setUint32(OUT_CONTROL, OUT_BYTES, true);
  const offer = (register, value) => rp2040.writeUint32(0x50100000 + register, value | USB_AVAILABLE);
  const isTaken = (register) => !(view.getUint32(register, true) & USB_AVAILABLE);
  return { rp2040, host, heard, offer, isTaken, wait: (nanos) => rp2040.clock.tick(nanos) };
}

test('the pipes of a serial port are those of its data interface', () => {
  assert.deepEqual(pipes(CONFIGURATION), { in: 3, out: 2 });
});

test('a packet to the host takes the time of its bytes at 12 Mbit/s', () => {
  const { rp2040, heard, offer, isTaken, wait } = openPort();
  rp2040.usbDPRAM.set([1, 2, 3], IN_BYTES);
  offer(IN_BUFFER, 3);
  wait(3 * 667 + 9_000);
  assert.ok(!isTaken(IN_BUFFER));
  wait(1_100);
  assert.ok(isTaken(IN_BUFFER));
  assert.deepEqual(heard, [1, 2, 3]);
  assert.equal(rp2040.usbCtrl.buffStatus, 1 << 6);
});

test('a device waits for bytes of the host, for its cable and while it sleeps', () => {
  const { rp2040, host, heard, offer, isTaken, wait } = openPort();
  offer(OUT_BUFFER, 64);
  wait(1e6);
  assert.ok(!isTaken(OUT_BUFFER));
  host.send([7, 8]);
  wait(1e5);
  assert.ok(isTaken(OUT_BUFFER));
  assert.deepEqual([...rp2040.usbDPRAM.subarray(OUT_BYTES, OUT_BYTES + 2)], [7, 8]);
  host.suspend();
  offer(IN_BUFFER, 1);
  wait(5e6);
  assert.ok(!isTaken(IN_BUFFER) && rp2040.usbCtrl.sieStatus & (1 << 4));
  // The driver clears it by writing it.
  rp2040.usbCtrl.writeUint32Atomic(0x50, 1 << 4, 0);
  assert.equal(rp2040.usbCtrl.sieStatus & (1 << 4), 0);
  host.resume();
  wait(1e5);
  assert.ok(isTaken(IN_BUFFER));
  host.unplug();
  offer(IN_BUFFER, 1);
  wait(5e6);
  assert.ok(!isTaken(IN_BUFFER) && heard.length === 1);
});

test('a host resets the bus, asks for the device and opens its port', () => {
  const { rp2040, host, wait } = openPort();
  const requests = [];
  rp2040.usbCtrl.sendSetupPacket = (packet) => {
    requests.push([packet[0], packet[1]]);
    // The status at once, and no answer is longer than a packet.
    if (packet[0] & 0x80) {
      host.answered(packet[3] === 2 ? CONFIGURATION : new Uint8Array(18));
      host.bytesFor(0);
    } else host.answered(new Uint8Array());
  };
  Object.assign(host, { isOpen: false, pipes: {} });
  host.plug();
  wait(11e6);
  assert.ok(rp2040.usbCtrl.sieStatus & (1 << 19));
  for (let i = 0; i < 20; i++) wait(1e6);
  assert.deepEqual(requests, [[0x80, 6], [0, 5], [0x80, 6], [0, 9], [0x21, 0x20], [0x21, 0x22]]);
  assert.ok(host.isOpen);
  assert.deepEqual(host.pipes, { in: 3, out: 2 });
});
