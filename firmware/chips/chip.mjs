// An RP2040 that executes a program: `rp2040js` for the core, its interrupts and most peripherals, and what it lacks.
import { createRequire } from 'node:module';
import { Flash, PowerCut } from './flash.mjs';
import { attach } from './pio.mjs';
import { Rom } from './rom.mjs';
import { Uart } from './uart.mjs';

const { FIFO, RP2040 } = createRequire(import.meta.url)('rp2040js');

/** Nanoseconds of a clock at 125 MHz, to which the firmware sets the core. */
const CLOCK = 8;
const HARD_FAULT = 3;
const XIP = 0x10000000;
const FLASH_END = XIP + 0x1000000;
const ENDLESS_LOOP = 0xe7fe;
const UNDEFINED = 0xde00;

/** Causes of a reset in VREG_AND_CHIP_RESET: power-on. */
const HAD_POR = 1 << 8;

export class Chip {
  /** `io` is told of sent bytes, and lets the time of an operation of the flash pass. `calls` counts those of a function. */
  constructor(flash, io, calls, kept = null) {
    this.flash = flash;
    this.io = io;
    this.calls = calls;
    this.rp2040 = new RP2040();
    const { rp2040 } = this;
    this.clock = rp2040.clock;
    /** Messages of the emulator about what it does not have. */
    this.unknown = new Map();
    this.fault = false;
    this.isLockedUp = false;
    this.instructions = 0;
    this.resetBy = null;
    /** Code that a scenario replaces at the next instruction outside of interrupts, and where it stands. */
    this.trap = null;
    this.trapped = null;
    const log = (from, text) => {
      if (/invalid memory|undefined address/.test(text)) this.fault = true;
      this.unknown.set(`${from}: ${text}`, (this.unknown.get(`${from}: ${text}`) ?? 0) + 1);
    };
    // The emulator reports SEV, and does not execute it.
    const info = (_, text) => { if (text === 'SEV') rp2040.core.eventRegistered = true; };
    rp2040.logger = { debug() {}, info, warn: log, error: log };
    this.rom = new Rom(this);
    rp2040.loadBootrom(this.rom.words);
    rp2040.flash.set(flash.bytes);
    // One memory: what is erased and programmed is what is read.
    flash.bytes = rp2040.flash;
    flash.wait = (nanos) => io.wait(nanos);
    const word = (words) => ({
      readUint32: (offset) => words[offset] ?? 0, writeUint32() {}, writeUint32Atomic() {},
    });
    // XIP_CTRL: the cache is empty, and no stream is under way; VREG_AND_CHIP_RESET.
    rp2040.peripherals[0x14000] = word({ 0x08: 3 });
    rp2040.peripherals[0x40064] = word({ 0x08: kept ? 0 : HAD_POR });
    const watchdog = rp2040.peripherals[0x40058];
    if (kept) Object.assign(watchdog, kept);
    watchdog.onWatchdogTrigger = () => {
      this.resetBy = watchdog.reason === 2 ? 'force' : 'watchdog';
      // It would expire again at once.
      watchdog.timer.enable = false;
      watchdog.alarm.enable = false;
    };
    this.watchdog = watchdog;
    // An undefined instruction, and a breakpoint without a debugger, are faults.
    rp2040.onBreak = () => { this.fault = true; };
    this.catchUp = rp2040.pio.map((pio) => attach(pio, () => Math.floor(this.clock.nanos / CLOCK), FIFO));
    this.uart = new Uart(this, rp2040.uart[0]);
    // The periods of the PWM are not watched one by one.
    this.rom.boot();
  }

  /** What survives a reset by the watchdog: its scratch registers and the reason. */
  get kept() {
    const { scratchData, reason } = this.watchdog;
    return { scratchData, reason };
  }

  sent(byte) {
    this.io.sent(byte, this.uart.sentAt);
  }

  setInput(pin, isHigh) {
    this.catchUp.forEach((run) => run());
    this.rp2040.gpio[pin].setInputValue(isHigh);
  }

  /** Whether an output is driven high. */
  isHigh(pin) {
    return this.rp2040.gpio[pin].value === 1;
  }

  /** Executes until a time in nanoseconds since the start of the chip, or until a reset or a cut of its power. */
  run(until) {
    const { clock, rp2040: { core } } = this;
    try {
      while (clock.nanos < until && !this.resetBy) {
        if (core.waiting || this.isLockedUp) {
          const alarm = clock.nextAlarm?.nanos ?? Infinity;
          clock.tick(Math.max(0, Math.min(alarm, until) - clock.nanos));
        } else this.step(core);
      }
    } catch (error) {
      if (!(error instanceof PowerCut)) throw error;
      this.resetBy = 'power';
    }
    return this.resetBy;
  }

  step(core) {
    const at = core.PC;
    this.calls.follow(core, this.instructions);
    if (at < 0x4000) this.rom.call(at);
    if (this.trap !== null && core.IPSR === 0 && at > XIP && at < FLASH_END) this.setTrap(at);
    if (this.trapped?.at === at && this.trapped.code === ENDLESS_LOOP) {
      // The loop is not executed a million times.
      const alarm = this.clock.nextAlarm?.nanos ?? Infinity;
      this.clock.tick(Math.max(2 * CLOCK, Math.min(1e5, alarm - this.clock.nanos)));
    }
    this.clock.tick(core.executeInstruction() * CLOCK);
    this.instructions++;
    if (this.fault) this.raise(core);
  }

  /** A fault: the handler of faults. One in the entry of that handler, or in itself, locks the core up (ARMv6-M, B1.5.14). */
  raise(core) {
    this.fault = false;
    if (core.IPSR === HARD_FAULT) {
      this.isLockedUp = true;
      return;
    }
    core.exceptionEntry(HARD_FAULT);
    core.PC &= ~1;
    if (this.fault) {
      this.fault = false;
      this.isLockedUp = true;
    }
  }

  setTrap(at) {
    const { flashView } = this.rp2040;
    this.trapped = { at, code: this.trap, was: flashView.getUint16(at - XIP, true) };
    flashView.setUint16(at - XIP, this.trap, true);
    this.trap = null;
  }

  /** Takes the code of a scenario back. */
  clearTrap() {
    if (this.trapped) this.rp2040.flashView.setUint16(this.trapped.at - XIP, this.trapped.was, true);
    this.trapped = null;
  }

  hang() {
    this.trap = ENDLESS_LOOP;
  }

  failAtInstruction() {
    this.trap = UNDEFINED;
  }

  /** The stack has reached the start of the RAM. */
  overflowStack() {
    this.rp2040.core.SP = 0x20000000;
  }
}

export { Flash };
