//! The parameters of the node: one table, from which the parsing of YAML, the checks, the descriptors of the services and the
//! table of `docs/ros.md` are made.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The value of a parameter. Units are in the description.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A real number.
    Double(f64),
    /// A text.
    Text(String),
    /// A list of real numbers.
    Doubles(Vec<f64>),
    /// A list of texts.
    Texts(Vec<String>),
}

impl Value {
    /// The number of its type in `rcl_interfaces/ParameterType`.
    #[must_use]
    pub fn type_number(&self) -> u8 {
        match self {
            Self::Bool(_) => 1,
            Self::Integer(_) => 2,
            Self::Double(_) => 3,
            Self::Text(_) => 4,
            Self::Doubles(_) => 8,
            Self::Texts(_) => 9,
        }
    }

    /// The name of its type.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Integer(_) => "integer",
            Self::Double(_) => "double",
            Self::Text(_) => "string",
            Self::Doubles(_) => "double[]",
            Self::Texts(_) => "string[]",
        }
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            #[expect(clippy::cast_precision_loss, reason = "the ranges end far below 2^53")]
            Self::Integer(number) => vec![*number as f64],
            Self::Double(number) => vec![*number],
            Self::Doubles(numbers) => numbers.clone(),
            _ => Vec::new(),
        }
    }

    /// The value of this YAML; of the type of `like` where YAML leaves it open (`1` for a real number, `[]` for a list).
    fn of_yaml(yaml: &serde_yaml::Value, like: Option<&Self>) -> Option<Self> {
        use serde_yaml::Value as Yaml;
        match (yaml, like) {
            (Yaml::Bool(value), _) => Some(Self::Bool(*value)),
            (Yaml::Number(number), Some(Self::Double(_))) => number.as_f64().map(Self::Double),
            (Yaml::Number(number), _) => {
                number.as_i64().map(Self::Integer).or_else(|| number.as_f64().map(Self::Double))
            }
            (Yaml::String(text), _) => Some(Self::Text(text.clone())),
            (Yaml::Sequence(list), Some(Self::Texts(_))) => list
                .iter()
                .map(|item| item.as_str().map(str::to_owned))
                .collect::<Option<_>>()
                .map(Self::Texts),
            (Yaml::Sequence(list), _) => {
                list.iter().map(serde_yaml::Value::as_f64).collect::<Option<_>>().map(Self::Doubles)
            }
            _ => None,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Double(value) => write!(f, "{value:?}"),
            Self::Text(value) => write!(f, "\"{value}\""),
            Self::Doubles(values) => write!(f, "{values:?}"),
            Self::Texts(values) => write!(f, "{values:?}"),
        }
    }
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name; as that of AMCL where AMCL has it.
    pub name: &'static str,
    /// Its value if none is given, which sets its type.
    pub default: Value,
    /// The least and the largest number.
    pub range: Option<[f64; 2]>,
    /// The texts that it can have; empty: any.
    pub choices: &'static [&'static str],
    /// Whether it can be changed while the node is configured.
    pub is_dynamic: bool,
    /// What it sets, with its unit.
    pub description: &'static str,
}

fn row(name: &'static str, default: Value, description: &'static str) -> Parameter {
    Parameter { name, default, range: None, choices: &[], is_dynamic: false, description }
}

fn text(name: &'static str, default: &str, description: &'static str) -> Parameter {
    row(name, Value::Text(default.to_owned()), description)
}

fn flag(name: &'static str, default: bool, description: &'static str) -> Parameter {
    row(name, Value::Bool(default), description)
}

fn texts(name: &'static str, default: &[&str], description: &'static str) -> Parameter {
    row(name, Value::Texts(default.iter().map(|&text| text.to_owned()).collect()), description)
}

fn number(
    name: &'static str,
    default: f64,
    range: [f64; 2],
    description: &'static str,
) -> Parameter {
    Parameter { range: Some(range), ..row(name, Value::Double(default), description) }
}

fn dynamic(parameter: Parameter) -> Parameter {
    Parameter { is_dynamic: true, ..parameter }
}

/// The table.
#[must_use]
pub fn table() -> Vec<Parameter> {
    [files(), inputs(), frames(), start(), outputs()].concat()
}

