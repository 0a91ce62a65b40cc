/* One frame of the feed: typed views of the received bytes. This module copies nothing and draws nothing.

   The layout is that of kiks/export/frames.py (the head of 32 bytes) and kiks/engine/sensing/frame_parts.py (32 words
   for each robot, 3 for each body, 4 for each lamp, 68 bytes for each camera and 56 ray lengths for each robot). It is
   little endian, like the arrays of all browsers. */

export const HEAD_BYTES = 32;
export const ROBOT_WORDS = 32;
export const BODY_WORDS = 3;
export const LAMP_WORDS = 4;
export const CAMERA_BYTES = 68;
const PIXELS = 64;

export const SENSORS = 8;
export const RAYS_PER_SENSOR = 7;
export const RAYS_PER_ROBOT = SENSORS * RAYS_PER_SENSOR;
/** The length of a ray that hit nothing. */
export const NO_HIT = 65535;
export const RAY_UNIT_MM = 0.01;

const TOUCHING = 1, LINE_IN_USE = 16;
/** The bit of a robot's first LED. */
const LEDS_BIT = 16;
const PAUSED = 1;

/** A robot in one frame. Arrays are views: read them, do not keep them beyond a few frames. */
class Robot {
  constructor(floats, whole, unsigned) {
    this._floats = floats;
    this._whole = whole;
    this._unsigned = unsigned;
  }
  get x_mm() { return this._floats[0]; }
  get y_mm() { return this._floats[1]; }
  get heading_rad() { return this._floats[2]; }
  /** Measured left and right, in the robot's `speed_unit`. */
  get speeds() { return this._floats.subarray(3, 5); }
  /** Commanded left and right, in the same unit. */
  get commanded() { return this._floats.subarray(5, 7); }
  get isTouching() { return (this._unsigned[7] & TOUCHING) !== 0; }
  /** Whether an LED on the robot is lit, by its index in the scene. */
  isLit(led) { return ((this._unsigned[7] >>> (LEDS_BIT + led)) & 1) === 1; }
  get isLineInUse() { return (this._unsigned[7] & LINE_IN_USE) !== 0; }
  /** The gripper's arm, 0 to 255 (down in front). */
  get arm() { return this._floats[8]; }
  /** The gripper's jaws, 0 (closed) to 200. */
  get jaws() { return this._floats[9]; }
  get contacts() { return this._unsigned[10]; }
  /** Left and right [pulses]. */
  get encoders() { return this._whole.subarray(11, 13); }
  get forwards_mm() { return this._floats[13]; }
  get backwards_mm() { return this._floats[14]; }
  get straight_mm() { return this._floats[15]; }
  /** Eight counts, as the command N returns them. */
  get proximity() { return this._floats.subarray(16, 24); }
  /** Eight counts, as the command O returns them. */
  get ambient() { return this._floats.subarray(24, 32); }
}

export class Frame {
  /** Create the views of a frame's bytes. Throws a RangeError if they are not a frame of this version. */
  constructor(buffer, now_ms) {
    const head = new DataView(buffer);
    if (buffer.byteLength < HEAD_BYTES || head.getUint8(0) !== 2 || head.getUint8(1) !== 1)
      throw new RangeError("a frame must be of version 2 and kind 1: reload the page after an update of KiKS");
    const flags = head.getUint16(2, true);
    this.buffer = buffer;
    this.arrived_ms = now_ms;
    this.isPaused = (flags & PAUSED) !== 0;
    this.scene = head.getUint32(4, true);
    this.time_s = head.getFloat64(8, true);
    this.speed_now = head.getFloat32(16, true);
    this.speed_average = head.getFloat32(20, true);
    this.robot_count = head.getUint16(24, true);
    this.body_count = head.getUint16(26, true);
    this.lamp_count = head.getUint16(28, true);
    this.camera_count = head.getUint16(30, true);

    let at = HEAD_BYTES;
    const words = this.robot_count * ROBOT_WORDS;
    this._robots = new Float32Array(buffer, at, words);
    this._whole = new Int32Array(buffer, at, words);
    this._unsigned = new Uint32Array(buffer, at, words);
    at += 4 * words;
    this._bodies = new Float32Array(buffer, at, this.body_count * BODY_WORDS);
    at += 4 * this._bodies.length;
    this._lamps = new Float32Array(buffer, at, this.lamp_count * LAMP_WORDS);
    at += 4 * this._lamps.length;
    this._cameras_at = at;
    at += this.camera_count * CAMERA_BYTES;
    this._rays = new Uint16Array(buffer, at, this.robot_count * RAYS_PER_ROBOT);
    /** The previous frame; the feed drops it when a newer frame arrives. */
    this.previous = null;
    /** Duration of the interpolation from the previous frame to this one [ms]. */
    this.interval_ms = 0;
    this._views = [];
  }

