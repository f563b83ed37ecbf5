//! The definition of a message as a bag contains it (`ros2msg`), as types of its fields.
//!
//! `docs`: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>. Constants, default values and bounds are read over.

use std::collections::HashMap;

/// The longest definition, bytes.
const LONGEST: usize = 1 << 20;
/// The deepest nesting of messages. Those of ROS have five.
const DEEPEST: usize = 32;

/// A number or a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plain {
    /// A truth value, a byte or a whole number of this many bytes.
    Unsigned(usize),
    /// A whole number with a sign, of this many bytes.
    Signed(usize),
    /// `float32`.
    Single,
    /// `float64`.
    Double,
    /// A text in UTF-8.
    Text,
    /// A text in UTF-16.
    WideText,
}

/// The type of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// A number or a text.
    Plain(Plain),
    /// A message, by its number in the [`Definition`].
    Message(usize),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// One.
    One,
    /// This many.
    Fixed(usize),
    /// A list with its length before it.
    List,
}

/// A field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// The type of its elements.
    pub element: Element,
    /// Their number.
    pub count: Count,
}

/// A message with those in it. The first one is the message itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    messages: Vec<Vec<Field>>,
}

/// Why a text is no definition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoDefinition {
    /// It is too long.
    #[error("it is longer than 1 MiB")]
    TooLong,
    /// A line has no field.
    #[error("its line {0} has no type with a name")]
    Line(usize),
    /// A message in it is not defined.
    #[error("the message `{0}` in it is not defined in it")]
    Missing(String),
    /// A message contains itself.
    #[error("its messages are nested more than 32 deep")]
    TooDeep,
}

/// A field whose type is still a name.
struct Line<'t> {
    number: usize,
    kind: &'t str,
    name: &'t str,
}

impl Definition {
    /// Reads the definition of a message of this type (`nav_msgs/msg/Odometry`).
    ///
    /// # Errors
    /// [`NoDefinition`], by the reason.
    pub fn parse(kind: &str, text: &str) -> Result<Self, NoDefinition> {
        if text.len() > LONGEST {
            return Err(NoDefinition::TooLong);
        }
        let sections = sections(kind, text)?;
        let numbers: HashMap<&str, usize> = sections
            .iter()
            .enumerate()
            .rev()
            .map(|(number, (name, _))| (name.as_str(), number))
            .collect();
        let fields = |(name, lines): &(String, Vec<Line>)| {
            let package = name.split('/').next().unwrap_or_default();
            lines.iter().map(|line| field(line, package, &numbers)).collect()
        };
        let messages: Vec<Vec<Field>> = sections.iter().map(fields).collect::<Result<_, _>>()?;
        let definition = Self { messages };
        definition.check_depth()?;
        Ok(definition)
    }

    /// The fields of a message by its number; 0 is the message itself.
    #[must_use]
    pub fn fields(&self, message: usize) -> &[Field] {
        self.messages.get(message).map_or(&[], Vec::as_slice)
    }

    /// Refuses a message that contains itself, and deeper nesting than [`DEEPEST`]: level by level, the messages of which all at a
    /// level are known.
    fn check_depth(&self) -> Result<(), NoDefinition> {
        let mut level = vec![0];
        for _ in 0..DEEPEST {
            let fields = level.iter().flat_map(|message| self.fields(*message));
            let mut next: Vec<usize> = fields
                .filter_map(|field| match field.element {
                    Element::Message(number) => Some(number),
                    Element::Plain(_) => None,
                })
                .collect();
            next.sort_unstable();
            next.dedup();
            if next.is_empty() {
                return Ok(());
            }
            level = next;
        }
        Err(NoDefinition::TooDeep)
    }
}

/// The messages of a text, each as package and name with its lines.
fn sections<'t>(kind: &str, text: &'t str) -> Result<Vec<(String, Vec<Line<'t>>)>, NoDefinition> {
    let mut sections = vec![(plain_name(kind), Vec::new())];
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if let Some(name) = line.strip_prefix("MSG:") {
            sections.push((plain_name(name.trim()), Vec::new()));
            continue;
        }
        if line.is_empty() || line.starts_with("===") {
            continue;
        }
        let (kind, rest) =
            line.split_once(char::is_whitespace).ok_or(NoDefinition::Line(number))?;
        let rest = rest.trim_start();
        let end = rest.find(|letter: char| !letter.is_alphanumeric() && letter != '_');
        let (name, behind) = rest.split_at_checked(end.unwrap_or(rest.len())).unwrap_or_default();
        if name.is_empty() {
            return Err(NoDefinition::Line(number));
        }
        let is_constant = behind.trim_start().starts_with('=');
        if let (Some((_, lines)), false) = (sections.last_mut(), is_constant) {
            lines.push(Line { number, kind, name });
        }
    }
    Ok(sections)
}

