//! The rules of every poll.

use anyhow::ensure;
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;
use sonarfix_app::Polled;
use sonarfix_hal::robot::Faults;

use super::Robot;
use super::wiring::POLL;

/// Time after which an unreadable encoder is reported and the motors are off, µs: half a second, a sample of the encoders, and
/// a ping that delays it.
const BLIND: u64 = 700_000;
/// Time after which a robot without ranges is not `Tracking`, µs.
const NO_RANGE: u64 = 61_500_000;
/// Longest time from tick to tick and from one status of the loop to the next, µs: its period, and a second after a leap of the
/// clock.
const PERIODIC: u64 = 2_000_000;

impl Robot<'_> {
    pub fn failures(&self) -> Failures {
        let devices = &self.hardware.devices.devices;
        let rangers = std::iter::once(&devices.ranger).chain(&self.hardware.devices.rangers);
        Failures {
            right: devices.right.failures,
            left: devices.left.failures,
            servo: self.channels.iter().map(|channel| channel.failures.get()).sum(),
            ranger: rangers.map(|ranger| ranger.failures).sum(),
            gyro: self.hardware.gyro.failures,
        }
    }

    /// Each failure that a driver reports is counted as one of its device.
    pub fn check_counts(&self, failed: Failures, before: Faults) -> anyhow::Result<()> {
        let after = self.app.faults();
        let counts = [
            ("right encoder", failed.right, before.right.errors, after.right.errors),
            ("left encoder", failed.left, before.left.errors, after.left.errors),
            ("servo", failed.servo, before.servo, after.servo),
            ("ranger", failed.ranger, before.ranger, after.ranger),
            ("gyro", failed.gyro, before.gyro, after.gyro),
        ];
        for (name, failed, before, after) in counts {
            ensure!(
                failed == 0 || after > before,
                "{failed} failures of the {name} are not counted"
            );
        }
        Ok(())
    }

    /// The rules.
    pub fn check(&self, polled: &Polled) -> anyhow::Result<()> {
        let Some(localizer) = self.app.localizer() else {
            ensure!(!polled.may_drive, "the motors are enabled while the loop does not run");
            return self.check_status();
        };
        if self.since.leaps > 0 {
            ensure!(
                self.since.leaps < 2 || !polled.may_drive,
                "the motors are enabled without a clock"
            );
            return Ok(());
        }
        let verdict = localizer.health().verdict;
        let policy = self.baked.config.motors;
        let is_older = |since: Option<u64>, than| {
            since.is_some_and(|since| self.real.saturating_sub(since) > than)
        };
        if self.since.blind.is_some_and(|since| since < self.since.began) {
            ensure!(!polled.may_drive, "the motors are enabled without a reading of the encoders");
        }
        let blind = self.since.blind.map(|since| since.max(self.since.began).max(self.since.told));
        if is_older(blind, BLIND) && self.since.tick + BLIND > self.real {
            ensure!(!polled.may_drive, "the motors are enabled without odometry");
            ensure!(verdict != Verdict::Tracking, "`Tracking` without odometry");
        }
        if self.composition.cautious
            && self.since.heard + policy.link_timeout.ticks() + POLL < self.real
        {
            ensure!(!polled.may_drive, "the motors are enabled without a link");
        }
        ensure!(
            !(self.composition.cautious && verdict == Verdict::Lost && polled.may_drive),
            "the motors are enabled while the robot is lost"
        );
        if is_older(self.since.no_range, NO_RANGE) && !self.composition.absolute {
            ensure!(verdict != Verdict::Tracking, "`Tracking` without ranges for a minute");
        }
        let late = self.real.saturating_sub(self.since.tick);
        ensure!(late <= PERIODIC, "no sample of the encoders for {late} us");
        check_numbers(localizer)?;
        self.check_status()
    }

    fn check_status(&self) -> anyhow::Result<()> {
        let late = self.real.saturating_sub(self.since.status);
        ensure!(self.line.is_unplugged || late <= PERIODIC, "no status of the loop for {late} us");
        Ok(())
    }
}

/// Counts of failures that drivers have reported.
#[derive(Debug, Clone, Copy)]
pub struct Failures {
    right: u32,
    left: u32,
    servo: u32,
    ranger: u32,
    gyro: u32,
}

impl Failures {
    /// What has been added since.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            right: self.right - before.right,
            left: self.left - before.left,
            servo: self.servo - before.servo,
            ranger: self.ranger - before.ranger,
            gyro: self.gyro - before.gyro,
        }
    }
}

/// Each number is finite.
fn check_numbers(localizer: &Localizer) -> anyhow::Result<()> {
    let filter = localizer.filter();
    let is_finite = filter.state().to_array().iter().all(|number| number.is_finite());
    ensure!(is_finite, "a state is not finite");
    let is = filter.standard_deviations();
    let deviations = [is.x.0, is.y.0, is.heading.0, is.scale_right, is.scale_left, is.range_scale];
    let is_finite = deviations.iter().all(|deviation| (0.0..=f32::MAX).contains(deviation));
    ensure!(is_finite, "a deviation is not finite: {is:?}");
    Ok(())
}