fn files() -> Vec<Parameter> {
    vec![
        Parameter {
            choices: &["host", "bridge"],
            ..text(
                "mode",
                "host",
                "`host` runs the localizer here, `bridge` publishes what a robot estimates",
            )
        },
        text("robot_file", "", "Robot file (docs/formats.md); needed in both modes"),
        text(
            "map_file",
            "",
            "Map file of walls (docs/formats.md). Empty: the walls are found in the grid of `map_topic`",
        ),
        text("port", "", "`bridge`: serial port of the robot, or `tcp:HOST:PORT`"),
        Parameter {
            range: Some([1200.0, 4_000_000.0]),
            ..row("baud", Value::Integer(115_200), "`bridge`: rate of the serial port, bit/s")
        },
        flag("use_sim_time", false, "The clock is `/clock`"),
        flag(
            "autostart_node",
            false,
            "Configures and activates the node at its start; otherwise a lifecycle manager does",
        ),
        number(
            "bond_heartbeat_period",
            0.1,
            [0.0, 10.0],
            "Period of the bond with a lifecycle manager, s; 0: no bond",
        ),
    ]
}

fn inputs() -> Vec<Parameter> {
    vec![
        text("map_topic", "map", "Topic of the grid"),
        flag("first_map_only", false, "Takes the first grid and ignores further ones"),
        Parameter {
            choices: &["odometry", "joints"],
            ..text(
                "odometry_source",
                "odometry",
                "`odometry`: nav_msgs/Odometry; `joints`: sensor_msgs/JointState of the wheels",
            )
        },
        text("odom_topic", "odom", "Topic of the odometry"),
        text("joint_topic", "joint_states", "Topic of the wheels"),
        texts(
            "wheel_joints",
            &["right_wheel_joint", "left_wheel_joint"],
            "Names of the right and of the left wheel's joint",
        ),
        number("wheel_radius", 0.03, [0.001, 10.0], "Radius of the wheels, m; for `joints`"),
        texts(
            "range_topics",
            &["range"],
            "Topics of the ranges, in the order of the rangers of the robot file",
        ),
        row(
            "range_bearings",
            Value::Doubles(Vec::new()),
            "Bearings of fixed rangers, rad from the heading. Empty: from the transform of each range's frame",
        ),
        text(
            "imu_topic",
            "",
            "Topic of the IMU, whose rate about z is used if the robot file has a gyro. Empty: none",
        ),
        text(
            "scan_topic",
            "",
            "Topic of a scan, which counts as single ranges of the first ranger. Empty: none",
        ),
        row(
            "scan_bearings",
            Value::Doubles(vec![0.0]),
            "Bearings of the beams that are used of a scan, rad from the heading",
        ),
        dynamic(number(
            "history",
            1.0,
            [0.0, 10.0],
            "How late a range may arrive, s; it is used at the time of its stamp",
        )),
        dynamic(number(
            "max_future",
            0.2,
            [0.0, 10.0],
            "How far a stamp may be ahead of the clock, s",
        )),
        dynamic(number(
            "odometry_timeout",
            0.5,
            [0.01, 60.0],
            "Time without odometry that is reported, s",
        )),
    ]
}

fn frames() -> Vec<Parameter> {
    vec![
        text("global_frame_id", "map", "Frame of the map"),
        text("odom_frame_id", "odom", "Frame of the odometry"),
        text(
            "base_frame_id",
            "base_footprint",
            "Frame of the robot: between the wheels' contact points, x ahead",
        ),
        dynamic(flag(
            "tf_broadcast",
            true,
            "Publishes the transform from global_frame_id to odom_frame_id",
        )),
        flag(
            "publish_odom_tf",
            false,
            "Publishes the transform from odom_frame_id to base_frame_id as well",
        ),
        dynamic(number(
            "transform_tolerance",
            1.0,
            [0.0, 60.0],
            "How long a published transform is valid beyond its time, s",
        )),
    ]
}