  robot(index) {
    if (!this._views[index]) {
      const from = index * ROBOT_WORDS, to = from + ROBOT_WORDS;
      this._views[index] = new Robot(
        this._robots.subarray(from, to), this._whole.subarray(from, to), this._unsigned.subarray(from, to));
    }
    return this._views[index];
  }

  /** Place of a ball or cylinder, and whether a gripper holds (isGripped) or lifts (isLifted) it. */
  body(index) {
    const at = index * BODY_WORDS, [x_mm, y_mm] = this._between("_bodies", at);
    const flags = this._bodies[at + 2];
    return { x_mm, y_mm, isGripped: flags === 1, isLifted: flags === 2 };
  }

  lamp(index) {
    const at = index * LAMP_WORDS, [x_mm, y_mm, power_w, is_on] = this._lamps.subarray(at, at + LAMP_WORDS);
    return { x_mm, y_mm, power_w, isOn: is_on !== 0 };
  }

  get lamps() { return Array.from({ length: this.lamp_count }, (_, index) => this.lamp(index)); }

  /** Lengths of a robot's 56 rays [0.01 mm], sensor by sensor, 7 each; NO_HIT for a ray that hit nothing. */
  rays(index) {
    return this._rays.subarray(index * RAYS_PER_ROBOT, (index + 1) * RAYS_PER_ROBOT);
  }

  /** The camera of a robot: {light, pixels}, 64 greys from the left; null for a robot without one. */
  camera(index) {
    const head = new DataView(this.buffer), end = this._cameras_at + this.camera_count * CAMERA_BYTES;
    for (let at = this._cameras_at; at < end; at += CAMERA_BYTES)
      if (head.getUint16(at, true) === index)
        return { light: head.getUint16(at + 2, true), pixels: new Uint8Array(this.buffer, at + 4, PIXELS) };
    return null;
  }

  /** Progress of the interpolation from the previous frame (0) to this one (1). */
  share(now_ms = performance.now()) {
    if (!this.previous || this.interval_ms <= 0) return 1;
    return Math.min(1, Math.max(0, (now_ms - this.arrived_ms) / this.interval_ms));
  }

  /** The pose of a robot on the screen, interpolated between the last two frames. */
  pose(index, now_ms) {
    const at = index * ROBOT_WORDS, [x_mm, y_mm] = this._between("_robots", at, now_ms);
    let heading_rad = this._robots[at + 2];
    const before = this.previous?._robots;
    if (before && at < before.length) {
      const turn = heading_rad - before[at + 2], least = turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
      heading_rad -= (1 - this.share(now_ms)) * least;
    }
    return { x_mm, y_mm, heading_rad };
  }

  _between(name, at, now_ms) {
    const there = this[name], before = this.previous?.[name];
    if (!before || at >= before.length) return [there[at], there[at + 1]];
    const left = 1 - this.share(now_ms);
    return [there[at] + left * (before[at] - there[at]), there[at + 1] + left * (before[at + 1] - there[at + 1])];
  }
}
