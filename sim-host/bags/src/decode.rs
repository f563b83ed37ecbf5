//! A message as values that are found by the names of their fields: its bytes (CDR) read by its [`Definition`].

use crate::definition::{Count, Definition, Element, Field, Plain};

/// The value of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum Value<'d> {
    /// A number. Whole ones beyond 2⁵³ are rounded.
    Number(f64),
    /// A text.
    Text(String),
    /// Several numbers.
    Numbers(Vec<f64>),
    /// Several texts or messages.
    List(Vec<Value<'d>>),
    /// A message: its fields and their values.
    Message(&'d [Field], Vec<Value<'d>>),
}

/// Why bytes are no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Undecodable {
    /// The first four bytes name another representation than plain CDR, or are missing.
    #[error("its bytes are not plain CDR")]
    Representation,
    /// The bytes end within a field.
    #[error("its bytes end within the field `{0}`")]
    Short(String),
    /// A text is no UTF-8, or its length is zero.
    #[error("the field `{0}` is no text")]
    Text(String),
    /// A text is in UTF-16.
    #[error("the field `{0}` is a wstring, which is not read")]
    WideText(String),
    /// There is no such field.
    #[error("it has no field `{0}` of the expected type")]
    Missing(String),
}

impl<'d> Value<'d> {
    /// Reads a message. Bytes after its last field are ignored.
    ///
    /// # Errors
    /// [`Undecodable`], by the reason.
    pub fn read(definition: &'d Definition, bytes: &[u8]) -> Result<Self, Undecodable> {
        let (header, body) = bytes.split_at_checked(4).ok_or(Undecodable::Representation)?;
        let is_little = match header {
            [0, 0, _, _] => false,
            [0, 1, _, _] => true,
            _ => return Err(Undecodable::Representation),
        };
        Reader { definition, body, at: 0, is_little }.message(0)
    }

    /// The value of a field of this message, or of a message in it: `pose.pose.position.x`.
    ///
    /// # Errors
    /// [`Undecodable::Missing`].
    pub fn find(&self, path: &str) -> Result<&Self, Undecodable> {
        let mut found = Some(self);
        for name in path.split('.') {
            found = match found {
                Some(Self::Message(fields, values)) => {
                    let place = fields.iter().position(|field| field.name == name);
                    place.and_then(|place| values.get(place))
                }
                _ => None,
            };
        }
        found.ok_or_else(|| Undecodable::Missing(path.to_owned()))
    }

    /// The number in a field.
    ///
    /// # Errors
    /// [`Undecodable::Missing`].
    pub fn number(&self, path: &str) -> Result<f64, Undecodable> {
        match self.find(path)? {
            Self::Number(number) => Ok(*number),
            _ => Err(Undecodable::Missing(path.to_owned())),
        }
    }

    /// The numbers in a field.
    ///
    /// # Errors
    /// [`Undecodable::Missing`].
    pub fn numbers(&self, path: &str) -> Result<&[f64], Undecodable> {
        match self.find(path)? {
            Self::Numbers(numbers) => Ok(numbers),
            _ => Err(Undecodable::Missing(path.to_owned())),
        }
    }

    /// The text in a field.
    ///
    /// # Errors
    /// [`Undecodable::Missing`].
    pub fn text(&self, path: &str) -> Result<&str, Undecodable> {
        match self.find(path)? {
            Self::Text(text) => Ok(text),
            _ => Err(Undecodable::Missing(path.to_owned())),
        }
    }

    /// The texts or messages in a field.
    ///
    /// # Errors
    /// [`Undecodable::Missing`].
    pub fn list(&self, path: &str) -> Result<&[Self], Undecodable> {
        match self.find(path)? {
            Self::List(values) => Ok(values),
            _ => Err(Undecodable::Missing(path.to_owned())),
        }
    }
}

/// The bytes of a message without the four before it.
struct Reader<'d, 'b> {
    definition: &'d Definition,
    body: &'b [u8],
    at: usize,
    is_little: bool,
}

