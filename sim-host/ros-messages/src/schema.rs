//! A message's definition as text, as bags contain it (`ros2msg`), made from its Rust type.

/// A type that can be a field of a message.
pub trait Field {
    /// Its name in a definition: `float64`, `geometry_msgs/Point[]`.
    fn name() -> String;

    /// Adds the messages in it, those in them first.
    fn messages(_known: &mut Vec<Definition>) {}
}

/// The definition of one message, without those of its fields.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// The package and the name: `geometry_msgs/Point`.
    pub name: String,
    /// A line for each field.
    pub fields: Vec<String>,
}

/// A message.
pub trait Message: Field {
    /// The package that defines it.
    const PACKAGE: &'static str;
    /// Its name in that package.
    const NAME: &'static str;

    /// Package and name as bags and programs show them: `geometry_msgs/msg/Point`.
    #[must_use]
    fn type_name() -> String {
        format!("{}/msg/{}", Self::PACKAGE, Self::NAME)
    }

    /// Its definition, followed by those of the messages in it.
    #[must_use]
    fn definition() -> String {
        let mut known = Vec::new();
        Self::messages(&mut known);
        let mut own = known.pop().map(|own| own.fields.join("\n")).unwrap_or_default();
        for Definition { name, fields } in &known {
            own += &format!("\n{}\nMSG: {name}\n{}", "=".repeat(80), fields.join("\n"));
        }
        own + "\n"
    }
}

/// The fields of the first message of a definition, without comments, constants and default values.
#[must_use]
pub fn fields(definition: &str) -> Vec<String> {
    let lines = definition.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    let own = lines.take_while(|line| !line.starts_with("==="));
    let fields = own.filter(|line| !line.is_empty() && !line.contains('='));
    let plain = |line: &str| {
        let mut words = line.split_ascii_whitespace();
        let (kind, name) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let kind = kind.rsplit('/').next().unwrap_or_default();
        format!("{kind} {name}")
    };
    fields.map(plain).collect()
}

macro_rules! plain {
    ($($type:ty: $name:literal),*) => { $(
        impl Field for $type {
            fn name() -> String { $name.to_owned() }
        }
    )* };
}

plain!(bool: "bool", u8: "uint8", i8: "int8", u16: "uint16", i32: "int32", u32: "uint32", f32: "float32", f64: "float64", String: "string");

impl<T: Field> Field for Vec<T> {
    fn name() -> String {
        format!("{}[]", T::name())
    }

    fn messages(known: &mut Vec<Definition>) {
        T::messages(known);
    }
}

impl<T: Field, const N: usize> Field for [T; N] {
    fn name() -> String {
        format!("{}[{N}]", T::name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{PoseWithCovarianceStamped, Range};

    #[test]
    fn a_definition_has_those_of_its_fields() {
        let text = PoseWithCovarianceStamped::definition();
        assert!(
            text.starts_with("std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n==")
        );
        for part in [
            "MSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n",
            "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
        ] {
            assert_eq!(text.matches(part).count(), 1, "{part}\n{text}");
        }
    }

    #[test]
    fn comments_and_constants_are_no_fields() {
        let text = "# A range\nuint8 ULTRASOUND=0\nstd_msgs/msg/Header header # when\nfloat32 range\n\
                    ===\nMSG: std_msgs/Header\nstring frame_id";
        assert_eq!(fields(text), ["Header header", "float32 range"]);
        assert_eq!(fields(&Range::definition()).len(), 7);
    }
}
