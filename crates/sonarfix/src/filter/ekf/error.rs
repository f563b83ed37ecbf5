//! What the filter refuses.

/// Reason for which the filter refuses a call. The filter is unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum EkfError {
    /// An argument is NaN or infinite.
    NotFinite,
    /// A variance or a standard deviation is negative.
    NegativeVariance,
    /// A variance would become negative: P would no longer be a covariance.
    Indefinite,
    /// The noise variance of a range is zero: P would become singular.
    ZeroNoise,
    /// The turn of one step is larger than 64 rad.
    TurnTooLarge,
    /// The innovation is larger than 1,000 km.
    InnovationTooLarge,
    /// The noise variance of a range is larger than 1 km².
    NoiseTooLarge,
    /// The derivatives of the expected range are NaN or larger than 1,000.
    JacobianTooLarge,
    /// A variance would exceed (1,000 km)².
    VarianceTooLarge,
}

impl core::fmt::Display for EkfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a value is NaN or infinite",
            Self::NegativeVariance => "a variance or a standard deviation is negative",
            Self::Indefinite => "a variance would become negative",
            Self::ZeroNoise => "the noise variance of a range is zero",
            Self::TurnTooLarge => "the turn of one step is larger than 64 rad",
            Self::InnovationTooLarge => "the innovation is larger than 1,000 km",
            Self::NoiseTooLarge => "the noise variance of a range is larger than 1 km²",
            Self::JacobianTooLarge => "the derivatives of a range are NaN or larger than 1,000",
            Self::VarianceTooLarge => "a variance would exceed (1,000 km)²",
        })
    }
}

impl core::error::Error for EkfError {}
