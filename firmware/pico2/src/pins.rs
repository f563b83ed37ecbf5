//! The wiring of a Raspberry Pi Pico or Pico 2. Its table is in `docs/firmware.md`.
//!
//! | | for | pins |
//! |---|---|---|
//! | PIO0 | right and left encoder, a state machine each | GP2 GP3, GP4 GP5 |
//! | PIO1 | the stamps of the edges of both echoes, 1 µs, a state machine each | GP8, GP17 |
//! | PWM slices 3 and 1, channel A | the pulses of the servos of both rangers | GP6, GP18 |
//! | PWM slices 5 and 6 | the inputs of the motor driver, right and left motor, 20 kHz | GP10 GP11, GP12 GP13 |
//! | UART0 | the link, 115,200 baud | GP0 GP1 |
//! | | the triggers of both rangers; high while the robot may drive | GP7, GP16; GP9 |
//! | | the buses of both rangers, clock and data, for light; the gyro is on the first | GP15 GP14, GP21 GP20 |

use sonarfix_motors::Drive;
use sonarfix_motors::commanded::GearMotor;

pub use sonarfix_hal::gyro::Mpu6050 as Gyro;

/// The peripherals of a part.
macro_rules! part {
    ($of:ident.right_encoder) => {
        ($of.PIN_2, $of.PIN_3)
    };
    ($of:ident.left_encoder) => {
        ($of.PIN_4, $of.PIN_5)
    };
    ($of:ident.servos) => {
        [
            Pwm::new_output_a($of.PWM_SLICE3, $of.PIN_6, servo_pulses()).split().0,
            Pwm::new_output_a($of.PWM_SLICE1, $of.PIN_18, servo_pulses()).split().0,
        ]
    };
    ($of:ident.right_motor) => {
        ($of.PWM_SLICE5, $of.PIN_10, $of.PIN_11)
    };
    ($of:ident.left_motor) => {
        ($of.PWM_SLICE6, $of.PIN_12, $of.PIN_13)
    };
    ($of:ident.enable) => {
        $of.PIN_9
    };
    ($of:ident.triggers) => {
        ($of.PIN_7, $of.PIN_16)
    };
    ($of:ident.echoes) => {
        ($of.PIN_8, $of.PIN_17)
    };
    ($of:ident.buses) => {
        [bus($of.PIN_15, $of.PIN_14), bus($of.PIN_21, $of.PIN_20)]
    };
    ($of:ident.link) => {
        ($of.UART0, $of.PIN_0, $of.PIN_1)
    };
}

/// Number of the pin of received bytes.
pub const RECEIVES: usize = 1;
/// Number of the pin that is high while the robot may drive.
pub const ENABLE: usize = 9;
pub const MOTOR: GearMotor = GearMotor::USUAL;

/// The counts of both channels of each motor's slice; `full` is a period. Channel A drives forwards.
pub fn inputs(drive: Drive, full: u16) -> [[u16; 2]; 2] {
    let [right_1, right_2, left_1, left_2] = drive.inputs(full);
    [[right_1, right_2], [left_1, left_2]]
}
