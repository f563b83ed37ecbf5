//! The wiring of an XRP robot with the board that has an RP2350. Sources are in `docs/xrp.md`.
//!
//! | | for | pins | connector |
//! |---|---|---|---|
//! | PIO0 | right and left encoder, a state machine each | GPIO24 GPIO25, GPIO30 GPIO31 | Motor R, Motor L |
//! | PIO1 | the stamps of the edges of the echoes, 1 µs, a state machine each | GPIO1, GPIO15 | DIST, header |
//! | PWM slice 3 | the pulses of the servos | GPIO6, GPIO7 | Servo 1, Servo 3 |
//! | PWM slices 8 and 9 | the inputs of the motor drivers, right and left motor, 20 kHz | GPIO32 GPIO33, GPIO34 GPIO35 | Motor R, Motor L |
//! | UART0 | the link, 115,200 baud | GPIO12 GPIO13 | header |
//! | | the triggers | GPIO0, GPIO14 | DIST, header |
//! | | the buses, clock and data; the gyro is on the first | GPIO39 GPIO38, GPIO5 GPIO4 | Qwiic 1, Qwiic 0 |

use sonarfix_motors::Drive;
use sonarfix_motors::commanded::GearMotor;

pub use sonarfix_hal::gyro::Lsm6dso as Gyro;

/// The peripherals of a part.
macro_rules! part {
    ($of:ident.right_encoder) => {
        ($of.PIN_24, $of.PIN_25)
    };
    ($of:ident.left_encoder) => {
        ($of.PIN_30, $of.PIN_31)
    };
    ($of:ident.servos) => {{
        let servos = Pwm::new_output_ab($of.PWM_SLICE3, $of.PIN_6, $of.PIN_7, servo_pulses());
        <[_; 2]>::from(servos.split())
    }};
    ($of:ident.right_motor) => {
        ($of.PWM_SLICE8, $of.PIN_32, $of.PIN_33)
    };
    ($of:ident.left_motor) => {
        ($of.PWM_SLICE9, $of.PIN_34, $of.PIN_35)
    };
    ($of:ident.enable) => {
        pins::INPUTS
    };
    ($of:ident.triggers) => {
        ($of.PIN_0, $of.PIN_14)
    };
    ($of:ident.echoes) => {
        ($of.PIN_1, $of.PIN_15)
    };
    ($of:ident.buses) => {
        [bus($of.PIN_39, $of.PIN_38), bus($of.PIN_5, $of.PIN_4)]
    };
    ($of:ident.link) => {
        ($of.UART0, $of.PIN_12, $of.PIN_13)
    };
}

/// Number of the pin of received bytes.
pub const RECEIVES: usize = 13;
/// Numbers of the inputs of the motor drivers.
pub const INPUTS: [usize; 4] = [32, 33, 34, 35];
pub const MOTOR: GearMotor = GearMotor::XRP;

/// The counts of both channels of each motor's slice; `full` is a period. The motors are mirror images of each other: the left one turns
/// forwards by channel A, the right one by B.
pub fn inputs(drive: Drive, full: u16) -> [[u16; 2]; 2] {
    let [right_ahead, right_back, left_ahead, left_back] = drive.inputs(full);
    [[right_back, right_ahead], [left_ahead, left_back]]
}
