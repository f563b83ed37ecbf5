//! stub
use sonarfix::{
    aim::Policy, config::*, map::*, motion::Drive, pose::*, range::RangeNoise, units::*,
};
#[derive(Debug, Clone)]
pub struct NamedWall {
    pub name: String,
    pub from: [f64; 2],
    pub to: [f64; 2],
}
#[derive(Debug, Clone)]
pub struct Floor {
    pub walls: Vec<NamedWall>,
}
impl Floor {
    pub fn walls(&self) -> Vec<Wall> {
        self.walls
            .iter()
            .map(|w| {
                Wall::new(
                    Point::new(w.from[0] as f32, w.from[1] as f32),
                    Point::new(w.to[0] as f32, w.to[1] as f32),
                )
                .unwrap()
            })
            .collect()
    }
}
#[derive(Debug, Clone)]
pub struct Robot {
    pub config: Config,
    pub encoder_period: Duration,
    pub fix_period: Duration,
}
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    pub advance: f64,
    pub turn: f64,
}
#[derive(Debug, Clone)]
pub struct Path;
impl Path {
    pub fn duration(&self) -> f64 {
        1248.0
    }
    pub fn pose_at(&self, t: f64) -> (f64, f64, f64) {
        let lap = 312.0;
        let t = t % lap;
        use std::f64::consts::PI;
        let c = [
            (0., 0., PI / 2., 40.),
            (0., 40., PI, 20.),
            (-20., 40., -PI / 2., 40.),
            (-20., 0., 0., 20.),
        ];
        let mut s = t;
        for (x, y, h, l) in c {
            let d = l / 0.4;
            if s < d {
                return (x + s * 0.4 * f64::cos(h), y + s * 0.4 * f64::sin(h), h);
            }
            s -= d;
            if s < 3.0 {
                let h2 = h + s * PI / 6.;
                return (
                    x + l * f64::cos(h),
                    y + l * f64::sin(h),
                    if h2 > PI { h2 - 2. * PI } else { h2 },
                );
            }
            s -= 3.0;
        }
        (0., 0., PI / 2.)
    }
    pub fn motion_between(&self, a: f64, b: f64) -> Vec<Piece> {
        let m = (a + b) / 2.;
        let mut s = m % 312.0;
        for l in [40., 20., 40., 20.] {
            if s < l / 0.4 {
                return vec![Piece {
                    advance: 0.4 * (b - a),
                    turn: 0.,
                }];
            }
            s -= l / 0.4;
            if s < 3. {
                return vec![Piece {
                    advance: 0.,
                    turn: (b - a) * std::f64::consts::PI / 6.,
                }];
            }
            s -= 3.
        }
        vec![]
    }
}
#[derive(Debug, Clone)]
pub struct Start {
    pub position: f64,
    pub heading: f64,
    pub drawn: bool,
}
#[derive(Debug, Clone)]
pub struct Truth {
    pub track_width: f64,
    pub scale_right: f64,
    pub scale_left: f64,
    pub range_scale: f64,
    pub wheel_noise: f64,
    pub scale_walk: f64,
    pub track_width_walk: f64,
    pub range_noise: f64,
    pub range_noise_per_metre: f64,
    pub cone: f64,
}
#[derive(Debug, Clone)]
pub struct Scenario {
    pub name: String,
    pub floor: Floor,
    pub robot: Robot,
    pub path: Path,
    pub start: Start,
    pub truth: Truth,
    pub run: RunSettings,
    pub description: String,
}
pub fn paper() -> Scenario {
    let run = RunSettings { runs: 50, seed: 0 };
    let description = String::new();
    let w = |n: &str, a, b, c, d| NamedWall {
        name: n.into(),
        from: [a, b],
        to: [c, d],
    };
    let mut config = Config::for_track_width(Metres(0.35));
    config.drive = Drive {
        track_width: Metres(0.35),
        wheel_noise: PerRootMetre(Metres(0.0005)),
        scale_walk: PerRootMetre(5e-6),
        track_width_walk: PerRootMetre(Metres(5e-6)),
    };
    config.sonar.max_range = Metres(10.);
    config.sonar.noise = RangeNoise {
        floor: Metres(0.0024),
        per_metre: 0.,
    };
    config.prior.track_width = Metres(0.01);
    config.trust.gate = 5.0;
    config.policy = Policy::Nearest;
    Scenario {
        run,
        description,
        name: "paper".into(),
        floor: Floor {
            walls: vec![
                w("oe", 2.5, -1.5, 2.5, 41.5),
                w("ow", -22.5, -1.5, -22.5, 41.5),
                w("ie", -3., 3., -3., 37.),
                w("iw", -17., 3., -17., 37.),
                w("os", -22.5, -1.5, 2.5, -1.5),
                w("on", -22.5, 41.5, 2.5, 41.5),
                w("is", -17., 3., -3., 3.),
                w("in", -17., 37., -3., 37.),
            ],
        },
        robot: Robot {
            config,
            encoder_period: Duration::millis(100),
            fix_period: Duration::secs(1),
        },
        path: Path,
        start: Start {
            position: 1e-3,
            heading: 1e-3,
            drawn: true,
        },
        truth: Truth {
            track_width: 0.3488,
            scale_right: -0.0065,
            scale_left: 2e-4,
            range_scale: 0.,
            wheel_noise: 0.0005,
            scale_walk: 0.,
            track_width_walk: 0.,
            range_noise: 0.0024,
            range_noise_per_metre: 0.,
            cone: 0.2617993877991494,
        },
    }
}
#[derive(Debug, Clone)]
pub struct RunSettings {
    pub runs: usize,
    pub seed: u64,
}
impl Scenario {
    pub fn paper() -> Result<Self, std::io::Error> {
        Ok(paper())
    }
    pub fn read(_: &std::path::Path) -> Result<Self, std::io::Error> {
        Ok(paper())
    }
    pub fn let_truth_walk_as_assumed(&mut self) {
        self.truth.scale_walk = 5e-6;
        self.truth.track_width_walk = 5e-6
    }
}
