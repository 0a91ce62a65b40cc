/* Makes a run again beside the player, piece by piece, and compares each recorded hash of its state. */

import { HASH_BYTES, hexadecimal } from "./engine_inputs.js";
import { TICK_NS } from "./engine_world.js";

/** How long the page waits for a piece [ms]. */
const PIECE_MS = 8;
/** A judge looks this often (LOOK_S of judge.js). */
const LOOK_TICKS = 10;
const NS_PER_S = 1e9;

export class Comparison {
  /** `world` is an `EngineWorld` that nothing else uses, at the begin. `onNews` is called with this now and then, `onLook` each 0.1 s
      of the run. */
  constructor(world, onNews = () => {}, onLook = () => {}) {
    this.world = world;
    this.onNews = onNews;
    this.onLook = onLook;
    /** Whether there is a way to compare: browsers have none on pages of foreign http:. */
    this.isPossible = globalThis.crypto?.subtle !== undefined;
    this.count = world.inputs.hashes.length;
    this.compared = this.equal = 0;
    /** Up to where it has compared, and from where on the run differs [s]. */
    this.compared_s = world.time_ns / NS_PER_S;
    this.firstDifference_s = null;
    this.isOver = false;
  }

  /** Compare all checkpoints; states are remembered on the way. */
  async run() {
    const { world } = this, end = world.inputs.ticks.at(-1), waiting = [];
    world.onCheck = (number) => waiting.push([number, world.tick, this.isPossible ? world.hashedBytes() : null]);
    do {
      const until_ms = performance.now() + PIECE_MS;
      do {
        world.advanceTo(Math.min(world.tick + LOOK_TICKS, end));
        if (world.tick % LOOK_TICKS === 0) this.onLook(world);
      } while (world.tick < end && performance.now() < until_ms);
      for (const [number, tick, bytes] of waiting.splice(0)) if (bytes) this._note(await hash(bytes), number, tick);
      this.onNews(this);
      await new Promise((go) => setTimeout(go));
    } while (world.tick < end);
    this.isOver = true;
    this.onNews(this);
  }

  _note(found, number, tick) {
    const isEqual = found === this.world.inputs.hashes[number];
    this.compared++;
    this.compared_s = (tick * TICK_NS) / NS_PER_S;
    if (isEqual) this.equal++;
    else this.firstDifference_s ??= this.compared_s;
  }
}

/** The hash of a state: the first digits of the SHA-256 of its bytes. */
export async function hash(bytes) {
  return hexadecimal(new Uint8Array(await crypto.subtle.digest("SHA-256", bytes)).subarray(0, HASH_BYTES));
}
