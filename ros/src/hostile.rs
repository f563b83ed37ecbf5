//! Bytes that are no messages, from a seed, for tests and measurements: random ones, and messages with bytes changed, removed and
//! added.

use serde::Serialize;
use serde::de::DeserializeOwned;
use sonarfix_ros_messages::cdr;
use sonarfix_ros_messages::messages::{
    Imu, JointState, LaserScan, OccupancyGrid, Odometry, PoseWithCovarianceStamped, RangeHeard,
    TFMessage, TransformStamped,
};

use crate::node::Input;

/// A generator of random numbers (xorshift64*).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator with a seed other than zero.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16
    }

    fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % (end.max(1) as u64)).unwrap_or(0)
    }

    #[expect(clippy::cast_possible_truncation, reason = "a random byte")]
    fn byte(&mut self) -> u8 {
        // Zeros and ones: lengths and numbers that are almost right.
        match self.next() % 4 {
            0 => 0,
            1 => 255,
            _ => self.next() as u8,
        }
    }

    /// Random bytes, or a message with some of its bytes changed, cut off or added.
    pub fn bytes(&mut self, message: &[u8]) -> Vec<u8> {
        if self.next().is_multiple_of(4) {
            let length = self.below(300);
            let mut bytes: Vec<u8> = (0..length).map(|_| self.byte()).collect();
            if let Some(head) = bytes.get_mut(..4) {
                head.copy_from_slice(&[0, 1, 0, 0]);
            }
            return bytes;
        }
        let mut bytes = message.to_vec();
        for _ in 0..=self.below(6) {
            let place = self.below(bytes.len());
            let byte = self.byte();
            if let Some(at) = bytes.get_mut(place) {
                *at = byte;
            }
        }
        match self.next() % 4 {
            0 => bytes.truncate(self.below(message.len())),
            1 => bytes.extend((0..self.below(40)).map(|_| 255)),
            _ => {}
        }
        bytes
    }
}

/// A subscription as it is attacked: its name, a right message, and how the bytes become an input.
pub struct Target {
    /// The type of its messages.
    pub name: &'static str,
    /// The bytes of a right message.
    pub message: Vec<u8>,
    /// The input of these bytes, if they are a message.
    pub decode: fn(&[u8]) -> Option<Input>,
}

fn target<T: Serialize + DeserializeOwned>(
    name: &'static str,
    message: &T,
    decode: fn(&[u8]) -> Option<Input>,
) -> Target {
    Target { name, message: cdr::write(message).unwrap_or_default(), decode }
}

/// All subscriptions of the node.
#[must_use]
pub fn targets() -> Vec<Target> {
    let scan = LaserScan { ranges: vec![1.0; 30], angle_increment: 0.1, ..LaserScan::default() };
    let names = ["right_wheel_joint", "left_wheel_joint"].map(str::to_owned).into();
    let joints = JointState { name: names, position: vec![0.0; 2], ..JointState::default() };
    let transforms = TFMessage { transforms: vec![TransformStamped::default(); 2] };
    let mut grid = OccupancyGrid { data: vec![100; 64], ..OccupancyGrid::default() };
    (grid.info.width, grid.info.height, grid.info.resolution) = (8, 8, 0.5);
    vec![
        target("Odometry", &Odometry::default(), |bytes| {
            Some(Input::Odometry(cdr::read(bytes).ok()?))
        }),
        target("JointState", &joints, |bytes| Some(Input::Joints(cdr::read(bytes).ok()?))),
        target("Range", &RangeHeard::default(), |bytes| {
            Some(Input::Range(0, cdr::read(bytes).ok()?))
        }),
        target("LaserScan", &scan, |bytes| Some(Input::Scan(cdr::read(bytes).ok()?))),
        target("Imu", &Imu::default(), |bytes| Some(Input::Imu(cdr::read(bytes).ok()?))),
        target("TFMessage", &transforms, |bytes| Some(Input::Transforms(cdr::read(bytes).ok()?))),
        target("OccupancyGrid", &grid, |bytes| Some(Input::Map(cdr::read(bytes).ok()?))),
        target("PoseWithCovarianceStamped", &PoseWithCovarianceStamped::default(), |bytes| {
            Some(Input::InitialPose(cdr::read(bytes).ok()?))
        }),
    ]
}
