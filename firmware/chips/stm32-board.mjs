// A board with an STM32F4 in QEMU, its robot, and the PC's end of its link. The machine stops before each access to a part that it lacks (stm32.mjs); then the room
// catches up with the clock of the chip. A sleep of the core ends in time for the next event. Times in nanoseconds since power-on.
import { spawn } from 'node:child_process';
import { Debugger, Line, Tester } from './debugger.mjs';
import { ERASE_STEPS, Steps } from './flash.mjs';
import { Robot } from './robot.mjs';
import { numbers } from './room.mjs';
import { peripherals } from './stm32.mjs';
import { access } from './thumb.mjs';

/** The left encoder counts backwards, as in docs/firmware.md. */
const WIRING = { mirrored: 1 };
/** The sectors of the store, as their numbers and addresses. */
const SECTORS = { 2: 0x08008000, 3: 0x0800c000 };
const SECTOR = 16 * 1024;
const TIM3 = 0x40000400;
const TIM5 = 0x40000c00;
const TIM5_INTERRUPT = 50;
const CC1IF = 1 << 1;
const CC2IF = 1 << 2;
const USART2 = 0x40004400;
const SYSTICK = 0xe000e010;
const INTERRUPTS = '/machine/unattached/device[0]/armv7m';
/** An instruction takes 1 ns of the emulator, whose timers run at 1 GHz in place of 16 MHz, and its SysTick at 168 MHz: counts in a nanosecond of the chip. */
const SYSTICK_RATE = (168e6 * 16e-9) / 1e3;
/** Memory that the program does not use, for the code of a scenario. */
const CODE = 0x20010000;
const ENDLESS_LOOP = 0xe7fe;
const UNDEFINED = 0xde00;
/** After this time without a stop, milliseconds of this computer, the machine is stopped: its program hangs. */
const LONGEST = 2000;

export class Stm32Board extends Robot {
  /** `folder` has room for the sockets. */
  constructor(world, folder) {
    const { seed } = world;
    super(world, numbers(seed + 2), WIRING);
    this.folder = folder;
    /** Of the flash: a word that changes, and the parts of an erasure. */
    this.steps = new Steps(numbers(seed + 1));
    this.images = [];
    this.received = [];
    this.lineFree = 0;
    this.toSend = [];
    this.parts = peripherals(this);
    this.voltages = [0, 0];
    /** Machines so far, time in the life of the present one, and why it is to be reset. */
    this.lives = 0;
    this.nanos = 0;
    this.resetBy = null;
    this.until = 0;
    this.lost = 0;
    /** Instructions that were read, by their addresses. */
    this.code = new Map();
    this.stops = 0;
  }

  get now() {
    return this.began + this.nanos;
  }

  load(_, at, path) {
    this.images.push(at === null ? ['-kernel', path] : ['-device', `loader,file=${path},addr=${at},force-raw=on`]);
  }

  /** Power-on. */
  async start() {
    await this.boot();
    for (const sector of Object.keys(SECTORS)) await this.fill(sector);
  }

  /** A new machine. One that resets itself would not start its timers at 0, and would let time jump. */
  async boot() {
    this.machine?.stdin.end();
    const life = ++this.lives;
    const socket = (name) => `${this.folder}/${name}-${life}`;
    const server = (name) => `unix:${socket(name)},server=on,wait=off`;
    const command = ['qemu-system-arm', '-machine', 'netduinoplus2', '-icount', 'shift=0,sleep=off', '-S',
      '-display', 'none', '-monitor', 'none', '-serial', 'null', '-serial', server('uart'), '-gdb', server('debugger'),
      '-qtest', server('tester'), '-qtest-log', 'none', ...this.images.flat()];
    // It ends with this program, whose end closes its input.
    this.machine = spawn('sh', ['-c', '"$@" & read -r line; kill $!', 'sh', ...command], { stdio: ['pipe', 'ignore', 'ignore'] });
    this.line = await Line.at(socket('uart'));
    this.tester = await Tester.at(socket('tester'));
    this.debugger = await Debugger.at(socket('debugger'));
    for (const { kind, at, bytes } of Object.values(this.parts)) await this.debugger.watch(kind, at, bytes);
  }

