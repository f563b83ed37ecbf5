//! Names of topics and services: namespaces, private names and remapping.

/// A rule of the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remap {
    /// The name as the node has it.
    pub from: String,
    /// The name in its place.
    pub to: String,
}

/// The names of one node.
#[derive(Debug, Clone)]
pub struct Names {
    /// The name of the node.
    pub node: String,
    /// Its namespace, with a leading slash.
    pub namespace: String,
    /// The rules, of which the first that matches counts.
    pub remaps: Vec<Remap>,
}

impl Names {
    /// The full name of the node.
    #[must_use]
    pub fn full_name(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.node)
    }

    /// The full name of a topic or service: `name` in the namespace, `/name` as it is, `~/name` below the node.
    #[must_use]
    pub fn resolve(&self, name: &str) -> String {
        let expanded = self.expand(name);
        let rule = self.remaps.iter().find(|rule| self.expand(&rule.from) == expanded);
        rule.map_or(expanded, |rule| self.expand(&rule.to))
    }

    fn expand(&self, name: &str) -> String {
        if name.starts_with('/') {
            name.to_owned()
        } else if let Some(own) = name.strip_prefix("~/") {
            format!("{}/{own}", self.full_name())
        } else {
            format!("{}/{name}", self.namespace.trim_end_matches('/'))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_resolved_as_in_ros() {
        let rule = |from: &str, to: &str| Remap { from: from.to_owned(), to: to.to_owned() };
        let remaps = vec![rule("odom", "/base/odom"), rule("/tf", "tf"), rule("~/aim", "look")];
        let names = Names { node: "loc".to_owned(), namespace: "/r1".to_owned(), remaps };
        let cases = [
            ("amcl_pose", "/r1/amcl_pose"),
            ("/map", "/map"),
            ("~/calibration", "/r1/loc/calibration"),
            ("odom", "/base/odom"),
            ("/r1/odom", "/base/odom"),
            ("/tf", "/r1/tf"),
            ("~/aim", "/r1/look"),
        ];
        for (name, expected) in cases {
            assert_eq!(names.resolve(name), expected, "{name}");
        }
    }
}
