//! When each of several rangers can ping, and which one does.

use sonarfix::aim::{Aim, Standing};
use sonarfix::config::{Config, MAX_RANGERS, PingSchedule, RangerId};
use sonarfix::geometry::units::Instant;

use super::Hardware;
use super::cycle::Target;
use crate::ranger::Ranger;
use crate::time::{NEVER, since};

/// The instant at which the servo of a ranger has settled, and the echoes of all pings that the ranger hears have decayed. A ping of a
/// sweep need not wait for the servo to settle: the oscillation is far below the cone within which the search expects an echo.
pub(super) fn can_ping_at<W>(
    config: &Config,
    ranger: RangerId,
    target: &Target<W>,
    hardware: &mut impl Hardware,
) -> Instant {
    let servo = hardware.servo_of(ranger);
    let is_there_at = match target {
        Target::Wall(_) => servo.settles_at(),
        Target::Sweep(_) => servo.arrives_at(),
    };
    is_there_at.max(quiet_at(config, ranger, hardware))
}

/// The instant at which the echoes of all pings that a ranger hears have decayed.
fn quiet_at(config: &Config, ranger: RangerId, hardware: &mut impl Hardware) -> Instant {
    let own = hardware.ranger_of(ranger).ready_at();
    if !config.rangers.are_several() {
        return own;
    }
    let heard = |other: RangerId| {
        let sonars = config.rangers.get(ranger).zip(config.rangers.get(other));
        other != ranger && sonars.is_some_and(|(sonar, other)| sonar.hears(other))
    };
    let others = config.rangers.iter().map(|(other, _)| other).filter(|other| heard(*other));
    others.fold(own, |quiet, other| quiet.max(hardware.ranger_of(other).ready_at()))
}

/// Where the servo of a ranger stands, and when the ranger can ping.
pub(super) fn standing(
    config: &Config,
    ranger: RangerId,
    now: Instant,
    hardware: &mut impl Hardware,
) -> Standing {
    let quiet_at = quiet_at(config, ranger, hardware);
    let servo = hardware.servo_of(ranger);
    // Before its first command a servo settles nowhere.
    let settles_at = Some(servo.settles_at()).filter(|at| *at != NEVER);
    let ready_at = settles_at.map_or(quiet_at, |settled| settled.max(quiet_at));
    Standing { bearing: servo.target(), ready_in: since(ready_at, now) }
}

/// The ping that comes first: the one with the highest score; before it, if pings are as fast as possible, the best of those
/// that end and decay while its servo turns.
pub(super) fn first_of(config: &Config, aims: &[Option<Aim>; MAX_RANGERS]) -> Option<Aim> {
    let best = highest(config, aims.iter().flatten())?;
    let is_free = config.rangers.first.timing.schedule == PingSchedule::AsFastAsPossible;
    let ends_before = |aim: &&Aim| {
        let sonar = config.rangers.get(aim.ranger);
        let decayed = sonar.and_then(|sonar| aim.why.time.checked_add(sonar.timing.cycle));
        is_free && aim.ranger != best.ranger && decayed.is_some_and(|end| end <= best.why.time)
    };
    highest(config, aims.iter().flatten().filter(ends_before)).or(Some(best))
}

/// The aim with the highest score, the first of equal ones.
fn highest<'a>(config: &Config, aims: impl Iterator<Item = &'a Aim>) -> Option<Aim> {
    let policy = config.policy;
    let mut best: Option<&Aim> = None;
    for aim in aims {
        if best.is_none_or(|best| aim.score(policy) > best.score(policy)) {
            best = Some(aim);
        }
    }
    best.copied()
}
