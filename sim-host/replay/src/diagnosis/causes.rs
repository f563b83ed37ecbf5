//! The causes that are tried on a log, one after another.

use std::f64::consts::{PI, TAU};

use sonarfix::map::Wall;
use sonarfix_hal::config::RobotConfig;
use sonarfix_sim::trace::Pose;

use crate::diagnosis::change::{Change, Start};
use crate::diagnosis::walls::{self, WallChange};

/// What may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The right and the left wheel are exchanged.
    WheelsSwapped,
    /// The right encoder counts backwards.
    RightMirrored,
    /// The left encoder counts backwards.
    LeftMirrored,
    /// Both encoders count backwards.
    BothMirrored,
    /// The travel of the right wheel per count is another.
    RightTravel,
    /// The travel of the left wheel per count is another.
    LeftTravel,
    /// The travel of both wheels per count is another.
    Travel,
    /// The travel of both wheels is in another unit.
    TravelUnit,
    /// The track width is another.
    TrackWidth,
    /// The wheels are noisier.
    WheelNoise,
    /// The servo turns the other way.
    BearingMirrored,
    /// The zero of the servo is another.
    BearingOffset,
    /// The servo turns farther or less far.
    BearingScale,
    /// Bearings are in degrees.
    BearingUnit,
    /// The columns of bearing and range are exchanged.
    Columns,
    /// The sonar is farther ahead or back.
    MountAhead,
    /// The sonar is farther to a side.
    MountLeft,
    /// Ranges are in another unit.
    RangeUnit,
    /// All ranges are too long or too short by a factor.
    RangeScale,
    /// All ranges are too long or too short by a length.
    RangeOffset,
    /// The times of the ranges are late or early.
    RangeDelay,
    /// The clock of the ranges is too fast or too slow.
    RangeClock,
    /// Each range is that of an earlier ping.
    LatePings,
    /// The heading at the start is another.
    StartHeading,
    /// The heading at the start is in degrees, or its position in another unit.
    StartUnit,
    /// x and y of the start are exchanged.
    StartAxes,
    /// The pose at the start is another.
    StartPose,
    /// The robot was carried, or its wheels slipped.
    Moved,
    /// The map is a mirror image.
    MapMirrored,
    /// The map is turned.
    MapTurned,
    /// The map has another unit.
    MapUnit,
    /// The map has another scale.
    MapScale,
    /// The x axis of the map has another scale.
    MapScaleX,
    /// The y axis of the map has another scale.
    MapScaleY,
    /// A wall is at another place than in the map.
    WallShifted,
    /// A wall of the map is not there.
    WallRemoved,
    /// A wall is missing in the map.
    WallAdded,
}

/// What causes have in common that a drive may not tell apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// All ranges are longer or shorter.
    Length,
    /// Ranges belong to another time.
    Time,
}

/// A change that explains the log if the cause is right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    pub cause: Cause,
    pub change: Change,
    /// What was varied: a factor, radians, metres or seconds; 0 if nothing.
    pub value: f64,
}

/// A quantity that is varied.
struct Varied {
    cause: Cause,
    values: &'static [f64],
    /// Half the distance of two values, as a factor or as a difference.
    half_step: f64,
    is_factor: bool,
    change: fn(f64) -> Change,
}

const FACTORS: &[f64] = &[
    0.1, 0.2, 0.25, 0.32, 0.4, 0.5, 0.58, 0.67, 0.76, 0.83, 0.9, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0,
    2.5, 3.0, 3.2, 4.0, 5.0, 10.0,
];

const WIDTHS: &[f64] = &[
    0.1, 0.2, 0.25, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88, 1.13, 1.25, 1.4, 1.6, 1.8, 2.0, 2.3, 4.0, 10.0,
];

