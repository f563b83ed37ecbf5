//! The messages, with the fields, their order and the names of ROS's definitions. Units are SI, as there.

#![expect(missing_docs, reason = "the fields are those of ROS's definitions")]

use serde::{Deserialize, Serialize};

use crate::schema::{Definition, Field, Message};

macro_rules! messages {
    ($($package:ident / $name:ident { $($field:ident: $type:ty),* $(,)? })*) => { $(
        #[doc = concat!("`", stringify!($package), "/msg/", stringify!($name), "`.")]
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        pub struct $name { $(pub $field: $type),* }

        impl Field for $name {
            fn name() -> String {
                format!("{}/{}", Self::PACKAGE, Self::NAME)
            }

            fn messages(known: &mut Vec<Definition>) {
                let name = <Self as Field>::name();
                $(<$type as Field>::messages(known);)*
                if !known.iter().any(|known| known.name == name) {
                    let field = |kind: String, field: &str| {
                        format!("{kind} {}", field.trim_start_matches("r#"))
                    };
                    let fields = vec![$(field(<$type as Field>::name(), stringify!($field))),*];
                    known.push(Definition { name, fields });
                }
            }
        }

        impl Message for $name {
            const PACKAGE: &'static str = stringify!($package);
            const NAME: &'static str = stringify!($name);
        }
    )* };
}

/// A covariance of x, y, z, roll, pitch and yaw, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Covariance(pub [[f64; 6]; 6]);

impl Field for Covariance {
    fn name() -> String {
        "float64[36]".to_owned()
    }
}

/// A `Range` up to the field that ROS's Jazzy has appended: what is read of one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RangeHeard {
    pub header: Header,
    pub radiation_type: u8,
    pub field_of_view: f32,
    pub min_range: f32,
    pub max_range: f32,
    pub range: f32,
}

messages! {
    builtin_interfaces / Time { sec: i32, nanosec: u32 }
    builtin_interfaces / Duration { sec: i32, nanosec: u32 }
    std_msgs / Header { stamp: Time, frame_id: String }
    std_msgs / ColorRGBA { r: f32, g: f32, b: f32, a: f32 }
    rosgraph_msgs / Clock { clock: Time }
    geometry_msgs / Point { x: f64, y: f64, z: f64 }
    geometry_msgs / Vector3 { x: f64, y: f64, z: f64 }
    geometry_msgs / Quaternion { x: f64, y: f64, z: f64, w: f64 }
    geometry_msgs / Pose { position: Point, orientation: Quaternion }
    geometry_msgs / Twist { linear: Vector3, angular: Vector3 }
    geometry_msgs / Transform { translation: Vector3, rotation: Quaternion }
    geometry_msgs / PoseWithCovariance { pose: Pose, covariance: Covariance }
    geometry_msgs / TwistWithCovariance { twist: Twist, covariance: Covariance }
    geometry_msgs / PoseWithCovarianceStamped { header: Header, pose: PoseWithCovariance }
    geometry_msgs / TransformStamped { header: Header, child_frame_id: String, transform: Transform }
    tf2_msgs / TFMessage { transforms: Vec<TransformStamped> }
    nav_msgs / Odometry {
        header: Header,
        child_frame_id: String,
        pose: PoseWithCovariance,
        twist: TwistWithCovariance,
    }
    nav_msgs / MapMetaData {
        map_load_time: Time,
        resolution: f32,
        width: u32,
        height: u32,
        origin: Pose,
    }
    nav_msgs / OccupancyGrid { header: Header, info: MapMetaData, data: Vec<i8> }
    nav2_msgs / Particle { pose: Pose, weight: f64 }
    nav2_msgs / ParticleCloud { header: Header, particles: Vec<Particle> }
    sensor_msgs / JointState {
        header: Header,
        name: Vec<String>,
        position: Vec<f64>,
        velocity: Vec<f64>,
        effort: Vec<f64>,
    }
    sensor_msgs / Range {
        header: Header,
        radiation_type: u8,
        field_of_view: f32,
        min_range: f32,
        max_range: f32,
        range: f32,
        variance: f32,
    }
    sensor_msgs / Imu {
        header: Header,
        orientation: Quaternion,
        orientation_covariance: [f64; 9],
        angular_velocity: Vector3,
        angular_velocity_covariance: [f64; 9],
        linear_acceleration: Vector3,
        linear_acceleration_covariance: [f64; 9],
    }
    sensor_msgs / LaserScan {
        header: Header,
        angle_min: f32,
        angle_max: f32,
        angle_increment: f32,
        time_increment: f32,
        scan_time: f32,
        range_min: f32,
        range_max: f32,
        ranges: Vec<f32>,
        intensities: Vec<f32>,
    }
    sensor_msgs / CompressedImage { header: Header, format: String, data: Vec<u8> }
    diagnostic_msgs / KeyValue { key: String, value: String }
    diagnostic_msgs / DiagnosticStatus {
        level: u8,
        name: String,
        message: String,
        hardware_id: String,
        values: Vec<KeyValue>,
    }
    diagnostic_msgs / DiagnosticArray { header: Header, status: Vec<DiagnosticStatus> }
    visualization_msgs / UVCoordinate { u: f32, v: f32 }
    visualization_msgs / MeshFile { filename: String, data: Vec<u8> }
    visualization_msgs / Marker {
        header: Header,
        ns: String,
        id: i32,
        r#type: i32,
        action: i32,
        pose: Pose,
        scale: Vector3,
        color: ColorRGBA,
        lifetime: Duration,
        frame_locked: bool,
        points: Vec<Point>,
        colors: Vec<ColorRGBA>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UVCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }
    visualization_msgs / MarkerArray { markers: Vec<Marker> }
    bond / Status {
        header: Header,
        id: String,
        instance_id: String,
        active: bool,
        heartbeat_timeout: f32,
        heartbeat_period: f32,
    }
}

impl Time {
    /// Nanoseconds since the clock's zero.
    #[must_use]
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// The time of so many nanoseconds; one beyond the range of seconds in 32 bits is the nearest in it.
    #[must_use]
    pub fn of_nanoseconds(nanoseconds: i64) -> Self {
        let sec = nanoseconds.div_euclid(1_000_000_000);
        let limit = if sec < 0 { i32::MIN } else { i32::MAX };
        let nanosec = u32::try_from(nanoseconds.rem_euclid(1_000_000_000)).unwrap_or(0);
        Self { sec: i32::try_from(sec).unwrap_or(limit), nanosec }
    }
}
