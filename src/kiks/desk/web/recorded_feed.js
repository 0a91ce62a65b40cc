/* The feed of a page without a desk: it passes on the messages and frames of a recorded run, at the time that is
   asked for.

   `show(time_s)` passes all frames up to a time, one by one, so that trails and curves get them all. Another time may be
   far away: then it calls `onJump`, and passes the frames just before that time. */

import { Feed } from "./feed.js";
import { Frame } from "./frame.js";

/** Most frames that are passed one by one. */
const MOST_PASSED = 3000;
const LENGTH_BYTES = 4;
const SCENE_AT = 4, TIME_AT = 8;

/** A frame that is shown at an instant of the recording, not at one of this computer. */
class RecordedFrame extends Frame {
  part = 1;
  share() { return this.part; }
}

/** Unpack the text of kiks/export/run_frames.py: {period_s, scenes, shapes, groups: [{size, count, bytes}]}. */
export async function unpackRun(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let at = LENGTH_BYTES + new DataView(bytes.buffer).getUint32(0, true);
  const run = JSON.parse(new TextDecoder().decode(bytes.subarray(LENGTH_BYTES, at)));
  for (const group of run.groups) {
    group.bytes = sumUp(bytes.subarray(at, at + group.size * group.count), group.size, group.count);
    at += group.size * group.count;
  }
  for (const { arena } of run.scenes) arena.picture = run.pictures[arena.picture];
  return run;
}

/** Return frames from the differences of their bytes, which come column by column. */
function sumUp(differences, size, count) {
  const frames = new Uint8Array(size * count);
  for (let column = 0, k = 0; column < size; column++)
    for (let row = 0, sum = 0; row < count; row++, k++) frames[row * size + column] = sum += differences[k];
  return frames;
}

export class RecordedFeed extends Feed {
  /** `run` is that of `unpackRun`. */
  constructor(run) {
    super();
    this.onJump = () => {};
    this._run = run;
    this._heads = run.groups.flatMap(({ bytes, size, count }) =>
      Array.from({ length: count }, (_, k) => new DataView(bytes.buffer, k * size, size)));
    this._index = -1;
    this._shapes = null;
    this.begin_s = this._time(0);
    this.end_s = this._time(this._heads.length - 1);
    this.show(this.begin_s);
  }

  /** There is no desk. */
  _connect() { this.connection = "open"; }

  get engine() { return null; }

  /** The time of the next frame after a time (way 1), or of the last one before it (way -1). */
  neighbour(time_s, way) {
    const index = this._indexAt(time_s), isThere = Math.abs(this._time(index) - time_s) < 1e-6;
    const next = way < 0 || isThere ? index + way : index;
    return this._time(Math.min(Math.max(next, 0), this._heads.length - 1));
  }

  /** Show a time; robots are between the frames before and after it. */
  show(time_s) {
    const next = this._indexAt(time_s), isNear = next >= this._index && next - this._index <= MOST_PASSED;
    if (!isNear) this.onJump();
    for (let k = isNear ? this._index + 1 : this._firstBefore(next); k <= next; k++) this._pass(k);
    const end_s = this._time(next), begin_s = this.frame.previous ? this.frame.previous.time_s : end_s;
    this.frame.part = end_s > begin_s ? Math.min(Math.max((time_s - begin_s) / (end_s - begin_s), 0), 1) : 1;
  }

  _time(index) { return this._heads[index].getFloat64(TIME_AT, true); }

  _scene(index) { return this._heads[index].getUint32(SCENE_AT, true); }

  /** Return the index of the first frame at or after a time. */
  _indexAt(time_s) {
    const guess = Math.ceil((time_s - this.begin_s) / this._run.period_s - 1e-6);
    return Math.min(Math.max(guess, 0), this._heads.length - 1);
  }

  /** Return the first of the frames to pass before one: they are of its scene. */
  _firstBefore(index) {
    let first = index;
    while (first > 0 && index - first < MOST_PASSED && this._scene(first - 1) === this._scene(index)) first--;
    return first;
  }

  _pass(index) {
    const { buffer, byteOffset, byteLength } = this._heads[index];
    const frame = new RecordedFrame(buffer.slice(byteOffset, byteOffset + byteLength), 0);
    this.frames_received++;
    this.bytes_received += byteLength;
    if (frame.scene !== this.scene?.scene) {
      this._takeMessage(JSON.stringify(this._run.scenes[frame.scene]));
      this._shapes = null;
    } else if (this._index === index - 1) {
      this.frame.previous = null;
      this.frame.part = 1;
      frame.previous = this.frame;
    }
    const shapes = this._run.shapes.findLast(([from]) => from <= index)[1];
    if (shapes !== this._shapes) {
      this._shapes = shapes;
      this._takeMessage(JSON.stringify(shapes));
    }
    this._index = index;
    this.frame = frame;
    this._emit("frame", frame);
  }
}
