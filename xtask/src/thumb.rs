//! Decodes the Thumb instructions that change the stack pointer or call through a register (Arm, *ARMv7-M Architecture
//! Reference Manual*, chapter A7).

/// The use of the stack by a block of code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stack {
    /// Bytes by which all its instructions lower the stack.
    pub bytes: u64,
    /// Whether one of them calls through a register.
    pub calls_by_register: bool,
    /// Whether one of them sets the stack pointer to an unknown value.
    pub is_unbounded: bool,
}

impl Stack {
    /// Decodes a block of code without data, which lies at this address; `word` returns the word at an address near it.
    ///
    /// Every instruction counts once. This is an upper bound: the stack may be lowered on two branches, but compilers do
    /// not lower it in a loop.
    pub fn of(code: &[u8], at: u64, word: impl Fn(u64) -> Option<u32>) -> Self {
        let mut stack = Self::default();
        let mut last = None;
        for (offset, instruction) in instructions(code) {
            match instruction {
                Instruction::Short(short) => match last {
                    // ADD SP, …: how ARMv6-M makes a large frame, and frees it.
                    Some((register, Value::Constant(constant)))
                        if short == 0x4485_u16 | register << 3 =>
                    {
                        stack.bytes += u64::from(constant_below_zero(constant));
                    }
                    // MOV SP, …: frees it, too.
                    Some((register, Value::BelowFrame)) if short == 0x4685_u16 | register << 3 => {}
                    _ => stack.short(short),
                },
                Instruction::Long(first, second) => stack.long(first, second),
            }
            last = match instruction {
                // LDR …, [PC, #…]
                Instruction::Short(short @ 0x4800..=0x4fff) => {
                    let from = ((at + offset + 4) & !3) + 4 * u64::from(short & 0xff);
                    word(from).map(|constant| (short >> 8 & 7, Value::Constant(constant)))
                }
                // SUBS …, R7, #…
                Instruction::Short(short @ 0x1e00..=0x1fff) if short >> 3 & 7 == 7 => {
                    Some((short & 7, Value::BelowFrame))
                }
                // SUBS …, #… of the same register
                Instruction::Short(short @ 0x3800..=0x3fff) => last.filter(|(register, value)| {
                    *register == short >> 8 & 7 && *value == Value::BelowFrame
                }),
                _ => None,
            };
        }
        stack
    }

    /// Joins two blocks of one function.
    pub fn and(self, other: Self) -> Self {
        Self {
            bytes: self.bytes + other.bytes,
            calls_by_register: self.calls_by_register || other.calls_by_register,
            is_unbounded: self.is_unbounded || other.is_unbounded,
        }
    }

    fn short(&mut self, word: u16) {
        match word {
            // PUSH {…}
            0xb400..=0xb5ff => self.bytes += 4 * u64::from((word & 0x1ff).count_ones()),
            // SUB SP, #…
            0xb080..=0xb0ff => self.bytes += 4 * u64::from(word & 0x7f),
            // BX LR: the end of a function.
            0x4770 => {}
            // BX, BLX
            0x4700..=0x47ff => self.calls_by_register = true,
            // ADD SP, …; MOV SP, …
            _ if word & 0xff87 == 0x4485 || word & 0xff87 == 0x4685 => self.is_unbounded = true,
            _ => {}
        }
    }

    fn long(&mut self, first: u16, second: u16) {
        let to_sp = second & 0x8f00 == 0x0d00;
        match first {
            // PUSH.W {…}
            0xe92d => self.bytes += 4 * u64::from(second.count_ones()),
            // VPUSH {…}; STRD …, …, [SP, #-…]!
            0xed2d | 0xed6d | 0xe96d => self.bytes += 4 * u64::from(second & 0xff),
            // STR …, [SP, #-…]!
            0xf84d if second & 0x0f00 == 0x0d00 => self.bytes += u64::from(second & 0xff),
            // SUB.W SP, SP, #…
            0xf1ad | 0xf5ad if to_sp => self.bytes += modified(immediate(first, second)),
            // SUBW SP, SP, #…
            0xf2ad | 0xf6ad if to_sp => self.bytes += u64::from(immediate(first, second)),
            // ADD.W, SUB.W SP, …, register; MSR MSP, …; MSR PSP, …
            0xeb00..=0xeb1f | 0xeba0..=0xebbf if to_sp => self.is_unbounded = true,
            0xf380..=0xf38f if matches!(second, 0x8808 | 0x8809) => self.is_unbounded = true,
            _ => {}
        }
    }
}