fn start() -> Vec<Parameter> {
    let wide = [-1e6, 1e6];
    vec![
        flag(
            "set_initial_pose",
            false,
            "Starts at the pose of the parameters `initial_pose`; otherwise the pose is searched or set later",
        ),
        number("initial_pose.x", 0.0, wide, "x at the start, m in the map"),
        number("initial_pose.y", 0.0, wide, "y at the start, m in the map"),
        number("initial_pose.z", 0.0, wide, "Not used: the robot drives on a plane"),
        number(
            "initial_pose.yaw",
            0.0,
            [-1e3, 1e3],
            "Heading at the start, rad counter-clockwise from x of the map",
        ),
        number(
            "initial_pose.position_deviation",
            0.05,
            [1e-3, 10.0],
            "Standard deviation of x and of y at the start, m",
        ),
        number(
            "initial_pose.heading_deviation",
            0.05,
            [1e-3, 3.2],
            "Standard deviation of the heading at the start, rad",
        ),
        flag(
            "always_reset_initial_pose",
            false,
            "A map that arrives sets the pose of the parameters again; otherwise the last pose is kept",
        ),
        dynamic(flag(
            "search_when_lost",
            true,
            "Searches for the pose when the verdict is `Lost`, and at a start without a pose",
        )),
    ]
}

fn outputs() -> Vec<Parameter> {
    vec![
        text("pose_topic", "amcl_pose", "Topic of the estimated pose"),
        dynamic(number(
            "pose_period",
            0.1,
            [0.0, 60.0],
            "Longest time between two poses while odometry arrives, s; after each range there is one anyway",
        )),
        dynamic(number(
            "diagnostics_period",
            1.0,
            [0.05, 60.0],
            "Period of diagnostics, markers and calibration, s",
        )),
        flag("publish_markers", true, "Publishes walls, pings, ellipse and hypotheses as markers"),
        text(
            "search_motion_topic",
            "",
            "`host`: topic of the velocities of a robot that searches, as `search_motion` of the robot file has them. Empty: none",
        ),
    ]
}

/// What is wrong with a parameter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParameterError {
    /// There is no such parameter.
    #[error("there is no parameter {0}: see docs/ros.md")]
    Unknown(String),
    /// The value has another type.
    #[error("{name}: the value must be a {expected}")]
    Type {
        /// The parameter.
        name: String,
        /// The type that it has.
        expected: &'static str,
    },
    /// The number is beyond its range.
    #[error("{name}: the value must be from {from} to {to}")]
    Range {
        /// The parameter.
        name: String,
        /// The least number.
        from: String,
        /// The largest number.
        to: String,
    },
    /// The text is none of the choices.
    #[error("{name}: the value must be one of {choices}")]
    Choice {
        /// The parameter.
        name: String,
        /// The choices.
        choices: String,
    },
    /// It cannot be changed now.
    #[error(
        "{0} can only be changed while the node is unconfigured: use the transition cleanup first"
    )]
    Fixed(String),
    /// A file cannot be parsed.
    #[error("the parameter file {file}: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
}

impl Parameter {
    /// Checks a value; a whole number counts as a real one, and an empty list as of either type.
    ///
    /// # Errors
    /// [`ParameterError`], by what is wrong.
    pub fn checked(&self, value: Value) -> Result<Value, ParameterError> {
        let name = self.name.to_owned();
        let value = match (value, &self.default) {
            #[expect(clippy::cast_precision_loss, reason = "the ranges end far below 2^53")]
            (Value::Integer(number), Value::Double(_)) => Value::Double(number as f64),
            (Value::Doubles(list), Value::Texts(_)) if list.is_empty() => Value::Texts(Vec::new()),
            (Value::Texts(list), Value::Doubles(_)) if list.is_empty() => {
                Value::Doubles(Vec::new())
            }
            (value, _) => value,
        };
        if value.type_number() != self.default.type_number() {
            return Err(ParameterError::Type { name, expected: self.default.type_name() });
        }
        let [from, to] = self.range.unwrap_or([f64::MIN, f64::MAX]);
        if !value.numbers().iter().all(|number| (from..=to).contains(number)) {
            let [from, to] = [from, to].map(|end| end.to_string());
            return Err(ParameterError::Range { name, from, to });
        }
        match &value {
            Value::Text(text)
                if !self.choices.is_empty() && !self.choices.contains(&text.as_str()) =>
            {
                Err(ParameterError::Choice { name, choices: self.choices.join(", ") })
            }
            _ => Ok(value),
        }
    }
}

/// The parameters of a node with their values.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    table: Vec<Parameter>,
    values: BTreeMap<&'static str, Value>,
}

impl Default for Parameters {
    fn default() -> Self {
        let table = table();
        let values = table.iter().map(|row| (row.name, row.default.clone())).collect();
        Self { table, values }
    }
}

