//! The range of a ping along a bearing, or that there was no echo.
//!
//! # Non-finite policy
//! That of the [localizer](super).

use super::measurement::{Measurement, News, Past, View};
use super::{Localizer, NO_TIME};
use crate::aim::{Aim, Situation};
use crate::association::alternatives::{Scene, Target};
use crate::association::echo::{ExpectedEcho, Explanation, Others};
use crate::association::gating::{self, Use};
use crate::association::history::{Entry, History, Origin};
use crate::association::outcome::{Fix, Refusal};
use crate::association::reliability::Returned;
use crate::association::visibility::{Viewpoint, check_range};
use crate::config::{Config, RangerId, RangerParameters, Ranging};
use crate::geometry::units::{Duration, Metres, SquareMetres};

/// Time after a ping, or after the last time without a wall that has counted, from which on a time without a wall counts as a
/// ping without an accepted range, with a sonar at a fixed bearing.
pub const FIXED_SKIP: Duration = Duration::from_ticks(1_000_000);

impl Localizer<'_> {
    /// Corrects the estimate by the range measured along an aim, or records that there was no echo.
    ///
    /// The estimate must be that of the instant when the echo left the wall: call [`Self::odometry`] up
    /// to it first. [`Fix::Accepted`] and [`Fix::Downweighted`] correct the estimate; every outcome
    /// enters the health.
    pub fn fix(&mut self, aim: &Aim, range: Option<Metres>) -> Fix {
        self.history.record_ping(aim.ranger, aim.wall, aim.bearing, aim.range);
        self.pinged = self.time;
        self.measure(&Ping { aim, range })
    }

    /// Records that a ranger could not ping, because it or its servo has failed.
    pub fn ranger_failed(&mut self, ranger: RangerId) {
        self.history.record_returned(ranger, &Returned::silence(0.0), self.time);
    }

    /// Records that [`Self::aim`] found no wall to measure when a ping was due, so that the verdict of
    /// a localizer without measurements does not stay `Tracking`. A robot with sonars at fixed bearings only often waits
    /// until it has turned: that counts once in [`FIXED_SKIP`].
    pub fn skip(&mut self) {
        if self.config.rangers.iter().all(|(_, sonar)| sonar.fixed_bearing().is_some()) {
            self.skip_unplanned();
        } else {
            self.count_skip();
        }
    }

    /// Records that [`Self::aim_along`] found no wall for a ping whose bearing this localizer did not choose. Of a ring of sonars most
    /// pings go where no wall answers, which is no evidence: it counts once in [`FIXED_SKIP`].
    pub fn skip_unplanned(&mut self) {
        let since = self.time.checked_duration_since(self.pinged).unwrap_or(NO_TIME);
        if since >= FIXED_SKIP {
            self.pinged = self.time;
            self.count_skip();
        }
    }

    fn count_skip(&mut self) {
        self.health.record_no_aim(self.ekf.pose_uncertainty(), &self.limits);
    }
}

/// A ping along an aim.
struct Ping<'a> {
    aim: &'a Aim,
    range: Option<Metres>,
}

/// A wall as a ping measures it.
struct Seen {
    /// Probability that the foot lies on the wall, its range is within the limits and the beam is square.
    geometry: f32,
    entry: Entry,
    /// The shortest and the longest range that the ranger reports.
    limits: (Metres, Metres),
    /// Whether the heading is known well enough to tell what is in the beam.
    is_heading_known: bool,
}

