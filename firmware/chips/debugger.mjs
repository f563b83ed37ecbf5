// Two connections to QEMU: its debugger (the remote protocol of GDB), and its tester of devices (docs/devel/qtest.rst), which writes registers as the core would.
import net from 'node:net';

/** Between attempts to connect, and until the last one, milliseconds. */
const RETRY = 20;
const PATIENCE = 20e3;

async function connected(path) {
  for (let waited = 0; ; waited += RETRY) {
    const socket = net.connect(path);
    const failed = await new Promise((resolve) => {
      socket.once('connect', () => resolve(null));
      socket.once('error', resolve);
    });
    if (!failed) return socket.on('error', () => {});
    if (waited > PATIENCE) throw failed;
    await new Promise((resolve) => setTimeout(resolve, RETRY));
  }
}

/** A socket whose answers come in the order of the questions. */
class Connection {
  /** `parse` takes the first answer off a text: the answer, or null if it is something else, and the rest; null if there is none. */
  constructor(socket, parse) {
    this.socket = socket;
    this.text = '';
    this.waiting = [];
    socket.setEncoding('latin1');
    socket.on('data', (data) => {
      this.text += data;
      for (let found; (found = parse(this.text)); this.text = found.rest) {
        if (found.answer !== null) this.waiting.shift()?.resolve(found.answer);
      }
    });
    socket.on('close', () => this.waiting.splice(0).forEach(({ reject }) => reject(new Error('the emulator has ended'))));
  }

  answer() {
    return new Promise((resolve, reject) => this.waiting.push({ resolve, reject }));
  }

  ask(bytes) {
    const answer = this.answer();
    this.socket.write(bytes, 'latin1');
    return answer;
  }
}

/** A line on a unix socket, for the bytes of an UART. */
export class Line {
  static async at(path) {
    const line = new Line();
    line.received = [];
    line.socket = await connected(path);
    line.socket.on('data', (bytes) => line.received.push(...bytes));
    return line;
  }

  send(byte) {
    this.socket.write(Uint8Array.of(byte));
  }
}

const packet = (order) => {
  let sum = 0;
  for (const letter of order) sum += letter.charCodeAt(0);
  return `$${order}#${(sum & 255).toString(16).padStart(2, '0')}`;
};
/** A word as the protocol has it: from the lowest byte on. */
const word = (value) => {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32LE(value >>> 0);
  return bytes.toString('hex');
};

/** Bytes of memory in a packet. */
const MOST = 1024;
export class Debugger {
  static async at(path) {
    const it = new Debugger();
    it.stopped = null;
    it.orders = [];
    it.connection = new Connection(await connected(path), (text) => {
      const found = /^\+*\$([^#]*)#../.exec(text);
      if (!found) return null;
      const [{ length }, answer] = found;
      const isStop = /^T[0-9a-f]{2}/.test(answer);
      // An order to stop that meets a stop is reported twice.
      if (isStop) it.stopped?.(answer);
      return { answer: isStop ? null : answer, rest: text.slice(length) };
    });
    await it.ask('QStartNoAckMode');
    // Registers can be written once their description was read.
    await it.ask('qXfer:features:read:target.xml:0,ffb');
    return it;
  }

  ask(order) {
    return this.connection.ask(packet(order));
  }

  async order(order) {
    const answer = await this.ask(order);
    if (answer !== 'OK') throw new Error(`the debugger answers ${order} with ${answer}`);
  }

  /** Stops the core before each access of this kind, `reads`, `writes` or `both`, to these bytes. */
  watch(kind, address, bytes) {
    const number = { writes: 2, reads: 3, both: 4 }[kind];
    return this.order(`Z${number},${address.toString(16)},${bytes.toString(16)}`);
  }

  async registers() {
    const bytes = Buffer.from((await this.ask('g')).slice(0, 16 * 8), 'hex');
    return Array.from({ length: 16 }, (_, i) => bytes.readUInt32LE(4 * i));
  }

  /** Sets a register before the core continues. */
  setRegister(number, value) {
    this.orders.push(this.order(`P${number.toString(16)}=${word(value)}`));
  }

  async read(address, bytes) {
    const parts = [];
    for (let i = 0; i < bytes; i += MOST) {
      const length = Math.min(MOST, bytes - i);
      parts.push(Buffer.from(await this.ask(`m${(address + i).toString(16)},${length.toString(16)}`), 'hex'));
    }
    return Buffer.concat(parts);
  }

  /** Writes memory, also that of the flash. */
  async write(address, bytes) {
    for (let i = 0; i < bytes.length; i += MOST) {
      const part = Buffer.from(bytes.subarray(i, i + MOST));
      await this.order(`M${(address + i).toString(16)},${part.length.toString(16)}:${part.toString('hex')}`);
    }
  }

  /** Continues until the core stops; after this time in milliseconds it is stopped wherever it is. Returns whether a watched access has stopped it. */
  async continue(longest) {
    const { socket } = this.connection;
    const stopped = new Promise((resolve) => { this.stopped = resolve; });
    socket.write(packet('c'));
    const timer = setTimeout(() => socket.write('\x03'), longest);
    const reason = await stopped;
    clearTimeout(timer);
    this.stopped = null;
    await Promise.all(this.orders.splice(0));
    return /watch/.test(reason);
  }
}

export class Tester {
  static async at(path) {
    const it = new Tester();
    it.connection = new Connection(await connected(path), (text) => {
      const end = text.indexOf('\n');
      if (end < 0) return null;
      const line = text.slice(0, end);
      // It also reports interrupts.
      return { answer: line.startsWith('IRQ') ? null : line, rest: text.slice(end + 1) };
    });
    return it;
  }

  async ask(order) {
    const answer = await this.connection.ask(`${order}\n`);
    if (!answer.startsWith('OK')) throw new Error(`the tester answers ${order} with ${answer}`);
    return answer.split(' ')[1];
  }

  async read(address) {
    return Number(await this.ask(`readl 0x${address.toString(16)}`)) >>> 0;
  }

  write(address, value) {
    return this.ask(`writel 0x${address.toString(16)} 0x${(value >>> 0).toString(16)}`);
  }

  /** An edge at an interrupt of a device. */
  async pulse(device, interrupt) {
    for (const level of [1, 0]) await this.ask(`set_irq_in ${device} unnamed-gpio-in ${interrupt} ${level}`);
  }
}
