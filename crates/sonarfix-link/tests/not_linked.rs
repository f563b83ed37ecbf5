//! A configuration that asks for a part that this program was built without is refused by name. To be run without the
//! default features.
#![cfg(not(any(feature = "light", feature = "gyro", feature = "rangers", feature = "search")))]

use serde::Serialize;
use sonarfix::config::{Config, Policy, ServoTiming};
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::image::checksum;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig, StartPose};
use sonarfix_link::baked::{self, BakedError};
use sonarfix_link::message::SessionCommand;
use sonarfix_link::{Command, Receiver, Sender, frame};

fn example() -> RobotConfig {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.rangers.first.servo = (Radians(-1.5), Radians(1.5));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    RobotConfig::with_common_parts(localizer)
}

fn postcard(value: &impl Serialize) -> Vec<u8> {
    postcard::to_slice(value, &mut [0; 1_000]).unwrap().to_vec()
}

/// An image of these bytes.
fn sealed(content: &[u8]) -> Vec<u8> {
    let version = baked::VERSION.to_le_bytes();
    let length = u16::try_from(content.len()).unwrap().to_le_bytes();
    let mut image = [b"SFXC", &version[..], &length, content].concat();
    image.extend(checksum(&image).to_le_bytes());
    image
}

/// The example with other bytes in place of one, after so many.
fn replaced(before: usize, bytes: &[u8]) -> Vec<u8> {
    let config = postcard(&example());
    assert_eq!(config[before], 0, "nothing is asked for there");
    [&config[..before], bytes, &config[before + 1..]].concat()
}

/// Bytes of the example before the kind of its ranger, the gyro and the rangers after the first.
fn before() -> [usize; 3] {
    let Config { drive, max_wheel_speed, rangers, prior, gating, echo, policy, weights, .. } =
        example().localizer;
    let sonar = rangers.first;
    let parts = (sonar.mount, sonar.servo, sonar.cone, sonar.min_range, sonar.max_range);
    let ranging = postcard(&(drive, max_wheel_speed, parts, sonar.noise, sonar.timing));
    let further = postcard(&(drive, max_wheel_speed, sonar));
    let gyro = postcard(&(drive, max_wheel_speed, rangers, prior, gating, echo, policy, weights));
    [ranging.len(), gyro.len(), further.len()]
}

/// Configurations that ask for a part each.
fn asking() -> [(Feature, Vec<u8>); 3] {
    let [ranging, gyro, rangers] = before();
    let light = [&[1], &postcard(&[0.1_f32; 2])[..]].concat();
    let measured = [&[1], &postcard(&([0.1_f32; 5], 10_000_u64, false))[..]].concat();
    let further = [&[1], &postcard(&example().localizer.rangers.first)[..]].concat();
    [
        (Feature::Light, replaced(ranging, &light)),
        (Feature::Gyro, replaced(gyro, &measured)),
        (Feature::Rangers, replaced(rangers, &further)),
    ]
}

#[test]
fn a_baked_configuration_names_what_is_missing() {
    assert_eq!(baked::read(&sealed(&postcard(&example()))), Ok(example()));
    for (feature, config) in asking() {
        let refused = Err(BakedError::NotLinked(NotLinked(feature)));
        assert_eq!(baked::read(&sealed(&config)), refused);
    }
    let longer = [&postcard(&example())[..], &[0]].concat();
    assert_eq!(baked::read(&sealed(&longer)), Err(BakedError::Layout));
}

#[test]
fn what_can_be_decoded_is_refused_as_well() {
    let mut config = example();
    config.start = StartPose::Unknown { region: None };
    let refused = Err(BakedError::NotLinked(NotLinked(Feature::Search)));
    assert_eq!(baked::read(&sealed(&postcard(&config))), refused);
    config.start = StartPose::Known;
    config.localizer.policy = Policy::Informative;
    let refused = baked::read(&sealed(&postcard(&config))).unwrap_err();
    assert_eq!(refused.to_string(), "this program was built without `informative`");
}

/// A robot receives the configuration as a command that it can answer.
#[test]
fn a_sent_configuration_names_what_is_missing() {
    let stop = SessionCommand { session: 300, command: Command::Stop };
    let mut buffer = frame::EMPTY;
    let sent = Sender::starting_at(1).frame(&stop, &mut buffer).to_vec();
    assert_eq!(receive(&sent).unwrap().command, Command::Stop);
    for (feature, config) in asking() {
        let command = [&postcard(&(300_u32, 1_u32))[..], &config].concat();
        let received = receive(&framed(&command)).unwrap();
        assert_eq!(received.session, 300);
        assert_eq!(received.command, Command::SetUnusable(NotLinked(feature)));
    }
    let other = [&postcard(&(300_u32, 0_u32))[..], &asking()[1].1].concat();
    assert_eq!(receive(&framed(&other)), None, "another command");
}

/// A frame around a command in postcard.
fn framed(command: &[u8]) -> Vec<u8> {
    let mut body = [&[frame::VERSION, 1, 1, 0], command].concat();
    body.extend(checksum(&body).to_le_bytes());
    let mut encoded = vec![0; 2_000];
    let length = cobs::encode(&body, &mut encoded);
    [&[0], &encoded[..length], &[0]].concat()
}

fn receive(bytes: &[u8]) -> Option<SessionCommand> {
    let mut receiver = Receiver::<SessionCommand>::new();
    let frames = bytes.iter().filter_map(|&byte| receiver.push(byte));
    frames.last().map(|frame| frame.message)
}
