// The UART, a PL011, with what `rp2040js` lacks: queues of 32 bytes, the time that a byte takes, the interrupts of the level and of the time-out,
// and overruns (data sheet, section 4.2).

const PLACES = 32;
/** A byte of 8N1 has ten bits; the time-out is that of 32 bits without a byte. */
const BITS = 10;
const TIME_OUT = 32;
const RX_LEVEL = 1 << 4;
const RX_TIME_OUT = 1 << 6;
const OVERRUN = 1 << 11;

export class Uart {
  constructor(chip, uart) {
    this.chip = chip;
    this.uart = uart;
    this.received = [];
    this.overruns = 0;
    this.lost = 0;
    this.isOverrun = false;
    this.hasTimedOut = false;
    this.mask = 0;
    this.select = 0b010_010;
    /** When the last byte to be sent has left. */
    this.sentAt = 0;
    this.timeOut = chip.clock.createAlarm(() => {
      this.hasTimedOut = this.received.length > 0;
      this.check();
    });
    const { readUint32, writeUint32 } = uart;
    uart.readUint32 = (offset) => this.read(offset) ?? readUint32.call(uart, offset);
    uart.writeUint32 = (offset, value) => { if (!this.write(offset, value)) writeUint32.call(uart, offset, value); };
  }

  /** Nanoseconds of a bit. */
  get bit() {
    return 1e9 / this.uart.baudRate;
  }

  /** Bytes that are not yet sent. */
  get waiting() {
    return Math.max(0, Math.ceil((this.sentAt - this.chip.clock.nanos) / (BITS * this.bit)));
  }

  get status() {
    const levels = [4, 8, 16, 24, 28];
    const level = this.received.length >= (levels[(this.select >> 3) & 7] ?? 16) ? RX_LEVEL : 0;
    return level | (this.hasTimedOut ? RX_TIME_OUT : 0);
  }

  check() {
    this.chip.rp2040.setInterrupt(this.uart.irq, (this.status & this.mask) !== 0);
  }

  read(offset) {
    switch (offset) {
      case 0x00: return this.take();
      case 0x18: {
        const { waiting, received } = this;
        return (waiting > PLACES ? 1 << 5 : 0) | (waiting ? 1 << 3 : 1 << 7)
          | (received.length ? 0 : 1 << 4) | (received.length >= PLACES ? 1 << 6 : 0);
      }
      case 0x34: return this.select;
      case 0x38: return this.mask;
      case 0x3c: return this.status;
      case 0x40: return this.status & this.mask;
      default: return undefined;
    }
  }

  take() {
    const value = (this.received.shift() ?? 0) | (this.isOverrun ? OVERRUN : 0);
    this.isOverrun = false;
    this.hasTimedOut = this.hasTimedOut && this.received.length > 0;
    this.check();
    return value;
  }

  write(offset, value) {
    const now = this.chip.clock.nanos;
    switch (offset) {
      case 0x00:
        if (this.waiting > PLACES) this.lost++;
        else {
          this.sentAt = Math.max(this.sentAt, now) + BITS * this.bit;
          this.chip.sent(value & 0xff);
        }
        return true;
      case 0x34: this.select = value & 0x3f; return true;
      case 0x38: this.mask = value & 0x7ff; this.check(); return true;
      case 0x44:
        if (this.uart.rawWriteValue & RX_TIME_OUT) this.hasTimedOut = false;
        this.check();
        return true;
      default: return false;
    }
  }

  /** A byte has arrived. */
  receive(byte) {
    if (this.received.length < PLACES) this.received.push(byte);
    else {
      this.overruns++;
      this.isOverrun = true;
    }
    this.timeOut.schedule(TIME_OUT * this.bit);
    this.check();
  }
}
