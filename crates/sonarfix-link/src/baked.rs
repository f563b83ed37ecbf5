//! The configuration image in flash, which `sonarfix config bake` writes and a robot reads at its start.
//!
//! ```text
//! "SFXC" | version u16 | length u16 | configuration (postcard) | CRC-32 u32 of all before it
//! ```
//!
//! Numbers are little-endian. Bytes after the image are ignored.

use serde::Deserialize;
use sonarfix::config::{
    CalibrationPrior, EchoParameters, GatingParameters, Policy, RangerParameters, Rangers, Weights,
};
use sonarfix::filter::motion::Drive;
use sonarfix::geometry::units::MetresPerSecond;
use sonarfix::map::image::checksum as crc32;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig, RobotConfigError};

/// The version of the image. It is raised whenever the bytes of a configuration change.
pub const VERSION: u16 = 10;
/// Largest size of an image, bytes.
pub const LENGTH_MAX: usize = HEADER + POSTCARD_MAX + CHECKSUM;

const MAGIC: [u8; 4] = *b"SFXC";
const HEADER: usize = 8;
const POSTCARD_MAX: usize = 784;
const CHECKSUM: usize = 4;

/// Why bytes are not a configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BakedError {
    /// The signature is missing: no image was written.
    Missing,
    /// The image has this other version.
    Version(u16),
    /// The image is truncated.
    Cut,
    /// The image is damaged.
    Checksum,
    /// The image is intact but not a configuration: a defect of its writer.
    Layout,
    /// The configuration violates a rule.
    Rule(RobotConfigError),
    /// The program was built without a part that the configuration asks for.
    NotLinked(NotLinked),
}

impl core::fmt::Display for BakedError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Missing => f.write_str("no configuration was baked there"),
            Self::Version(found) => {
                write!(f, "the configuration is of version {found}, and version {VERSION} is read")
            }
            Self::Cut => f.write_str("the configuration is cut off"),
            Self::Checksum => f.write_str("the configuration is damaged: its checksum is wrong"),
            Self::Layout => f.write_str("the configuration's bytes are not those of one"),
            Self::Rule(error) => write!(f, "the configuration is wrong: {error}"),
            Self::NotLinked(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for BakedError {}

/// Writes the image of a configuration into `buffer`; returns its bytes.
///
/// # Errors
/// [`BakedError::Rule`] if the configuration violates a rule.
///
/// # Panics
/// Never.
pub fn write<'b>(
    config: &RobotConfig,
    buffer: &'b mut [u8; LENGTH_MAX],
) -> Result<&'b [u8], BakedError> {
    config.check().map_err(BakedError::Rule)?;
    fill(config, buffer).ok_or(BakedError::Layout)
}

fn fill<'b>(config: &RobotConfig, buffer: &'b mut [u8; LENGTH_MAX]) -> Option<&'b [u8]> {
    let (header, rest) = buffer.split_first_chunk_mut::<HEADER>()?;
    let (space, _) = rest.split_at_mut_checked(POSTCARD_MAX)?;
    let length = postcard::to_slice(config, space).ok()?.len();
    let [v0, v1] = VERSION.to_le_bytes();
    let [l0, l1] = u16::try_from(length).ok()?.to_le_bytes();
    let [m0, m1, m2, m3] = MAGIC;
    *header = [m0, m1, m2, m3, v0, v1, l0, l1];
    let end = HEADER + length;
    let checksum = crc32(buffer.get(..end)?);
    buffer.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum.to_le_bytes());
    buffer.get(..end + CHECKSUM)
}