const VARIED: [Varied; 17] = [
    Varied {
        cause: Cause::RightTravel,
        values: FACTORS,
        half_step: 1.05,
        is_factor: true,
        change: |by| Change { wheels: [by, 1.0], ..Change::default() },
    },
    Varied {
        cause: Cause::LeftTravel,
        values: FACTORS,
        half_step: 1.05,
        is_factor: true,
        change: |by| Change { wheels: [1.0, by], ..Change::default() },
    },
    Varied {
        cause: Cause::Travel,
        values: FACTORS,
        half_step: 1.05,
        is_factor: true,
        change: |by| Change { wheels: [by, by], ..Change::default() },
    },
    Varied {
        cause: Cause::TrackWidth,
        values: WIDTHS,
        half_step: 1.06,
        is_factor: true,
        change: |by| Change { track_width: by, ..Change::default() },
    },
    Varied {
        cause: Cause::WheelNoise,
        values: &[2.5, 4.0, 6.0, 10.0, 16.0],
        half_step: 1.27,
        is_factor: true,
        change: |by| Change { wheel_noise: by, ..Change::default() },
    },
    Varied {
        cause: Cause::BearingOffset,
        values: &[
            -165.0, -150.0, -135.0, -120.0, -105.0, -90.0, -75.0, -60.0, -45.0, -35.0, -25.0,
            -15.0, -8.0, 8.0, 15.0, 25.0, 35.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0,
            165.0, 180.0,
        ],
        half_step: 5.0,
        is_factor: false,
        change: |by| Change { bearing_offset: by.to_radians(), ..Change::default() },
    },
    Varied {
        cause: Cause::RangeOffset,
        values: &[-0.5, -0.3, -0.2, -0.12, -0.07, -0.04, 0.04, 0.07, 0.12, 0.2, 0.3, 0.5],
        half_step: 0.02,
        is_factor: false,
        change: |by| Change { range_offset: by, ..Change::default() },
    },
    Varied {
        cause: Cause::RangeDelay,
        values: &[-5.0, -3.0, -2.0, -1.2, -0.7, -0.4, 0.4, 0.7, 1.2, 2.0, 3.0, 5.0],
        half_step: 0.2,
        is_factor: false,
        change: |by| Change { delay: by, ..Change::default() },
    },
    Varied {
        cause: Cause::StartHeading,
        values: &[
            -160.0, -140.0, -120.0, -105.0, -90.0, -75.0, -60.0, -45.0, -30.0, -20.0, -10.0, 10.0,
            20.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 140.0, 160.0, 180.0,
        ],
        half_step: 5.0,
        is_factor: false,
        change: |by| Change { heading_offset: by.to_radians(), ..Change::default() },
    },
    Varied {
        cause: Cause::BearingScale,
        values: &[0.4, 0.5, 0.6, 0.7, 0.8, 1.25, 1.45, 1.7, 2.0],
        half_step: 1.08,
        is_factor: true,
        change: |by| Change { bearing: by, ..Change::default() },
    },
    Varied {
        cause: Cause::RangeScale,
        values: SCALES,
        half_step: 1.06,
        is_factor: true,
        change: |by| Change { range: by, ..Change::default() },
    },
    Varied {
        cause: Cause::MapScale,
        values: SCALES,
        half_step: 1.06,
        is_factor: true,
        change: |by| Change { map: [[by, 0.0], [0.0, by]], ..Change::default() },
    },
    Varied {
        cause: Cause::MapScaleX,
        values: SCALES,
        half_step: 1.06,
        is_factor: true,
        change: |by| Change { map: [[by, 0.0], [0.0, 1.0]], ..Change::default() },
    },
    Varied {
        cause: Cause::MapScaleY,
        values: SCALES,
        half_step: 1.06,
        is_factor: true,
        change: |by| Change { map: [[1.0, 0.0], [0.0, by]], ..Change::default() },
    },
    Varied {
        cause: Cause::MountAhead,
        values: MOUNTS,
        half_step: 0.03,
        is_factor: false,
        change: |by| Change { mount: [by, 0.0], ..Change::default() },
    },
    Varied {
        cause: Cause::MountLeft,
        values: MOUNTS,
        half_step: 0.03,
        is_factor: false,
        change: |by| Change { mount: [0.0, by], ..Change::default() },
    },
    Varied {
        cause: Cause::RangeClock,
        values: &[-0.1, -0.06, -0.035, -0.02, -0.012, 0.012, 0.02, 0.035, 0.06, 0.1],
        half_step: 0.006,
        is_factor: false,
        change: |by| Change { clock_gain: by, ..Change::default() },
    },
];