/// What a register holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Value {
    /// A constant of the code.
    Constant(u32),
    /// An address below the frame pointer R7: what the stack pointer was when the function had saved its registers.
    BelowFrame,
}

/// The targets of the BL instructions in a block of code at this address.
pub fn calls(code: &[u8], at: u64) -> impl Iterator<Item = u64> {
    instructions(code).filter_map(move |(offset, instruction)| {
        let Instruction::Long(first, second) = instruction else { return None };
        let is_call = first >> 11 == 0b11110 && second & 0xd000 == 0xd000;
        is_call.then(|| (at + offset + 4).wrapping_add_signed(distance(first, second)))
    })
}

/// The offset of a BL in bytes: S:I1:I2:imm10:imm11:0, where I1 and I2 are J1 and J2, inverted if S is zero.
fn distance(first: u16, second: u16) -> i64 {
    let [first, second] = [first, second].map(i64::from);
    let sign = first >> 10 & 1;
    let [i1, i2] = [second >> 13, second >> 11].map(|j| j & 1 ^ sign ^ 1);
    i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1 | -sign << 24
}

/// The magnitude of a negative constant, zero of another one.
fn constant_below_zero(constant: u32) -> u32 {
    let constant = constant.cast_signed();
    if constant < 0 { constant.unsigned_abs() } else { 0 }
}

/// An instruction has one half word or two.
#[derive(Clone, Copy)]
enum Instruction {
    Short(u16),
    Long(u16, u16),
}

/// The instructions of a block of code, each with its offset.
fn instructions(code: &[u8]) -> impl Iterator<Item = (u64, Instruction)> {
    let (words, _) = code.as_chunks::<2>();
    let mut words = (0..).step_by(2).zip(words.iter().map(|bytes| u16::from_le_bytes(*bytes)));
    std::iter::from_fn(move || {
        let (offset, first) = words.next()?;
        if first >> 11 < 0b11101 {
            return Some((offset, Instruction::Short(first)));
        }
        let (_, second) = words.next()?;
        Some((offset, Instruction::Long(first, second)))
    })
}