impl Measurement for Ping<'_> {
    type Seen = Seen;

    fn view(&self, robot: &Situation<'_>) -> Result<(View, Seen), Refusal> {
        let &Ping { aim, range } = self;
        let ranger = self.ranger(robot.config)?;
        let measured = check_range(ranger, range);
        if measured == Err(Refusal::NotFinite) {
            return Err(Refusal::NotFinite);
        }
        // A range that is refused by itself has that reason, whatever the geometry.
        let refused = |geometry: Refusal| measured.err().unwrap_or(geometry);
        let Some(wall) = robot.map.wall(aim.wall) else {
            return Err(refused(Refusal::UnknownWall));
        };
        let viewpoint = Viewpoint::new(robot.config, ranger, robot.ekf).of_echo();
        let sight = viewpoint.sight(&wall, aim.bearing).map_err(refused)?;
        let (expected, parameters) = (sight.expected, &robot.config.echo);
        let &Situation { history, now, .. } = robot;
        let (wall, place, range) = (aim.wall, sight.place, expected.range);
        let seen = Seen {
            geometry: sight.on_wall * sight.square,
            entry: history.entry(parameters, aim.ranger, wall, place, range, now),
            limits: (ranger.min_range, ranger.max_range),
            is_heading_known: viewpoint.is_heading_known(),
        };
        let of_mount = robot.config.mount_noise(aim.ranger);
        let noise = SquareMetres(sight.noise + sight.of_map + of_mount);
        let repeated = sight.of_map * (seen.entry.repetition - 1.0);
        let ahead = viewpoint.ahead_of(aim.ranger);
        Ok((View { expected, noise, repeated, ahead, measured }, seen))
    }

    fn explain(
        &self,
        robot: &Situation<'_>,
        view: &View,
        seen: &Seen,
        variance: SquareMetres,
    ) -> Explanation {
        let parameters = &robot.config.echo;
        let measured = view.measured.ok();
        let echo = ExpectedEcho {
            range: view.expected.range,
            variance,
            geometry: seen.geometry,
            occluded: seen.entry.occlusion,
            source: seen.entry.source,
            limits: seen.limits,
            by_chance: robot.history.by_chance((view.expected.by_x, view.expected.by_y), variance),
            lying: robot.history.lying(self.aim.ranger, robot.config),
        };
        let alone = echo.explain(parameters, measured, Others::NONE);
        let is_clear = gating::use_of(alone.association) == Use::Accept;
        let unclear = measured.filter(|_| !is_clear && seen.is_heading_known);
        let Some((range, ranger)) = unclear.zip(self.ranger(robot.config).ok()) else {
            return alone;
        };
        let answers = echo.answers(parameters);
        let target = Target { expected: &view.expected, variance, answers };
        let others = self.others(robot, ranger, &target, range);
        echo.explain(parameters, Some(range), others)
    }

    fn record(&self, past: Past<'_>, view: &View, seen: &Seen, found: &Explanation) -> News {
        let Past { config, history, now } = past;
        let Seen { limits, entry, .. } = seen;
        let is_repeated = view
            .measured
            .is_ok_and(|range| entry.source.is_some_and(|source| source.repeats(range)));
        let is_of_wall = found.association > 0.5;
        if config.rangers.are_several() {
            let (nearest, farthest) = *limits;
            let anywhere = 1.0 / (farthest - nearest).0;
            let returned = match view.measured {
                Ok(_) => Returned::echo(found.density, anywhere, is_of_wall || is_repeated),
                Err(_) => Returned::silence(found.density),
            };
            history.record_returned(self.aim.ranger, &returned, now);
        }
        let origin = match view.measured {
            Ok(_) if is_of_wall => Origin::Wall,
            Ok(range) => Origin::Other(range),
            Err(_) => Origin::Silence,
        };
        history.record_echo(entry, found.occluded, origin, now);
        if origin == Origin::Wall {
            history.record_used((view.expected.by_x, view.expected.by_y));
        }
        if view.measured.is_ok() && !is_repeated {
            history.clutter.record(view.expected.range, found.occluded);
        }
        // A missing echo may come from a failed ranger, at a right pose as well.
        let is_echo = view.measured.is_ok();
        let contradicts = is_echo && gating::contradicts(found.mapped, entry.occlusion);
        News { contradicts, is_repeated }
    }

    fn has_failed(&self, config: &Config, history: &History) -> bool {
        config.rangers.are_several() && history.has_failed(self.aim.ranger, config)
    }
}

impl Ping<'_> {
    fn ranger<'c>(&self, config: &'c Config) -> Result<&'c RangerParameters, Refusal> {
        config.rangers.get(self.aim.ranger).ok_or(match self.range {
            None => Refusal::NoEcho,
            Some(range) if !range.is_finite() => Refusal::NotFinite,
            Some(_) => Refusal::UnknownRanger,
        })
    }

    /// What else of the map may have returned the echo.
    fn others(
        &self,
        robot: &Situation<'_>,
        ranger: &RangerParameters,
        target: &Target<'_>,
        range: Metres,
    ) -> Others {
        let Situation { config, map, ekf, history, .. } = *robot;
        let scene = Scene { config, sonar: ranger, map: *map, ekf, history };
        match ranger.ranging {
            Ranging::Sound => scene.others(target, self.aim.bearing, range),
            Ranging::Light(beam) => {
                let viewpoint = Viewpoint::new(config, ranger, ekf).of_echo();
                scene.others_lit(&viewpoint, beam, target, range)
            }
        }
    }
}