/// `geometry_msgs/Point` of `geometry_msgs/msg/Point`.
fn plain_name(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

fn field(
    line: &Line,
    package: &str,
    numbers: &HashMap<&str, usize>,
) -> Result<Field, NoDefinition> {
    let (kind, count) = match line.kind.split_once('[') {
        None => (line.kind, Count::One),
        Some((kind, bounds)) => {
            let bounds = bounds.strip_suffix(']').ok_or(NoDefinition::Line(line.number))?;
            let is_list = bounds.is_empty() || bounds.starts_with("<=");
            let fixed = if is_list { None } else { Some(bounds.parse()) };
            match fixed.transpose().map_err(|_| NoDefinition::Line(line.number))? {
                Some(count) => (kind, Count::Fixed(count)),
                None => (kind, Count::List),
            }
        }
    };
    // A text may have a bound: string<=10.
    let kind = kind.split('<').next().unwrap_or_default();
    let message = || {
        let name = match kind {
            "Header" => "std_msgs/Header".to_owned(),
            "time" => "builtin_interfaces/Time".to_owned(),
            kind if kind.contains('/') => plain_name(kind),
            kind => format!("{package}/{kind}"),
        };
        let number = numbers.get(name.as_str()).copied();
        number.map(Element::Message).ok_or(NoDefinition::Missing(name))
    };
    let element = plain(kind).map_or_else(message, |plain| Ok(Element::Plain(plain)))?;
    Ok(Field { name: line.name.to_owned(), element, count })
}

fn plain(kind: &str) -> Option<Plain> {
    Some(match kind {
        "bool" | "byte" | "char" | "uint8" => Plain::Unsigned(1),
        "uint16" => Plain::Unsigned(2),
        "uint32" => Plain::Unsigned(4),
        "uint64" => Plain::Unsigned(8),
        "int8" => Plain::Signed(1),
        "int16" => Plain::Signed(2),
        "int32" => Plain::Signed(4),
        "int64" => Plain::Signed(8),
        "float32" => Plain::Single,
        "float64" => Plain::Double,
        "string" => Plain::Text,
        "wstring" => Plain::WideText,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_has_fields_without_constants_and_comments() {
        let text = "# A thing\nuint8 KIND=3 # no field\nstring NAME = \"a\"\nHeader header\n\
                    float64[36] covariance\nPoint[<=5] points\nstring<=10 label \"none\"\nint32 x -3\n\
                    ================\nMSG: std_msgs/msg/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
                    ===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n===\nMSG: my_msgs/Point\nfloat32 x\n";
        let definition = Definition::parse("my_msgs/msg/Thing", text).unwrap();
        let names = |message| {
            let fields = definition.fields(message).iter();
            fields.map(|field| field.name.as_str()).collect::<Vec<_>>()
        };
        assert_eq!(names(0), ["header", "covariance", "points", "label", "x"]);
        assert_eq!(names(1), ["stamp", "frame_id"]);
        let field = |place: usize| &definition.fields(0)[place];
        assert_eq!(field(0).element, Element::Message(1));
        assert_eq!(field(1).count, Count::Fixed(36));
        assert_eq!((field(2).element, field(2).count), (Element::Message(3), Count::List));
        assert_eq!(field(3).element, Element::Plain(Plain::Text));
        assert_eq!(definition.fields(9), &[]);
    }

    #[test]
    fn what_is_no_definition_is_refused() {
        let refused = |text: &str| Definition::parse("a/msg/B", text).unwrap_err();
        assert_eq!(refused("float64"), NoDefinition::Line(1));
        assert_eq!(refused("float64 x\nfloat64[3 y"), NoDefinition::Line(2));
        assert_eq!(refused("float64[x] y"), NoDefinition::Line(1));
        assert_eq!(refused("Point p"), NoDefinition::Missing("a/Point".into()));
        assert_eq!(refused("B again"), NoDefinition::TooDeep);
        assert_eq!(refused(&" ".repeat(LONGEST + 1)), NoDefinition::TooLong);
        let pairs = |n: usize| format!("===\nMSG: a/C{n}\nC{} one\nC{} two\n", n + 1, n + 1);
        let many = (0..40).map(pairs).collect::<String>();
        assert_eq!(refused(&format!("C0 x\n{many}===\nMSG: a/C40\n")), NoDefinition::TooDeep);
    }
}
