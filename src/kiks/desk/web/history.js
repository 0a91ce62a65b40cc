/* The history of a robot's readings: a ring buffer of a few hundred samples, spread over simulated time. */

/** Shortest time covered [s]; a fast simulation covers more, so that curves have enough samples. */
export const SPAN_S = 20;
const ROOM = 640;
const SPACING_S = SPAN_S / (ROOM - 15);
const LEAST_SAMPLES = 100;

/** Start and number of each kind of value in a sample. */
export const KINDS = {
  proximity: { first: 0, count: 8 },
  ambient: { first: 8, count: 8 },
  speeds: { first: 16, count: 4 },
};
const WIDTH = 20;

export class History {
  constructor() {
    this._times_s = new Float64Array(ROOM);
    this._values = new Float32Array(ROOM * WIDTH);
    this.clear();
  }

  clear() {
    this.count = 0;
    this._next = 0;
  }

  /** Add the readings of a robot; `robot` is that of a frame. */
  note(time_s, robot) {
    if (this.count && time_s < this.time(0)) this.clear();
    // A sample that follows too closely replaces the newest one.
    const isClose = this.count > 1 && time_s - this.time(1) < SPACING_S;
    if (isClose || (this.count && time_s === this.time(0))) {
      this._next = (this._next + ROOM - 1) % ROOM;
      this.count--;
    }
    const at = this._next * WIDTH;
    this._times_s[this._next] = time_s;
    this._values.set(robot.proximity, at);
    this._values.set(robot.ambient, at + 8);
    this._values.set(robot.speeds, at + 16);
    this._values.set(robot.commanded, at + 18);
    this._next = (this._next + 1) % ROOM;
    this.count = Math.min(this.count + 1, ROOM);
  }

  /** The time of a sample, `back` samples before the newest [s]. */
  time(back) {
    return this._times_s[(this._next - 1 - back + 2 * ROOM) % ROOM];
  }

  /** One value of that sample. */
  value(back, column) {
    return this._values[((this._next - 1 - back + 2 * ROOM) % ROOM) * WIDTH + column];
  }

  /** The time that the curves cover [s]. */
  get span_s() {
    const last = Math.min(this.count, LEAST_SAMPLES) - 1;
    return last < 1 ? SPAN_S : Math.max(SPAN_S, this.time(0) - this.time(last));
  }
}
