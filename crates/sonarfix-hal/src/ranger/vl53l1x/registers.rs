//! The registers of a VL53L1X that the driver uses, and its settings.

/// Addresses, by ST's names.
pub(super) mod register {
    /// `VHV_CONFIG__TIMEOUT_MACROP_LOOP_BOUND`
    pub const VHV_BOUND: u16 = 0x0008;
    /// `VHV_CONFIG__INIT`
    pub const VHV_INIT: u16 = 0x000B;
    /// `OSC_MEASURED__FAST_OSC__FREQUENCY`, two bytes
    pub const OSCILLATOR: u16 = 0x0006;
    /// `ALGO__PART_TO_PART_RANGE_OFFSET_MM`, two bytes
    pub const RANGE_OFFSET: u16 = 0x001E;
    /// `MM_CONFIG__OUTER_OFFSET_MM`, two bytes
    pub const OUTER_OFFSET: u16 = 0x0022;
    /// `GPIO__TIO_HV_STATUS`; bit 0 is low when a range is ready
    pub const INTERRUPT_STATUS: u16 = 0x0031;
    /// `CAL_CONFIG__VCSEL_START`
    pub const PHASE_START: u16 = 0x0047;
    /// `PHASECAL_CONFIG__TIMEOUT_MACROP`
    pub const PHASE_TIMEOUT: u16 = 0x004B;
    /// `PHASECAL_CONFIG__OVERRIDE`
    pub const PHASE_OVERRIDE: u16 = 0x004D;
    /// `DSS_CONFIG__MANUAL_EFFECTIVE_SPADS_SELECT`, two bytes
    pub const DETECTORS: u16 = 0x0054;
    /// `MM_CONFIG__TIMEOUT_MACROP_A`, two bytes
    pub const MODE_TIMEOUT_A: u16 = 0x005A;
    /// `MM_CONFIG__TIMEOUT_MACROP_B`, two bytes
    pub const MODE_TIMEOUT_B: u16 = 0x005C;
    /// `RANGE_CONFIG__TIMEOUT_MACROP_A`, two bytes
    pub const RANGE_TIMEOUT_A: u16 = 0x005E;
    /// `RANGE_CONFIG__TIMEOUT_MACROP_B`, two bytes
    pub const RANGE_TIMEOUT_B: u16 = 0x0061;
    /// `SYSTEM__INTERRUPT_CLEAR`
    pub const INTERRUPT_CLEAR: u16 = 0x0086;
    /// `SYSTEM__MODE_START`
    pub const MODE_START: u16 = 0x0087;
    /// `RESULT__RANGE_STATUS`, and 16 bytes after it
    pub const RESULT: u16 = 0x0089;
    /// `PHASECAL_RESULT__VCSEL_START`
    pub const PHASE_RESULT: u16 = 0x00D8;
    /// `FIRMWARE__SYSTEM_STATUS`; bit 0 is high when it has booted
    pub const FIRMWARE_STATUS: u16 = 0x00E5;
    /// `IDENTIFICATION__MODEL_ID`, two bytes
    pub const MODEL_ID: u16 = 0x010F;

    /// Value of [`MODE_START`] for one range.
    pub const SINGLE_SHOT: u8 = 0x10;
}

/// The long mode, with the defaults of ST's driver: register and value.
pub(super) const SETTINGS: [(u16, u8); 33] = [
    (0x002E, 0x01), // PAD_I2C_HV__EXTSUP_CONFIG: supply of the pins 2.8 V
    (0x0024, 0x0A), // DSS_CONFIG__TARGET_TOTAL_RATE_MCPS
    (0x0025, 0x00),
    (0x0031, 0x02), // GPIO__TIO_HV_STATUS
    (0x0036, 0x08), // SIGMA_ESTIMATOR__EFFECTIVE_PULSE_WIDTH_NS
    (0x0037, 0x10), // SIGMA_ESTIMATOR__EFFECTIVE_AMBIENT_WIDTH_NS
    (0x0039, 0x01), // ALGO__CROSSTALK_COMPENSATION_VALID_HEIGHT_MM
    (0x003E, 0xFF), // ALGO__RANGE_IGNORE_VALID_HEIGHT_MM
    (0x003F, 0x00), // ALGO__RANGE_MIN_CLIP
    (0x0040, 0x02), // ALGO__CONSISTENCY_CHECK__TOLERANCE
    (0x0050, 0x00), // SYSTEM__THRESH_RATE_HIGH
    (0x0051, 0x00),
    (0x0057, 0x38), // DSS_CONFIG__APERTURE_ATTENUATION
    (0x0064, 0x01), // RANGE_CONFIG__SIGMA_THRESH: 360
    (0x0065, 0x68),
    (0x0066, 0x00), // RANGE_CONFIG__MIN_COUNT_RATE_RTN_LIMIT_MCPS: 192
    (0x0067, 0xC0),
    (0x0071, 0x01), // SYSTEM__GROUPED_PARAMETER_HOLD_0
    (0x007C, 0x01), // SYSTEM__GROUPED_PARAMETER_HOLD_1
    (0x007E, 0x02), // SD_CONFIG__QUANTIFIER
    (0x0082, 0x00), // SYSTEM__GROUPED_PARAMETER_HOLD
    (0x0077, 0x01), // SYSTEM__SEED_CONFIG
    (0x0081, 0x8B), // SYSTEM__SEQUENCE_CONFIG: VHV, PHASECAL, DSS1, RANGE
    (0x0054, 0xC8), // DSS_CONFIG__MANUAL_EFFECTIVE_SPADS_SELECT: 200
    (0x0055, 0x00),
    (0x004F, 0x02), // DSS_CONFIG__ROI_MODE_CONTROL: that many detectors
    (0x0060, 0x0F), // RANGE_CONFIG__VCSEL_PERIOD_A
    (0x0063, 0x0D), // RANGE_CONFIG__VCSEL_PERIOD_B
    (0x0069, 0xB8), // RANGE_CONFIG__VALID_PHASE_HIGH
    (0x0078, 0x0F), // SD_CONFIG__WOI_SD0
    (0x0079, 0x0D), // SD_CONFIG__WOI_SD1
    (0x007A, 0x0E), // SD_CONFIG__INITIAL_PHASE_SD0
    (0x007B, 0x0E), // SD_CONFIG__INITIAL_PHASE_SD1
];
