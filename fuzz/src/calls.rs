//! The localizer, called in any order with any arguments.

use sonarfix::aim::{Aim, Policy, Reason};
use sonarfix::config::{CalibrationPrior, Config, Pace, Rhythm, Sonar, Timing, Trust, Weights};
use sonarfix::ekf::Ekf;
use sonarfix::health::{Health, LOST_AT, MOST_NIS, Verdict};
use sonarfix::localizer::{Fix, Localizer, Refusal, Start};
use sonarfix::map::{Map, Wall, WallId};
use sonarfix::motion::{Drive, WheelTravel};
use sonarfix::pose::{Point, Pose};
use sonarfix::range::RangeNoise;
use sonarfix::units::{
    Duration, Instant, Metres, MetresPerSecond, PerRootMetre, Radians, SquareMetres,
};

use crate::bytes::Bytes;

/// A configuration, a start, up to eight walls, and calls until the bytes are used up.
///
/// # Panics
/// If an invariant breaks.
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
    let usual = Config::for_track_width(Metres(0.16));
    // Half of the robots are usual ones, so that the calls are reached.
    if bytes.byte() < 128 {
        let trust = Trust {
            gate: 1.0 + f32::from(bytes.byte() % 8),
            short: f32::from(bytes.byte() % 4),
            outer_gate: if bytes.byte() < 128 { 0.0 } else { 20.0 },
            ..usual.trust
        };
        let policy = if bytes.byte() < 128 { Policy::Nearest } else { Policy::Informative };
        return Config { trust, policy, ..usual };
    }
    Config {
        drive: Drive {
            track_width: Metres(bytes.between(0.05, 0.6)),
            wheel_noise: PerRootMetre(Metres(bytes.between(1e-4, 1e-2))),
            scale_walk: PerRootMetre(bytes.between(0.0, 1e-4)),
            track_width_walk: PerRootMetre(Metres(bytes.between(0.0, 1e-4))),
        },
        max_wheel_speed: MetresPerSecond(bytes.between(0.1, 5.0)),
        sonar: Sonar {
            mount: Point::new(bytes.number(0.2), bytes.number(0.2)),
            servo: (Radians(bytes.between(-3.1, 0.0)), Radians(bytes.between(0.0, 3.1))),
            cone: Radians(bytes.between(0.05, 1.5)),
            min_range: Metres(bytes.between(0.0, 0.2)),
            max_range: Metres(bytes.between(1.0, 10.0)),
            noise: RangeNoise {
                floor: Metres(bytes.between(1e-4, 0.05)),
                per_metre: bytes.between(0.0, 0.02),
            },
            timing: timing(bytes),
        },
        prior: CalibrationPrior {
            scale_right: bytes.between(1e-4, 0.05),
            scale_left: bytes.between(1e-4, 0.05),
            track_width: Metres(bytes.between(0.0, 0.02)),
            range_scale: bytes.between(0.0, 0.05),
        },
        trust: Trust {
            gate: bytes.between(1.0, 8.0),
            confidence: bytes.between(0.0, 4.0),
            outer_gate: bytes.between(8.0, 20.0),
            short: bytes.between(0.0, 4.0),
            reopen: Metres(bytes.between(0.0, 0.1)),
            stale: Metres(bytes.between(0.1, 10.0)),
            doubtful: Metres(bytes.between(0.01, 1.0)),
        },
        policy: if bytes.byte() < 128 { Policy::Nearest } else { Policy::Informative },
        weights: Weights {
            heading: Metres(bytes.between(0.0, 1.0)),
            wheels: Metres(bytes.between(0.0, 10.0)),
        },
    }
}

/// Up to 65 ms for each part; a look every so often, or as fast as can be.
fn timing(bytes: &mut Bytes) -> Timing {
    let span = |bytes: &mut Bytes| {
        Duration::from_ticks(u16::from_le_bytes([bytes.byte(), bytes.byte()]).into())
    };
    let rhythm =
        if bytes.byte() < 128 { Rhythm::Every(span(bytes)) } else { Rhythm::AsFastAsPossible };
    let servo = Pace { frame: span(bytes), sixty_degrees: span(bytes), settle: span(bytes) };
    Timing { rhythm, servo, cycle: span(bytes) }
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

/// All that a refusal must leave alone.
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

    /// Some usual steps.
    fn drive(&mut self, bytes: &mut Bytes) {
        let wheel = |byte: u8| 0.001 * f32::from(byte.cast_signed());
        let travel = WheelTravel::new(wheel(bytes.byte()), wheel(bytes.byte()));
        for _ in 0..bytes.byte() {
            let Some(ticks) = self.localizer.time().ticks().checked_add(100_000) else { return };
            self.odometry(Instant::from_ticks(ticks), travel);
        }
    }

    fn odometry(&mut self, now: Instant, travel: WheelTravel) {
        let (before, time, health) = self.remember();
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

    /// The wall that the localizer asks for, and a range near what it expects, or any.
    fn look(&mut self, bytes: &mut Bytes) {
        let Ok(aim) = self.localizer.aim() else {
            self.skip();
            return;
        };
        let sonar = self.localizer.config().sonar;
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
        let sonar = self.localizer.config().sonar;
        assert!((aim.wall.0 as usize) < self.walls.len(), "{aim:?}");
        assert!(aim.range >= sonar.min_range && aim.range <= sonar.max_range, "{aim:?}");
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
        let (before, time, _) = self.remember();
        let fix = self.localizer.fix(aim, range);
        let is_same = bits(self.localizer.filter()) == before;
        let trust = self.localizer.config().trust;
        let may_reopen = self.localizer.health().verdict == Verdict::Lost;
        assert_eq!(self.localizer.time(), time);
        match fix {
            Fix::Accepted(innovation) => assert!(innovation.nis() <= trust.gate * trust.gate),
            Fix::Weakened(innovation) => {
                // What was beyond the gate has been brought to it, up to rounding.
                assert!(innovation.nis() <= trust.gate * trust.gate * 1.001, "{innovation:?}");
            }
            Fix::Gated(innovation) => {
                // NaN is not inside.
                let is_inside = innovation.nis() <= trust.gate * trust.gate;
                assert!(!is_inside);
                assert!(is_same || may_reopen, "{fix:?} changed the filter");
            }
            Fix::Refused(refusal) => {
                assert!(is_same, "{fix:?} changed the filter");
                match range {
                    None => assert_eq!(refusal, Refusal::NoEcho),
                    Some(range) if !range.is_finite() => assert_eq!(refusal, Refusal::NotFinite),
                    Some(_) => {}
                }
            }
        }
    }

    fn skip(&mut self) {
        let (before, time, _) = self.remember();
        self.localizer.skip();
        assert_eq!((bits(self.localizer.filter()), self.localizer.time()), (before, time));
    }

    fn remember(&self) -> (Vec<u32>, Instant, Health) {
        (bits(self.localizer.filter()), self.localizer.time(), self.localizer.health())
    }

    fn check_estimate(&self) {
        let ekf = self.localizer.filter();
        let (state, p) = (ekf.state_vector(), ekf.covariance());
        assert!(state.iter().chain(p.iter()).all(|v| v.is_finite()), "{state} {p}");
        assert_eq!(p, p.transpose());
        // The wheels' scale errors are held as mean and difference: shown, they may round to less.
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
