//! Compares every bit with the floating-point unit of the PC, which rounds as IEEE 754 prescribes.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_soft_float::{add, multiply, subtract};

/// Operands of a test: their bits.
type Pair = (u32, u32);
/// An operation of two numbers.
type Operation = fn(f32, f32) -> f32;

/// Ours, and the PC's.
const OPERATIONS: [(&str, Operation, Operation); 3] = [
    ("product", multiply, |a, b| a * b),
    ("sum", add, |a, b| a + b),
    ("difference", subtract, |a, b| a - b),
];

/// The bit by which a number that is not a number is quiet.
const QUIET: u32 = 1 << 22;
const SIGN: u32 = 1 << 31;

/// Compares all operations on a pair, in both orders.
fn compare((a, b): Pair) {
    for (a, b) in [(a, b), (b, a)] {
        let (a, b) = (f32::from_bits(a), f32::from_bits(b));
        for (name, ours, theirs) in OPERATIONS {
            let (ours, theirs) = (ours(a, b), theirs(a, b));
            let is_same = if theirs.is_nan() {
                ours.is_nan() && ours.to_bits() & QUIET != 0
            } else {
                ours.to_bits() == theirs.to_bits()
            };
            let (x, y) = (a.to_bits(), b.to_bits());
            assert!(
                is_same,
                "{name} of {a:e} ({x:#010x}) and {b:e} ({y:#010x}): {ours:e} ({:#010x}) instead of {theirs:e} ({:#010x})",
                ours.to_bits(),
                theirs.to_bits(),
            );
        }
    }
}

/// Fractions at which a result is rounded to an even number, carries over or cancels.
const FRACTIONS: [u32; 22] = [
    0x00_0000, 0x00_0001, 0x00_0002, 0x00_0003, 0x00_0007, 0x00_0800, 0x00_0801, 0x00_0FFF,
    0x00_1000, 0x12_3456, 0x2A_AAAA, 0x35_04F3, 0x3F_FFFF, 0x40_0000, 0x40_0001, 0x55_5555,
    0x60_0000, 0x7F_F000, 0x7F_FFFC, 0x7F_FFFD, 0x7F_FFFE, 0x7F_FFFF,
];

/// Exponents at the ends of all ranges: zero and subnormal, normal, what the fast paths take, infinity and what is not a number.
const EXPONENTS: [u32; 26] = [
    0, 1, 2, 3, 22, 23, 24, 25, 62, 63, 64, 65, 103, 126, 127, 128, 151, 158, 189, 190, 191, 192,
    252, 253, 254, 255,
];

#[test]
fn special_values() {
    let values: Vec<u32> = [0, SIGN]
        .into_iter()
        .flat_map(|sign| EXPONENTS.map(|exponent| sign | exponent << 23))
        .flat_map(|number| FRACTIONS.map(|fraction| number | fraction))
        .collect();
    for &a in &values {
        for &b in &values {
            compare((a, b));
        }
    }
}

#[test]
fn all_pairs_of_exponents() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for exponent_a in 0..256 {
        for exponent_b in 0..256 {
            for (fraction_a, fraction_b) in [
                (0, 0),
                (0x7F_FFFF, 0x7F_FFFF),
                (0, 0x7F_FFFF),
                (1, 0),
                (sparse(&mut rng), sparse(&mut rng)),
            ] {
                let (a, b) = (exponent_a << 23 | fraction_a, exponent_b << 23 | fraction_b);
                compare((a, b));
                compare((a, b | SIGN));
            }
        }
    }
}

/// Compares the results of so many random pairs.
fn compare_random(pair: fn(&mut ChaCha8Rng) -> Pair, count: u32, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..count {
        compare(pair(&mut rng));
    }
}

#[test]
fn random_bits() {
    compare_random(any, 10_000_000, 2);
}

#[test]
fn neighbouring_exponents() {
    compare_random(neighbours, 5_000_000, 3);
}

#[test]
fn few_ones() {
    compare_random(ties, 5_000_000, 4);
}

#[test]
#[ignore = "a billion pairs: several minutes"]
fn a_billion_pairs() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..=1_000_000_000_u32 / 3 {
        compare(any(&mut rng));
        compare(neighbours(&mut rng));
        compare(ties(&mut rng));
    }
}

/// Any two numbers.
fn any(rng: &mut ChaCha8Rng) -> Pair {
    (rng.next_u32(), rng.next_u32())
}

/// Two numbers whose exponents differ by at most 35: sums that are rounded, and differences that cancel.
fn neighbours(rng: &mut ChaCha8Rng) -> Pair {
    let (a, b) = any(rng);
    let exponent = (a >> 23 & 0xFF) + rng.random_range(0..=70);
    (a, b & !0x7F80_0000 | exponent.saturating_sub(35).min(255) << 23)
}

/// Two numbers near one with few ones or few zeros in their fractions, or that are neighbours: many results are ties.
fn ties(rng: &mut ChaCha8Rng) -> Pair {
    let signs = rng.next_u32();
    let exponent = rng.random_range(40..210);
    let a = signs & SIGN | exponent << 23 | sparse(rng);
    let exponent = exponent + rng.random_range(0..=54) - 27;
    let b = signs << 1 & SIGN | exponent << 23 | sparse(rng);
    match signs % 8 {
        // Almost equal.
        0 => (a, a ^ SIGN ^ rng.random_range(0..4)),
        _ => (a, b),
    }
}

/// A fraction of two to four ones, or of as many zeros.
fn sparse(rng: &mut ChaCha8Rng) -> u32 {
    let bits = rng.next_u32();
    let ones = 1 << (bits % 23)
        | 1 << (bits / 23 % 23)
        | 1 << (bits >> 16 & 0xF)
        | 1 << (bits >> 20 & 0xF);
    let inverted = if bits >> 31 == 0 { 0 } else { 0x7F_FFFF };
    (ones ^ inverted) & 0x7F_FFFF
}
