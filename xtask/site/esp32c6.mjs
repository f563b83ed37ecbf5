// The serial port of a board with an ESP32-C6, whose flash is in memory: the boot ROM and, after it was sent, the loader, as Espressif's documentation
// of esptool describes them ("Serial Protocol", https://docs.espressif.com/projects/esptool/en/latest/esp32c6/advanced-topics/serial-protocol.html;
// "Boot Mode Selection", the same folder). The loader's code does not run: it is compared with that of esptool-js, and answers as documented.
import { createHash } from "node:crypto";
import { inflateSync } from "node:zlib";

const FLASH = 4 << 20; // bytes: 4 MiB, the least of a module with this chip
const SECTOR = 4096;   // bytes that are erased at once
const SYNC = 0x08, READ_REG = 0x0a, SECURITY_INFO = 0x14, MEM_BEGIN = 0x05, MEM_END = 0x06, MEM_DATA = 0x07;
const DEFL_BEGIN = 0x10, DEFL_DATA = 0x11, DEFL_END = 0x12, FLASH_MD5 = 0x13;
// Errors of the ROM, and of the loader.
const ROM_INVALID = 0x05, ROM_CHECKSUM = 0x07, BAD_LENGTH = 0xc0, BAD_CHECKSUM = 0xc1, NOT_IN_FLASH_MODE = 0xc6, INFLATE_ERROR = 0xc5, UNKNOWN = 0xff;
// Registers by their addresses: word 3 of the block of eFuses with the chip's revision (bits 18 to 20), here 1.
const REGISTERS = new Map([[0x600b0850, 1 << 18]]);

export class Board {
  // `send` takes bytes for the PC. `faults`: `deaf`, without the circuit that holds BOOT; `chip`, the number of another chip; `flips`, an address where
  // a bit is wrong after it was written; `unplugsAt`, an address: `unplug` is called when it would be written.
  constructor(send, unplug, faults = {}) {
    Object.assign(this, { send, unplug, faults });
    this.flash = Buffer.alloc(FLASH, 0xa5); // of another program: neither erased nor zero
    this.memory = new Map(); // of RAM: bytes by the address where they begin
    this.starts = 0; // of the program in flash
    this.lines = { dataTerminalReady: false, requestToSend: false };
    this.mode = "program";
    this.received = [];
  }

  // DTR pulls IO9 down, RTS pulls EN down, and both together neither: the circuit of the board. IO9 is sampled when EN rises.
  signals(changed) {
    const { dataTerminalReady: wasDtr, requestToSend: wasRts } = this.lines;
    Object.assign(this.lines, changed);
    const { dataTerminalReady: dtr, requestToSend: rts } = this.lines;
    const wasInReset = wasRts && !wasDtr, isInReset = rts && !dtr;
    if (isInReset) this.mode = "reset";
    if (!wasInReset || isInReset) return;
    this.received = [];
    this.download = this.writing = null;
    if (dtr && !rts && !this.faults.deaf) {
      this.mode = "rom";
      this.memory.clear();
      this.send(Buffer.from("ESP-ROM:esp32c6-20220919\r\nrst:0x1 (POWERON),boot:0x6 (DOWNLOAD(USB/UART0/SDIO_REI_FEO))\r\nwaiting for download\r\n"));
    } else {
      this.mode = "program";
      this.starts += 1;
      this.send(Buffer.from("ESP-ROM:esp32c6-20220919\r\nrst:0x1 (POWERON),boot:0xe (SPI_FAST_FLASH_BOOT)\r\n"));
    }
  }

  receive(bytes) {
    if (this.mode !== "rom" && this.mode !== "loader") return;
    for (const byte of bytes) {
      if (byte !== 0xc0) { this.received.push(byte); continue; }
      const packet = unescaped(this.received);
      this.received = [];
      if (packet.length > 0) this.obey(packet);
    }
  }

  obey(packet) {
    const command = packet[1], length = packet.readUInt16LE(2), checksum = packet.readUInt32LE(4), data = packet.subarray(8);
    if (packet[0] !== 0 || data.length !== length) throw new Error(`a packet of ${data.length} bytes says that it has ${length}`);
    const answer = this.mode === "rom" ? this.rom(command, data, checksum) : this.loader(command, data, checksum);
    if (answer === null) return; // the port is gone
    const { value = 0, body = [], error = 0, times = 1, after } = answer;
    const status = this.mode === "rom" ? [error > 0, error, 0, 0] : [error > 0, error];
    const contents = Buffer.from([...body, ...status]), head = Buffer.alloc(8);
    head.writeUInt8(1, 0);
    head.writeUInt8(command, 1);
    head.writeUInt16LE(contents.length, 2);
    head.writeUInt32LE(value, 4);
    for (let time = 0; time < times; time += 1) this.send(slip(Buffer.concat([head, contents])));
    after?.();
  }

