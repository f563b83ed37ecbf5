//! The sonars and time-of-flight rangers that have a name, in one list for robot files, scenarios and forecasts.

use sonarfix::config::LightBeam;
use sonarfix::sensor::echo::EchoParameters;
use sonarfix_hal::ranger::RangerSettings;

use crate::devices::{
    EV3_ECHO, LV_MAXSONAR_ECHO, NXT_ECHO, POLAROID_6500_ECHO, SRF08_ECHO, VL53L0X_BEAM,
    VL53L0X_ECHO, VL53L1X_ECHO,
};
use crate::document::Node;
use crate::spelling::alternatives;

/// The name of a ranger with a driver of its own, which only a robot file can have.
pub(crate) const CUSTOM: &str = "custom";

/// A simulated sonar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SonarName {
    /// The paper's: always detects the nearest wall in its cone. Noise and cone are in `[truth]`. Of a robot that
    /// measures with light, a ranger without other errors than noise and direction.
    #[default]
    Ideal,
    /// HC-SR04.
    HcSr04,
    /// LEGO NXT.
    Nxt,
    /// LEGO EV3, which reports the nearest point of its cone.
    Ev3,
    /// LV-MaxSonar-EZ, by pulse width.
    LvMaxSonar,
    /// SRF08.
    Srf08,
    /// Polaroid 6500 with its electrostatic transducer.
    Polaroid6500,
    /// VL53L1X, a time-of-flight ranger.
    Vl53l1x,
    /// VL53L0X, a time-of-flight ranger.
    Vl53l0x,
}

/// What is known of a sonar, by its name in files and on the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SonarModel {
    /// Its name.
    pub name: &'static str,
    /// Its simulation, if there is one: a scenario's `sensor.model`.
    pub simulated: Option<SonarName>,
    /// Its driver's settings, if it has a driver: a robot file's `sonar.ranger`.
    pub ranger: Option<RangerSettings>,
    /// The parameters of its echoes, if they were measured: a robot file's `echo.sensor`.
    pub echo: Option<EchoParameters>,
    /// Its beam, if it measures with light.
    pub beam: Option<LightBeam>,
}

impl SonarModel {
    /// All sonars.
    pub const ALL: [Self; 10] = [
        Self {
            name: "ideal",
            simulated: Some(SonarName::Ideal),
            ranger: None,
            echo: Some(EchoParameters::NONE),
            beam: None,
        },
        Self {
            name: "hc_sr04",
            simulated: Some(SonarName::HcSr04),
            ranger: Some(RangerSettings::HC_SR04),
            echo: Some(EchoParameters::HC_SR04),
            beam: None,
        },
        Self {
            name: "nxt",
            simulated: Some(SonarName::Nxt),
            ranger: None,
            echo: Some(NXT_ECHO),
            beam: None,
        },
        Self {
            name: "ev3",
            simulated: Some(SonarName::Ev3),
            ranger: None,
            echo: Some(EV3_ECHO),
            beam: None,
        },
        Self {
            name: "lv_maxsonar",
            simulated: Some(SonarName::LvMaxSonar),
            ranger: Some(RangerSettings::LV_MAXSONAR),
            echo: Some(LV_MAXSONAR_ECHO),
            beam: None,
        },
        Self {
            name: "srf02",
            simulated: None,
            ranger: Some(RangerSettings::SRF),
            echo: None,
            beam: None,
        },
        Self {
            name: "srf08",
            simulated: Some(SonarName::Srf08),
            ranger: Some(RangerSettings::SRF),
            echo: Some(SRF08_ECHO),
            beam: None,
        },
        Self {
            name: "polaroid_6500",
            simulated: Some(SonarName::Polaroid6500),
            ranger: None,
            echo: Some(POLAROID_6500_ECHO),
            beam: None,
        },
        Self {
            name: "vl53l1x",
            simulated: Some(SonarName::Vl53l1x),
            ranger: Some(RangerSettings::VL53L1X),
            echo: Some(VL53L1X_ECHO),
            beam: Some(LightBeam::VL53L1X),
        },
        Self {
            name: "vl53l0x",
            simulated: Some(SonarName::Vl53l0x),
            ranger: Some(RangerSettings::VL53L0X),
            echo: Some(VL53L0X_ECHO),
            beam: Some(VL53L0X_BEAM),
        },
    ];

    /// The sonar with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.name == name)
    }
}

/// A property of the sonar that a value names. A placeholder if the sonar has none, which is recorded; `others` are
/// further names for the message.
pub(crate) fn read<T>(
    node: &Node<'_>,
    others: &[&str],
    placeholder: T,
    property: impl Fn(SonarModel) -> Option<T>,
) -> T {
    let name = node.text();
    let model = SonarModel::named(name);
    model.and_then(&property).unwrap_or_else(|| {
        let having = SonarModel::ALL.into_iter().filter(|model| property(*model).is_some());
        let known: Vec<&str> =
            having.map(|model| model.name).chain(others.iter().copied()).collect();
        let known = alternatives(name, &known);
        node.report(match model {
            Some(_) => format!("must be {known}: nothing is known here of \"{name}\""),
            None => format!("must be {known}"),
        });
        placeholder
    })
}
