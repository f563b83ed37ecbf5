//! The registers of a VL53L0X that the driver uses, and its tuning.

/// Addresses and values, by ST's names where it has published one. The registers are in pages; these are in the first, where
/// nothing else is said.
pub(super) mod register {
    /// `SYSRANGE_START`
    pub const START: u8 = 0x00;
    /// `SYSTEM_SEQUENCE_CONFIG`: the steps of a range
    pub const SEQUENCE: u8 = 0x01;
    /// `SYSTEM_INTERRUPT_CONFIG_GPIO`
    pub const INTERRUPT_CONFIG: u8 = 0x0A;
    /// `SYSTEM_INTERRUPT_CLEAR`
    pub const INTERRUPT_CLEAR: u8 = 0x0B;
    /// `RESULT_INTERRUPT_STATUS`; its lowest three bits are not 0 when a range is ready
    pub const INTERRUPT_STATUS: u8 = 0x13;
    /// `RESULT_RANGE_STATUS`, and 11 bytes after it
    pub const RESULT: u8 = 0x14;
    /// `FINAL_RANGE_CONFIG_MIN_COUNT_RATE_RTN_LIMIT`, 128ths of a million counts a second, two bytes
    pub const LIMIT_HIGH: u8 = 0x44;
    pub const LIMIT_LOW: u8 = 0x45;
    /// `MSRC_CONFIG_CONTROL`
    pub const MSRC_CONTROL: u8 = 0x60;
    /// `FINAL_RANGE_CONFIG_TIMEOUT_MACROP_HI` and `_LO`
    pub const FINE_TIMEOUT: u8 = 0x71;
    pub const FINE_TIMEOUT_LOW: u8 = 0x72;
    /// Pages 6 and 7: asks for a number of the sensor's own memory, and is not 0 when it is read
    pub const STROBE: u8 = 0x83;
    /// `GPIO_HV_MUX_ACTIVE_HIGH`
    pub const INTERRUPT_LEVEL: u8 = 0x84;
    /// `VHV_CONFIG_PAD_SCL_SDA__EXTSUP_HV`
    pub const SUPPLY: u8 = 0x89;
    /// Page 1: the value that ends a range
    pub const STOP: u8 = 0x91;
    /// Page 7: the number of reference detectors, and in bit 7 whether they are apertures
    pub const DETECTORS: u8 = 0x92;
    /// `GLOBAL_CONFIG_SPAD_ENABLES_REF_0` to `_5`
    pub const DETECTOR_MAP: u8 = 0xB0;
    /// `IDENTIFICATION_MODEL_ID`
    pub const MODEL_ID: u8 = 0xC0;
    /// The page of the other registers
    pub const PAGE: u8 = 0xFF;

    /// Value of [`START`] for one range, and for a calibration of the voltage.
    pub const SINGLE_SHOT: u8 = 0x01;
    pub const CALIBRATE_VOLTAGE: u8 = 0x41;
    /// Values of [`SEQUENCE`]: selection of detectors, coarse and fine range; and one calibration.
    pub const RANGE_STEPS: u8 = 0xE8;
    pub const VOLTAGE_ONLY: u8 = 0x01;
    pub const PHASE_ONLY: u8 = 0x02;
    /// Value of [`INTERRUPT_CONFIG`]: when a range is ready.
    pub const RANGE_READY: u8 = 0x04;
}

/// Values of [`TUNING`] that are written in one step of the set-up.
pub(super) const PART: usize = 14;

/// ST's tuning (`DefaultTuningSettings` of its driver): register and value.
pub(super) const TUNING: [(u8, u8); 80] = [
    (0xFF, 0x01), // page 1
    (0x00, 0x00),
    (0xFF, 0x00), // page 0
    (0x09, 0x00), // SYSTEM_RANGE_CONFIG
    (0x10, 0x00),
    (0x11, 0x00),
    (0x24, 0x01),
    (0x25, 0xFF),
    (0x75, 0x00),
    (0xFF, 0x01), // page 1
    (0x4E, 0x2C), // DYNAMIC_SPAD_NUM_REQUESTED_REF_SPAD
    (0x48, 0x00),
    (0x30, 0x20), // ALGO_PHASECAL_LIM
    (0xFF, 0x00), // page 0
    (0x30, 0x09), // ALGO_PHASECAL_CONFIG_TIMEOUT
    (0x54, 0x00),
    (0x31, 0x04),
    (0x32, 0x03), // GLOBAL_CONFIG_VCSEL_WIDTH
    (0x40, 0x83),
    (0x46, 0x25), // MSRC_CONFIG_TIMEOUT_MACROP
    (0x60, 0x00), // MSRC_CONFIG_CONTROL
    (0x27, 0x00),
    (0x50, 0x06), // PRE_RANGE_CONFIG_VCSEL_PERIOD: 14 clocks
    (0x51, 0x00), // PRE_RANGE_CONFIG_TIMEOUT_MACROP
    (0x52, 0x96),
    (0x56, 0x08), // PRE_RANGE_CONFIG_VALID_PHASE_LOW
    (0x57, 0x30), // PRE_RANGE_CONFIG_VALID_PHASE_HIGH
    (0x61, 0x00), // PRE_RANGE_CONFIG_SIGMA_THRESH
    (0x62, 0x00),
    (0x64, 0x00), // PRE_RANGE_MIN_COUNT_RATE_RTN_LIMIT
    (0x65, 0x00),
    (0x66, 0xA0),
    (0xFF, 0x01), // page 1
    (0x22, 0x32),
    (0x47, 0x14),
    (0x49, 0xFF),
    (0x4A, 0x00),
    (0xFF, 0x00), // page 0
    (0x7A, 0x0A),
    (0x7B, 0x00),
    (0x78, 0x21),
    (0xFF, 0x01), // page 1
    (0x23, 0x34),
    (0x42, 0x00),
    (0x44, 0xFF),
    (0x45, 0x26),
    (0x46, 0x05),
    (0x40, 0x40),
    (0x0E, 0x06),
    (0x20, 0x1A),
    (0x43, 0x40),
    (0xFF, 0x00), // page 0
    (0x34, 0x03),
    (0x35, 0x44),
    (0xFF, 0x01), // page 1
    (0x31, 0x04),
    (0x4B, 0x09),
    (0x4C, 0x05),
    (0x4D, 0x04),
    (0xFF, 0x00), // page 0
    (0x44, 0x00), // FINAL_RANGE_CONFIG_MIN_COUNT_RATE_RTN_LIMIT: 0.25
    (0x45, 0x20),
    (0x47, 0x08), // FINAL_RANGE_CONFIG_VALID_PHASE_LOW
    (0x48, 0x28), // FINAL_RANGE_CONFIG_VALID_PHASE_HIGH
    (0x67, 0x00),
    (0x70, 0x04), // FINAL_RANGE_CONFIG_VCSEL_PERIOD: 10 clocks
    (0x71, 0x01), // FINAL_RANGE_CONFIG_TIMEOUT_MACROP
    (0x72, 0xFE),
    (0x76, 0x00),
    (0x77, 0x00),
    (0xFF, 0x01), // page 1
    (0x0D, 0x01),
    (0xFF, 0x00), // page 0
    (0x80, 0x01),
    (0x01, 0xF8), // SYSTEM_SEQUENCE_CONFIG
    (0xFF, 0x01), // page 1
    (0x8E, 0x01),
    (0x00, 0x01),
    (0xFF, 0x00), // page 0
    (0x80, 0x00),
];
