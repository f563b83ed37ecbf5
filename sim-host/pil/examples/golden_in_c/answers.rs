//! A hash of the answers of a trace, over the words that the C program gets from its library for the same.

use anyhow::bail;
use sonarfix::health::Health;
use sonarfix_c::aim::sonarfix_aim_t;
use sonarfix_c::fix::{sonarfix_absolute_fix_t, sonarfix_fix_t};
use sonarfix_c::state::sonarfix_health_t;
use sonarfix_c::status::sonarfix_status_t;
use sonarfix_pil::{Actuators, Answer, Snapshot};

/// FNV-1a, 64 bits, over words of 32 bits in little-endian order.
pub struct Hash(u64);

impl Default for Hash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Hash {
    pub fn value(&self) -> u64 {
        self.0
    }

    fn word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn number(&mut self, number: f32) {
        self.word(number.to_bits());
    }

    fn status(&mut self, status: sonarfix_status_t) {
        self.word((status as i32).cast_unsigned());
    }

    pub fn add(&mut self, answer: &Answer) -> anyhow::Result<()> {
        match answer {
            Answer::Odometry(result, snapshot) => {
                let status = result.map_or_else(Into::into, |()| sonarfix_status_t::SONARFIX_OK);
                self.status(status);
                self.snapshot(snapshot);
            }
            Answer::Aim(Err(reason)) => self.status((*reason).into()),
            Answer::Aim(Ok(aim)) => {
                self.status(sonarfix_status_t::SONARFIX_OK);
                self.aim(&(*aim).into());
            }
            Answer::Fix(fix, snapshot) => {
                self.fix(&(*fix).into());
                self.snapshot(snapshot);
            }
            Answer::Skipped(health) => self.health(health),
            Answer::Absolute(fix, snapshot) => {
                self.absolute(&(*fix).into());
                self.snapshot(snapshot);
            }
            Answer::Waits(waits) => self.word(u32::from(*waits)),
            Answer::Polled { actuators, snapshot, telemetry } => {
                self.actuators(actuators);
                self.word(u32::from(snapshot.is_some()));
                if let Some(snapshot) = snapshot {
                    self.snapshot(snapshot);
                }
                self.word(*telemetry);
            }
            Answer::Started(_) | Answer::Refused(_) | Answer::Ended(_) => bail!("no answer"),
        }
        Ok(())
    }

    fn aim(&mut self, aim: &sonarfix_aim_t) {
        self.word(aim.wall);
        self.word(aim.ranger);
        for number in [aim.bearing_rad, aim.range_m, aim.gain_m2, aim.success] {
            self.number(number);
        }
        self.word(aim.duration_us);
        self.word(aim.candidates);
    }

    fn fix(&mut self, fix: &sonarfix_fix_t) {
        self.word((fix.outcome as i32).cast_unsigned());
        self.word((fix.refusal as i32).cast_unsigned());
        self.status(fix.filter_error);
        self.number(fix.innovation_m);
        self.number(fix.variance_m2);
    }

    fn absolute(&mut self, fix: &sonarfix_absolute_fix_t) {
        self.word((fix.outcome as i32).cast_unsigned());
        self.word((fix.refusal as i32).cast_unsigned());
        self.status(fix.filter_error);
        self.number(fix.nis);
        self.word(fix.dimensions);
    }

    fn snapshot(&mut self, snapshot: &Snapshot) {
        snapshot.numbers().for_each(|number| self.number(number));
        self.health(&snapshot.health);
    }

    fn health(&mut self, health: &Health) {
        let health = sonarfix_health_t::from(*health);
        let [t0, t1, t2, t3, t4, t5, t6, t7] = health.time_since_fix_us.to_le_bytes();
        self.word(u32::from_le_bytes([t0, t1, t2, t3]));
        self.word(u32::from_le_bytes([t4, t5, t6, t7]));
        self.word((health.verdict as i32).cast_unsigned());
        let numbers = [health.evidence, health.nis, health.rolled_since_fix_m];
        for number in numbers {
            self.number(number);
        }
        self.number(health.position_deviation_m);
        self.number(health.heading_deviation_rad);
        let counts = [health.accepted_in_a_row, health.gated_in_a_row, health.silent_in_a_row];
        for count in counts {
            self.word(u32::from(count));
        }
        self.word(u32::from(health.inflations));
    }

    fn actuators(&mut self, actuators: &Actuators) {
        for ranger in &actuators.rangers {
            self.word(u32::from(ranger.duty.is_some()));
            self.word(u32::from(ranger.duty.unwrap_or(0)));
            self.word(u32::from(ranger.is_raised));
            self.word(u32::from(ranger.has_fallen));
        }
    }
}
