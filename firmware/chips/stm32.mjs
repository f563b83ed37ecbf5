// The parts of an STM32F4 that QEMU's `netduinoplus2` does not have, as registers that the core reads and writes (RM0090). The machine stops before each access to
// them; times are in nanoseconds of the chip.

const word = (registers, offset) => registers.get(offset) ?? 0;

/** Registers that keep what is written to them. */
class Kept {
  constructor(at, bytes = 0x400) {
    Object.assign(this, { at, bytes, kind: 'both', registers: new Map() });
  }

  read(offset) {
    return word(this.registers, offset);
  }

  write(offset, value) {
    this.registers.set(offset, value);
  }

  /** The values after a reset, which are 0. */
  reset() {
    this.registers.clear();
  }
}

/** An advanced timer as a counter of the edges of an encoder: section 17.3.16. */
class Encoder extends Kept {
  constructor(at, count) {
    super(at);
    this.count = count;
  }

  read(offset) {
    const [CR1, SMCR, CNT] = [0x00, 0x08, 0x24];
    const counts = (super.read(CR1) & 1) === 1 && (super.read(SMCR) & 7) === 3;
    return offset === CNT ? (counts ? this.count() & 0xffff : 0) : super.read(offset);
  }
}

/** A timer with one channel, whose pulses turn a servo: section 19.3.9. */
class Pulses extends Kept {
  /** Their width, microseconds of a timer at 16 MHz; 0 while there are none. */
  get width() {
    const [CR1, CCER, PSC, CCR1] = [0x00, 0x20, 0x28, 0x34];
    const runs = super.read(CR1) & 1 && super.read(CCER) & 1;
    return runs ? (super.read(CCR1) * (super.read(PSC) + 1)) / 16 : 0;
  }
}

/** A port: the register that sets and clears pins. The first write to a pin is its first level. */
class Port {
  constructor(at, pin, changed) {
    Object.assign(this, { at: at + 0x18, bytes: 4, kind: 'writes', pin, changed });
  }

  write(_, value) {
    if (value >>> this.pin & 1) this.changed(true);
    else if (value >>> (this.pin + 16) & 1) this.changed(false);
  }
}

/** The independent watchdog: section 21. */
class Watchdog extends Kept {
  /** The slowest oscillator of the data sheet, kHz. */
  static OSCILLATOR = 17;

  constructor(now) {
    super(0x40003000, 16);
    this.now = now;
    this.expiresAt = Infinity;
  }

  write(offset, value) {
    const [KR, PR, RLR] = [0, 4, 8];
    super.write(offset, value);
    if (offset !== KR || ![0xcccc, 0xaaaa].includes(value)) return;
    const divider = 4 << super.read(PR);
    this.expiresAt = this.now() + (1e6 * divider * (super.read(RLR) || 0xfff)) / Watchdog.OSCILLATOR;
  }

  reset() {
    super.reset();
    this.expiresAt = Infinity;
  }
}

/** The causes of a reset: the register RCC_CSR, section 7.3.21. */
class Causes {
  static FLAGS = { power: 1 << 27, force: 1 << 28, watchdog: 1 << 29 };

  constructor() {
    Object.assign(this, { at: 0x40023874, bytes: 4, kind: 'both', flags: Causes.FLAGS.power });
  }

  read() {
    return this.flags;
  }

  write(_, value) {
    if (value >>> 24 & 1) this.flags = 0;
  }

  add(cause) {
    this.flags = cause === 'power' ? Causes.FLAGS.power : this.flags | Causes.FLAGS[cause];
  }
}

/** The controller of the flash, section 3.9; it erases sectors of the store, 2 and 3. */
class FlashController extends Kept {
  static SECTOR = 16 * 1024;

  constructor(erase) {
    super(0x40023c00, 0x20);
    this.erase = erase;
    this.erased = 0;
    this.programmed = 0;
    this.reset();
  }

  reset() {
    super.reset();
    this.keys = [];
    this.isLocked = true;
  }

  read(offset) {
    const [KEYR, SR, CR] = [0x04, 0x0c, 0x10];
    if (offset === KEYR || offset === SR) return 0;
    return offset === CR && this.isLocked ? (super.read(CR) | 0x80000000) >>> 0 : super.read(offset);
  }

  async write(offset, value) {
    const [KEYR, SR, CR] = [0x04, 0x0c, 0x10];
    const [SER, STRT, LOCK] = [1 << 1, 1 << 16, 1 << 31];
    if (offset === KEYR) {
      this.keys = [...this.keys, value].slice(-2);
      if (this.keys[0] === 0x45670123 && this.keys[1] === 0xcdef89ab) this.isLocked = false;
    } else if (offset === CR && !this.isLocked) {
      super.write(CR, (value & ~(STRT | LOCK)) >>> 0);
      this.isLocked = (value & LOCK) !== 0;
      if (value & SER && value & STRT) {
        this.erased++;
        await this.erase((value >>> 3) & 15);
      }
    } else if (offset !== SR && offset !== CR) super.write(offset, value);
  }

  /** Whether words can be written to the flash. */
  get isProgramming() {
    return !this.isLocked && (super.read(0x10) & 1) === 1;
  }
}

/** What the machine lacks, around a board. */
export function peripherals(board) {
  const { room } = board;
  const now = () => board.now;
  const flash = new FlashController((sector) => board.erase(sector));
  return {
    flash,
    right: new Encoder(0x40010000, () => room.counts[0]),
    left: new Encoder(0x40010400, () => room.counts[1]),
    servo: new Pulses(0x40014400),
    trigger: new Port(0x40020000, 1, (isHigh) => board.sonar.trigger(isHigh, board.now)),
    enable: new Port(0x40020400, 7, (isHigh) => board.setEnabled(isHigh, board.now)),
    watchdog: new Watchdog(now),
    causes: new Causes(),
    // Sectors 2 and 3.
    store: {
      at: 0x08008000,
      bytes: 0x8000,
      kind: 'writes',
      async write(offset, value) {
        if (flash.isProgramming) await board.program(this.at + offset, value);
      },
    },
    // Flags of TIM5 that its edges set; the emulated timer has the other registers.
    stamps: {
      at: 0x40000c10,
      bytes: 4,
      kind: 'reads',
      flags: 0,
      read() {
        const { flags } = this;
        this.flags = 0;
        return flags;
      },
    },
    // The core asks for a reset: AIRCR, SYSRESETREQ.
    resets: {
      at: 0xe000ed0c,
      bytes: 4,
      kind: 'writes',
      write(_, value) {
        if (value >>> 2 & 1) board.resetBy = 'force';
      },
    },
    // SysTick begins to count: the length of a sleep.
    sleep: { at: 0xe000e018, bytes: 4, kind: 'writes', write: () => board.sleep() },
  };
}
