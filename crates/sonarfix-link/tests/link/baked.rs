//! The configuration in flash.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::config::{Config, Policy, ServoTiming};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::baked::{self, BakedError, LENGTH_MAX};

use crate::messages::{Largest, config};
use crate::wire::{crc32, to_stdvec};

fn example() -> RobotConfig {
    let mut localizer = Config::for_track_width(Metres(0.35));
    localizer.rangers.first.servo = (Radians(-1.5), Radians(1.75));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    localizer.policy = Policy::Nearest;
    RobotConfig::with_common_parts(localizer)
}

fn bytes(config: &RobotConfig) -> Vec<u8> {
    baked::write(config, &mut [0; LENGTH_MAX]).unwrap().to_vec()
}

/// Bytes with a valid header and checksum of a configuration.
fn sealed(version: u16, postcard: &[u8]) -> Vec<u8> {
    let length = u16::try_from(postcard.len()).unwrap();
    let mut bytes = [b"SFXC", &version.to_le_bytes()[..], &length.to_le_bytes(), postcard].concat();
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes
}

#[test]
fn the_bytes_are_as_documented() {
    let config = example();
    assert_eq!(bytes(&config), sealed(baked::VERSION, &to_stdvec(&config)));
    assert_eq!(baked::checksum(&config), crc32(&to_stdvec(&config)));
    // The largest image would fit, but is refused because its content is not a configuration.
    assert!(8 + to_stdvec(&config_of_largest()).len() + 4 <= LENGTH_MAX);
    assert!(matches!(
        baked::write(&config_of_largest(), &mut [0; LENGTH_MAX]),
        Err(BakedError::Rule(_))
    ));
}

fn config_of_largest() -> RobotConfig {
    config(&mut Largest { variant: 0 })
}

#[test]
fn the_image_is_read_from_a_larger_region() {
    let config = example();
    for rest in [0x00, 0xff] {
        let region = [bytes(&config), vec![rest; 1000]].concat();
        assert_eq!(baked::read(&region), Ok(config));
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    let baked = bytes(&example());
    for bit in 0..8 * baked.len() {
        let mut flipped = [&baked[..], &[0xff; 400]].concat();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let error = baked::read(&flipped).unwrap_err();
        let expected = match bit / 8 {
            0..4 => error == BakedError::Missing,
            4..6 => matches!(error, BakedError::Version(_)),
            6..8 => matches!(error, BakedError::Checksum | BakedError::Cut),
            _ => error == BakedError::Checksum,
        };
        assert!(expected, "bit {bit}: {error}");
    }
}

#[test]
fn every_changed_byte_is_refused() {
    let baked = bytes(&example());
    for at in 0..baked.len() {
        for other in (0..=u8::MAX).filter(|&other| other != baked[at]) {
            let mut changed = baked.clone();
            changed[at] = other;
            assert!(baked::read(&changed).is_err(), "byte {at} as {other}");
        }
    }
}

#[test]
fn every_cut_length_is_refused() {
    let baked = bytes(&example());
    assert_eq!(baked::read(&[]), Err(BakedError::Missing));
    for length in 1..baked.len() {
        assert_eq!(baked::read(&baked[..length]), Err(BakedError::Cut), "{length}");
        // As after a power cut during the write.
        let region = [&baked[..length], &vec![0xff; 400 - length]].concat();
        assert!(baked::read(&region).is_err(), "{length}");
    }
}

#[test]
fn a_valid_frame_with_an_invalid_message_is_refused() {
    let config = example();
    let postcard = to_stdvec(&config);
    // A configuration of version 1, which contained only the localizer's part.
    assert_eq!(baked::read(&sealed(1, &to_stdvec(&config.localizer))), Err(BakedError::Version(1)));
    assert_eq!(baked::read(&sealed(baked::VERSION, &postcard[1..])), Err(BakedError::Layout));
    assert_eq!(
        baked::read(&sealed(baked::VERSION, &[&postcard[..], &[0]].concat())),
        Err(BakedError::Layout)
    );
    assert_eq!(baked::read(&sealed(baked::VERSION, &[])), Err(BakedError::Layout));
    let mut wrong = config;
    wrong.localizer.gating.confidence = f32::NAN;
    let error = baked::read(&sealed(baked::VERSION, &to_stdvec(&wrong))).unwrap_err();
    assert!(error.to_string().contains("gating.confidence must be zero or positive"), "{error}");
    assert_eq!(baked::write(&wrong, &mut [0; LENGTH_MAX]).unwrap_err(), error);
}

proptest! {
    /// Random bytes, half of them behind a right header, are refused and nothing panics.
    #[test]
    fn random_bytes_are_refused(seed in any::<u64>(), length in 0_usize..300) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut bytes: Vec<u8> = (0..length).map(|_| rng.random()).collect();
        if rng.random() {
            bytes.splice(..0, *b"SFXC\x04\x00\xff\x00");
        }
        prop_assert!(baked::read(&bytes).is_err());
    }
}