/// Reads and checks the configuration at the start of `bytes`.
///
/// ```
/// use sonarfix::{config::{Config, ServoTiming}, geometry::units::{Metres, Radians}};
/// use sonarfix_hal::config::RobotConfig;
/// use sonarfix_link::baked::{self, BakedError};
/// let mut localizer = Config::for_track_width(Metres(0.16));
/// localizer.rangers.first.servo = (Radians(-1.5), Radians(1.5));
/// localizer.rangers.first.timing.servo = ServoTiming::SG90;
/// let config = RobotConfig::with_common_parts(localizer);
/// let mut buffer = [0xff; baked::LENGTH_MAX];
/// let bytes = baked::write(&config, &mut buffer)?;
/// assert_eq!(baked::read(bytes), Ok(config));
/// // Flash that was erased and never written:
/// assert_eq!(baked::read(&[0xff; 256]), Err(BakedError::Missing));
/// # Ok::<(), BakedError>(())
/// ```
///
/// # Errors
/// [`BakedError`], by the cause.
///
/// # Panics
/// Never.
pub fn read(bytes: &[u8]) -> Result<RobotConfig, BakedError> {
    let Some((header, rest)) = bytes.split_first_chunk::<HEADER>() else {
        let begins = !bytes.is_empty() && bytes.iter().zip(MAGIC).all(|(&byte, m)| byte == m);
        return Err(if begins { BakedError::Cut } else { BakedError::Missing });
    };
    let [m0, m1, m2, m3, v0, v1, l0, l1] = *header;
    if [m0, m1, m2, m3] != MAGIC {
        return Err(BakedError::Missing);
    }
    let version = u16::from_le_bytes([v0, v1]);
    if version != VERSION {
        return Err(BakedError::Version(version));
    }
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    let (postcard, rest) = rest.split_at_checked(length).ok_or(BakedError::Cut)?;
    let checksum = rest.first_chunk::<CHECKSUM>().ok_or(BakedError::Cut)?;
    let covered = bytes.get(..HEADER + length).ok_or(BakedError::Cut)?;
    if crc32(covered) != u32::from_le_bytes(*checksum) {
        return Err(BakedError::Checksum);
    }
    // Without the tuple of `take_from_bytes`, the stack holds one copy less of the configuration.
    let mut decoder = postcard::Deserializer::from_bytes(postcard);
    let config = RobotConfig::deserialize(&mut decoder)
        .map_err(|_| not_linked(postcard).map_or(BakedError::Layout, BakedError::NotLinked))?;
    if !decoder.finalize().is_ok_and(<[u8]>::is_empty) {
        return Err(BakedError::Layout);
    }
    config.check_linked().map_err(BakedError::NotLinked)?;
    config.check().map(|()| config).map_err(BakedError::Rule)
}

/// The fields of the localizer's configuration between the rangers and the gyro.
type UpToGyro = (CalibrationPrior, GatingParameters, EchoParameters, Policy, Weights);

/// The part that a configuration in postcard asks for and that this program was built without; `None` if there is no such
/// part, or before it there is no configuration.
///
/// The parameters of such a part have no value, so that the whole configuration cannot be decoded. Its fields follow each
/// other in postcard without anything between them.
pub(crate) fn not_linked(postcard: &[u8]) -> Option<NotLinked> {
    if Feature::Light.is_linked() && Feature::Gyro.is_linked() && Feature::Rangers.is_linked() {
        return None;
    }
    let decoder = &mut postcard::Deserializer::from_bytes(postcard);
    <(Drive, MetresPerSecond)>::deserialize(&mut *decoder).ok()?;
    if Rangers::<RangerParameters>::deserialize(&mut *decoder).is_err() {
        let first = <(Drive, MetresPerSecond, RangerParameters)>::deserialize(
            &mut postcard::Deserializer::from_bytes(postcard),
        );
        let one_is_read = first.is_ok() && !Feature::Rangers.is_linked();
        return Some(NotLinked(if one_is_read { Feature::Rangers } else { Feature::Light }));
    }
    UpToGyro::deserialize(&mut *decoder).ok()?;
    Option::<GyroParameters>::deserialize(&mut *decoder).err().map(|_| NotLinked(Feature::Gyro))
}

/// The checksum by which a robot identifies its configuration
/// ([`Hello`](crate::message::Hello::configuration)): CRC-32 of its postcard encoding.
#[must_use]
pub fn checksum(config: &RobotConfig) -> u32 {
    let mut space = [0; POSTCARD_MAX];
    let bytes = postcard::to_slice(config, &mut space);
    crc32(bytes.as_deref().unwrap_or_default())
}
