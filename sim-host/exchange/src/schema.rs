//! The JSON schemas of the messages. Those with a name of Foxglove describe the fields that are written, as
//! <https://docs.foxglove.dev/docs/sdk/schemas> defines them; the others are this project's.

use serde_json::{Map, Value, json};

use crate::row::Kind;

/// A message type: name, and JSON schema.
#[derive(Debug, Clone)]
pub struct Schema {
    /// Its name.
    pub name: &'static str,
    /// Its JSON schema.
    pub text: Value,
}

fn object(properties: &Value) -> Value {
    let required: Vec<&String> =
        properties.as_object().into_iter().flatten().map(|(name, _)| name).collect();
    json!({ "type": "object", "properties": properties, "required": required })
}

fn named(name: &'static str, properties: &Value) -> Schema {
    let mut text = object(properties);
    if let Some(text) = text.as_object_mut() {
        text.insert("title".to_owned(), name.into());
    }
    Schema { name, text }
}

fn time() -> Value {
    object(&json!({
        "sec": { "type": "integer", "minimum": 0 },
        "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
    }))
}

fn numbers(names: &[&str]) -> Value {
    let number = |&name: &&str| (name.to_owned(), json!({ "type": "number" }));
    object(&names.iter().map(number).collect())
}

fn vector() -> Value {
    numbers(&["x", "y", "z"])
}

fn pose() -> Value {
    object(&json!({ "position": vector(), "orientation": numbers(&["x", "y", "z", "w"]) }))
}

fn list(items: &Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn covariance() -> Value {
    json!({ "type": "array", "items": { "type": "number" }, "minItems": 36, "maxItems": 36 })
}

/// A pose.
pub fn pose_in_frame() -> Schema {
    let properties =
        json!({ "timestamp": time(), "frame_id": { "type": "string" }, "pose": pose() });
    named("foxglove.PoseInFrame", &properties)
}

/// A pose with its covariance, without velocities.
pub fn odometry() -> Schema {
    let text = json!({ "type": "string" });
    let properties = json!({
        "timestamp": time(),
        "frame_id": text,
        "child_frame_id": text,
        "pose": pose(),
        "pose_covariance": covariance(),
    });
    named("foxglove.Odometry", &properties)
}

/// The place of the robot's frame in the map's.
pub fn frame_transform() -> Schema {
    let text = json!({ "type": "string" });
    let properties = json!({
        "timestamp": time(),
        "parent_frame_id": text,
        "child_frame_id": text,
        "translation": vector(),
        "rotation": numbers(&["x", "y", "z", "w"]),
    });
    named("foxglove.FrameTransform", &properties)
}

/// Lines and ellipsoids.
pub fn scene_update() -> Schema {
    let colour = numbers(&["r", "g", "b", "a"]);
    let lines = object(&json!({
        "type": { "type": "integer", "description": "2: each two points are a line" },
        "pose": pose(),
        "thickness": { "type": "number" },
        "scale_invariant": { "type": "boolean" },
        "points": list(&vector()),
        "color": colour,
        "colors": list(&colour),
        "indices": list(&json!({ "type": "integer" })),
    }));
    let spheres = object(&json!({ "pose": pose(), "size": vector(), "color": colour }));
    let pair = object(&json!({ "key": { "type": "string" }, "value": { "type": "string" } }));
    let none = list(&json!({ "type": "object" }));
    let entity = object(&json!({
        "timestamp": time(),
        "frame_id": { "type": "string" },
        "id": { "type": "string" },
        "lifetime": time(),
        "frame_locked": { "type": "boolean" },
        "metadata": list(&pair),
        "arrows": none,
        "cubes": none,
        "spheres": list(&spheres),
        "cylinders": none,
        "lines": list(&lines),
        "triangles": none,
        "texts": none,
        "models": none,
    }));
    named("foxglove.SceneUpdate", &json!({ "deletions": none, "entities": list(&entity) }))
}

/// A scan.
pub fn laser_scan() -> Schema {
    let number = json!({ "type": "number" });
    let properties = json!({
        "timestamp": time(),
        "frame_id": { "type": "string" },
        "pose": pose(),
        "start_angle": number,
        "end_angle": number,
        "ranges": list(&number),
        "intensities": list(&number),
    });
    named("foxglove.LaserScan", &properties)
}

/// A line of text with a severity.
pub fn log() -> Schema {
    let text = json!({ "type": "string" });
    let properties = json!({
        "timestamp": time(),
        "level": { "type": "integer", "minimum": 0, "maximum": 5 },
        "message": text,
        "name": text,
        "file": text,
        "line": { "type": "integer" },
    });
    named("foxglove.Log", &properties)
}

/// A message with these columns; all except the first may be null.
pub fn columns(name: &'static str, columns: impl Iterator<Item = (&'static str, Kind)>) -> Schema {
    let mut properties = Map::new();
    for (at, (column, kind)) in columns.enumerate() {
        let kind = match kind {
            Kind::Real => "number",
            Kind::Whole => "integer",
            Kind::Text => "string",
        };
        let kind = if at == 0 { json!(kind) } else { json!([kind, "null"]) };
        properties.insert(column.to_owned(), json!({ "type": kind }));
    }
    named(name, &Value::Object(properties))
}