impl Parameters {
    /// The rows of the table.
    #[must_use]
    pub fn rows(&self) -> &[Parameter] {
        &self.table
    }

    /// The row of a parameter.
    ///
    /// # Errors
    /// [`ParameterError::Unknown`].
    pub fn row(&self, name: &str) -> Result<&Parameter, ParameterError> {
        let row = self.table.iter().find(|row| row.name == name);
        row.ok_or_else(|| ParameterError::Unknown(name.to_owned()))
    }

    /// The value of a parameter.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.values.get(name)
    }

    /// Sets a parameter; nothing changes if that is not possible.
    ///
    /// # Errors
    /// [`ParameterError`], by the reason.
    pub fn set(&mut self, name: &str, value: Value) -> Result<(), ParameterError> {
        let row = self.row(name)?;
        let (name, value) = (row.name, row.checked(value)?);
        self.values.insert(name, value);
        Ok(())
    }

    /// As [`Self::set`], of a node that may be configured: then only dynamic parameters change.
    ///
    /// # Errors
    /// [`ParameterError`], by the reason.
    pub fn change(
        &mut self,
        name: &str,
        value: Value,
        is_configured: bool,
    ) -> Result<(), ParameterError> {
        let row = self.row(name)?;
        let checked = row.checked(value)?;
        if is_configured && !row.is_dynamic && self.get(name) != Some(&checked) {
            return Err(ParameterError::Fixed(name.to_owned()));
        }
        self.set(name, checked)
    }

    /// Sets a parameter from YAML, as on the command line.
    ///
    /// # Errors
    /// [`ParameterError`], by the reason.
    pub fn set_text(&mut self, name: &str, text: &str) -> Result<(), ParameterError> {
        let yaml = serde_yaml::from_str(text);
        self.set_yaml(name, &yaml.unwrap_or_else(|_| serde_yaml::Value::String(text.to_owned())))
    }

    fn set_yaml(&mut self, name: &str, yaml: &serde_yaml::Value) -> Result<(), ParameterError> {
        let row = self.row(name)?;
        let value = Value::of_yaml(yaml, Some(&row.default));
        let expected = row.default.type_name();
        self.set(name, value.ok_or(ParameterError::Type { name: name.to_owned(), expected })?)
    }

    /// Sets the parameters of a file as ROS has them: for each node, `ros__parameters`. Nodes of other names are skipped;
    /// `/**` and `*` match every node: what such a section sets for other nodes is skipped, and returned by name.
    ///
    /// # Errors
    /// [`ParameterError`], by the reason.
    pub fn read(
        &mut self,
        file: &str,
        content: &str,
        node: &str,
    ) -> Result<Vec<String>, ParameterError> {
        let wrong = |reason: String| ParameterError::File { file: file.to_owned(), reason };
        let yaml: serde_yaml::Value =
            serde_yaml::from_str(content).map_err(|error| wrong(error.to_string()))?;
        let nodes = yaml.as_mapping().ok_or_else(|| wrong("it has no nodes".to_owned()))?;
        let mut skipped = Vec::new();
        for (name, content) in nodes {
            let name = name.as_str().unwrap_or_default();
            let is_of_all = ["/**", "/*", "*"].contains(&name);
            let is_ours = is_of_all
                || name.trim_start_matches('/') == node.trim_start_matches('/')
                || node.rsplit('/').next() == Some(name);
            let Some(own) = content.get("ros__parameters").filter(|_| is_ours) else { continue };
            for (name, value) in leaves("", own) {
                match self.set_yaml(&name, value) {
                    Err(ParameterError::Unknown(name)) if is_of_all => skipped.push(name),
                    result => result?,
                }
            }
        }
        Ok(skipped)
    }

    /// A text.
    #[must_use]
    pub fn text(&self, name: &str) -> &str {
        match self.get(name) {
            Some(Value::Text(text)) => text,
            _ => "",
        }
    }

    /// Texts.
    #[must_use]
    pub fn texts(&self, name: &str) -> &[String] {
        match self.get(name) {
            Some(Value::Texts(texts)) => texts,
            _ => &[],
        }
    }

    /// A flag.
    #[must_use]
    pub fn flag(&self, name: &str) -> bool {
        self.get(name) == Some(&Value::Bool(true))
    }

    /// A number.
    #[must_use]
    pub fn number(&self, name: &str) -> f64 {
        self.get(name).map(Value::numbers).unwrap_or_default().first().copied().unwrap_or(0.0)
    }

    /// Numbers.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.get(name).map(Value::numbers).unwrap_or_default()
    }

    /// A time in nanoseconds, of a parameter in seconds.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the ranges end at 60 s")]
    pub fn nanoseconds(&self, name: &str) -> i64 {
        (self.number(name) * 1e9).round() as i64
    }
}

