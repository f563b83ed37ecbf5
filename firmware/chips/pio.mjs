// State machines in step with the core: `rp2040js` runs them from a timer of the PC, without clock dividers, delays of disabled machines and
// joined queues. Here each machine is run up to the present clock before a register of its block is accessed and before an input changes,
// so that it sees each level for as long as it lasts.

/** Rounds of a loop whose state repeats, but for X, are skipped after so many instructions. */
const LONG = 64;

/** Attaches this to a block; `clock` is the count of clocks of the system. Returns what runs its machines up to the present. */
export function attach(pio, clock, Queue) {
  pio.run = () => {};
  const started = pio.machines.map(() => null);
  const catchUp = () => pio.machines.forEach((machine, i) => {
    if (started[i] !== null) started[i] = run(machine, started[i], clock());
  });
  const { readUint32, writeUint32 } = pio;
  pio.readUint32 = (offset) => {
    catchUp();
    return readUint32.call(pio, offset);
  };
  pio.writeUint32 = (offset, value) => {
    catchUp();
    writeUint32.call(pio, offset, value);
    pio.machines.forEach((machine, i) => {
      joinQueues(machine, Queue);
      if (machine.enabled && started[i] === null) started[i] = clock();
      if (!machine.enabled) started[i] = null;
    });
  };
  return catchUp;
}

/** A machine that only sends has the places of both queues (data sheet, section 3.5.2: FJOIN_RX). */
function joinQueues(machine, Queue) {
  const places = machine.shiftCtrl >>> 31 ? 8 : 4;
  if (machine.rxFIFO.size !== places) machine.rxFIFO = new Queue(places);
}

/** Runs a machine from one clock to another; returns the clock at which its next instruction begins. */
function run(machine, at, now) {
  if (machine.clockDivFrac) throw new Error('a fractional clock divider');
  const divider = machine.clockDivInt || 65536;
  let seen = null;
  for (let count = 0; at + divider <= now; count++) {
    if (now - at > LONG * divider) {
      if (seen && repeats(seen, machine)) {
        const change = (machine.x - seen.x) | 0;
        // X must not pass zero, at which a branch may be another.
        const left = change < 0 ? Math.floor(machine.x / -change) : change ? 0 : Infinity;
        const rounds = Math.min(left, Math.floor((now - at) / (at - seen.at))) - 1;
        if (rounds > 0) {
          at += rounds * (at - seen.at);
          machine.x = (machine.x + rounds * change) >>> 0;
          seen = null;
          continue;
        }
      }
      if (!seen || count % LONG === 0) seen = state(machine, at);
    }
    const before = machine.cycles;
    machine.step();
    // A machine that waits takes a clock.
    at += Math.max(1, machine.cycles - before) * divider;
  }
  return at;
}

const state = (m, at) => ({
  at, x: m.x, pc: m.pc, y: m.y, isr: m.inputShiftReg, osr: m.outputShiftReg, shifted: m.inputShiftCount, queued: m.rxFIFO.itemCount,
});

function repeats(seen, m) {
  return seen.pc === m.pc && seen.y === m.y && seen.isr === m.inputShiftReg && seen.osr === m.outputShiftReg
    && seen.shifted === m.inputShiftCount && seen.queued === m.rxFIFO.itemCount && !m.waiting;
}
