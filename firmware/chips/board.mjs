// A board with its robot, and the PC's end of its link. Times in nanoseconds since power-on.
import { Calls } from './calls.mjs';
import { Chip, Flash } from './chip.mjs';
import { Gyro } from './gyro.mjs';
import { Room, STEP, numbers } from './room.mjs';
import { WIRINGS } from './wirings.mjs';

/** Levels of A and B by the two low bits of the count; A leads when a wheel rolls forwards. */
const QUADRATURE = [[false, false], [true, false], [true, true], [false, true]];
/** From pulse to pulse of the servo. */
const FRAME = 20e6;
/** How long the truth is kept: longer than a message waits. */
const HISTORY = 10e9;

/**
 * Nanoseconds until an event, at a time of a chip whose life began at `began`. The difference is that of the two sums: `event - began` may be
 * rounded to the time of the chip before the event is due, so that time would stand still.
 */
export function ahead(began, nanos, event) {
  return Math.max(0, event - (began + nanos));
}

export class Board {
  constructor({ board = 'pico', walls, pose, seed }) {
    this.wiring = WIRINGS[board];
    this.random = numbers(seed);
    this.flash = new Flash(numbers(seed + 1));
    this.room = new Room(walls, pose, numbers(seed + 2), this.wiring);
    this.gyro = new Gyro(() => this.room.turnRate, numbers(seed + 3));
    /** Time at which the present life of the chip began. */
    this.began = 0;
    this.next = STEP;
    this.received = [];
    this.lineFree = 0;
    this.toSend = [];
    this.isNoisy = false;
    /** When the next pulse of the servo begins at the echo, which a wire connects with it instead of the sonar. */
    this.nextPulse = Infinity;
    this.events = [];
    this.truth = [];
    this.isEnabled = false;
    this.chip = null;
    /** The polls of the program's loop. */
    this.polls = new Calls();
    /** When a motor last had a voltage, and when an encoder last changed. */
    this.poweredAt = 0;
    this.rolledAt = 0;
  }

  /** Power-on, or a reset that keeps these registers. */
  start(kept = null) {
    this.began = this.now;
    this.chip = new Chip(this.flash, {
      sent: (byte) => this.received.push(byte),
      wait: (nanos) => this.wait(nanos),
    }, this.polls, kept);
    this.polls.leave();
    this.setEncoders();
    const { pins, slices } = this.wiring;
    this.chip.setInput(pins.echo, false);
    this.chip.rp2040.gpio[pins.trigger].addListener((level) => this.room.trigger(level === 1, this.now));
    if (pins.clock) this.gyro.connect(this.chip.rp2040.gpio, pins.clock, pins.data);
    // The 20 kHz of the motors are read as duties, and not as edges.
    for (const slice of [slices.right, slices.left]) {
      this.chip.rp2040.pwm.channels[slice].updateEnable = function () { this.timer.enable = false; };
    }
    this.watchEnable();
  }

  get now() {
    return this.began + (this.chip?.clock.nanos ?? 0);
  }

  watchEnable() {
    const isEnabled = this.wiring.isEnabled(this.chip);
    if (isEnabled === this.isEnabled) return;
    this.isEnabled = isEnabled;
    this.polls.isDriving = isEnabled;
    this.events.push(`${isEnabled ? 'enabled' : 'disabled'} ${this.now}`);
  }

  setEncoders() {
    const { right, left } = this.wiring.pins;
    this.room.counts.forEach((count, side) => QUADRATURE[count & 3].forEach((level, channel) => {
      this.chip.setInput((side ? left : right)[channel], level);
    }));
  }

  ahead(until) {
    return ahead(this.began, this.chip.clock.nanos, this.nextEvent(until));
  }

  /** Runs until a time. */
  run(until) {
    while (this.now < until) {
      const reset = this.chip.run(this.chip.clock.nanos + this.ahead(until));
      if (reset) this.reset(reset);
      else this.happen();
    }
  }

  /** Time passes while the core is stalled. */
  wait(nanos) {
    const until = this.now + nanos;
    while (this.now < until) {
      this.chip.clock.tick(this.ahead(until));
      this.happen();
    }
  }

  nextEvent(until) {
    const edge = this.room.edges[0]?.at ?? Infinity;
    const byte = this.toSend.length || this.isNoisy ? this.lineFree : Infinity;
    return Math.max(this.now, Math.min(until, this.next, edge, byte, this.nextPulse));
  }

  /** What is due now. */
  happen() {
    const { now, room, chip } = this;
    while (room.edges.length && room.edges[0].at <= now) chip.setInput(this.wiring.pins.echo, room.edges.shift().isHigh);
    if (now >= this.nextPulse) {
      const width = 1e3 * this.pulse();
      if (width) room.edges.push({ at: this.nextPulse, isHigh: true }, { at: this.nextPulse + width, isHigh: false });
      this.nextPulse += FRAME;
    }
    if (now >= this.lineFree && (this.toSend.length || this.isNoisy)) {
      const byte = this.toSend.length ? this.toSend.shift() : Math.floor(256 * this.random());
      chip.uart.receive(byte);
      this.lineFree = now + 10e9 / 115200;
    }
    while (now >= this.next) {
      this.next += STEP;
      this.watchEnable();
      const before = room.counts;
      const voltages = this.voltages();
      if (voltages.some((voltage) => voltage)) this.poweredAt = now;
      room.move(voltages, this.target());
      if (before.some((count, side) => count !== room.counts[side])) {
        this.rolledAt = now;
        this.setEncoders();
      }
      this.truth.push([this.next - STEP - this.began, room.x, room.y, room.heading]);
      if (this.truth.length > HISTORY / STEP) this.truth.splice(0, this.truth.length / 2);
    }
  }

  /** The voltages of both motors as parts of the full one. */
  voltages() {
    return this.isEnabled ? this.wiring.voltages(this.chip) : [0, 0];
  }

  /** The width of the servo's pulses, microseconds. */
  pulse() {
    const { csr, cc, div } = this.chip.rp2040.pwm.channels[this.wiring.slices.servo];
    return csr & 1 ? (cc & 0xffff) * (div / 16) * 8e-3 : 0;
  }

  /** A wire from the servo's pin to that of the echo; the sonar is unplugged. */
  loop() {
    this.room.busyUntil = Infinity;
    this.nextPulse = this.now;
  }

  /** Where the servo's pulses point: 45° at 2 ms, −45° at 1 ms. */
  target() {
    const pulse = this.pulse();
    return pulse > 400 ? ((pulse - 1500) / 500) * (Math.PI / 4) : this.room.bearing;
  }

  /** The chip has been reset: its pins are inputs, and pull-downs disable the motors. */
  reset(cause) {
    const { now } = this;
    if (this.isEnabled) this.events.push(`disabled ${now}`);
    this.isEnabled = false;
    this.polls.isDriving = false;
    this.events.push(`reset-by-${cause} ${now}`);
    this.chip.clearTrap();
    const { kept } = this.chip;
    this.truth = [];
    this.start(cause === 'power' ? null : kept);
  }

  /** The pose at a time of the chip's clock. */
  poseAt(nanos) {
    const first = this.truth[0]?.[0] ?? 0;
    return this.truth[Math.max(0, Math.min(this.truth.length - 1, Math.round((nanos - first) / STEP)))];
  }
}