const MOUNTS: &[f64] = &[-0.3, -0.2, -0.13, -0.07, 0.07, 0.13, 0.2, 0.3];
const SCALES: &[f64] = &[0.6, 0.7, 0.78, 0.87, 1.15, 1.28, 1.45, 1.65];

/// Factor of ranges in inches that were converted as centimetres.
pub const INCHES_AS_CENTIMETRES: f64 = 2.54;
/// Factor of ranges in centimetres that were converted as inches.
pub const CENTIMETRES_AS_INCHES: f64 = 1.0 / INCHES_AS_CENTIMETRES;
/// Factors of the ranges: of metres from other units, of a unit taken for another one, and of half and double the way.
const RANGE_UNITS: [f64; 14] = [
    1e-3,
    1e-2,
    0.1,
    10.0,
    100.0,
    1e3,
    0.0254,
    0.3048,
    39.37,
    3.2808,
    INCHES_AS_CENTIMETRES,
    CENTIMETRES_AS_INCHES,
    0.5,
    2.0,
];
/// Factors of a map's unit.
const MAP_UNITS: [f64; 10] = [1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3, 0.0254, 0.3048, 39.37, 3.2808];

/// Factors of the travel of wheels in other units.
const TRAVEL_UNITS: [f64; 5] = [1e-3, 1e-2, 0.0254, 100.0, 1e3];
/// Matrices of maps that are mirrored, and of those that are turned.
const MIRRORS: [[[f64; 2]; 2]; 4] = [
    [[-1.0, 0.0], [0.0, 1.0]],
    [[1.0, 0.0], [0.0, -1.0]],
    [[0.0, 1.0], [1.0, 0.0]],
    [[0.0, -1.0], [-1.0, 0.0]],
];
const TURNS: [[[f64; 2]; 2]; 3] =
    [[[0.0, 1.0], [-1.0, 0.0]], [[0.0, -1.0], [1.0, 0.0]], [[-1.0, 0.0], [0.0, -1.0]]];

/// All candidates that need no search for the pose.
pub fn all() -> Vec<Candidate> {
    let none = Change::default();
    let fixed = |cause, change| Candidate { cause, change, value: 0.0 };
    let mut all = vec![
        fixed(Cause::WheelsSwapped, Change { is_swapped: true, ..none }),
        fixed(Cause::RightMirrored, Change { wheels: [-1.0, 1.0], ..none }),
        fixed(Cause::LeftMirrored, Change { wheels: [1.0, -1.0], ..none }),
        fixed(Cause::BothMirrored, Change { wheels: [-1.0, -1.0], ..none }),
        fixed(Cause::BearingMirrored, Change { bearing: -1.0, ..none }),
        fixed(Cause::BearingUnit, Change { bearing: PI / 180.0, ..none }),
        fixed(Cause::WheelsSwapped, Change { is_swapped: true, wheels: [-1.0; 2], ..none }),
        fixed(Cause::WheelsSwapped, Change { is_swapped: true, wheels: [-1.0, 1.0], ..none }),
        fixed(Cause::WheelsSwapped, Change { is_swapped: true, wheels: [1.0, -1.0], ..none }),
        fixed(Cause::Columns, Change { is_exchanged: true, ..none }),
    ];
    for is_about_centre in [false, true] {
        let maps = MIRRORS.map(|map| (Cause::MapMirrored, map)).into_iter();
        let maps = maps.chain(TURNS.map(|map| (Cause::MapTurned, map)));
        all.extend(maps.map(|(cause, map)| fixed(cause, Change { map, is_about_centre, ..none })));
    }
    let late = (1_u8..=10).map(|pings| Candidate {
        cause: Cause::LatePings,
        change: Change { late_pings: pings, ..none },
        value: pings.into(),
    });
    all.extend(late);
    let travels =
        TRAVEL_UNITS.map(|by| (Cause::TravelUnit, by, Change { wheels: [by; 2], ..none }));
    let units = RANGE_UNITS.map(|by| (Cause::RangeUnit, by, Change { range: by, ..none }));
    let maps =
        MAP_UNITS.map(|by| (Cause::MapUnit, by, Change { map: [[by, 0.0], [0.0, by]], ..none }));
    let units = units.into_iter().chain(maps).chain(travels);
    all.extend(units.map(|(cause, value, change)| Candidate { cause, change, value }));
    for varied in &VARIED {
        let values = varied.values.iter();
        all.extend(values.map(|&value| Candidate {
            cause: varied.cause,
            change: (varied.change)(value),
            value,
        }));
    }
    all
}

