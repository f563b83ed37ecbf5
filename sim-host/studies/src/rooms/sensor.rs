//! The sensors of the study: the tables of the robot's file.

/// A sensor on the robot's servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// HC-SR04.
    HcSr04,
    /// LEGO NXT.
    Nxt,
    /// LEGO EV3, which hears oblique walls at the edge of its cone.
    Ev3,
    /// LV-MaxSonar-EZ.
    LvMaxSonar,
    /// VL53L1X, a time-of-flight ranger.
    Vl53l1x,
}

impl Sensor {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::HcSr04, Self::Nxt, Self::Ev3, Self::LvMaxSonar, Self::Vl53l1x];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HcSr04 => "HC-SR04",
            Self::Nxt => "NXT",
            Self::Ev3 => "EV3",
            Self::LvMaxSonar => "LV-MaxSonar",
            Self::Vl53l1x => "VL53L1X",
        }
    }

    /// Its tables of a scenario.
    pub(crate) fn tables(self) -> &'static str {
        match self {
            Self::HcSr04 => include_str!("sensors/hc_sr04.toml"),
            Self::Nxt => include_str!("sensors/nxt.toml"),
            Self::Ev3 => include_str!("sensors/ev3.toml"),
            Self::LvMaxSonar => include_str!("sensors/lv_maxsonar.toml"),
            Self::Vl53l1x => include_str!("sensors/vl53l1x.toml"),
        }
    }
}
