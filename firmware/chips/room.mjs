// What is around the board: wheels with motors and encoders, a sonar on a servo, perhaps a fixed one, and a room. Metres, radians, seconds, nanoseconds where it says so.

/** How often wheels and servo move on, nanoseconds: at 0.5 m/s a wheel turns by a third of an edge meanwhile. */
export const STEP = 100e3;
const SPEED_OF_SOUND = 343.4;
/** From the end of the trigger to the burst of an HC-SR04, and its pulse without an echo, nanoseconds. */
const BURST = 460e3;
const NO_ECHO = 38e6;

/** The usual robot as it is, beside what its robot file says: wheels, track width and speed of sound are a little different. */
const ROBOT = {
  track: 0.1234,
  edge: [1.008, 0.994].map((scale) => (scale * Math.PI * 0.065) / 1496.6),
  mount: [0.06, 0],
  /** Speed at full voltage, and the time in which a wheel reaches it. */
  speed: 0.5,
  lag: 0.08,
  servo: (500 * Math.PI) / 180,
  cone: (12 * Math.PI) / 180,
  range: 4,
  noise: 0.003,
};

/** Numbers below 1 that are the same in each run (mulberry32). */
export function numbers(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** A sonar of the robot: on the servo, or at a fixed bearing. */
class Sonar {
  /** `mount`: where it is, ahead and to the left. */
  constructor(room, mount, bearing = null) {
    Object.assign(this, { room, mount, bearing });
    this.pings = 0;
    this.busyUntil = 0;
    this.shortTriggers = 0;
    this.triggeredAt = null;
    /** Edges of the echo that are to come: time and level. */
    this.edges = [];
  }

  /** The trigger has changed, at a time in nanoseconds. */
  trigger(isHigh, now) {
    if (isHigh) {
      this.triggeredAt = now;
      return;
    }
    if (this.triggeredAt === null) return;
    const isLong = now - this.triggeredAt >= 10e3;
    this.triggeredAt = null;
    if (!isLong) this.shortTriggers++;
    if (!isLong || now < this.busyUntil) return;
    this.pings++;
    const range = this.range();
    const { random, robot } = this.room;
    const noise = robot.noise * Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
    const pulse = range === null ? NO_ECHO : (2e9 * (range + noise)) / SPEED_OF_SOUND;
    this.busyUntil = now + BURST + pulse;
    this.edges.push({ at: now + BURST, isHigh: true }, { at: this.busyUntil, isHigh: false });
  }

  /** The distance of what is nearest in the cone and in sight: a wall that is square to the beam, or a corner of two walls. */
  range() {
    const { room, mount: [ahead, left] } = this;
    const [cos, sin] = [Math.cos(room.heading), Math.sin(room.heading)];
    const [x, y] = [room.x + ahead * cos - left * sin, room.y + ahead * sin + left * cos];
    const beam = room.heading + (this.bearing ?? room.bearing);
    const distances = [...room.feet(x, y), ...room.corners(x, y)].flatMap(({ at, walls }) => {
      const [dx, dy] = [at[0] - x, at[1] - y];
      const distance = Math.hypot(dx, dy);
      const off = Math.atan2(dy, dx) - beam;
      const isHeard = Math.abs(Math.atan2(Math.sin(off), Math.cos(off))) <= room.robot.cone && distance <= room.robot.range;
      const isHidden = () => room.walls.some((other) => !walls.includes(other) && crosses([x, y, ...at], other));
      return isHeard && !isHidden() ? [distance] : [];
    });
    return distances.length ? Math.min(...distances) : null;
  }
}

export class Room {
  /**
   * `walls`: two points each. The robot stands at a pose; `robot` has what differs from the usual one, whose left encoder is mirrored. A
   * second sonar has a mount and a bearing.
   */
  constructor(walls, [x, y, heading], random, { robot = {}, mirrored = 1 } = {}, second = null) {
    Object.assign(this, { walls, x, y, heading, random, mirrored });
    this.robot = { ...ROBOT, ...robot };
    /** Radians per second. */
    this.turnRate = 0;
    this.speeds = [0, 0];
    this.travels = [0, 0];
    this.counts = [0, 0];
    this.bearing = 0;
    this.sonars = [new Sonar(this, this.robot.mount), ...second ? [new Sonar(this, second.mount, second.bearing)] : []];
  }

  /** The time of the next edge of an echo. */
  get nextEdge() {
    return Math.min(...this.sonars.map(({ edges }) => edges[0]?.at ?? Infinity));
  }

  /** Moves on by a step. `voltages` of right and left wheel are parts of the full one; `target` is that of the servo. */
  move(voltages, target) {
    const dt = STEP / 1e9;
    const { robot } = this;
    for (const side of [0, 1]) {
      this.speeds[side] += ((voltages[side] * robot.speed - this.speeds[side]) * dt) / robot.lag;
      if (Math.abs(this.speeds[side]) < 1e-6) this.speeds[side] = 0;
      this.travels[side] += this.speeds[side] * dt;
    }
    const [right, left] = this.speeds.map((speed) => speed * dt);
    const turn = (right - left) / robot.track;
    this.x += ((right + left) / 2) * Math.cos(this.heading + turn / 2);
    this.y += ((right + left) / 2) * Math.sin(this.heading + turn / 2);
    this.heading += turn;
    this.turnRate = turn / dt;
    // One wheel is a mirror image of the other one.
    this.counts = this.travels.map((travel, side) => Math.floor(travel / robot.edge[side]) * (side === this.mirrored ? -1 : 1));
    const most = robot.servo * dt;
    this.bearing += Math.max(-most, Math.min(most, target - this.bearing));
  }

  /** The feet of the perpendiculars from a place on the walls. */
  feet(x, y) {
    return this.walls.flatMap((wall) => {
      const [ax, ay, bx, by] = wall;
      const along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2);
      return along < 0 || along > 1 ? [] : [{ at: [ax + along * (bx - ax), ay + along * (by - ay)], walls: [wall] }];
    });
  }

  /** The right-angled corners that are open to a place: sound returns from one wall to the other, whatever its direction. */
  corners(x, y) {
    return this.walls.flatMap((one, n) => this.walls.slice(n + 1).flatMap((other) => {
      const ends = (wall) => [[wall.slice(0, 2), wall.slice(2)], [wall.slice(2), wall.slice(0, 2)]];
      return ends(one).flatMap(([at, from]) => ends(other).flatMap(([same, to]) => {
        if (at[0] !== same[0] || at[1] !== same[1]) return [];
        const [u, v] = [from, to].map((end) => [end[0] - at[0], end[1] - at[1]]);
        const isRight = Math.abs(u[0] * v[0] + u[1] * v[1]) < 0.01 * Math.hypot(...u) * Math.hypot(...v);
        const isOpen = [u, v].every((side) => side[0] * (x - at[0]) + side[1] * (y - at[1]) > 0);
        return isRight && isOpen ? [{ at, walls: [one, other] }] : [];
      }));
    }));
  }
}

/** Whether two segments cross. */
function crosses([ax, ay, bx, by], [cx, cy, dx, dy]) {
  const side = (px, py, qx, qy, rx, ry) => Math.sign((qx - px) * (ry - py) - (qy - py) * (rx - px));
  return side(ax, ay, bx, by, cx, cy) !== side(ax, ay, bx, by, dx, dy)
    && side(cx, cy, dx, dy, ax, ay) !== side(cx, cy, dx, dy, bx, by);
}
