//! The values of a row.

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum SqlValue {
    /// No value.
    Null,
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// A text; what is no UTF-8 in it is replaced.
    Text(String),
    /// Bytes.
    Blob(Vec<u8>),
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its number.
    pub number: i64,
    /// Its values in the order of the columns; those at the end may be missing.
    pub values: Vec<SqlValue>,
}

/// Reads a number of one to nine bytes, seven bits a byte and all of the ninth; `None` if it is cut off.
pub fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for place in 0..9 {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        if place == 8 {
            return Some(value << 8 | u64::from(byte));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            break;
        }
    }
    Some(value)
}

/// A number of 64 bits with its sign.
pub fn integer(value: u64) -> i64 {
    i64::from_ne_bytes(value.to_ne_bytes())
}

/// The values of a row, whose types are in its header; `None` if it is damaged.
pub fn values(payload: &[u8]) -> Option<Vec<SqlValue>> {
    let mut rest = payload;
    let header = usize::try_from(varint(&mut rest)?).ok()?;
    let mut types = rest.get(..header.checked_sub(payload.len() - rest.len())?)?;
    let mut content = payload.get(header..)?;
    let mut values = Vec::new();
    while !types.is_empty() {
        let kind = varint(&mut types)?;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => (kind - 12) / 2,
        };
        let (bytes, rest) = content.split_at_checked(usize::try_from(length).ok()?)?;
        content = rest;
        values.push(value(kind, bytes));
    }
    Some(values)
}

fn value(kind: u64, bytes: &[u8]) -> SqlValue {
    match kind {
        0 => SqlValue::Null,
        1..=6 => SqlValue::Integer(signed(bytes)),
        7 => SqlValue::Real(f64::from_bits(u64::from_ne_bytes(signed(bytes).to_ne_bytes()))),
        8 => SqlValue::Integer(0),
        9 => SqlValue::Integer(1),
        _ if kind.is_multiple_of(2) => SqlValue::Blob(bytes.to_owned()),
        _ => SqlValue::Text(String::from_utf8_lossy(bytes).into_owned()),
    }
}

/// A big-endian number of up to eight bytes.
fn signed(bytes: &[u8]) -> i64 {
    let is_negative = bytes.first().is_some_and(|first| *first >= 0x80);
    let start: i64 = if is_negative { -1 } else { 0 };
    bytes.iter().fold(start, |value, byte| value << 8 | i64::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_length() {
        let cases: [(&[u8], u64); 4] = [
            (&[0x7f], 127),
            (&[0x81, 0], 128),
            (&[0x82, 0x80, 1], 2 << 14 | 1),
            (&[0xff; 9], u64::MAX),
        ];
        for (mut bytes, value) in cases {
            assert_eq!(varint(&mut bytes), Some(value));
            assert!(bytes.is_empty());
        }
        assert_eq!(varint(&mut [0x80].as_slice()), None);
        assert_eq!(integer(u64::MAX), -1);
    }

    #[test]
    fn a_row_has_values_of_every_type() {
        // Null, −2 in one byte, 300 in two, 1.0, zero, one, two bytes, a text.
        let row =
            [9, 0, 1, 2, 7, 8, 9, 16, 15, 0xfe, 1, 44, 0x3f, 0xf0, 0, 0, 0, 0, 0, 0, 5, 6, b'a'];
        let expected = vec![
            SqlValue::Null,
            SqlValue::Integer(-2),
            SqlValue::Integer(300),
            SqlValue::Real(1.0),
            SqlValue::Integer(0),
            SqlValue::Integer(1),
            SqlValue::Blob(vec![5, 6]),
            SqlValue::Text("a".into()),
        ];
        assert_eq!(values(&row), Some(expected));
        for length in 0..row.len() {
            assert_eq!(values(&row[..length]), None, "{length}");
        }
        assert_eq!(values(&[2, 10]), None, "a reserved type");
        assert_eq!(values(&[0x80, 0]), None, "a header shorter than its length");
    }
}