  /** Runs until a time, at least. */
  async run(until) {
    this.until = until;
    while (this.now < until) {
      const isAccess = await this.debugger.continue(LONGEST);
      await this.catchUp();
      if (isAccess) await this.perform();
      if (this.resetBy) await this.reset(this.resetBy);
      await this.happen();
    }
    await this.listen();
  }

  /** What the program has sent has arrived here. */
  async listen() {
    await new Promise(setImmediate);
    this.received.push(...this.line.received.splice(0));
  }

  /** The room catches up with the clock of the chip. */
  async catchUp() {
    this.stops++;
    const [clock, motors, systick, registers] = await Promise.all([
      this.debugger.read(TIM5, 0x28), this.debugger.read(TIM3 + 0x2c, 0x18), this.debugger.read(SYSTICK, 8), this.debugger.registers(),
    ]);
    this.registers = registers;
    this.systick = { hasInterrupt: (systick[0] & 2) !== 0, length: systick.readUInt32LE(4) };
    // Until the program has started it, the timer counts something else.
    const runs = (clock.readUInt32LE(0) & 1) === 1;
    const nanos = runs ? 1e3 * clock.readUInt32LE(0x24) : 0;
    const { watchdog } = this.parts;
    const hasExpired = this.began + nanos > watchdog.expiresAt;
    this.nanos = hasExpired ? watchdog.expiresAt - this.began : Math.max(this.nanos, nanos);
    while (this.next <= this.now) this.step(this.isEnabled ? this.voltages : [0, 0], this.parts.servo.width);
    if (hasExpired) this.resetBy = 'watchdog';
    const [full, , ...inputs] = Array.from({ length: 6 }, (_, i) => motors.readUInt32LE(4 * i));
    this.voltages = [0, 2].map((first) => (inputs[first] - inputs[first + 1]) / (full + 1));
  }

  /** Makes the access before which the core has stopped, in place of the machine. */
  async perform() {
    const { registers } = this;
    const at = registers[15];
    const it = access(...await this.codeAt(at), registers);
    const part = Object.values(this.parts).find(({ at, bytes }) => it.address >= at && it.address < at + bytes);
    if (!part) throw new Error(`an access to 0x${it.address.toString(16)} by the instruction at 0x${at.toString(16)}`);
    const offset = it.address - part.at;
    if (it.isLoad) this.debugger.setRegister(it.register, part.read(offset));
    else await part.write(offset, registers[it.register], it.size);
    if (it.base) this.debugger.setRegister(it.base.number, it.base.value);
    this.debugger.setRegister(15, at + it.length);
  }

  /** Two halfwords of the program. */
  async codeAt(address) {
    if (!this.code.has(address)) {
      const code = await this.debugger.read(address, 4);
      this.code.set(address, [code.readUInt16LE(0), code.readUInt16LE(2)]);
    }
    return this.code.get(address);
  }

  /** What is due now. */
  async happen() {
    const { edges } = this.sonar;
    const { stamps } = this.parts;
    while (edges.length && edges[0].at <= this.now) {
      const { at, isHigh } = edges.shift();
      // Capture registers 1 and 2 hold the stamps of the last rising and the last falling edge.
      await this.tester.write(TIM5 + (isHigh ? 0x34 : 0x38), Math.round((at - this.began) / 1e3));
      stamps.flags |= isHigh ? CC1IF : CC2IF;
      await this.tester.pulse(INTERRUPTS, TIM5_INTERRUPT);
    }
    if (this.toSend.length && this.now >= this.lineFree) await this.send(this.toSend.shift());
  }

