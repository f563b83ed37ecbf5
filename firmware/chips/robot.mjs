// What is around a board: a robot in its room, what has happened, and the truth. Times in nanoseconds since power-on.
import { Room, STEP } from './room.mjs';

/** How long the truth is kept: longer than a message waits. */
const HISTORY = 10e9;

export class Robot {
  constructor({ walls, pose, second }, random, wiring) {
    this.wiring = wiring;
    this.room = new Room(walls, pose, random, wiring, second);
    /** Time at which the present life of the chip began. */
    this.began = 0;
    /** The next step of the room. */
    this.next = STEP;
    this.events = [];
    this.truth = [];
    this.isEnabled = false;
    /** When a motor last had a voltage, and when an encoder last changed. */
    this.poweredAt = 0;
    this.rolledAt = 0;
  }

  setEnabled(isEnabled, now) {
    if (isEnabled === this.isEnabled) return;
    this.isEnabled = isEnabled;
    this.events.push(`${isEnabled ? 'enabled' : 'disabled'} ${now}`);
  }

  /** The sonar on the servo. */
  get sonar() {
    return this.room.sonars[0];
  }

  /** The room moves on by a step, with these voltages of the motors and this width of the servo's pulses; returns whether an encoder has changed. */
  step(voltages, pulse) {
    const { room } = this;
    const now = this.next;
    this.next += STEP;
    const before = room.counts;
    if (voltages.some((voltage) => voltage)) this.poweredAt = now;
    room.move(voltages, this.target(pulse));
    const hasRolled = before.some((count, side) => count !== room.counts[side]);
    if (hasRolled) this.rolledAt = now;
    this.truth.push([now - this.began, room.x, room.y, room.heading]);
    if (this.truth.length > HISTORY / STEP) this.truth.splice(0, this.truth.length / 2);
    return hasRolled;
  }

  /** Where the servo's pulses point, whose width is in microseconds: 45° at 2 ms, −45° at 1 ms. */
  target(pulse) {
    return pulse > 400 ? ((pulse - 1500) / 500) * (Math.PI / 4) : this.room.bearing;
  }

  /** The chip is reset: its pins are inputs, and pull-downs disable the motors. */
  endLife(cause, now) {
    this.setEnabled(false, now);
    this.events.push(`reset-by-${cause} ${now}`);
    this.truth = [];
  }

  /** The pose at a time of the chip's clock. */
  poseAt(nanos) {
    const first = this.truth[0]?.[0] ?? 0;
    return this.truth[Math.max(0, Math.min(this.truth.length - 1, Math.round((nanos - first) / STEP)))];
  }
}
