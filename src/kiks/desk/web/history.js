/* What a robot's readings were: the last samples of a few hundred, in a ring, spread over simulated time. */

/** Least time covered [s]; a simulation that runs fast covers more, so that there is always a curve to be seen. */
export const SPAN_S = 20;
const ROOM = 640;
const SPACING_S = SPAN_S / (ROOM - 15);
const LEAST_SAMPLES = 100;

/** Where each kind of value begins in a sample, and how many there are. */
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

  /** Note the readings of a robot; `robot` is that of a frame. */
  note(time_s, robot) {
    if (this.count && time_s < this.time(0)) this.clear();
    // Samples that come closer than can be kept replace the newest one.
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

  /** One of its values. */
  value(back, column) {
    return this._values[((this._next - 1 - back + 2 * ROOM) % ROOM) * WIDTH + column];
  }

  /** How much time the curves show [s]. */
  get span_s() {
    const last = Math.min(this.count, LEAST_SAMPLES) - 1;
    return last < 1 ? SPAN_S : Math.max(SPAN_S, this.time(0) - this.time(last));
  }
}