  /** A byte arrives at the receiver. */
  async send(byte) {
    const [SR, CR1, RXNE, UE, RE] = [0x00, 0x0c, 1 << 5, 1 << 13, 1 << 2];
    this.lineFree = this.now + 10e9 / 115200;
    const receives = ((await this.tester.read(USART2 + CR1)) & (UE | RE)) === (UE | RE);
    if (!receives || (await this.tester.read(USART2 + SR)) & RXNE) {
      this.lost++;
      return;
    }
    this.line.send(byte);
    while (!((await this.tester.read(USART2 + SR)) & RXNE));
  }

  /** The core begins a sleep, which ends in time for the next event. */
  async sleep() {
    const [RELOAD, CURRENT, SHORTEST] = [4, 8, 64];
    const { hasInterrupt, length } = this.systick;
    const byte = this.toSend.length ? this.lineFree : Infinity;
    const next = Math.min(this.until, byte, this.room.nextEdge);
    const counts = Math.max(SHORTEST, Math.ceil((next - this.now) * SYSTICK_RATE));
    // Without its interrupt it is no alarm: the program measures its rate.
    const isShortened = hasInterrupt && counts < length;
    await Promise.all([
      isShortened && this.tester.write(SYSTICK + RELOAD, counts), this.tester.write(SYSTICK + CURRENT, 0),
    ]);
  }

  /** A sector of the store that is erased. */
  fill(sector) {
    return this.debugger.write(SECTORS[sector], new Uint8Array(SECTOR).fill(0xff));
  }

  /** Erases a sector of the store, of which a power cut leaves a part. */
  async erase(sector) {
    for (let step = 0; step < ERASE_STEPS; step++) {
      if (!this.steps.isCut()) continue;
      const bytes = await this.debugger.read(SECTORS[sector], SECTOR);
      const partly = bytes.map((byte) => byte | this.steps.bits(step / ERASE_STEPS));
      await this.debugger.write(SECTORS[sector], partly);
      this.resetBy = 'power';
      return;
    }
    await this.fill(sector);
  }

  /** Writes a word of the store, which clears bits only; a power cut leaves some of them. */
  async program(address, value) {
    this.parts.flash.programmed++;
    const bytes = await this.debugger.read(address, 4);
    const before = bytes.readUInt32LE(0);
    let after = (before & value) >>> 0;
    if (after !== before && this.steps.isCut()) {
      const kept = Buffer.from(Array.from({ length: 4 }, () => this.steps.bits(0.5))).readUInt32LE(0);
      after = (before & (value | kept)) >>> 0;
      this.resetBy = 'power';
    }
    bytes.writeUInt32LE(after);
    await this.debugger.write(address, bytes);
  }

  /** Resets the chip, whose flash stays. */
  async reset(cause) {
    await this.listen();
    const store = await this.debugger.read(SECTORS[2], 2 * SECTOR);
    this.endLife(cause, this.now);
    await this.boot();
    await this.debugger.write(SECTORS[2], store);
  }

  endLife(cause, now) {
    super.endLife(cause, now);
    this.began = now;
    this.nanos = 0;
    this.resetBy = null;
    this.voltages = [0, 0];
    for (const part of Object.values(this.parts)) part.reset?.();
    this.parts.causes.add(cause);
  }

  /** Continues the program at this instruction. */
  async jumpTo(code) {
    await this.debugger.write(CODE, Uint8Array.of(code & 0xff, code >> 8));
    this.debugger.setRegister(15, CODE);
  }

  hang() {
    return this.jumpTo(ENDLESS_LOOP);
  }

  failAtInstruction() {
    return this.jumpTo(UNDEFINED);
  }

  /** As those of another board; the stops stand for the instructions, which QEMU does not count. */
  counters() {
    const { flash } = this.parts;
    return [this.stops, 0, this.lost, flash.erased, flash.programmed, this.sonar.shortTriggers];
  }
}
