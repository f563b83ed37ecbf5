// The calls of one function of a program: how many have returned, and the instructions of the longest one, interrupts during it included.
export class Calls {
  constructor() {
    /** The address of its first instruction. */
    this.at = null;
    this.returned = 0;
    /** Whether the motors are enabled: the longest call that began with them, and the longest other one. */
    this.isDriving = false;
    this.driving = 0;
    this.waiting = 0;
    this.leave();
  }

  /** A call that is under way does not return. */
  leave() {
    this.end = null;
  }

  /** Before an instruction; `instructions` have been executed. */
  follow(core, instructions) {
    const { PC } = core;
    if (this.end === null) {
      if (PC === this.at) this.begin(core, instructions);
      return;
    }
    if (PC !== this.end || core.SP !== this.stack) return;
    this[this.kind] = Math.max(this[this.kind], instructions - this.from);
    this.returned++;
    this.leave();
    // A call may follow at once.
    this.follow(core, instructions);
  }

  begin({ LR, SP }, instructions) {
    this.end = LR & ~1;
    this.stack = SP;
    this.from = instructions;
    this.kind = this.isDriving ? 'driving' : 'waiting';
  }
}
