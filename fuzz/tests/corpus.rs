//! Every target over its corpus, over changed copies of it, and over random bytes.

use std::path::Path;

use sonarfix_fuzz::TARGETS;

/// Inputs for each target.
const INPUTS: u64 = 5_000;
/// The longest random input, bytes.
const LONGEST: u64 = 2_000;

/// The generator of S. Vigna, for an input that is the same everywhere.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, limit: u64) -> usize {
        usize::try_from(self.next() % limit.max(1)).unwrap()
    }

    fn byte(&mut self) -> u8 {
        self.next().to_le_bytes()[0]
    }
}

fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    let inputs: Vec<_> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
    assert!(!inputs.is_empty(), "{} is empty", folder.display());
    inputs
}

/// Overwrites, inserts and cuts here and there.
fn changed(mut input: Vec<u8>, rng: &mut SplitMix) -> Vec<u8> {
    for _ in 0..=rng.below(8) {
        let at = rng.below(input.len() as u64);
        match rng.below(4) {
            0 if at < input.len() => input[at] = rng.byte(),
            1 => input.insert(at, rng.byte()),
            2 if at < input.len() => {
                let end = input.len().min(at + rng.below(20));
                input.drain(at..end);
            }
            _ => {
                let copied: Vec<u8> = input.iter().skip(at).take(30).copied().collect();
                let to = rng.below(input.len() as u64);
                input.splice(to..to, copied);
            }
        }
    }
    input
}

#[test]
fn no_target_breaks() {
    for (name, target) in TARGETS {
        let corpus = corpus(name);
        corpus.iter().for_each(|input| target(input));
        let mut rng = SplitMix(1);
        for _ in 0..INPUTS {
            let random: Vec<u8> = (0..rng.below(LONGEST)).map(|_| rng.byte()).collect();
            target(&random);
            let one = corpus[rng.below(corpus.len() as u64)].clone();
            target(&changed(one, &mut rng));
        }
    }
}
