//! A robot with a second sonar, which does not turn.

use std::f32::consts::FRAC_PI_2;

use sonarfix_hal::config::RobotConfig;

use crate::pico::{FixedSonar, World};
use crate::results::{Table, polls, row};
use crate::{drive_with, world};

const LEFT: FixedSonar = FixedSonar { mount: [0.05, 0.04], bearing: FRAC_PI_2 };

/// The robot of the other scenarios with this sonar.
fn configuration() -> RobotConfig {
    let text = include_str!("../../../../firmware/robot.toml");
    let second = r#"[[sonar]]
mount = ["50 mm", "40 mm"]
bearing = "90 deg"
cone = "12 deg"
min_range = "10 cm"
max_range = "3.5 m"
noise = "6 mm"
noise_per_metre = "2 mm/m"
ranger = "hc_sr04"

[prior]"#;
    let text = text.replacen("[sonar]", "[[sonar]]", 1).replacen("[prior]", second, 1);
    sonarfix_map::robot_file::parse(&text, "robot.toml").unwrap()
}

#[test]
#[ignore = "cargo xtask chips"]
fn ninety_seconds_with_two_sonars_stay_within_15_mm_and_have_the_bits_of_the_pc() {
    let (mut pico, driven) = drive_with(&World { second: Some(LEFT), ..world() }, &configuration());
    let pings = pico.pings();
    row(
        Table::Measured,
        &[
            &"two sonars, 90 s drive: position within; pings of each",
            &format!("{:.1} mm; {} and {}", 1e3 * driven.worst, pings[0], pings[1]),
        ],
    );
    assert!(pings.len() == 2 && pings.iter().all(|pings| *pings > 100.0), "{pings:?}");
    polls("two sonars", driven.polls);
}