/// The names and values of a tree, whose branches are joined by dots.
fn leaves<'y>(prefix: &str, tree: &'y serde_yaml::Value) -> Vec<(String, &'y serde_yaml::Value)> {
    let mut found = Vec::new();
    for (key, value) in tree.as_mapping().into_iter().flatten() {
        let name = format!("{prefix}{}", key.as_str().unwrap_or_default());
        if value.is_mapping() {
            found.extend(leaves(&format!("{name}."), value));
        } else {
            found.push((name, value));
        }
    }
    found
}

/// The table as Markdown, for `docs/ros.md`.
#[must_use]
pub fn markdown() -> String {
    let mut text =
        "| parameter | type | default | range | at run time | what |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for row in table() {
        let range = match (row.range, row.choices) {
            (Some([from, to]), _) => format!("{from} … {to}"),
            (None, choices) => choices.join(", "),
        };
        let when = if row.is_dynamic { "yes" } else { "" };
        let Parameter { name, default, description, .. } = &row;
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| `{name}` | {} | `{default}` | {range} | {when} | {description} |",
            default.type_name()
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_valid_and_named_once() {
        let rows = table();
        for row in &rows {
            assert_eq!(row.checked(row.default.clone()).as_ref(), Ok(&row.default), "{}", row.name);
            assert!(row.description.len() > 3, "{}", row.name);
        }
        let mut names: Vec<_> = rows.iter().map(|row| row.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), rows.len());
    }

    #[test]
    fn a_file_of_ros_is_read() {
        let mut parameters = Parameters::default();
        let file = "/**:\n  ros__parameters:\n    use_sim_time: true\n    speed: {limit: 1.0}\nsonarfix:\n  ros__parameters:\n    \
                    initial_pose: {x: 1, yaw: 0.5}\n    range_topics: [left, right]\n    scan_bearings: []\nother:\n  \
                    ros__parameters: {nonsense: 1}\n";
        let skipped = parameters.read("nav2.yaml", file, "/sonarfix").unwrap();
        assert_eq!(skipped, ["speed.limit"]);
        assert!(parameters.flag("use_sim_time"));
        assert_eq!(parameters.numbers("initial_pose.x"), [1.0]);
        assert_eq!(parameters.texts("range_topics"), ["left", "right"]);
        assert_eq!(parameters.numbers("scan_bearings"), Vec::<f64>::new());
        let error = parameters.read("nav2.yaml", file, "/other").unwrap_err();
        assert_eq!(error, ParameterError::Unknown("nonsense".to_owned()));
    }

    #[test]
    fn wrong_values_are_refused_by_name() {
        let mut parameters = Parameters::default();
        let tries = [
            ("transform_tolerance", "-1"),
            ("transform_tolerance", ".nan"),
            ("transform_tolerance", "soon"),
            ("mode", "amcl"),
            ("baud", "1.5"),
            ("range_topics", "[1]"),
            ("laser_model_type", "beam"),
        ];
        for (name, value) in tries {
            let error = parameters.set_text(name, value).unwrap_err();
            assert!(error.to_string().contains(name), "{error}");
        }
        assert_eq!(parameters, Parameters::default());
    }

    #[test]
    fn a_configured_node_changes_what_is_safe() {
        let mut parameters = Parameters::default();
        let period = Value::Integer(2);
        assert_eq!(parameters.change("pose_period", period, true), Ok(()));
        assert_eq!(parameters.numbers("pose_period"), [2.0]);
        let topic = || Value::Text("pose".to_owned());
        let refused = parameters.change("pose_topic", topic(), true).unwrap_err();
        assert!(matches!(refused, ParameterError::Fixed(_)));
        assert_eq!(parameters.change("pose_topic", topic(), false), Ok(()));
    }
}
