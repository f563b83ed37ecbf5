// What the firmware needs of the RP2040's boot ROM, from its description in the data sheet (section 2.8), not its contents:
// the table of functions by codes of two letters, and the check of the second stage. The functions themselves are JavaScript.

/** Where the real ROM copies the second stage, and the stack that it starts with: the end of SRAM5. */
const STAGE_2_AT = 0x20041f00;
const STAGE_2_BYTES = 256;
const XIP = 0x10000000;

/** Addresses in the stub. */
const LOOKUP = 0x40;
const TABLE = 0x80;
const FUNCTIONS = 0x100;

/** A loop in Thumb over pairs of code and address that end with 0; r0: table, r1: code. */
const LOOKUP_CODE = [
  0x8802, // loop: ldrh r2, [r0]
  0x2a00, //       cmp r2, #0
  0xd005, //       beq none
  0x428a, //       cmp r2, r1
  0xd001, //       beq found
  0x3004, //       adds r0, #4
  0xe7f8, //       b loop
  0x8840, // found: ldrh r0, [r0, #2]
  0x4770, //       bx lr
  0x2000, // none: movs r0, #0
  0x4770, //       bx lr
];
const BX_LR = 0x4770;

/** The functions of a chip by their codes (data sheet, section 2.8.3). */
function functions(chip) {
  const nothing = () => {};
  return {
    IF: nothing, // connect_internal_flash
    EX: nothing, // flash_exit_xip
    FC: nothing, // flash_flush_cache
    CX: nothing, // flash_enter_cmd_xip
    RE: (at, bytes) => chip.flash.erase(at, bytes),
    RP: (at, from, bytes) => chip.flash.program(at, (i) => chip.rp2040.readUint8(from + i), bytes),
    C4: (to, from, bytes) => {
      for (let i = 0; i < bytes; i += 4) chip.rp2040.writeUint32(to + i, chip.rp2040.readUint32(from + i));
      return to;
    },
  };
}

export class Rom {
  constructor(chip) {
    this.chip = chip;
    const bytes = new DataView(new ArrayBuffer(16 * 1024));
    const half = (at, value) => bytes.setUint16(at, value, true);
    bytes.setUint32(0, STAGE_2_AT, true);
    half(0x10, 0x754d); // "Mu"
    half(0x12, 0x0201); // version 2
    half(0x14, TABLE);
    half(0x16, TABLE + 0x70); // no data
    half(0x18, LOOKUP | 1);
    LOOKUP_CODE.forEach((code, i) => half(LOOKUP + 2 * i, code));
    this.calls = new Map();
    Object.entries(functions(chip)).forEach(([code, work], i) => {
      const at = FUNCTIONS + 4 * i;
      half(TABLE + 4 * i, code.charCodeAt(0) | (code.charCodeAt(1) << 8));
      half(TABLE + 4 * i + 2, at | 1);
      half(at, BX_LR);
      this.calls.set(at, work);
    });
    this.words = new Uint32Array(bytes.buffer);
  }

  /** Executes the function at the program counter, if there is one; its instruction returns to the caller. */
  call(at) {
    const { core } = this.chip.rp2040;
    const result = this.calls.get(at)?.(...core.registers.slice(0, 4));
    if (result !== undefined) core.registers[0] = result;
  }

  /** Copies the second stage and continues with it, as the real ROM does if its checksum is right. */
  boot() {
    const { rp2040, flash } = this.chip;
    const stage = flash.bytes.subarray(0, STAGE_2_BYTES);
    const sum = new DataView(stage.buffer, stage.byteOffset).getUint32(STAGE_2_BYTES - 4, true);
    if (crc32(stage.subarray(0, STAGE_2_BYTES - 4)) !== sum) throw new Error('the second stage has a wrong checksum');
    rp2040.sram.set(stage, STAGE_2_AT - 0x20000000);
    rp2040.core.SP = STAGE_2_AT;
    rp2040.core.LR = 0;
    rp2040.core.PC = STAGE_2_AT;
  }
}

/** The checksum of the second stage: polynomial 04C11DB7, initially all ones, not reflected (data sheet, section 2.8.1.3.1). */
export function crc32(bytes) {
  let sum = 0xffffffff;
  for (const byte of bytes) {
    sum ^= byte << 24;
    for (let i = 0; i < 8; i++) sum = sum & 0x80000000 ? (sum << 1) ^ 0x04c11db7 : sum << 1;
  }
  return sum >>> 0;
}

/** Writes the loaded segments of an ELF, or the blocks of a UF2, into a flash. */
export function load(file, flash) {
  const put = (at, bytes) => {
    if (at < XIP || at + bytes.length > XIP + flash.length) throw new Error(`0x${at.toString(16)} is not in the flash`);
    flash.set(bytes, at - XIP);
  };
  if (file.readUInt32LE(0) === 0x0a324655) {
    for (let at = 0; at < file.length; at += 512) {
      put(file.readUInt32LE(at + 12), file.subarray(at + 32, at + 32 + file.readUInt32LE(at + 16)));
    }
    return;
  }
  if (file.readUInt32BE(0) !== 0x7f454c46) throw new Error('neither an ELF nor a UF2');
  const [headers, size, count] = [file.readUInt32LE(28), file.readUInt16LE(42), file.readUInt16LE(44)];
  for (let i = 0; i < count; i++) {
    const [type, offset, , to, length] = [0, 4, 8, 12, 16].map((field) => file.readUInt32LE(headers + i * size + field));
    if (type === 1 && length) put(to, file.subarray(offset, offset + length));
  }
}
