//! Parameters as the messages of ROS's parameter services.

use crate::interfaces::{
    FloatingPointRange, IntegerRange, ListParametersRequest, ListParametersResult,
    ParameterDescriptor, ParameterValue,
};
use crate::parameters::{Parameter, ParameterError, Parameters, Value};

/// Number of the type of a parameter that is not set.
const NOT_SET: u8 = 0;

/// A value as a message; `None` is a parameter that does not exist.
#[must_use]
pub fn message(value: Option<&Value>) -> ParameterValue {
    let Some(value) = value else {
        return ParameterValue { r#type: NOT_SET, ..ParameterValue::default() };
    };
    let mut message = ParameterValue { r#type: value.type_number(), ..ParameterValue::default() };
    match value.clone() {
        Value::Bool(value) => message.bool_value = value,
        Value::Integer(value) => message.integer_value = value,
        Value::Double(value) => message.double_value = value,
        Value::Text(value) => message.string_value = value,
        Value::Doubles(values) => message.double_array_value = values,
        Value::Texts(values) => message.string_array_value = values,
    }
    message
}

/// The value of a message.
///
/// # Errors
/// [`ParameterError::Type`], if no parameter has a value of this type.
pub fn value(name: &str, message: &ParameterValue) -> Result<Value, ParameterError> {
    Ok(match message.r#type {
        1 => Value::Bool(message.bool_value),
        2 => Value::Integer(message.integer_value),
        3 => Value::Double(message.double_value),
        4 => Value::Text(message.string_value.clone()),
        #[expect(clippy::cast_precision_loss, reason = "the ranges end far below 2^53")]
        7 => Value::Doubles(message.integer_array_value.iter().map(|&it| it as f64).collect()),
        8 => Value::Doubles(message.double_array_value.clone()),
        9 => Value::Texts(message.string_array_value.clone()),
        _ => {
            let expected = "bool, integer, double, string, double[] or string[]";
            return Err(ParameterError::Type { name: name.to_owned(), expected });
        }
    })
}

/// The descriptor of a parameter.
#[must_use]
pub fn descriptor(row: &Parameter) -> ParameterDescriptor {
    let mut descriptor = ParameterDescriptor {
        name: row.name.to_owned(),
        r#type: row.default.type_number(),
        description: row.description.to_owned(),
        read_only: false,
        dynamic_typing: false,
        ..ParameterDescriptor::default()
    };
    if !row.choices.is_empty() {
        descriptor.additional_constraints = format!("one of {}", row.choices.join(", "));
    } else if !row.is_dynamic {
        descriptor.additional_constraints += "takes effect with the transition configure";
    }
    match (row.range, &row.default) {
        #[expect(clippy::cast_possible_truncation, reason = "the ranges end far below 2^53")]
        (Some([from, to]), Value::Integer(_)) => {
            let (from_value, to_value) = (from as i64, to as i64);
            descriptor.integer_range.push(IntegerRange { from_value, to_value, step: 1 });
        }
        (Some([from_value, to_value]), _) => {
            descriptor.floating_point_range.push(FloatingPointRange {
                from_value,
                to_value,
                step: 0.0,
            });
        }
        (None, _) => {}
    }
    descriptor
}

/// The names below the prefixes of a request, to its depth; 0: to any.
#[must_use]
pub fn list(parameters: &Parameters, request: &ListParametersRequest) -> ListParametersResult {
    let mut found = ListParametersResult::default();
    for row in parameters.rows() {
        let name = row.name;
        let below = |prefix: &String| {
            if name == prefix {
                return Some("");
            }
            name.strip_prefix(prefix.as_str())?.strip_prefix('.')
        };
        let rest = if request.prefixes.is_empty() {
            Some(name)
        } else {
            request.prefixes.iter().find_map(below)
        };
        let Some(rest) = rest else { continue };
        if request.depth != 0 && rest.split('.').count() as u64 > request.depth {
            continue;
        }
        found.names.push(name.to_owned());
        if let Some((prefix, _)) = name.rsplit_once('.')
            && !found.prefixes.iter().any(|known| known == prefix)
        {
            found.prefixes.push(prefix.to_owned());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive() {
        for row in Parameters::default().rows() {
            let sent = message(Some(&row.default));
            assert_eq!(value(row.name, &sent), Ok(row.default.clone()));
            assert_eq!(descriptor(row).r#type, sent.r#type);
        }
        assert_eq!(message(None).r#type, NOT_SET);
        assert!(value("x", &message(None)).is_err());
    }

    #[test]
    fn names_are_listed_by_prefix_and_depth() {
        let parameters = Parameters::default();
        let list = |prefixes: &[&str], depth| {
            let prefixes = prefixes.iter().map(|&prefix| prefix.to_owned()).collect();
            list(&parameters, &ListParametersRequest { prefixes, depth })
        };
        assert_eq!(list(&[], 0).names.len(), parameters.rows().len());
        let pose = list(&["initial_pose"], 0);
        assert_eq!((pose.names.len(), pose.prefixes), (6, vec!["initial_pose".to_owned()]));
        assert!(list(&[], 1).names.iter().all(|name| !name.contains('.')));
        assert_eq!(list(&["mode"], 0).names, ["mode"]);
        assert_eq!(list(&["mod"], 0).names.len(), 0);
    }

    #[test]
    fn ranges_are_described() {
        let parameters = Parameters::default();
        let baud = descriptor(parameters.row("baud").unwrap());
        assert_eq!(baud.integer_range[0].to_value, 4_000_000);
        let tolerance = descriptor(parameters.row("transform_tolerance").unwrap());
        assert!((tolerance.floating_point_range[0].to_value - 60.0).abs() < 1e-9);
        assert!(
            descriptor(parameters.row("mode").unwrap()).additional_constraints.contains("bridge")
        );
    }
}
