//! The localizer, called in any order with any arguments.

use sonarfix::aim::{Aim, Policy, Reason};
use sonarfix::config::{Config, PingSchedule, PingTiming, RangerId, ServoTiming};
use sonarfix::filter::ekf::Ekf;
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{
    Duration, Instant, Metres, MetresPerSecond, PerRootMetre, Radians, SquareMetres,
};
use sonarfix::health::{Health, LOST_AT, MOST_NIS, Verdict};
use sonarfix::localizer::{Fix, Localizer, Refusal, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::sensor::echo::EchoParameters;
use sonarfix::sensor::range::RangeNoise;

use crate::bytes::Bytes;

/// Creates a localizer from a configuration, a start and up to eight walls, and calls it until the end of the bytes.
///
/// # Panics
/// If an invariant is violated.
pub fn localizer(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let config = config(&mut bytes);
    let walls = walls(&mut bytes);
    let start = Start {
        pose: Pose::new(bytes.number(5.0), bytes.number(5.0), Radians(bytes.number(3.2))),
        position_deviation: Metres(bytes.between(1e-3, 1.0)),
        heading_deviation: Radians(bytes.between(1e-3, 0.1)),
    };
    let Ok(localizer) =
        Localizer::new(config, Map::new(&walls), start, Instant::from_ticks(1_000_000))
    else {
        return;
    };
    assert!(config.check().is_ok(), "started with {config:?}");
    let mut session = Session { localizer, walls: &walls };
    session.check_estimate();
    while !bytes.is_empty() {
        session.call(&mut bytes);
        session.check_estimate();
    }
}

fn config(bytes: &mut Bytes) -> Config {
    let mut config = Config::for_track_width(Metres(0.16));
    // Half of the robots are usual ones, so that the calls are reached at all.
    if bytes.byte() < 128 {
        config.echo =
            if bytes.byte() < 128 { EchoParameters::NONE } else { EchoParameters::HC_SR04 };
        config.gating.confidence = f32::from(bytes.byte() % 4);
        config.policy = policy(bytes);
        return config;
    }
    config.drive = Drive {
        track_width: Metres(bytes.between(0.05, 0.6)),
        wheel_noise: PerRootMetre(Metres(bytes.between(1e-4, 1e-2))),
        scale_walk: PerRootMetre(bytes.between(0.0, 1e-4)),
        track_width_walk: PerRootMetre(Metres(bytes.between(0.0, 1e-4))),
    };
    config.max_wheel_speed = MetresPerSecond(bytes.between(0.1, 5.0));
    let sonar = &mut config.rangers.first;
    sonar.mount = Point::new(bytes.number(0.2), bytes.number(0.2));
    sonar.servo = (Radians(bytes.between(-3.1, 0.0)), Radians(bytes.between(0.0, 3.1)));
    sonar.cone = Radians(bytes.between(0.05, 1.5));
    sonar.min_range = Metres(bytes.between(0.0, 0.2));
    sonar.max_range = Metres(bytes.between(1.0, 10.0));
    sonar.noise = RangeNoise {
        floor: Metres(bytes.between(1e-4, 0.05)),
        per_metre: bytes.between(0.0, 0.02),
    };
    sonar.timing = timing(bytes);
    config.prior.scale_right = bytes.between(1e-4, 0.05);
    config.prior.scale_left = bytes.between(1e-4, 0.05);
    config.prior.track_width = Metres(bytes.between(0.0, 0.02));
    config.prior.range_scale = bytes.between(0.0, 0.05);
    config.prior.mount = Metres(bytes.between(0.0, 0.02));
    let gating = &mut config.gating;
    gating.confidence = bytes.between(0.0, 4.0);
    gating.inflation = Metres(bytes.between(0.0, 0.1));
    gating.max_distance_without_fix = Metres(bytes.between(0.1, 10.0));
    gating.max_position_deviation = Metres(bytes.between(0.01, 1.0));
    let echo = &mut config.echo;
    echo.missed = bytes.between(0.0, 0.3);
    echo.short = bytes.between(0.0, 0.3);
    echo.long = bytes.between(0.0, 0.3);
    echo.free_path = Metres(bytes.between(0.0, 20.0));
    echo.map_accuracy = Metres(bytes.between(0.0, 0.1));
    echo.late = Metres(bytes.between(0.0, 0.01));
    echo.late_per_radian = Metres(bytes.between(0.0, 0.1));
    echo.half_angle = Radians(bytes.between(0.0, 1.5));
    echo.rim = Radians(bytes.between(0.0, 0.2));
    echo.sure_within = Metres(bytes.between(0.0, 2.0));
    config.policy = policy(bytes);
    config.weights.heading = Metres(bytes.between(0.0, 1.0));
    config.weights.wheels = Metres(bytes.between(0.0, 10.0));
    config
}

fn policy(bytes: &mut Bytes) -> Policy {
    if bytes.byte() < 128 { Policy::Nearest } else { Policy::Informative }
}

/// Up to 65 ms for each part; pings periodically or as fast as possible.
fn timing(bytes: &mut Bytes) -> PingTiming {
    let span = |bytes: &mut Bytes| {
        Duration::from_ticks(u16::from_le_bytes([bytes.byte(), bytes.byte()]).into())
    };
    let schedule = if bytes.byte() < 128 {
        PingSchedule::Every(span(bytes))
    } else {
        PingSchedule::AsFastAsPossible
    };
    let servo = ServoTiming { frame: span(bytes), sixty_degrees: span(bytes), settle: span(bytes) };
    PingTiming { schedule, servo, cycle: span(bytes) }
}

fn walls(bytes: &mut Bytes) -> Vec<Wall> {
    let corner = |bytes: &mut Bytes| Point::new(bytes.number(8.0), bytes.number(8.0));
    let count = bytes.byte() % 8;
    (0..count).filter_map(|_| Wall::new(corner(bytes), corner(bytes)).ok()).collect()
}

struct Session<'a> {
    localizer: Localizer<'a>,
    walls: &'a [Wall],
}