/// Candidates between a value of a varied quantity and its neighbours; none of what is not varied. `fineness` halves the step.
pub fn finer(candidate: &Candidate, fineness: i32) -> Vec<Candidate> {
    let Some(varied) = VARIED.iter().find(|varied| varied.cause == candidate.cause) else {
        let shifts = || {
            let shift = candidate.change.wall.into_iter();
            shift.flat_map(|it| walls::finer(it, fineness)).map(of_wall).collect()
        };
        return poses_around(candidate, fineness).unwrap_or_else(shifts);
    };
    let share = 0.5_f64.powi(fineness);
    let values = if varied.is_factor {
        let step = varied.half_step.powf(share);
        [candidate.value / step, candidate.value * step]
    } else {
        let step = share * varied.half_step;
        [candidate.value - step, candidate.value + step]
    };
    let finer =
        values.map(|value| Candidate { change: (varied.change)(value), value, ..*candidate });
    finer.into()
}

/// How improbable a value is, of a normal distribution around zero.
fn unusual(value: f64, deviation: f64) -> f64 {
    0.5 * (value / deviation).powi(2)
}

/// A start elsewhere.
pub fn start_at(pose: Pose) -> Candidate {
    let change = Change { start: Some(Start { pose, is_found: true }), ..Change::default() };
    Candidate { cause: Cause::StartPose, change, value: 0.0 }
}

/// The heading of the start in degrees, if it is more than a turn.
pub fn start_unit(pose: Pose) -> Option<Candidate> {
    let change = Change { heading: PI / 180.0, ..Change::default() };
    let candidate = Candidate { cause: Cause::StartUnit, change, value: 0.0 };
    (pose.heading.abs() > TAU).then_some(candidate)
}

/// A ruler measures a track width better than this, whatever prior the robot file states.
const MEASURED: f64 = 0.15;
/// A start farther from the origin may be in another unit than metres.
const FAR: f64 = 10.0;
/// A start that is moved and turned less is the same, metres and radians.
const ELSEWHERE: f64 = 0.15;

/// The position of the start in another unit, and with exchanged axes.
pub fn start_positions(pose: Pose) -> impl Iterator<Item = Candidate> {
    let at = move |cause, value, x, y| {
        let start = Some(Start { pose: Pose { x, y, ..pose }, is_found: false });
        let change = Change { start, ..Change::default() };
        Candidate { cause, change, value }
    };
    let exchanged = at(Cause::StartAxes, 0.0, pose.y, pose.x);
    // Near the origin a start in another unit is hardly another start.
    let is_far = pose.x.hypot(pose.y) > FAR;
    let units = [1e-3, 1e-2, 0.0254].into_iter().filter(move |_| is_far);
    let units = units.map(move |by| at(Cause::StartUnit, by, by * pose.x, by * pose.y));
    units.chain(std::iter::once(exchanged))
}

