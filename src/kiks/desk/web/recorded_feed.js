/* The feed of a page that holds all frames (see kiks/export/ghost_frames.py). */

import { PlayedFeed } from "./played_feed.js";

const MOST_PASSED = 3000;
const SCENE_AT = 4, TIME_AT = 8;

/** Return frames from the differences of their bytes, which come column by column. */
function sumUp(differences, size, count) {
  const frames = new Uint8Array(size * count);
  for (let column = 0, k = 0; column < size; column++)
    for (let row = 0, sum = 0; row < count; row++, k++) frames[row * size + column] = sum += differences[k];
  return frames;
}

export class RecordedFeed extends PlayedFeed {
  /** `run` is {period_s, scenes, shapes, groups: [{size, count}]}, `packed` the frames, `engine` lights the floor. */
  constructor(run, packed, engine) {
    super(run.scenes, run.shapes, MOST_PASSED);
    this._engine = engine;
    this._period_s = run.period_s;
    this._heads = [];
    let at = 0;
    for (const { size, count } of run.groups) {
      const { buffer } = sumUp(packed.subarray(at, at += size * count), size, count);
      for (let k = 0; k < count; k++) this._heads.push(new DataView(buffer, k * size, size));
    }
    this.count = this._heads.length;
    this.begin();
  }

  get engine() { return this._engine; }

  time(index) { return this._heads[index].getFloat64(TIME_AT, true); }

  indexAt(time_s) {
    const guess = Math.ceil((time_s - this.begin_s) / this._period_s - 1e-6);
    return Math.min(Math.max(guess, 0), this.count - 1);
  }

  sceneFrom(index) {
    const scene = this._scene(index);
    let first = index;
    while (first > 0 && this._scene(first - 1) === scene) first--;
    return { scene, first };
  }

  buffer(index) {
    const { buffer, byteOffset, byteLength } = this._heads[index];
    return buffer.slice(byteOffset, byteOffset + byteLength);
  }

  _scene(index) { return this._heads[index].getUint32(SCENE_AT, true); }
}