  rom(command, data, checksum) {
    const words = wordsOf(data);
    switch (command) {
      case SYNC: return { value: 0x20120707, times: 8 }; // other than zero: not yet the loader
      case READ_REG: return { value: REGISTERS.get(words[0]) ?? 0 };
      case SECURITY_INFO: { // flags, count of encryptions, purposes of the keys, chip, version of the interface
        const body = Buffer.alloc(20);
        body.writeUInt32LE(this.faults.chip ?? 13, 12);
        return { body };
      }
      case MEM_BEGIN:
        this.download = { left: words[0], next: 0, address: words[3] };
        return {};
      case MEM_DATA: {
        const bytes = data.subarray(16), { download } = this;
        if (!download || words[1] !== download.next || bytes.length !== words[0]) return { error: ROM_INVALID };
        if (sumOf(bytes) !== checksum) return { error: ROM_CHECKSUM };
        const before = this.memory.get(download.address) ?? Buffer.alloc(0);
        this.memory.set(download.address, Buffer.concat([before, bytes]));
        download.left -= bytes.length;
        download.next += 1;
        return {};
      }
      case MEM_END: {
        if (this.download?.left !== 0 || words[0] !== 0) return { error: ROM_INVALID };
        this.entry = words[1];
        const after = () => {
          this.mode = "loader";
          this.send(slip(Buffer.from("OHAI")));
        };
        return { after };
      }
      default: return { error: ROM_INVALID };
    }
  }

  loader(command, data, checksum) {
    const words = wordsOf(data);
    switch (command) {
      case READ_REG: return { value: REGISTERS.get(words[0]) ?? 0 };
      case DEFL_BEGIN:
        if (data.length !== 16) return { error: BAD_LENGTH };
        this.writing = { size: words[0], blocks: words[1], address: words[3], packed: [] };
        return {};
      case DEFL_DATA: {
        const bytes = data.subarray(16), { writing } = this;
        if (!writing) return { error: NOT_IN_FLASH_MODE };
        if (bytes.length !== words[0] || words[1] !== writing.packed.length) return { error: BAD_LENGTH };
        if (sumOf(bytes) !== checksum) return { error: BAD_CHECKSUM };
        const { unplugsAt } = this.faults;
        if (unplugsAt >= writing.address && unplugsAt < writing.address + writing.size) {
          this.unplug();
          return null;
        }
        writing.packed.push(Buffer.from(bytes));
        return writing.packed.length === writing.blocks ? this.write() : {};
      }
      case DEFL_END: return this.writing?.isWritten ? {} : { error: NOT_IN_FLASH_MODE };
      case FLASH_MD5: {
        const [address, size] = words;
        return { body: createHash("md5").update(this.flash.subarray(address, address + size)).digest() };
      }
      default: return { error: UNKNOWN };
    }
  }

  // Erases the sectors, and writes: a written bit can become 0 only.
  write() {
    const { size, address, packed } = this.writing, bytes = inflateSync(Buffer.concat(packed));
    if (bytes.length !== size || address + size > FLASH) return { error: INFLATE_ERROR };
    this.flash.fill(0xff, address - address % SECTOR, Math.ceil((address + size) / SECTOR) * SECTOR);
    for (const [index, byte] of bytes.entries()) this.flash[address + index] &= byte;
    const { flips } = this.faults;
    if (flips >= address && flips < address + size) this.flash[flips] ^= 1;
    this.writing.isWritten = true;
    return {};
  }
}

const wordsOf = (data) => Array.from({ length: data.length >> 2 }, (_, index) => data.readUInt32LE(4 * index));
const sumOf = (bytes) => bytes.reduce((sum, byte) => sum ^ byte, 0xef);

function slip(bytes) {
  const escaped = [...bytes].flatMap((byte) => byte === 0xc0 ? [0xdb, 0xdc] : byte === 0xdb ? [0xdb, 0xdd] : [byte]);
  return Buffer.from([0xc0, ...escaped, 0xc0]);
}

function unescaped(bytes) {
  const packet = [];
  for (let index = 0; index < bytes.length; index += 1) {
    if (bytes[index] !== 0xdb) packet.push(bytes[index]);
    else packet.push(bytes[++index] === 0xdc ? 0xc0 : 0xdb);
  }
  return Buffer.from(packet);
}