/// Everything that a refused call must not change.
fn bits(ekf: &Ekf) -> Vec<u32> {
    let (state, covariance) = (ekf.state_vector(), ekf.covariance());
    state.iter().chain(covariance.iter()).map(|v| v.to_bits()).collect()
}

impl Session<'_> {
    fn call(&mut self, bytes: &mut Bytes) {
        match bytes.byte() % 8 {
            0 => self.roll(bytes),
            1 => self.drive(bytes),
            2 | 3 => self.look(bytes),
            4 => self.look_at(bytes),
            5 => {
                let aim = Aim {
                    wall: WallId(bytes.word()),
                    bearing: Radians(bytes.number(4.0)),
                    range: Metres(bytes.number(5.0)),
                    why: Reason {
                        gain: SquareMetres(bytes.number(1.0)),
                        success: bytes.number(1.0),
                        time: Duration::from_ticks(bytes.word().into()),
                        candidates: 0,
                    },
                    ranger: RangerId(bytes.byte() % 2),
                };
                self.fix(&aim, Some(Metres(bytes.number(5.0))));
            }
            6 => self.skip(),
            _ => {
                let _ = self.localizer.aim_at(Radians(bytes.number(4.0)));
            }
        }
    }

    /// Any travel at any time, backwards too.
    fn roll(&mut self, bytes: &mut Bytes) {
        let now = self.localizer.time().ticks();
        let ticks = match bytes.byte() {
            0..16 => u64::from(bytes.word()),
            16..32 => u64::MAX - u64::from(bytes.word()),
            _ => now.saturating_add(u64::from(bytes.word() % 1_000_000)),
        };
        let travel = WheelTravel::new(bytes.number(0.2), bytes.number(0.2));
        self.odometry(Instant::from_ticks(ticks), travel);
    }

    /// Some usual travels.
    fn drive(&mut self, bytes: &mut Bytes) {
        let wheel = |byte: u8| 0.001 * f32::from(byte.cast_signed());
        let travel = WheelTravel::new(wheel(bytes.byte()), wheel(bytes.byte()));
        for _ in 0..bytes.byte() {
            let Some(ticks) = self.localizer.time().ticks().checked_add(100_000) else { return };
            self.odometry(Instant::from_ticks(ticks), travel);
        }
    }

    fn odometry(&mut self, now: Instant, travel: WheelTravel) {
        let (before, time, health) = self.snapshot();
        let taken = self.localizer.odometry(now, travel);
        let after = bits(self.localizer.filter());
        if taken.is_err() {
            assert_eq!((after, self.localizer.time()), (before, time), "{travel:?}: {taken:?}");
            assert_eq!(self.localizer.health(), health);
        } else {
            assert!(now >= time && travel.is_finite());
            assert_eq!(self.localizer.time(), now);
            if travel == WheelTravel::default() {
                assert_eq!(after, before, "no travel");
            }
        }
    }

    /// The wall of the localizer's aim, and a range near the expected one, or any.
    fn look(&mut self, bytes: &mut Bytes) {
        let Ok(aim) = self.localizer.aim() else {
            self.skip();
            return;
        };
        let sonar = self.localizer.config().rangers.first;
        assert!(aim.bearing >= sonar.servo.0 && aim.bearing <= sonar.servo.1, "{aim:?}");
        self.check_aim(&aim);
        self.hear(&aim, bytes);
    }

    fn look_at(&mut self, bytes: &mut Bytes) {
        if let Ok(aim) = self.localizer.aim_at(Radians(bytes.number(3.2))) {
            self.check_aim(&aim);
            self.hear(&aim, bytes);
        }
    }

    fn check_aim(&self, aim: &Aim) {
        assert!((aim.wall.0 as usize) < self.walls.len(), "{aim:?}");
        // The limits of the sonar enter as a probability: a wall just beyond them may be the only one.
        assert!(aim.range.is_finite() && aim.range >= Metres(0.0), "{aim:?}");
        assert!((0.0..=1.0).contains(&aim.why.success), "{aim:?}");
        assert!(aim.bearing.is_finite());
    }

    fn hear(&mut self, aim: &Aim, bytes: &mut Bytes) {
        let range = match bytes.byte() {
            0..32 => None,
            32..64 => Some(Metres(bytes.number(5.0))),
            _ => Some(aim.range + Metres(bytes.number(0.5))),
        };
        self.fix(aim, range);
    }

    fn fix(&mut self, aim: &Aim, range: Option<Metres>) {
        let (before, time, _) = self.snapshot();
        let fix = self.localizer.fix(aim, range);
        let is_same = bits(self.localizer.filter()) == before;
        let may_inflate = self.localizer.health().verdict == Verdict::Lost;
        assert_eq!(self.localizer.time(), time);
        match fix {
            Fix::Accepted(innovation) | Fix::Downweighted(innovation) => {
                assert!(innovation.nis().is_finite(), "{innovation:?}");
            }
            Fix::Gated(_) => assert!(is_same || may_inflate, "{fix:?} changed the filter"),
            Fix::Refused(refusal) => {
                assert!(is_same || may_inflate, "{fix:?} changed the filter");
                match range {
                    None => assert_eq!(refusal, Refusal::NoEcho),
                    Some(range) if !range.is_finite() => assert_eq!(refusal, Refusal::NotFinite),
                    Some(_) => {}
                }
            }
            _ => panic!("an unknown outcome: {fix:?}"),
        }
    }

    fn skip(&mut self) {
        let (before, time, _) = self.snapshot();
        self.localizer.skip();
        assert_eq!((bits(self.localizer.filter()), self.localizer.time()), (before, time));
    }

    fn snapshot(&self) -> (Vec<u32>, Instant, Health) {
        (bits(self.localizer.filter()), self.localizer.time(), self.localizer.health())
    }

    fn check_estimate(&self) {
        let ekf = self.localizer.filter();
        let (state, p) = (ekf.state_vector(), ekf.covariance());
        assert!(state.iter().chain(p.iter()).all(|v| v.is_finite()), "{state} {p}");
        assert_eq!(p, p.transpose());
        // The wheels' scale errors are stored as mean and difference: converted, their variances may round below zero.
        assert!([0, 1, 2, 5, 6].iter().all(|&i| p[(i, i)] >= 0.0), "{p}");
        let heading = state[2];
        let half_turn = core::f32::consts::PI;
        assert!(heading > -half_turn && heading <= half_turn, "{heading}");
        let health = self.localizer.health();
        assert!((0.0..=LOST_AT).contains(&health.evidence), "{health:?}");
        assert!((0.0..=MOST_NIS).contains(&health.nis), "{health:?}");
        assert!(health.rolled_since_fix >= Metres(0.0), "{health:?}");
        assert!(health.position_deviation >= Metres(0.0), "{health:?}");
    }
}
