//! The application's events as lines of a `defmt` log.
//!
//! *error*: the estimate is lost. *warn*: a fault survived. *info*: a mode change. *debug*: each
//! ping. *trace*: each tick.

use defmt::{debug, error, info, trace, warn};
use sonarfix::health::Verdict;
use sonarfix_hal::robot::Report;

use crate::app::Polled;
use crate::flash_contents::FlashContents;

/// Logs the contents of the flash, once at the start.
pub fn flash_contents(flash: &FlashContents) {
    match &flash.map {
        Ok((map, checksum)) => info!("map: {} walls, checksum {:08x}", map.count(), checksum),
        Err(error) => warn!("no map, so the loop cannot start: {}", error),
    }
    match &flash.config {
        Ok((_, checksum)) => info!("configuration: checksum {:08x}", checksum),
        Err(error) => warn!("no configuration, so the loop cannot start: {}", error),
    }
}

/// Logs the result of a poll and the report of the loop, if it runs. It is not inlined, because the caller's stack frame
/// is below that of every poll.
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
    if let Some(reason) = polled.unsupported {
        warn!("the configuration is not for this board: {}", reason);
    }
    if let Some(outcome) = polled.answered {
        info!("command: {}", outcome);
    }
    match polled.saved {
        Some(Ok(())) => info!("calibration and pose written"),
        Some(Err(error)) => warn!("calibration and pose not written: {}", error),
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
    if let Some(heard) = &report.ping_result {
        debug!("{}", heard);
    }
    if let Some(tick) = &report.tick {
        trace!("{}", tick);
    }
    if let Some(Err(no_aim)) = &report.aimed {
        debug!("no wall to measure: {}", no_aim);
    }
}