impl<'d> Reader<'d, '_> {
    fn message(&mut self, number: usize) -> Result<Value<'d>, Undecodable> {
        let fields = self.definition.fields(number);
        if fields.is_empty() {
            // ROS gives a message without fields a byte, so that it has a size.
            self.unsigned(1, "structure_needs_at_least_one_member")?;
        }
        let values = fields.iter().map(|field| self.field(field)).collect::<Result<_, _>>()?;
        Ok(Value::Message(fields, values))
    }

    fn field(&mut self, field: &Field) -> Result<Value<'d>, Undecodable> {
        let name = field.name.as_str();
        let count = match field.count {
            Count::One => return self.element(field.element, name),
            Count::Fixed(count) => count,
            Count::List => self.length(name)?,
        };
        // Each element has a byte at least: a count beyond the bytes is refused before anything is allocated for it.
        if count > self.body.len().saturating_sub(self.at) {
            return Err(short(name));
        }
        if let Element::Plain(plain) = field.element
            && !matches!(plain, Plain::Text | Plain::WideText)
        {
            let numbers = (0..count).map(|_| self.number(plain, name));
            return Ok(Value::Numbers(numbers.collect::<Result<_, _>>()?));
        }
        let values = (0..count).map(|_| self.element(field.element, name));
        Ok(Value::List(values.collect::<Result<_, _>>()?))
    }

    fn element(&mut self, element: Element, name: &str) -> Result<Value<'d>, Undecodable> {
        match element {
            Element::Message(number) => self.message(number),
            Element::Plain(Plain::Text) => self.text(name).map(Value::Text),
            Element::Plain(Plain::WideText) => Err(Undecodable::WideText(name.to_owned())),
            Element::Plain(plain) => self.number(plain, name).map(Value::Number),
        }
    }

    /// A text: its length with the zero at its end, then its bytes.
    fn text(&mut self, name: &str) -> Result<String, Undecodable> {
        let length = self.length(name)?;
        let bytes = self.take(length, name)?;
        // Some writers leave the zero out of an empty text.
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|_| Undecodable::Text(name.to_owned()))?;
        Ok(text.to_owned())
    }

    fn length(&mut self, name: &str) -> Result<usize, Undecodable> {
        usize::try_from(self.unsigned(4, name)?).map_err(|_| short(name))
    }

    #[expect(clippy::cast_precision_loss, reason = "documented at `Value::Number`")]
    fn number(&mut self, plain: Plain, name: &str) -> Result<f64, Undecodable> {
        Ok(match plain {
            Plain::Unsigned(bytes) => self.unsigned(bytes, name)? as f64,
            Plain::Signed(bytes) => {
                // The sign is the topmost bit of so many bytes.
                let above = 64 - 8 * bytes;
                let moved = self.unsigned(bytes, name)? << above;
                (i64::from_ne_bytes(moved.to_ne_bytes()) >> above) as f64
            }
            Plain::Single => {
                let bits = u32::try_from(self.unsigned(4, name)?).unwrap_or(0);
                f32::from_bits(bits).into()
            }
            Plain::Double => f64::from_bits(self.unsigned(8, name)?),
            Plain::Text | Plain::WideText => return Err(Undecodable::Text(name.to_owned())),
        })
    }

    /// A number of so many bytes, at the next multiple of as many.
    fn unsigned(&mut self, bytes: usize, name: &str) -> Result<u64, Undecodable> {
        self.at = self.at.next_multiple_of(bytes);
        let is_little = self.is_little;
        let part = self.take(bytes, name)?;
        let add = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        Ok(if is_little { part.iter().rev().fold(0, add) } else { part.iter().fold(0, add) })
    }

    fn take(&mut self, bytes: usize, name: &str) -> Result<&[u8], Undecodable> {
        let part = self.body.get(self.at..).and_then(|rest| rest.get(..bytes));
        self.at += bytes;
        part.ok_or_else(|| short(name))
    }
}

