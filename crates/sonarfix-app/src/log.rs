//! What an app did, as lines of a `defmt` log.
//!
//! *error*: the estimate is lost. *warn*: a fault survived. *info*: a mode change. *debug*: each
//! ping. *trace*: each tick.

use defmt::{debug, error, info, trace, warn};
use sonarfix::health::Verdict;
use sonarfix_hal::robot::Report;

use crate::app::Polled;
use crate::flashed::Flashed;

/// Logs what the flash holds, once at the start.
pub fn flashed(flashed: &Flashed) {
    match &flashed.map {
        Ok((map, checksum)) => info!("map: {} walls, checksum {:08x}", map.count(), checksum),
        Err(error) => warn!("no map, so the robot stays still: {}", error),
    }
    match &flashed.config {
        Ok((_, checksum)) => info!("configuration: checksum {:08x}", checksum),
        Err(error) => warn!("no configuration, so the robot stays still: {}", error),
    }
}

/// Logs what a poll did, and in it the loop, if it runs. Not part of the frame of whoever calls it, which lies below every poll's.
#[inline(never)]
pub fn polled(polled: &Polled, of_loop: Option<&Report>) {
    if polled.has_changed {
        info!("{}", if polled.is_running { "the loop runs" } else { "the loop waits" });
    }
    match polled.verdict {
        Some(Verdict::Lost) => error!("lost"),
        Some(verdict) => info!("{}", verdict),
        None => {}
    }
    if let Some(outcome) = polled.answered {
        info!("command: {}", outcome);
    }
    match polled.saved {
        Some(Ok(())) => info!("calibration and pose written"),
        Some(Err(error)) => warn!("calibration and pose not kept: {}", error),
        None => {}
    }
    if !polled.missing.is_none() {
        warn!("missing: {}", polled.missing);
    }
    if let Some(of_loop) = of_loop {
        report(of_loop);
    }
}

fn report(report: &Report) {
    if !report.faults.is_none() {
        warn!("{}", report.faults);
    }
    if let Some(heard) = &report.heard {
        debug!("{}", heard);
    }
    if let Some(tick) = &report.tick {
        trace!("{}", tick);
    }
    if let Some(Err(no_aim)) = &report.aimed {
        debug!("nothing to look at: {}", no_aim);
    }
}
