// The loads and stores of one register in Thumb-2 (ARMv7-M Architecture Reference Manual, A5.2.4, A5.3.7, A5.3.10), as far as a compiler uses them for registers
// of peripherals.

/** Bytes by the field for the size. */
const SIZES = [1, 2, 4];

/**
 * The load or store at an instruction, whose halfwords are `first` and `second`, with these values of the registers: whether it loads, its register, the
 * address and size of the access, the length of the instruction, and the value that the base register has afterwards, if it changes.
 */
export function access(first, second, registers) {
  const found = first >= 0xe800 ? wide(first, second, registers) : narrow(first, registers);
  if (!found) throw new Error(`no load or store: 0x${first.toString(16)} 0x${second.toString(16)}`);
  return { base: null, ...found, address: found.address >>> 0 };
}

function narrow(code, registers) {
  const [register, base] = [code & 7, registers[(code >> 3) & 7]];
  const isLoad = (code >> 11 & 1) === 1;
  const immediate = (code >> 6) & 31;
  const at = (address, size, loads = isLoad) => ({ isLoad: loads, register, address, size, length: 2 });
  switch (code >> 12) {
    case 5: {
      // STR, STRH, STRB, LDRSB, LDR, LDRH, LDRB, LDRSH
      const kind = (code >> 9) & 7;
      return at(base + registers[(code >> 6) & 7], [4, 2, 1, 1, 4, 2, 1, 2][kind], kind > 2);
    }
    case 6: return at(base + 4 * immediate, 4);
    case 7: return at(base + immediate, 1);
    case 8: return at(base + 2 * immediate, 2);
    default: return null;
  }
}

function wide(first, second, registers) {
  if ((first & 0xfe00) !== 0xf800) return null;
  const size = SIZES[(first >> 5) & 3];
  const number = first & 15;
  if (!size || number === 15) return null;
  const it = { isLoad: (first >> 4 & 1) === 1, register: second >> 12, size, length: 4 };
  const base = registers[number];
  if (first & 0x80) return { ...it, address: base + (second & 0xfff) };
  if (!(second & 0x800)) return { ...it, address: base + (registers[second & 15] << ((second >> 4) & 3)) };
  const [isBefore, isUp, writesBack] = [10, 9, 8].map((bit) => second >> bit & 1);
  const moved = base + (isUp ? 1 : -1) * (second & 0xff);
  return { ...it, address: isBefore ? moved : base, base: writesBack ? { number, value: moved >>> 0 } : null };
}