fn short(name: &str) -> Undecodable {
    Undecodable::Short(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sonarfix_ros_messages::cdr;
    use sonarfix_ros_messages::messages::{JointState, Odometry, TFMessage, TransformStamped};
    use sonarfix_ros_messages::schema::Message;

    fn definition<M: Message>() -> Definition {
        Definition::parse(&M::type_name(), &M::definition()).unwrap()
    }

    #[test]
    fn fields_are_found_by_their_names() {
        let mut odometry = Odometry::default();
        odometry.header.stamp.sec = -3;
        odometry.header.frame_id = "odom".into();
        odometry.pose.pose.position.y = 0.1;
        odometry.pose.covariance.0[5][5] = 0.25;
        odometry.twist.twist.angular.z = -1.5;
        let definition = definition::<Odometry>();
        let bytes = cdr::write(&odometry).unwrap();
        let value = Value::read(&definition, &bytes).unwrap();
        assert_eq!(value.number("header.stamp.sec"), Ok(-3.0));
        assert_eq!(value.text("header.frame_id"), Ok("odom"));
        assert_eq!(value.number("pose.pose.position.y"), Ok(0.1));
        assert_eq!(value.numbers("pose.covariance").unwrap()[35].to_bits(), 0.25_f64.to_bits());
        assert_eq!(value.number("twist.twist.angular.z"), Ok(-1.5));
        for wrong in ["pose.x", "pose", "header.stamp.sec.x", ""] {
            assert_eq!(value.number(wrong), Err(Undecodable::Missing(wrong.into())));
        }
        for length in 0..bytes.len() {
            assert!(Value::read(&definition, &bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn both_byte_orders_are_read() {
        let definition =
            Definition::parse("a/msg/B", "int16 x\nfloat32 y\nint64 z\nbool w").unwrap();
        let little = [0, 1, 0, 0, 0xfe, 0xff, 0, 0, 0, 0, 0x80, 0x3f];
        let big = [0, 0, 0, 0, 0xff, 0xfe, 0, 0, 0x3f, 0x80, 0, 0];
        for (start, z) in [(little, 5_i64.to_le_bytes()), (big, 5_i64.to_be_bytes())] {
            let bytes = [start.as_slice(), &z, &[1]].concat();
            let value = Value::read(&definition, &bytes).unwrap();
            let numbers = ["x", "y", "z", "w"].map(|name| value.number(name).unwrap().to_string());
            assert_eq!(numbers, ["-2", "1", "5", "1"]);
        }
    }

    #[test]
    fn claimed_lengths_allocate_nothing() {
        let definition =
            Definition::parse("a/msg/B", "float64[] x\nE[] y\n===\nMSG: a/E\n").unwrap();
        let much = [0, 1, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0];
        assert_eq!(Value::read(&definition, &much), Err(short("x")));
        let much = [0, 1, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 0];
        assert_eq!(Value::read(&definition, &much), Err(short("y")));
        let fixed = Definition::parse("a/msg/B", "E[4000000000] y\n===\nMSG: a/E\n").unwrap();
        assert_eq!(Value::read(&fixed, &much), Err(short("y")));
    }

    proptest! {
        #[test]
        fn random_bytes_do_no_harm(bytes in proptest::collection::vec(any::<u8>(), 0..200), little: bool) {
            let bytes = [[0, u8::from(little), 0, 0].as_slice(), &bytes].concat();
            let _ = Value::read(&definition::<TFMessage>(), &bytes);
            let _ = Value::read(&definition::<JointState>(), &bytes);
        }

        #[test]
        fn lists_survive(
            names in proptest::collection::vec("[a-zä]{0,9}", 0..5),
            position in proptest::collection::vec(any::<f64>(), 0..9),
        ) {
            let joints = JointState { name: names.clone(), position: position.clone(), ..JointState::default() };
            let definition = definition::<JointState>();
            let bytes = cdr::write(&joints).unwrap();
            let value = Value::read(&definition, &bytes).unwrap();
            let read: Vec<_> = value.list("name").unwrap().to_vec();
            prop_assert_eq!(read, names.into_iter().map(Value::Text).collect::<Vec<_>>());
            let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(value.numbers("position").unwrap()), bits(&position));
        }
    }

    #[test]
    fn messages_in_lists_are_found() {
        let transform = TransformStamped { child_frame_id: "sonar".into(), ..Default::default() };
        let message = TFMessage { transforms: vec![TransformStamped::default(), transform] };
        let definition = definition::<TFMessage>();
        let bytes = cdr::write(&message).unwrap();
        let value = Value::read(&definition, &bytes).unwrap();
        let [first, second] = value.list("transforms").unwrap() else { panic!("two transforms") };
        assert_eq!(first.text("child_frame_id"), Ok(""));
        assert_eq!(second.text("child_frame_id"), Ok("sonar"));
        assert_eq!(second.number("transform.rotation.w"), Ok(0.0));
    }
}