/// The immediate of a MOVW. The first byte of the instruction is the lowest.
pub fn moved(instruction: u64) -> u16 {
    let [first, second] = [instruction & 0xffff, instruction >> 16 & 0xffff];
    let bits = (first & 0xf) << 12 | (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8;
    u16::try_from(bits | second & 0xff).unwrap_or_default()
}

/// The twelve bits i:imm3:imm8 of an instruction.
fn immediate(first: u16, second: u16) -> u16 {
    (first >> 10 & 1) << 11 | (second >> 12 & 0b111) << 8 | second & 0xff
}

/// The constant encoded in twelve bits (`ThumbExpandImm`): a byte, repeated or rotated.
fn modified(bits: u16) -> u64 {
    let byte = u32::from(bits & 0xff);
    let constant = match bits >> 8 {
        0b0000 => byte,
        0b0001 => byte * 0x0001_0001,
        0b0010 => byte * 0x0100_0100,
        0b0011 => byte * 0x0101_0101,
        _ => (byte & 0x7f | 0x80).rotate_right(u32::from(bits >> 7)),
    };
    u64::from(constant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(code: &[u8]) -> Stack {
        Stack::of(code, 0, |_| None)
    }

    /// ldr r4, constant; add sp, r4; …; ldr r5, other; add sp, r5: a frame of 1,040 bytes, made and freed.
    #[test]
    fn a_frame_from_a_loaded_constant_is_known() {
        let code = [0x02, 0x4c, 0xa5, 0x44, 0x02, 0x4d, 0xad, 0x44];
        let word = |at| match at {
            0x10c => Some((-1_040_i32).cast_unsigned()),
            0x110 => Some(1_040),
            _ => None,
        };
        assert_eq!(Stack::of(&code, 0x100, word), Stack { bytes: 1_040, ..Stack::default() });
        // The constant is that of another register, or of another instruction.
        assert!(Stack::of(&[0x02, 0x4c, 0xad, 0x44], 0x100, word).is_unbounded);
        assert!(Stack::of(&[0x02, 0x4c, 0x00, 0xbf, 0xa5, 0x44], 0x100, word).is_unbounded);
    }

    /// subs r6, r7, #7; subs r6, #5; mov sp, r6
    #[test]
    fn a_frame_that_is_freed_by_the_frame_pointer_is_known() {
        assert_eq!(decoded(&[0xfe, 0x1f, 0x05, 0x3e, 0xb5, 0x46]), Stack::default());
        // Another register, another base.
        assert!(decoded(&[0xfe, 0x1f, 0x05, 0x3d, 0xb5, 0x46]).is_unbounded);
        assert!(decoded(&[0xee, 0x1f, 0x05, 0x3e, 0xb5, 0x46]).is_unbounded);
    }

    /// Encoded by an assembler (`llvm-mc --triple=thumbv7em-none-eabihf --show-encoding`).
    #[test]
    fn every_instruction_that_lowers_the_stack_is_recognized() {
        let known: [(&[u8], u64); 11] = [
            (&[0xf0, 0xb5], 20),                        // push {r4, r5, r6, r7, lr}
            (&[0x2d, 0xe9, 0x00, 0x0f], 16),            // push.w {r8, r9, r10, r11}
            (&[0x4d, 0xf8, 0x04, 0xbd], 4),             // str r11, [sp, #-4]!
            (&[0x6d, 0xe9, 0x02, 0x01], 8),             // strd r0, r1, [sp, #-8]!
            (&[0x2d, 0xed, 0x10, 0x8b], 64),            // vpush {d8-d15}
            (&[0x6d, 0xed, 0x01, 0x8a], 4),             // vpush {s17}
            (&[0x82, 0xb0], 8),                         // sub sp, #8
            (&[0xad, 0xf5, 0x82, 0x6d], 1040),          // sub.w sp, sp, #1040
            (&[0xad, 0xf5, 0x80, 0x5d], 4096),          // sub.w sp, sp, #4096
            (&[0xad, 0xf2, 0x2c, 0x4d], 1068),          // subw sp, sp, #1068
            (&[0x82, 0xb0, 0x02, 0xb0, 0x70, 0x47], 8), // sub sp, #8; add sp, #8; bx lr
        ];
        for (code, bytes) in known {
            assert_eq!(decoded(code), Stack { bytes, ..Stack::default() }, "{code:x?}");
        }
    }

    #[test]
    fn calls_are_resolved() {
        let place = 0x0801_6934;
        // By a disassembler: 18 bytes back, and 59,212 bytes ahead.
        let cases: [(&[u8], i64); 2] =
            [(&[0xff, 0xf7, 0xf7, 0xff], -18), (&[0x0e, 0xf0, 0xa6, 0xfb], 59_212)];
        for (code, distance) in cases {
            let to = (place + 4_u64).wrapping_add_signed(distance);
            assert_eq!(calls(code, place).collect::<Vec<_>>(), [to], "{code:x?}");
        }
        // bl and movw: only one is a call.
        assert_eq!(calls(&[0xff, 0xf7, 0xf7, 0xff, 0x41, 0xf6, 0x2f, 0x40], place).count(), 1);
    }

    #[test]
    fn a_moved_constant_is_assembled() {
        // movw r0, #0x1c2f
        assert_eq!(moved(0x402f_f641), 0x1c2f);
    }

    #[test]
    fn indirect_calls_and_unknown_depths_are_detected() {
        let calls: [&[u8]; 2] = [&[0xa8, 0x47], &[0x18, 0x47]]; // blx r5; bx r3
        for code in calls {
            assert!(decoded(code).calls_by_register, "{code:x?}");
        }
        // mov sp, r4; sub.w sp, sp, r3; add sp, r4; msr msp, r0
        let unknown: [&[u8]; 4] =
            [&[0xa5, 0x46], &[0xad, 0xeb, 0x03, 0x0d], &[0xa5, 0x44], &[0x80, 0xf3, 0x08, 0x88]];
        for code in unknown {
            assert!(decoded(code).is_unbounded, "{code:x?}");
        }
    }
}
