/* The feed of a page that makes the run again (see kiks/export/page_run.py): the engine writes its frames. */

import { BODY_WORDS, CAMERA_BYTES, HEAD_BYTES, LAMP_WORDS, RAYS_PER_SENSOR, ROBOT_WORDS, SENSORS } from "./frame.js";
import { PlayedFeed } from "./played_feed.js";

/** Most frames that are passed one by one, for one robot. */
const MOST_PASSED = 750;
const NS_PER_S = 1e9;
/** Of frames. */
const VERSION = 2, KIND = 1;

export class RunFeed extends PlayedFeed {
  /** `run` is what the page says of the run, `world` its `EngineWorld`. */
  constructor(run, world) {
    super(run.scenes, run.shapes, Math.ceil(MOST_PASSED / Math.max(world.robotCount, 1)));
    this.world = world;
    this._run = run;
    // Frames are at the begin, at each whole period after it, and at the end.
    this._before = Math.floor(run.begin_ns / run.period_ns);
    const between = Math.floor((run.end_ns - 1) / run.period_ns) - this._before;
    this.count = run.end_ns > run.begin_ns ? between + 2 : 1;
    this.begin();
  }

  time(index) { return this._time_ns(index) / NS_PER_S; }

  indexAt(time_s) {
    const index = Math.ceil((time_s * NS_PER_S) / this._run.period_ns - 1e-6) - this._before;
    return time_s <= this.begin_s ? 0 : Math.min(Math.max(index, 1), this.count - 1);
  }

  sceneFrom(index) {
    const scene = this._run.scene_begins.findLastIndex((first) => first <= index);
    return { scene, first: this._run.scene_begins[scene] };
  }

  /** The bytes of a frame, as kiks/export/frames.py packs it. */
  buffer(index) {
    const { world } = this, { engine } = world, { scene } = this.sceneFrom(index);
    world.goTo(this._time_ns(index));
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
    head.setFloat64(8, this.time(index), true);
    [robots, bodies, lamps, cameras.length].forEach((count, k) => head.setUint16(24 + 2 * k, count, true));
    return frame.buffer;
  }

  _time_ns(index) {
    const { begin_ns, end_ns, period_ns } = this._run;
    return index === 0 ? begin_ns : index === this.count - 1 ? end_ns : (this._before + index) * period_ns;
  }
}
