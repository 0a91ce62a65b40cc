/* The feed of a page that makes the run again (see kiks/export/page_run.py): the engine writes its frames. */

import { BODY_WORDS, CAMERA_BYTES, HEAD_BYTES, LAMP_WORDS, RAYS_PER_SENSOR, ROBOT_WORDS, SENSORS } from "./frame.js";
import { PlayedFeed } from "./played_feed.js";

/** Most frames that are passed one by one: a minute. */
const MOST_PASSED = 1500;
/** For how many robots each frame of the last minute is made when the time has leapt. */
const FEW_ROBOTS = 2;
const NS_PER_S = 1e9;
/** Of frames. */
const VERSION = 2, KIND = 1;

export class RunFeed extends PlayedFeed {
  /** `run` is what the page says of the run, `world` its `EngineWorld`. */
  constructor(run, world) {
    super(run.scenes, run.shapes, MOST_PASSED, Math.ceil(Math.max(world.robotCount, 1) / FEW_ROBOTS));
    this.world = world;
    this._run = run;
    // Frames are at the begin, at each whole period after it, and at the end.
    this._before = Math.floor(run.begin_ns / run.period_ns);
    const between = Math.floor((run.end_ns - 1) / run.period_ns) - this._before;
    this.count = run.end_ns > run.begin_ns ? between + 2 : 1;
    this.begin();
  }

  get engine() { return this.world.engine; }

  get lampSwitches() { return this._run.lamp_switches; }

  time(index) { return this._time_ns(index) / NS_PER_S; }

  indexAt(time_s) {
    const index = Math.ceil((time_s * NS_PER_S) / this._run.period_ns - 1e-6) - this._before;
    return time_s <= this.begin_s ? 0 : Math.min(Math.max(index, 1), this.count - 1);
  }

  sceneFrom(index) {
    const scene = this._run.scene_begins.findLastIndex((first) => first <= index);
    return { scene, first: this._run.scene_begins[scene] };
  }

  buffer(index) {
    this.world.goTo(this._time_ns(index));
    return this._write(this.sceneFrom(index).scene, this.time(index));
  }

  /** Show the world as it is now, as a desk would. */
  showWorld() {
    this._takeFrame(this._write(this.scene.scene, this.world.time_ns / NS_PER_S));
  }

  /** Show a time of the recording; `onShow` is called before, so that another world can end. */
  show(time_s) {
    this.onShow?.();
    super.show(time_s);
  }

  /** Let the scene be another one for now. */
  changeScene(changes) {
    this._takeMessage(JSON.stringify({ ...this.scenes[this.scene.scene], ...changes }));
    this._takeMessage(JSON.stringify(this._shapes));
  }

  /** Begin anew with what is shown next, as another world was shown. */
  forget() {
    this._index = -1;
    this.scene = null;
  }

  /** The bytes of a frame of the world, as kiks/export/frames.py packs it. */
  _write(scene, time_s) {
    const { world } = this, { engine } = world;
    const { cameras } = this.scenes[scene], { robotCount: robots, bodyCount: bodies, lampCount: lamps } = world;
    const sizes = [4 * ROBOT_WORDS * robots, 4 * BODY_WORDS * bodies, 4 * LAMP_WORDS * lamps, CAMERA_BYTES * cameras.length];
    const rays = SENSORS * RAYS_PER_SENSOR * robots, length = sizes.reduce((sum, size) => sum + size, 2 * rays);
    const { at } = world.place("frame", 1, [length]), places = [at];
    for (const size of sizes) places.push(places.at(-1) + size);
    const view = new DataView(engine.memory.buffer);
    cameras.forEach((robot, k) => view.setUint16(places[3] + CAMERA_BYTES * k, robot, true));
    engine.call("write_frame", world.record, world.tick, world.time_ns, world.arrays.shown,
      engine.array(4 * ROBOT_WORDS, [robots], places[0]), engine.array(4, [bodies, BODY_WORDS], places[1]),
      engine.array(4, [lamps, LAMP_WORDS], places[2]), engine.array(CAMERA_BYTES, [cameras.length], places[3]),
      engine.array(2, [robots, SENSORS, RAYS_PER_SENSOR], places[4]));
    const frame = new Uint8Array(HEAD_BYTES + length), head = new DataView(frame.buffer);
    frame.set(engine.bytes(at, length), HEAD_BYTES);
    head.setUint8(0, VERSION);
    head.setUint8(1, KIND);
    head.setUint32(4, scene, true);
    head.setFloat64(8, time_s, true);
    [robots, bodies, lamps, cameras.length].forEach((count, k) => head.setUint16(24 + 2 * k, count, true));
    return frame.buffer;
  }

  _time_ns(index) {
    const { begin_ns, end_ns, period_ns } = this._run;
    return index === 0 ? begin_ns : index === this.count - 1 ? end_ns : (this._before + index) * period_ns;
  }
}
