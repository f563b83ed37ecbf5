//! A wheel that is turned by hand.

/// Largest difference to the robot file that turning by hand explains.
const BY_HAND: f64 = 0.01;
/// Edges that a wheel at rest may count: vibration.
const AT_REST: i64 = 5;

/// A wheel after some revolutions forwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turned {
    edges: i64,
    revolutions: f64,
}

/// Why the edges are not those of this wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TurnedError {
    /// No encoder has counted.
    #[error(
        "neither encoder has counted: check its supply and its two lines, then `monitor --signs-of-life`"
    )]
    Silent,
    /// The other encoder has counted.
    #[error(
        "the other wheel's encoder has counted: exchange the encoders' connectors, or turn the other wheel"
    )]
    Exchanged,
    /// Both have.
    #[error("both encoders have counted: lift the robot and turn one wheel at a time")]
    Both,
}

impl Turned {
    /// The wheel that was turned, from the edges of its encoder and of the other one.
    ///
    /// # Errors
    /// [`TurnedError`].
    pub fn new(edges: i64, other: i64, revolutions: f64) -> Result<Self, TurnedError> {
        match (edges.abs() > AT_REST, other.abs() > AT_REST) {
            (true, false) => Ok(Self { edges, revolutions }),
            (false, false) => Err(TurnedError::Silent),
            (false, true) => Err(TurnedError::Exchanged),
            (true, true) => Err(TurnedError::Both),
        }
    }

    /// Whether the count falls while the wheel turns forwards.
    #[must_use]
    pub fn is_mirrored(&self) -> bool {
        self.edges < 0
    }

    /// Edges of one revolution.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "edges of some revolutions")]
    pub fn edges_per_revolution(&self) -> f64 {
        self.edges.unsigned_abs() as f64 / self.revolutions
    }

    /// Whether this is the number of the robot file, to the precision of turning by hand.
    #[must_use]
    pub fn agrees_with(&self, edges_per_revolution: f64) -> bool {
        let measured = self.edges_per_revolution();
        (measured - edges_per_revolution).abs() <= BY_HAND * edges_per_revolution
    }
}

#[cfg(test)]
mod tests {
    use super::{Turned, TurnedError};

    #[test]
    fn a_wheel_is_recognized_by_what_counts() {
        assert_eq!(Turned::new(0, 2, 10.0), Err(TurnedError::Silent));
        assert_eq!(Turned::new(3, 900, 10.0), Err(TurnedError::Exchanged));
        assert_eq!(Turned::new(-900, 900, 10.0), Err(TurnedError::Both));
        let turned = Turned::new(-14_900, 1, 10.0).unwrap();
        assert!(turned.is_mirrored() && turned.agrees_with(1496.6) && !turned.agrees_with(1440.0));
        assert!(!Turned::new(14_900, 0, 10.0).unwrap().is_mirrored());
    }
}
