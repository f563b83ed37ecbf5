// An LSM6DSOX on a bus of two lines (data sheet DS12140 and UM10204 of NXP): its gyro, with a bias and noise.

const ADDRESS = 0x6b;
const IDENTITY = 0x6c;
const [WHO_AM_I, CTRL2_G, CTRL3_C, OUTZ_L_G, OUTZ_H_G] = [0x0f, 0x11, 0x12, 0x26, 0x27];
/** Degrees per second of a count in the smallest range. */
const COUNT = 8.75e-3;
/** Of the gyro in the room: degrees per second. */
const BIAS = 0.6;
const NOISE = 0.045;

/** A device on a bus: what its master does, bit by bit. */
export class Device {
  /** `read` and `write` a register of a number. */
  constructor(address, read, write) {
    Object.assign(this, { address, read, write, clock: true, data: true });
    /** Whether it pulls the data line. */
    this.pulls = false;
    this.leave();
  }

  /** It waits for a start. */
  leave() {
    this.state = 'waits';
    this.bits = 0;
    this.pulls = false;
  }

  /** The master drives these levels; a line that nobody pulls is high. */
  set(clock, master) {
    const data = master && !this.pulls;
    const before = { clock: this.clock, data: this.data };
    Object.assign(this, { clock, data });
    if (clock && before.clock && data !== before.data) {
      this.leave();
      if (!data) Object.assign(this, { state: 'address', bits: 0, byte: 0 });
    } else if (clock && !before.clock) this.rise(data);
    else if (!clock && before.clock) this.fall();
    this.data = master && !this.pulls;
  }

  rise(data) {
    if (this.state === 'sends') {
      // The ninth bit is the master's: it wants another byte, or none.
      if (this.bits === 8) this.isLast = data;
      this.bits++;
    } else if (this.state !== 'waits') {
      if (this.bits < 8) this.byte = (this.byte << 1) | Number(data);
      this.bits++;
    }
  }

  fall() {
    this.pulls = false;
    if (this.state === 'sends') this.send();
    else if (this.bits === 8) this.pulls = this.take();
    else if (this.bits === 9) {
      Object.assign(this, { state: this.next, bits: 0, byte: 0 });
      if (this.state === 'sends') this.send();
    }
  }

  /** The next bit of the byte that is sent; after nine bits the next byte. */
  send() {
    if (this.bits === 9) {
      if (this.isLast) return this.leave();
      this.bits = 0;
    }
    if (this.bits === 0) this.byte = this.read(this.register++);
    this.pulls = this.bits < 8 && !((this.byte >> (7 - this.bits)) & 1);
  }

  /** A byte is complete; returns whether it is acknowledged. */
  take() {
    const { byte } = this;
    if (this.state === 'address') {
      if (byte >> 1 !== this.address) {
        this.leave();
        return false;
      }
      this.next = byte & 1 ? 'sends' : 'register';
    } else if (this.state === 'register') {
      this.register = byte;
      this.next = 'data';
    } else this.write(this.register++, byte);
    return true;
  }
}

/** The sensor of a robot whose turn rate in radians per second is `rate()`. */
export class Gyro {
  constructor(rate, random) {
    this.registers = new Uint8Array(256);
    this.registers[WHO_AM_I] = IDENTITY;
    this.readings = 0;
    this.device = new Device(ADDRESS, (at) => {
      if (at === OUTZ_L_G) this.sample(rate(), random);
      return this.registers[at];
    }, (at, value) => { this.registers[at] = value; });
  }

  /** Both bytes of a sample; zero while the gyro is off. */
  sample(rate, random) {
    const control = this.registers[CTRL2_G];
    const isOn = control >> 4 !== 0 && (this.registers[CTRL3_C] & 0x44) === 0x44;
    const noise = NOISE * Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
    const degrees = (rate * 180) / Math.PI + BIAS + noise;
    const count = isOn ? Math.round(degrees / (COUNT * 2 ** ((control >> 2) & 3))) : 0;
    const limited = Math.max(-32768, Math.min(32767, count));
    this.registers[OUTZ_L_G] = limited & 0xff;
    this.registers[OUTZ_H_G] = (limited >> 8) & 0xff;
    this.readings++;
  }

  /** Connects it to two pins of a chip, which have pull-ups. */
  connect(gpio, clock, data) {
    const [scl, sda] = [gpio[clock], gpio[data]];
    const LOW = 0;
    const change = () => {
      this.device.set(scl.value !== LOW, sda.value !== LOW);
      scl.setInputValue(scl.value !== LOW);
      sda.setInputValue(this.device.data);
    };
    scl.addListener(change);
    sda.addListener(change);
    change();
  }
}
