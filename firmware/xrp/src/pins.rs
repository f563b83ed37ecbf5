//! The wiring of an XRP robot with the board of the beta kit, whose controller is a Raspberry Pi Pico W. Sources are in `docs/xrp.md`.
//!
//! | | for | pins | connector |
//! |---|---|---|---|
//! | PIO0 | right and left encoder, a state machine each | GP12 GP13, GP4 GP5 | Motor R, Motor L |
//! | PIO1 | the stamps of the edges of the echoes, 1 µs, a state machine each | GP21, GP9 | Range, Motor 4 |
//! | PWM slice 0 | the pulses of the servos | GP16, GP17 | Servo 1, Servo 2 |
//! | PWM slices 7 and 3 | phase and enable of right and left motor, 20 kHz | GP14 GP15, GP6 GP7 | Motor R, Motor L |
//! | UART0 | the link, 115,200 baud | GP0 GP1 | Motor 3 |
//! | | the triggers | GP20, GP8 | Range, Motor 4 |
//! | | the buses, clock and data; the gyro is on the first | GP19 GP18, GP27 GP26 | Qwiic, Line |

use sonarfix_motors::Drive;
use sonarfix_motors::commanded::GearMotor;

pub use sonarfix_hal::gyro::Lsm6dso as Gyro;

/// The peripherals of a part.
macro_rules! part {
    ($of:ident.right_encoder) => {
        ($of.PIN_12, $of.PIN_13)
    };
    ($of:ident.left_encoder) => {
        ($of.PIN_4, $of.PIN_5)
    };
    ($of:ident.servos) => {{
        let servos = Pwm::new_output_ab($of.PWM_SLICE0, $of.PIN_16, $of.PIN_17, servo_pulses());
        <[_; 2]>::from(servos.split())
    }};
    ($of:ident.right_motor) => {
        ($of.PWM_SLICE7, $of.PIN_14, $of.PIN_15)
    };
    ($of:ident.left_motor) => {
        ($of.PWM_SLICE3, $of.PIN_6, $of.PIN_7)
    };
    ($of:ident.enable) => {
        pins::INPUTS
    };
    ($of:ident.triggers) => {
        ($of.PIN_20, $of.PIN_8)
    };
    ($of:ident.echoes) => {
        ($of.PIN_21, $of.PIN_9)
    };
    ($of:ident.buses) => {
        [bus($of.PIN_19, $of.PIN_18), bus($of.PIN_27, $of.PIN_26)]
    };
    ($of:ident.link) => {
        ($of.UART0, $of.PIN_0, $of.PIN_1)
    };
}

/// Number of the pin of received bytes.
pub const RECEIVES: usize = 1;
/// Numbers of the inputs of the motor drivers.
pub const INPUTS: [usize; 4] = [14, 15, 6, 7];
pub const MOTOR: GearMotor = GearMotor::XRP;

/// The counts of both channels of each motor's slice; `full` is a period. Channel A is the phase, B the enable. The motors are mirror
/// images of each other: the left one turns forwards while its phase is high, the right one while it is low.
pub fn inputs(drive: Drive, full: u16) -> [[u16; 2]; 2] {
    let [right_ahead, right_back, left_ahead, left_back] = drive.inputs(full);
    let phase = |driven: u16| if driven > 0 { full } else { 0 };
    [
        [phase(right_back), right_ahead.max(right_back)],
        [phase(left_ahead), left_ahead.max(left_back)],
    ]
}