/// Starts around the one of the log.
pub fn starts_around(pose: Pose) -> impl Iterator<Item = Candidate> {
    const STEPS: [f64; 7] = [-1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0];
    let offsets = STEPS.into_iter().flat_map(|x| STEPS.map(|y| (x, y)));
    let others = offsets.filter(|offset| *offset != (0.0, 0.0));
    others.map(move |(x, y)| start_at(Pose { x: pose.x + x, y: pose.y + y, ..pose }))
}

/// Candidates of single walls.
pub fn of_walls(walls: &[Wall]) -> impl Iterator<Item = Candidate> {
    walls::changes(walls).into_iter().map(of_wall)
}

fn of_wall(wall: WallChange) -> Candidate {
    let (cause, value) = match wall {
        WallChange::Shifted(_, by) => (Cause::WallShifted, by),
        WallChange::Removed(_) => (Cause::WallRemoved, 0.0),
        WallChange::Added(..) => (Cause::WallAdded, 0.0),
    };
    Candidate { cause, change: Change { wall: Some(wall), ..Change::default() }, value }
}

/// The poses next to that of a candidate. `fineness` halves the step.
fn poses_around(candidate: &Candidate, fineness: i32) -> Option<Vec<Candidate>> {
    let step = 0.2 * 0.5_f64.powi(fineness);
    let around = |pose: Pose| {
        [-step, step].into_iter().flat_map(move |by| {
            let (x, y, heading) = (pose.x + by, pose.y + by, pose.heading + by);
            [Pose { x, ..pose }, Pose { y, ..pose }, Pose { heading, ..pose }]
        })
    };
    match (candidate.change.moved, candidate.change.start) {
        (Some((time, pose)), _) => Some(around(pose).map(|pose| moved_to(time, pose)).collect()),
        (None, Some(start)) if candidate.cause == Cause::StartPose => {
            Some(around(start.pose).map(start_at).collect())
        }
        _ => None,
    }
}

/// Poses around the one at which the ranges no longer fit: a robot that slips or is pushed stays near.
pub fn moves_around(time: f64, pose: Pose) -> impl Iterator<Item = Candidate> {
    const TURNS: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];
    let at = move |turn: f64| Pose { heading: pose.heading + turn.to_radians(), ..pose };
    let turned = TURNS.into_iter().skip(1).map(at);
    let all = TURNS.into_iter().flat_map(move |turn| starts_around(at(turn)));
    let moved = all.filter_map(|it| it.change.start).map(|start| start.pose);
    turned.chain(moved).map(move |pose| moved_to(time, pose))
}

/// A robot that was carried at a time.
pub fn moved_to(time: f64, pose: Pose) -> Candidate {
    let change = Change { moved: Some((time, pose)), ..Change::default() };
    Candidate { cause: Cause::Moved, change, value: time }
}

impl Candidate {
    /// Whether its value is one of many.
    pub fn is_varied(&self) -> bool {
        VARIED.iter().any(|varied| varied.cause == self.cause)
    }

    /// Causes of one kind have similar effects, which many drives do not tell apart.
    pub fn kind(&self) -> Option<Kind> {
        match self.cause {
            Cause::RangeOffset
            | Cause::RangeScale
            | Cause::RangeUnit
            | Cause::MountAhead
            | Cause::MountLeft => Some(Kind::Length),
            Cause::RangeDelay | Cause::RangeClock | Cause::LatePings => Some(Kind::Time),
            _ => None,
        }
    }

    /// Whether it makes a robot drive less than half of what its log says.
    pub fn is_standing(&self) -> bool {
        let of_wheels = [Cause::RightTravel, Cause::LeftTravel, Cause::Travel];
        of_wheels.contains(&self.cause) && self.value < 0.5
    }

    /// Whether its start differs from that of the log, or it has none.
    pub fn is_elsewhere(&self, start: Option<Pose>) -> bool {
        let (Some(to), Some(from)) = (self.change.start, start) else { return true };
        let to = to.pose;
        let turn = sonarfix_sim::angle::wrap(to.heading - from.heading).abs();
        (to.x - from.x).hypot(to.y - from.y) > ELSEWHERE || turn > ELSEWHERE
    }

