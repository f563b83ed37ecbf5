//! Messages as bytes: the Common Data Representation (CDR), with the four bytes before it that name the byte order.

use byteorder::{BigEndian, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The bytes before a message: plain CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Why bytes are no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The first four bytes name another representation than plain CDR, or are missing.
    #[error("the bytes are not plain CDR")]
    Representation,
    /// The bytes are too short, or a text in them is no UTF-8.
    #[error("the bytes are no such message: {0}")]
    Content(String),
}

/// Reads a message. Bytes after its last field are ignored, so that a field which a later version of ROS appended does no harm.
///
/// # Errors
/// [`CdrError`], by what is wrong with the bytes.
pub fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CdrError> {
    let (header, body) = bytes.split_at_checked(HEADER.len()).ok_or(CdrError::Representation)?;
    let read = match header {
        [0, 0, _, _] => cdr_encoding::from_bytes::<T, BigEndian>(body),
        [0, 1, _, _] => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(CdrError::Representation),
    };
    read.map(|(message, _)| message).map_err(|error| CdrError::Content(error.to_string()))
}

/// Writes a message.
///
/// # Errors
/// [`CdrError::Content`], if a list is longer than its length can tell.
pub fn write<T: Serialize>(message: &T) -> Result<Vec<u8>, CdrError> {
    let body = cdr_encoding::to_vec::<T, LittleEndian>(message);
    let body = body.map_err(|error| CdrError::Content(error.to_string()))?;
    Ok([HEADER.as_slice(), &body].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Odometry, Range, RangeHeard, Time};

    #[test]
    fn a_message_survives() {
        let mut odometry = Odometry::default();
        odometry.header.stamp = Time { sec: -3, nanosec: 7 };
        odometry.header.frame_id = "odom".into();
        odometry.pose.covariance.0[5][5] = 0.25;
        odometry.twist.twist.angular.z = -1.5;
        let bytes = write(&odometry).unwrap();
        assert_eq!(read::<Odometry>(&bytes).unwrap(), odometry);
        // The stamp, two texts with their lengths and padding up to a multiple of 8; then 7, 36, 6 and 36 numbers.
        assert_eq!(bytes.len(), 4 + 32 + 8 * (7 + 36 + 6 + 36));
    }

    /// ROS's Jazzy has appended `variance` to `Range`.
    #[test]
    fn a_range_is_read_with_and_without_its_last_field() {
        let range = Range { range: 1.25, variance: 0.5, ..Range::default() };
        let bytes = write(&range).unwrap();
        assert_eq!(read::<RangeHeard>(&bytes).unwrap().range, 1.25);
        let before = &bytes[..bytes.len() - 4];
        assert_eq!(read::<RangeHeard>(before).unwrap().range, 1.25);
        assert!(read::<Range>(before).is_err());
    }

    #[test]
    fn other_bytes_are_refused() {
        assert_eq!(read::<Time>(&[]), Err(CdrError::Representation));
        assert_eq!(read::<Time>(&[0, 7, 0, 0, 1, 2, 3, 4]), Err(CdrError::Representation));
        assert!(matches!(read::<Time>(&[0, 1, 0, 0, 1]), Err(CdrError::Content(_))));
        let claims_much = [0, 1, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0];
        assert!(read::<Vec<f64>>(&claims_much).is_err());
    }
}
