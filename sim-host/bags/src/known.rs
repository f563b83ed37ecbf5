//! The definition of a message: that of the bag, else that of this program.

use sonarfix_ros_messages::messages;

use crate::definition::Definition;
use crate::error::Defect;

/// `nav_msgs/msg/Odometry` of `nav_msgs/Odometry`.
pub fn with_msg(kind: &str) -> String {
    match kind.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => kind.to_owned(),
    }
}

/// The definition of a type, from the text in the bag if there is one.
pub fn definition(kind: &str, text: Option<&str>) -> Result<Definition, Defect> {
    let known = || {
        let mut known = messages::definitions().into_iter();
        // The versions of ROS before Jazzy have no variance of a range, which is not needed.
        let found = known.find_map(|(name, text)| (name == kind).then_some(text));
        found.map(|text| text.replace("float32 variance\n", ""))
    };
    let Some(text) = text.map(str::to_owned).or_else(known) else {
        let why = format!(
            "has no definition of {kind} as ros2msg, and this program has none either: convert the bag to MCAP with `ros2 bag convert`"
        );
        return Err(Defect::content(why));
    };
    Definition::parse(kind, &text).map_err(|why| Defect::Definition { kind: kind.to_owned(), why })
}