    /// Whether it is one wall of the map.
    pub fn is_of_wall(&self) -> bool {
        self.change.wall.is_some()
    }

    /// Whether it makes wheels slow that are too fast.
    pub fn is_of_slow_wheels(&self) -> bool {
        self.cause == Cause::TravelUnit && self.value < 1.0
    }

    /// The logarithm of how many candidates there are of its kind: a varied quantity, and a start anywhere, fit by chance.
    pub fn cost(&self) -> f64 {
        match self.cause {
            Cause::TravelUnit | Cause::WallShifted => 10.0,
            Cause::WallRemoved | Cause::WallAdded | Cause::StartAxes | Cause::RangeClock => 12.0,
            Cause::StartPose => 15.0,
            Cause::Moved => 25.0,
            Cause::RangeUnit => 3.0,
            Cause::WheelsSwapped if self.change.wheels.iter().any(|by| *by < 0.0) => 4.0,
            // A robot that hardly moves, by its log, can follow any ranges.
            Cause::RightTravel | Cause::LeftTravel | Cause::Travel => {
                let slower = (-self.value.ln()).max(0.0);
                5.0 + 40.0 * self.value.ln().abs() + 40.0 * slower.powi(2)
            }
            // The prior of the noise that a builder states: by a factor of 3.
            Cause::WheelNoise => 5.0 + unusual(self.value.ln(), 1.1),
            Cause::TrackWidth => 5.0 + 20.0 * self.value.ln().abs(),
            Cause::RangeScale => 5.0 + unusual(self.value.ln(), 0.15),
            // A mount that was measured wrongly is more frequent than a ranger with an offset.
            Cause::MountAhead | Cause::MountLeft => 3.5 + unusual(self.value, 0.1),
            Cause::RangeOffset => 6.5 + unusual(self.value, 0.1),
            _ if self.is_varied() => 5.0,
            _ => 1.0,
        }
    }

    /// Whether the value is so near to what the robot file or the start record states that the localizer estimates it by itself;
    /// `of_heading`: the deviation of the heading in the start record, radians.
    pub fn is_usual(&self, robot: &RobotConfig, of_heading: Option<f64>) -> bool {
        let prior = &robot.localizer.prior;
        let width = f64::from(robot.localizer.drive.track_width.0);
        let permitted = match self.cause {
            Cause::RightTravel => (self.value - 1.0, 3.0 * f64::from(prior.scale_right)),
            Cause::LeftTravel | Cause::Travel => {
                (self.value - 1.0, 3.0 * f64::from(prior.scale_left))
            }
            Cause::TrackWidth => {
                let prior = 3.0 * f64::from(prior.track_width.0) / width;
                (self.value - 1.0, prior.min(MEASURED))
            }
            // The filter adapts to twice the noise.
            Cause::WheelNoise => (self.value, 2.0),
            Cause::BearingOffset => (self.value, 6.0),
            Cause::StartHeading => {
                let expected = 4.0 * of_heading.unwrap_or(0.0).to_degrees();
                (self.value, expected.clamp(6.0, 15.0))
            }
            Cause::BearingScale => (self.value - 1.0, 0.08),
            Cause::RangeScale | Cause::MapScale | Cause::MapScaleX | Cause::MapScaleY => {
                (self.value - 1.0, (3.0 * f64::from(prior.range_scale)).max(0.03))
            }
            Cause::MountAhead | Cause::MountLeft => (self.value, 0.03),
            Cause::RangeClock => (self.value, 0.004),
            Cause::RangeOffset => (self.value, 0.025),
            Cause::RangeDelay => (self.value, 0.15),
            Cause::WallShifted => (self.value, 0.05),
            _ => return false,
        };
        permitted.0.abs() <= permitted.1
    }
}
