//! Time stamps that jitter.

/// Stamps of one device that go back by up to this are jitter, seconds.
pub const JITTER: f64 = 0.3;

/// Checks the stamps of one device, in the order of the file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Clock {
    latest: Option<f64>,
}

impl Clock {
    /// Takes the next stamp.
    ///
    /// # Errors
    /// The reason for which the message is left out: its stamp goes back by more than [`JITTER`].
    pub fn check(&mut self, time: f64) -> Result<(), &'static str> {
        match self.latest {
            Some(latest) if time < latest - JITTER => Err("goes back in time"),
            _ => {
                self.latest = Some(self.latest.map_or(time, |latest| latest.max(time)));
                Ok(())
            }
        }
    }
}

/// Makes the stamps of one device ascend: those that go back get the closest ascending sequence in the sense of least
/// squares (pool adjacent violators). Returns how many were changed.
pub fn repair<'a>(stamps: impl Iterator<Item = &'a mut f64>) -> u64 {
    let stamps: Vec<&mut f64> = stamps.collect();
    // Blocks of equal stamps: sum and count.
    let mut blocks: Vec<(f64, f64)> = Vec::new();
    for stamp in &stamps {
        let mut block = (**stamp, 1.0);
        while let Some(&(sum, count)) = blocks.last()
            && sum / count > block.0 / block.1
        {
            block = (block.0 + sum, block.1 + count);
            blocks.pop();
        }
        blocks.push(block);
    }
    let mut changed = 0;
    let mut stamps = stamps.into_iter();
    for (sum, count) in blocks {
        let mut left = count;
        while left > 0.5 {
            left -= 1.0;
            if let Some(stamp) = stamps.next()
                && count > 1.5
            {
                changed += 1;
                *stamp = sum / count;
            }
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn late_stamps_are_averaged_and_others_stay() {
        let mut stamps = [1.0, 2.0, 3.5, 3.1, 4.0, 5.0];
        assert_eq!(repair(stamps.iter_mut()), 2);
        let expected = [1.0, 2.0, 3.3, 3.3, 4.0, 5.0];
        assert!(
            stamps.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12)
        );
        let mut clock = Clock::default();
        assert!([1.0, 2.0, 1.71, 2.5].iter().all(|&time| clock.check(time).is_ok()));
        assert_eq!(clock.check(2.19).unwrap_err(), "goes back in time");
        assert!(clock.check(2.21).is_ok());
    }

    proptest! {
        /// Ascending, the same mean, and unchanged if it was ascending.
        #[test]
        fn the_repaired_sequence_ascends(mut stamps in proptest::collection::vec(0.0_f64..9.0, 1..40)) {
            let before = stamps.clone();
            repair(stamps.iter_mut());
            prop_assert!(stamps.windows(2).all(|pair| pair[0] <= pair[1]));
            prop_assert!((stamps.iter().sum::<f64>() - before.iter().sum::<f64>()).abs() < 1e-9);
            let mut sorted = before;
            sorted.sort_by(f64::total_cmp);
            sorted.dedup();
            prop_assert_eq!(repair(sorted.iter_mut()), 0);
        }
    }
}
