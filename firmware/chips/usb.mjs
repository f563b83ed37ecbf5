// The USB socket and a PC at it: `rp2040js` has the registers of the device, and its buffers are taken at once. Here they wait for the host, which
// enumerates the device, opens its serial port, and can be unplugged or sleep (data sheet, section 4.1; USB 2.0, chapter 9; CDC PSTN 1.2).

const SIE_STATUS = 0x50;
const SUSPENDED = 1 << 4;
const RESUME = 1 << 11;
const BUS_RESET = 1 << 19;
const BUFFERS = 0x80;
const BUFFERS_END = 0x100;
const LENGTH = 0x3ff;
const AVAILABLE = 1 << 10;
const STALL = 1 << 11;
const FULL = 1 << 15;
const PACKET = 64;

/** A packet with its handshake, and a byte of it, at 12 Mbit/s; the pause of a host between two packets to one endpoint. */
const PACKET_NANOS = 10_000;
const BYTE_NANOS = 667;
/** A bus without a frame for this long is suspended; a reset, and the pause after it. */
const IDLE_NANOS = 3e6;
const RESET_NANOS = 10e6;
const RECOVERY_NANOS = 10e6;

const setup = (type, request, value, index, length) => Uint8Array.of(
  type, request, value & 0xff, value >> 8, index & 0xff, index >> 8, length & 0xff, length >> 8,
);
const TO_DEVICE = 0x00;
const FROM_DEVICE = 0x80;
const CLASS_INTERFACE = 0x21;

/** The endpoints of the bulk pipes in a configuration. */
export function pipes(configuration) {
  const found = {};
  let isData = false;
  for (let at = 0; at < configuration.length && configuration[at]; at += configuration[at]) {
    const [, type, second, third, , fifth] = configuration.subarray(at);
    if (type === 4) isData = fifth === 10;
    if (type === 5 && isData && (third & 3) === 2) found[second & 0x80 ? 'in' : 'out'] = second & 15;
  }
  return found;
}

export class UsbHost {
  /** `received` is told of the bytes of the serial port. */
  constructor(chip, received) {
    const { rp2040, clock } = chip;
    this.usb = rp2040.usbCtrl;
    this.memory = rp2040.usbDPRAM;
    this.view = rp2040.usbDPRAMView;
    this.clock = clock;
    this.received = received;
    this.isPlugged = false;
    this.isAsleep = false;
    /** Whether the serial port is open; the bytes for it. */
    this.isOpen = false;
    this.toSend = [];
    this.requests = [];
    this.request = null;
    this.pipes = {};
    /** Buffers that the device has made available: offsets of their registers, and when the host takes them. */
    this.alarms = new Map();
    this.usb.onUSBEnabled = () => {};
    this.usb.DPRAMUpdated = (offset, value) => this.updated(offset, value);
    const { writeUint32 } = this.usb;
    // `SUSPENDED` is cleared by writing it.
    this.usb.writeUint32 = (offset, value) => {
      if (offset === SIE_STATUS) this.usb.sieStatus &= ~(this.usb.rawWriteValue & SUSPENDED);
      writeUint32.call(this.usb, offset, value);
    };
  }

  after(nanos, act) {
    const alarm = this.clock.createAlarm(act);
    alarm.schedule(nanos);
    return alarm;
  }

  signal(bits) {
    this.usb.sieStatus |= bits;
    this.usb.sieStatusUpdated();
  }

  plug() {
    this.isPlugged = true;
    this.isAsleep = false;
    this.requests = [];
    this.request = null;
    this.after(RESET_NANOS, () => {
      if (!this.isPlugged) return;
      this.signal(BUS_RESET);
      this.after(RECOVERY_NANOS, () => { if (this.isPlugged) this.enumerate(); });
    });
  }

  /** The bytes that are on their way are lost, and the bus falls silent. */
  unplug() {
    this.isPlugged = false;
    this.isOpen = false;
    this.toSend = [];
    this.after(IDLE_NANOS, () => { if (!this.isPlugged) this.signal(SUSPENDED); });
  }

  suspend() {
    this.isAsleep = true;
    this.after(IDLE_NANOS, () => { if (this.isAsleep) this.signal(SUSPENDED); });
  }

  resume() {
    this.isAsleep = false;
    this.signal(RESUME);
    this.poll();
  }

  send(bytes) {
    this.toSend.push(...bytes);
    this.poll();
  }

