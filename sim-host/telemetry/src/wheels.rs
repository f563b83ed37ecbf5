//! The travel of the wheels.

use sonarfix_link::message::Odometry;

/// The travel of both wheels while one of them stood still.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wheels {
    last: Option<Odometry>,
    /// Distance that one wheel has rolled since the other last did, metres: right, left.
    alone: [f64; 2],
}

impl Wheels {
    /// Takes the travel of a message.
    pub fn take(&mut self, step: &Odometry) {
        let Some(last) = self.last.replace(*step).filter(|last| last.at <= step.at) else {
            self.alone = [0.0; 2];
            return;
        };
        let right = (step.right_metres - last.right_metres).abs();
        let left = (step.left_metres - last.left_metres).abs();
        let [right_alone, left_alone] = self.alone;
        self.alone = [
            if left > 0.0 { 0.0 } else { right_alone + right },
            if right > 0.0 { 0.0 } else { left_alone + left },
        ];
    }

    /// Distance that one wheel has rolled since the other last did, metres: right, left.
    #[must_use]
    pub fn alone(&self) -> [f64; 2] {
        self.alone
    }
}
