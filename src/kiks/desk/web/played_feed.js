/* The feed of a page without a desk: it passes on messages and frames at the time that is asked for.

   `show(time_s)` passes all frames up to a time, one by one, so that trails and curves get them all. Another time may be
   far away: then it calls `onJump`, and passes the frames just before that time.

   A subclass knows the frames: their `count`, `time(index)`, `indexAt(time_s)` of the first one at or after a time,
   `sceneFrom(index)` (the number of the scene and its first frame), `buffer(index)`, and the messages: `scenes` by number
   and `shapes`, each with the first frame for which it holds. */

import { Feed } from "./feed.js";
import { Frame } from "./frame.js";

/** The last frames are all passed. */
const LAST_PASSED = 50;

/** A frame that is shown at an instant of the recording, not at one of this computer. */
class RecordedFrame extends Frame {
  part = 1;
  share() { return this.part; }
}

export class PlayedFeed extends Feed {
  /** `mostPassed` is how many frames back trails begin; of these, one of `step` is passed where the time has leapt. */
  constructor(scenes, shapes, mostPassed, step = 1) {
    super();
    this.onJump = () => {};
    this.scenes = scenes;
    this.shapes = shapes;
    this._mostPassed = mostPassed;
    this._step = Math.min(step, LAST_PASSED);
    this._index = -1;
    this._shapes = null;
  }

  /** There is no desk. */
  _connect() { this.connection = "open"; }

  /** Show the first frame: the subclass is ready. */
  begin() {
    this.begin_s = this.time(0);
    this.end_s = this.time(this.count - 1);
    this.show(this.begin_s);
  }

  /** The time of the next frame after a time (way 1), or of the last one before it (way -1). */
  neighbour(time_s, way) {
    const index = this.indexAt(time_s), isThere = Math.abs(this.time(index) - time_s) < 1e-6;
    const next = way < 0 || isThere ? index + way : index;
    return this.time(Math.min(Math.max(next, 0), this.count - 1));
  }

  /** Show a time; robots are between the frames before and after it. */
  show(time_s) {
    const next = this.indexAt(time_s), isNear = next >= this._index && next - this._index <= this._mostPassed;
    if (!isNear) this.onJump();
    // Frames to pass before one are of its scene.
    const first = isNear ? this._index + 1 : Math.max(this.sceneFrom(next).first, next - this._mostPassed);
    for (let k = first; k <= next; k += isNear || next - k <= LAST_PASSED ? 1 : this._step) this._pass(k);
    const end_s = this.time(next), begin_s = this.frame.previous ? this.frame.previous.time_s : end_s;
    this.frame.part = end_s > begin_s ? Math.min(Math.max((time_s - begin_s) / (end_s - begin_s), 0), 1) : 1;
  }

  _pass(index) {
    const frame = new RecordedFrame(this.buffer(index), 0);
    this.frames_received++;
    this.bytes_received += frame.buffer.byteLength;
    if (frame.scene !== this.scene?.scene) {
      this._takeMessage(JSON.stringify(this.scenes[frame.scene]));
      this._shapes = null;
    } else if (this._index === index - 1) {
      this.frame.previous = null;
      this.frame.part = 1;
      frame.previous = this.frame;
    }
    const shapes = this.shapes.findLast(([from]) => from <= index)[1];
    if (shapes !== this._shapes) {
      this._shapes = shapes;
      this._takeMessage(JSON.stringify(shapes));
    }
    this._index = index;
    this.frame = frame;
    this._emit("frame", frame);
  }
}
