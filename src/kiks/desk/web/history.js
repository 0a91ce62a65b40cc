/* The history of a robot's readings: a few hundred samples, spread over simulated time. */

/** Shortest time covered [s]; a fast simulation covers more, so that curves have enough samples. */
const SPAN_S = 20;
const ROOM = 640;
const SPACING_S = SPAN_S / (ROOM - 15);
const LEAST_SAMPLES = 100;

export class History {
  constructor() { this.clear(); }

  clear() { this._samples = []; }

  get count() { return this._samples.length; }

  /** Add the readings of a robot; `robot` is that of a frame. */
  note(time_s, robot) {
    if (this.count && time_s < this.time(0)) this.clear();
    // A sample that follows too closely replaces the newest one.
    const isClose = this.count > 1 && time_s - this.time(1) < SPACING_S;
    if (isClose || (this.count && time_s === this.time(0))) this._samples.pop();
    const { proximity, ambient } = robot, speeds = [...robot.speeds, ...robot.commanded];
    this._samples.push({ time_s, proximity: [...proximity], ambient: [...ambient], speeds });
    if (this.count > ROOM) this._samples.shift();
  }

  /** The time of a sample, `back` samples before the newest [s]. */
  time(back) { return this._samples.at(-1 - back).time_s; }

  /** The values of that sample: proximity, ambient or speeds. */
  values(back, kind) { return this._samples.at(-1 - back)[kind]; }

  /** The time that the curves cover [s]. */
  get span_s() {
    const last = Math.min(this.count, LEAST_SAMPLES) - 1;
    return last < 1 ? SPAN_S : Math.max(SPAN_S, this.time(0) - this.time(last));
  }
}