  enumerate() {
    this.ask(setup(FROM_DEVICE, 6, 0x0100, 0, 18), (device) => { this.device = device; });
    this.ask(setup(TO_DEVICE, 5, 1, 0, 0));
    this.ask(setup(FROM_DEVICE, 6, 0x0200, 0, 255), (configuration) => { this.pipes = pipes(configuration); });
    this.ask(setup(TO_DEVICE, 9, 1, 0, 0));
    // 115,200 baud, 8N1; DTR and RTS.
    this.ask(setup(CLASS_INTERFACE, 0x20, 0, 0, 7), () => {}, Uint8Array.of(0x00, 0xc2, 0x01, 0x00, 0, 0, 8));
    this.ask(setup(CLASS_INTERFACE, 0x22, 3, 0, 0), () => {
      this.isOpen = true;
      this.poll();
    });
  }

  /** A control transfer after those that wait. */
  ask(packet, done = () => {}, data = null) {
    this.requests.push({ packet, done, data, answer: [], isFromDevice: (packet[0] & 0x80) !== 0, wanted: packet[6] | (packet[7] << 8) });
    if (!this.request) this.next();
  }

  next() {
    this.request = this.requests.shift() ?? null;
    if (this.request) this.after(PACKET_NANOS, () => this.usb.sendSetupPacket(this.request.packet));
  }

  /** The device has written to its memory: a buffer may be available. */
  updated(offset, value) {
    if (offset < BUFFERS || offset >= BUFFERS_END) return;
    const endpoint = (offset - BUFFERS) >> 3;
    if (endpoint === 0 && value & STALL && this.request) {
      const { packet } = this.request;
      throw new Error(`the device refuses the request ${packet}`);
    }
    if (value & AVAILABLE) this.schedule(offset);
  }

  /** The buffers that have waited for the host. */
  poll() {
    for (let offset = BUFFERS; offset < BUFFERS_END; offset += 4) {
      if (this.view.getUint32(offset, true) & AVAILABLE) this.schedule(offset);
    }
  }

  schedule(offset) {
    if (this.alarms.has(offset)) return;
    const length = this.view.getUint32(offset, true) & LENGTH;
    const alarm = this.after(PACKET_NANOS + length * BYTE_NANOS, () => {
      this.alarms.delete(offset);
      if (this.isPlugged && !this.isAsleep && this.view.getUint32(offset, true) & AVAILABLE) this.transfer(offset);
    });
    this.alarms.set(offset, alarm);
  }

  /** A transaction with an available buffer. */
  transfer(offset) {
    const endpoint = (offset - BUFFERS) >> 3;
    const isOut = (offset & 4) !== 0;
    const value = this.view.getUint32(offset, true);
    const at = this.usb.getEndpointBufferOffset(endpoint, isOut);
    if (isOut) {
      const bytes = this.bytesFor(endpoint);
      if (bytes === null) return;
      this.memory.set(bytes, at);
      this.view.setUint32(offset, (value & ~(AVAILABLE | LENGTH)) | FULL | bytes.length, true);
      this.usb.indicateBufferReady(endpoint, true);
      return;
    }
    const bytes = this.memory.slice(at, at + (value & LENGTH));
    this.view.setUint32(offset, value & ~(AVAILABLE | FULL), true);
    this.usb.indicateBufferReady(endpoint, false);
    if (endpoint === 0) this.answered(bytes);
    else if (endpoint === this.pipes.in && this.isOpen) this.received(bytes);
  }

  /** What the host sends to an endpoint; `null`: nothing. */
  bytesFor(endpoint) {
    if (endpoint !== 0) {
      if (endpoint !== this.pipes.out || !this.isOpen || !this.toSend.length) return null;
      return Uint8Array.from(this.toSend.splice(0, PACKET));
    }
    const { request } = this;
    if (!request) return null;
    if (request.isFromDevice) {
      // The status of a request whose answer has come.
      if (!request.isAnswered) return null;
      this.done();
      return new Uint8Array();
    }
    const { data } = request;
    request.data = null;
    return data;
  }

  /** The device has sent a packet of an answer, or of the status of a request without one. */
  answered(bytes) {
    const { request } = this;
    if (!request) return;
    if (!request.isFromDevice) {
      this.done();
      return;
    }
    request.answer.push(...bytes);
    request.isAnswered = bytes.length < PACKET || request.answer.length >= request.wanted;
  }

  done() {
    const { request } = this;
    request.done(Uint8Array.from(request.answer));
    this.next();
  }
}
