// The boards with this chip: which pin is which part, and the robot around it, as in docs/firmware.md and docs/xrp.md.

/** The counts of both channels of a PWM slice, and those of a period; null while it does not run. */
function counts(chip, slice) {
  const { csr, cc, top } = chip.rp2040.pwm.channels[slice];
  return csr & 1 ? { a: cc & 0xffff, b: cc >>> 16, period: top + 1 } : null;
}

const pico = {
  pins: { right: [2, 3], left: [4, 5], sonars: [{ trigger: 7, echo: 8 }, { trigger: 16, echo: 17 }] },
  /** Slices of the PWM. */
  slices: { servo: 3, right: 5, left: 6 },
  /** The wheel whose encoder counts backwards. */
  mirrored: 1,
  robot: {},
  isEnabled: (chip) => chip.isHigh(9),
  /** The voltages of the right and the left motor as parts of the full one: two inputs each. */
  voltages: (chip) => [5, 6].map((slice) => {
    const it = counts(chip, slice);
    return it ? (it.a - it.b) / it.period : 0;
  }),
};

const GPIO_PWM = 4;

const xrp = {
  pins: { right: [12, 13], left: [4, 5], sonars: [{ trigger: 20, echo: 21 }], clock: 19, data: 18 },
  slices: { servo: 0, right: 7, left: 3 },
  mirrored: 0,
  // Wheels of 60 mm, 585 edges, 155 mm between them, 120 turns a minute.
  robot: {
    track: 0.1575,
    edge: [1.008, 0.994].map((scale) => (scale * Math.PI * 0.06) / 585),
    speed: 0.35,
  },
  /** The inputs of the motor drivers are those of the PWM, and are not overridden. */
  isEnabled: (chip) => [14, 15, 6, 7].every((pin) => {
    const { functionSelect, outputOverride } = chip.rp2040.gpio[pin];
    return functionSelect === GPIO_PWM && outputOverride === 0;
  }),
  /** Phase and enable: the left motor turns forwards while its phase is high, the right one while it is low. */
  voltages: (chip) => [7, 3].map((slice, side) => {
    const it = counts(chip, slice);
    if (!it) return 0;
    if (it.a !== 0 && it.a < it.period) throw new Error('the phase of a motor changes within a period');
    return ((it.a > 0) === (side === 1) ? 1 : -1) * (it.b / it.period);
  }),
};

export const WIRINGS = { pico, xrp };
