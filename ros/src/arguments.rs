//! The arguments of a node, as every program of ROS takes them (`--ros-args`).

use crate::names::Remap;
use crate::parameters::{ParameterError, Parameters};

/// What the command line sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Arguments {
    /// The name of the node.
    pub node: String,
    /// Its namespace, with a leading slash.
    pub namespace: String,
    /// The rules for names.
    pub remaps: Vec<Remap>,
    /// The parameters.
    pub parameters: Parameters,
    /// Parameters for every node that this one does not have.
    pub skipped: Vec<String>,
    /// What stands outside of `--ros-args`.
    pub others: Vec<String>,
}

/// What is wrong with the command line.
#[derive(Debug, thiserror::Error)]
pub enum ArgumentError {
    /// An option lacks its value.
    #[error("{0} needs a value")]
    Value(String),
    /// A rule is no rule.
    #[error("{0}: a rule has the form NAME:=VALUE")]
    Rule(String),
    /// There is no such option.
    #[error("there is no option {0} in --ros-args")]
    Option(String),
    /// A parameter is wrong.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A file cannot be read.
    #[error("the parameter file {0}: {1}")]
    File(String, std::io::Error),
}

/// A parameter or a file, in the order of the command line, in which the later one counts.
enum Setting {
    One(String, String),
    File(String),
}

impl Arguments {
    /// Parses the arguments after the program's name; `read` reads a file.
    ///
    /// # Errors
    /// [`ArgumentError`], by what is wrong.
    pub fn parse(
        arguments: impl Iterator<Item = String>,
        read: impl Fn(&str) -> std::io::Result<String>,
    ) -> Result<Self, ArgumentError> {
        let mut parsed = Self {
            node: "sonarfix".to_owned(),
            namespace: "/".to_owned(),
            remaps: Vec::new(),
            parameters: Parameters::default(),
            skipped: Vec::new(),
            others: Vec::new(),
        };
        let (mut settings, mut is_ros) = (Vec::new(), false);
        let mut arguments = arguments.peekable();
        while let Some(argument) = arguments.next() {
            let mut value =
                || arguments.next().ok_or_else(|| ArgumentError::Value(argument.clone()));
            match (argument.as_str(), is_ros) {
                ("--ros-args", _) => is_ros = true,
                ("--", true) => is_ros = false,
                ("-r" | "--remap", true) => parsed.rename(&value()?)?,
                ("-p" | "--param", true) => {
                    let (name, value) = rule(&value()?)?;
                    settings.push(Setting::One(name, value));
                }
                ("--params-file", true) => settings.push(Setting::File(value()?)),
                ("--log-level" | "--log-config-file" | "-e" | "--enclave", true) => drop(value()?),
                (other, true) if is_switch_of_logging(other) => {}
                (other, true) => return Err(ArgumentError::Option(other.to_owned())),
                (other, false) => parsed.others.push(other.to_owned()),
            }
        }
        parsed.set(settings, read)?;
        Ok(parsed)
    }

    fn rename(&mut self, text: &str) -> Result<(), ArgumentError> {
        let (from, to) = rule(text)?;
        // A rule may be for one node of several in a process: `node:name:=value`. This process has one.
        match from.rsplit(':').next().unwrap_or_default() {
            "__node" | "__name" => self.node = to,
            "__ns" => self.namespace = format!("/{}", to.trim_matches('/')),
            from => self.remaps.push(Remap { from: from.to_owned(), to }),
        }
        Ok(())
    }

    fn set(
        &mut self,
        settings: Vec<Setting>,
        read: impl Fn(&str) -> std::io::Result<String>,
    ) -> Result<(), ArgumentError> {
        let full = format!("{}/{}", self.namespace.trim_end_matches('/'), self.node);
        for setting in settings {
            match setting {
                Setting::One(name, value) => {
                    let name = name.rsplit(':').next().unwrap_or_default();
                    self.parameters.set_text(name, &value)?;
                }
                Setting::File(file) => {
                    let content = read(&file);
                    let content =
                        content.map_err(|error| ArgumentError::File(file.clone(), error))?;
                    self.skipped.extend(self.parameters.read(&file, &content, &full)?);
                }
            }
        }
        Ok(())
    }
}

/// A rule: what stands before and after `:=`.
fn rule(text: &str) -> Result<(String, String), ArgumentError> {
    let parts = text.split_once(":=").filter(|(from, _)| !from.is_empty());
    let (from, to) = parts.ok_or_else(|| ArgumentError::Rule(text.to_owned()))?;
    Ok((from.to_owned(), to.to_owned()))
}

/// `--enable-rosout-logs` and its like, which launch files pass to every node.
fn is_switch_of_logging(argument: &str) -> bool {
    argument.starts_with("--enable-") || argument.starts_with("--disable-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Error, ErrorKind};

    fn parse(line: &str) -> Result<Arguments, ArgumentError> {
        let read = |file: &str| match file {
            "a.yaml" => {
                Ok("sonarfix: {ros__parameters: {pose_period: 1.0, odom_topic: wheels}}".to_owned())
            }
            _ => Err(Error::from(ErrorKind::NotFound)),
        };
        Arguments::parse(line.split(' ').map(str::to_owned), read)
    }

    #[test]
    fn a_launch_file_s_arguments_are_taken() {
        let line = "check --ros-args -r __ns:=/robot1 -r odom:=/base/odom --params-file a.yaml \
                    -p pose_period:=2 --log-level info --disable-stdout-logs -- rest";
        let arguments = parse(line).unwrap();
        assert_eq!(arguments.namespace, "/robot1");
        let remap = Remap { from: "odom".to_owned(), to: "/base/odom".to_owned() };
        assert_eq!(arguments.remaps, [remap]);
        assert_eq!(arguments.parameters.numbers("pose_period"), [2.0]);
        assert_eq!(arguments.parameters.text("odom_topic"), "wheels");
        assert_eq!(arguments.others, ["check", "rest"]);
    }

    #[test]
    fn wrong_arguments_are_named() {
        for line in [
            "--ros-args -r",
            "--ros-args -r odom",
            "--ros-args -p :=2",
            "--ros-args --params-file b.yaml",
            "--ros-args -p laser:=2",
            "--ros-args --nonsense",
        ] {
            assert!(!parse(line).unwrap_err().to_string().is_empty(), "{line}");
        }
    }
}
