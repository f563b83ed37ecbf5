//! The core on this computer beside that on the chip: it takes the inputs that the robot has reported, and must compute the same bits.

use sonarfix::filter::ekf::STATES;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::Map;
use sonarfix_app::FlashContents;
use sonarfix_hal::config::RobotConfig;
use sonarfix_link::message::Odometry;
use sonarfix_link::{Estimate, Telemetry, reporter};
use sonarfix_search::navigator::{Mode, Navigator, UNKNOWN_POSITION};

/// What was compared.
#[derive(Debug, Clone, Copy, Default)]
pub struct Compared {
    pub estimates: u64,
    pub pings: u64,
}

/// The core, after the messages so far.
struct Beside<'m> {
    navigator: Navigator<'m>,
    last: Odometry,
    /// An estimate that has other bits: it is that after a message of the same poll, which follows.
    pending: Option<Estimate>,
}

/// Compares each estimate and each outcome of a ping in the messages of a robot with this map and this configuration.
///
/// Of a search the result is taken from the robot: what it computes depends on its computing time.
pub fn compare(heard: &[Telemetry], map: &[u8], config: &RobotConfig) -> Compared {
    let (map, _) = FlashContents::read(map, &[]).map.unwrap();
    let mut beside: Option<Beside> = None;
    let mut compared = Compared::default();
    for message in heard {
        if let Telemetry::Initialized(began) = message {
            beside = Some(Beside::begin(config, map, began));
        } else if let Some(beside) = &mut beside {
            beside.take(message);
            compared.estimates += u64::from(matches!(message, Telemetry::Estimate(_)));
            compared.pings += u64::from(matches!(message, Telemetry::Ping(_)));
        }
    }
    if let Some(beside) = beside {
        beside.has_none_pending();
    }
    compared
}

impl<'m> Beside<'m> {
    fn begin(config: &RobotConfig, map: Map<'m>, began: &Estimate) -> Self {
        let Estimate { at, state, deviation, .. } = *began;
        let localizer = Localizer::resume(config.localizer, map, state, deviation, at).unwrap();
        let mut navigator = Navigator::new(localizer);
        if deviation.x >= UNKNOWN_POSITION {
            navigator.adopt(Mode::Searching, state, deviation).unwrap();
        }
        let last = Odometry { at, right_metres: 0.0, left_metres: 0.0 };
        Self { navigator, last, pending: None }
    }

    fn take(&mut self, message: &Telemetry) {
        if matches!(message, Telemetry::Odometry(_) | Telemetry::Ping(_)) {
            self.has_none_pending();
        }
        let Self { navigator, last, .. } = self;
        match *message {
            Telemetry::Odometry(total) => {
                let travel = travel(last, &total);
                *last = total;
                navigator.odometry_with_turn(total.at, travel, None, None).unwrap();
            }
            Telemetry::Ping(ping) => {
                let range = ping.outcome.ok().map(|echo| echo.range);
                let fix = navigator.fix(&ping.aim, range, None);
                // Equal numbers are printed alike, and others are not.
                assert_eq!(format!("{fix:?}"), format!("{:?}", ping.fix), "{ping:?}");
            }
            Telemetry::SkippedPing(_) => navigator.localizer_mut().skip(),
            Telemetry::PoseSet(Estimate { state, deviation, .. }) => {
                let (position_deviation, heading_deviation) = (deviation.x, deviation.heading);
                let pose = state.pose();
                let start = Start { pose, position_deviation, heading_deviation };
                navigator.set_pose(&start).unwrap();
            }
            Telemetry::ModeChanged(changed) => {
                let Estimate { state, deviation, .. } = changed.estimate;
                navigator.adopt(changed.mode, state, deviation).unwrap();
            }
            Telemetry::Estimate(estimate) => self.pending = Some(estimate),
            _ => {}
        }
        let here = bits(&reporter::estimate(self.navigator.localizer()));
        self.pending = self.pending.filter(|estimate| bits(estimate) != here);
    }

    /// All estimates so far had the same bits.
    fn has_none_pending(&self) {
        if let Some(estimate) = &self.pending {
            let here = reporter::estimate(self.navigator.localizer());
            assert_eq!(bits(&here), bits(estimate), "{here:?} and {estimate:?}");
        }
    }
}

/// The travel between two totals: exactly what the localizer has taken (docs/link.md).
fn travel(last: &Odometry, total: &Odometry) -> WheelTravel {
    #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
    let [right, left] = [
        (total.right_metres - last.right_metres) as f32,
        (total.left_metres - last.left_metres) as f32,
    ];
    WheelTravel::new(right, left)
}

/// Time, state, deviations and health, to the bit.
fn bits(estimate: &Estimate) -> (Instant, [u32; STATES], [u32; STATES], String) {
    let Estimate { at, state, deviation, health } = estimate;
    let [state, deviation] =
        [state.to_array(), deviation.to_array()].map(|it| it.map(f32::to_bits));
    (*at, state, deviation, format!("{health:?}"))
}
