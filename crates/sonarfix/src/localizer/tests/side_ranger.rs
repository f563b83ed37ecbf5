//! An example of a further scalar measurement, by the recipe of `CONTRIBUTING.md`: the distance to the wall beside the robot,
//! measured by a ranger without a servo, as wall followers have it.
//!
//! # Non-finite policy
//! That of the [localizer](crate::localizer).

use crate::aim::Situation;
use crate::association::echo::{ExpectedEcho, Explanation, Others};
use crate::association::outcome::{Fix, Refusal};
use crate::config::Config;
use crate::filter::motion::WheelTravel;
use crate::geometry::pose::{Point, Pose};
use crate::geometry::units::{Instant, Metres, Radians, SquareMetres};
use crate::localizer::measurement::{Measurement, News, Past, View};
use crate::localizer::{Localizer, Start};
use crate::map::{Map, Wall, WallId};
use crate::sensor::echo::EchoParameters;
use crate::sensor::range::ExpectedRange;

/// A distance to a wall beside the robot.
struct SideDistance {
    wall: WallId,
    /// Place of the ranger in the robot frame.
    mount: Point,
    distance: Metres,
    deviation: Metres,
}

impl Localizer<'_> {
    /// Corrects the estimate by a distance to a wall beside the robot.
    fn side_distance(&mut self, measured: &SideDistance) -> Fix {
        self.measure(measured)
    }
}

impl Measurement for SideDistance {
    type Seen = ();

    fn view(&self, robot: &Situation<'_>) -> Result<(View, ()), Refusal> {
        if !self.distance.is_finite() {
            return Err(Refusal::NotFinite);
        }
        let wall = robot.map.wall(self.wall).ok_or(Refusal::UnknownWall)?;
        let expected = ExpectedRange::new(&wall, self.mount, &robot.ekf.state());
        let noise = SquareMetres(self.deviation.0 * self.deviation.0);
        Ok((View { expected, noise, repeated: 0.0, ahead: None, measured: Ok(self.distance) }, ()))
    }

    fn explain(
        &self,
        _: &Situation<'_>,
        view: &View,
        (): &(),
        variance: SquareMetres,
    ) -> Explanation {
        let echo = ExpectedEcho {
            range: view.expected.range,
            variance,
            geometry: 0.99,
            occluded: 0.01,
            source: None,
            limits: (Metres(0.02), Metres(2.0)),
            by_chance: 0.3,
            lying: 0.0,
        };
        echo.explain(&EchoParameters::HC_SR04, Some(self.distance), Others::NONE)
    }

    fn record(&self, _: Past<'_>, _: &View, (): &(), found: &Explanation) -> News {
        News { contradicts: found.mapped < 0.5, is_repeated: false }
    }
}

/// A robot that believes to be 4 cm farther from the wall on its left than it is.
fn robot(walls: &[Wall]) -> Localizer<'_> {
    let start = Start {
        pose: Pose::new(0.5, 0.56, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.01),
    };
    let config = Config::for_track_width(Metres(0.16));
    Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap()
}

fn wall_on_the_left() -> [Wall; 1] {
    [Wall::new(Point::new(0.0, 1.0), Point::new(4.0, 1.0)).unwrap()]
}

fn side(distance: f32) -> SideDistance {
    let mount = Point::new(0.0, 0.05);
    SideDistance { wall: WallId(0), mount, distance: Metres(distance), deviation: Metres(0.005) }
}

#[test]
fn distances_to_a_wall_beside_the_robot_correct_its_place_across_it() {
    let walls = wall_on_the_left();
    let mut localizer = robot(&walls);
    let along = localizer.filter().pose_covariance().xx;
    for step in 1..=10_u64 {
        let now = Instant::from_ticks(step * 100_000);
        localizer.odometry(now, WheelTravel::new(0.02, 0.02)).unwrap();
        // The true place is y = 0.6 m, and the ranger 0.65 m.
        let fix = localizer.side_distance(&side(0.35));
        assert!(matches!(fix, Fix::Accepted(_)), "{fix:?}");
    }
    let pose = localizer.pose();
    assert!((pose.y.0 - 0.6).abs() < 0.003, "{pose:?}");
    assert!((pose.x.0 - 0.7).abs() < 0.003, "{pose:?}");
    let covariance = localizer.filter().pose_covariance();
    assert!(
        covariance.yy < 1e-5 && covariance.xx > 0.9 * along,
        "{} {}",
        covariance.xx,
        covariance.yy
    );
    assert_eq!(localizer.health().accepted_in_a_row, 10);
}

#[test]
fn a_distance_that_is_not_that_of_the_wall_changes_nothing_but_the_health() {
    let walls = wall_on_the_left();
    let mut localizer = robot(&walls);
    assert!(matches!(localizer.side_distance(&side(0.35)), Fix::Accepted(_)));
    let before = localizer.pose();
    assert!(matches!(localizer.side_distance(&side(0.05)), Fix::Gated(_)));
    assert_eq!(localizer.side_distance(&side(f32::NAN)), Fix::Refused(Refusal::NotFinite));
    let elsewhere = SideDistance { wall: WallId(1), ..side(0.35) };
    assert_eq!(localizer.side_distance(&elsewhere), Fix::Refused(Refusal::UnknownWall));
    assert_eq!(localizer.pose(), before);
    let health = localizer.health();
    assert_eq!((health.gated_in_a_row, health.silent_in_a_row), (1, 2));
    assert!(health.evidence > 0.5, "{health:?}");
}
