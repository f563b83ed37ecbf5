// The flash of the Pico, a W25Q16JV: erased by sectors of 4 KiB, programmed by pages of 256 bytes, which clears bits only. The times are
// those of its data sheet, as a rule or at most. A power cut can end any operation at any of its steps.

const SECTOR = 4096;
const PAGE = 256;
/** Steps of an erasure at which power can be cut; a page has one for each byte. */
export const ERASE_STEPS = 8;

export const TIMES = {
  typical: { erase: 45e6, page: 0.4e6 },
  longest: { erase: 400e6, page: 3e6 },
};

/** The power was cut. */
export class PowerCut extends Error {}

/** The steps of writes and erasures, in one of which the power is cut. */
export class Steps {
  /** `random` gives numbers below 1. */
  constructor(random) {
    this.random = random;
    this.left = Infinity;
  }

  /** One step; whether the power is cut in it. */
  isCut() {
    if (--this.left > 0) return false;
    this.left = Infinity;
    return true;
  }

  /** Eight bits, each set with this probability: those that an interrupted step has not cleared, or has set. */
  bits(probability) {
    let bits = 0;
    for (let i = 0; i < 8; i++) bits |= (this.random() < probability ? 1 : 0) << i;
    return bits;
  }
}

export class Flash {
  /** `wait` lets nanoseconds pass in which the core is stalled; `random` gives numbers below 1. */
  constructor(random) {
    this.bytes = new Uint8Array(16 << 20).fill(0xff);
    this.steps = new Steps(random);
    this.times = TIMES.typical;
    this.wait = () => {};
    this.erased = 0;
    this.programmed = 0;
  }

  /** One step; `partly` leaves behind what an interrupted step leaves. */
  step(partly) {
    if (!this.steps.isCut()) return;
    partly();
    throw new PowerCut();
  }

  erase(at, bytes) {
    if (at % SECTOR || bytes % SECTOR) throw new Error(`erases ${bytes} bytes at 0x${at.toString(16)}`);
    for (const end = at + bytes; at < end; at += SECTOR) {
      const sector = this.bytes.subarray(at, at + SECTOR);
      for (let i = 0; i < ERASE_STEPS; i++) {
        const share = i / ERASE_STEPS;
        this.step(() => sector.forEach((byte, k) => { sector[k] = byte | this.steps.bits(share); }));
        this.wait(this.times.erase / ERASE_STEPS);
      }
      sector.fill(0xff);
      this.erased++;
    }
  }

  program(at, byte, bytes) {
    if (at % PAGE || bytes % PAGE) throw new Error(`programs ${bytes} bytes at 0x${at.toString(16)}`);
    for (let i = 0; i < bytes; i++) {
      const value = byte(i);
      // A byte that changes nothing is no step.
      if (this.bytes[at + i] & ~value) this.step(() => { this.bytes[at + i] &= value | this.steps.bits(0.5); });
      this.bytes[at + i] &= value;
      if (i % PAGE === PAGE - 1) this.wait(this.times.page);
    }
    this.programmed += bytes / PAGE;
  }
}
