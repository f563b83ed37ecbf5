// A board with an RP2040 and its robot, and the PC's end of its link. Times in nanoseconds since power-on.
import { Calls } from './calls.mjs';
import { Chip, Flash } from './chip.mjs';
import { TIMES } from './flash.mjs';
import { Gyro } from './gyro.mjs';
import { Robot } from './robot.mjs';
import { load } from './rom.mjs';
import { numbers } from './room.mjs';
import { UsbHost } from './usb.mjs';
import { WIRINGS } from './wirings.mjs';

const XIP = 0x10000000;

/** Levels of A and B by the two low bits of the count; A leads when a wheel rolls forwards. */
const QUADRATURE = [[false, false], [true, false], [true, true], [false, true]];
/** From pulse to pulse of the servo. */
const FRAME = 20e6;

/**
 * Nanoseconds until an event, at a time of a chip whose life began at `began`. The difference is that of the two sums: `event - began` may be
 * rounded to the time of the chip before the event is due, so that time would stand still.
 */
export function ahead(began, nanos, event) {
  return Math.max(0, event - (began + nanos));
}

export class Board extends Robot {
  constructor(world) {
    const { board = 'pico', seed } = world;
    super(world, numbers(seed + 2), WIRINGS[board]);
    this.random = numbers(seed);
    this.flash = new Flash(numbers(seed + 1));
    this.gyro = new Gyro(() => this.room.turnRate, numbers(seed + 3));
    this.received = [];
    this.lineFree = 0;
    this.toSend = [];
    this.isNoisy = false;
    /** When the next pulse of the servo begins at the echo, which a wire connects with it instead of the sonar. */
    this.nextPulse = Infinity;
    this.chip = null;
    /** The other end of the USB socket, whether it is plugged, and what it has received. */
    this.usb = null;
    this.isPlugged = false;
    this.receivedByUsb = [];
    /** The polls of the program's loop. */
    this.polls = new Calls();
  }

  /** Writes a file into the flash: the program as ELF or UF2, or other bytes to an address. */
  load(file, at = null) {
    if (at === null) load(file, this.flash.bytes);
    else this.flash.bytes.set(file, at - XIP);
  }

  /** Power-on, or a reset that keeps these registers. */
  start(kept = null) {
    this.began = this.now;
    this.chip = new Chip(this.flash, {
      sent: (byte) => this.received.push(byte),
      wait: (nanos) => this.wait(nanos),
    }, this.polls, kept);
    this.polls.leave();
    this.usb = new UsbHost(this.chip, (bytes) => this.receivedByUsb.push(...bytes));
    if (this.isPlugged) this.usb.plug();
    this.setEncoders();
    const { pins, slices } = this.wiring;
    this.room.sonars.forEach((sonar, n) => {
      const { trigger, echo } = pins.sonars[n];
      this.chip.setInput(echo, false);
      this.chip.rp2040.gpio[trigger].addListener((level) => sonar.trigger(level === 1, this.now));
    });
    if (pins.clock) this.gyro.connect(this.chip.rp2040.gpio, pins.clock, pins.data);
    // The 20 kHz of the motors are read as duties, and not as edges.
    for (const slice of [slices.right, slices.left]) {
      this.chip.rp2040.pwm.channels[slice].updateEnable = function () { this.timer.enable = false; };
    }
    this.watchEnable();
  }

  /** Those of the flash. */
  get steps() {
    return this.flash.steps;
  }

  get now() {
    return this.began + (this.chip?.clock.nanos ?? 0);
  }

  watchEnable() {
    this.setEnabled(this.wiring.isEnabled(this.chip), this.now);
    this.polls.isDriving = this.isEnabled;
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
    const byte = this.toSend.length || this.isNoisy ? this.lineFree : Infinity;
    return Math.max(this.now, Math.min(until, this.next, this.room.nextEdge, byte, this.nextPulse));
  }

  /** What is due now. */
  happen() {
    const { now, room, chip } = this;
    room.sonars.forEach(({ edges }, n) => {
      while (edges.length && edges[0].at <= now) chip.setInput(this.wiring.pins.sonars[n].echo, edges.shift().isHigh);
    });
    if (now >= this.nextPulse) {
      const width = 1e3 * this.pulse();
      if (width) this.sonar.edges.push({ at: this.nextPulse, isHigh: true }, { at: this.nextPulse + width, isHigh: false });
      this.nextPulse += FRAME;
    }
    if (now >= this.lineFree && (this.toSend.length || this.isNoisy)) {
      const byte = this.toSend.length ? this.toSend.shift() : Math.floor(256 * this.random());
      chip.uart.receive(byte);
      this.lineFree = now + 10e9 / 115200;
    }
    while (now >= this.next) {
      this.watchEnable();
      const hasRolled = this.step(this.isEnabled ? this.wiring.voltages(chip) : [0, 0], this.pulse());
      if (hasRolled) this.setEncoders();
    }
  }

  /** The width of the servo's pulses, microseconds. */
  pulse() {
    const { csr, cc, div } = this.chip.rp2040.pwm.channels[this.wiring.slices.servo];
    return csr & 1 ? (cc & 0xffff) * (div / 16) * 8e-3 : 0;
  }

  /** A wire from the servo's pin to that of the echo; the sonar is unplugged. */
  loop() {
    this.sonar.busyUntil = Infinity;
    this.nextPulse = this.now;
  }

  /** The chip has been reset: its pins are inputs, and pull-downs disable the motors. */
  reset(cause) {
    this.endLife(cause, this.now);
    this.polls.isDriving = false;
    this.chip.clearTrap();
    const { kept } = this.chip;
    this.start(cause === 'power' ? null : kept);
  }

  plug() {
    this.isPlugged = true;
    this.usb.plug();
  }

  unplug() {
    this.isPlugged = false;
    this.usb.unplug();
  }

  hang() {
    this.chip.hang();
  }

  failAtInstruction() {
    this.chip.failAtInstruction();
  }

  /** The longest times of the flash's data sheet. */
  slowFlash() {
    this.flash.times = TIMES.longest;
  }

  counters() {
    const { chip, flash, room } = this;
    const shortTriggers = room.sonars.reduce((sum, sonar) => sum + sonar.shortTriggers, 0);
    return [chip.instructions, chip.uart.overruns, chip.uart.lost, flash.erased, flash.programmed, shortTriggers];
  }
}
