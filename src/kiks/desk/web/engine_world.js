/* A run that the engine makes again, from what came to it (see engine_inputs.js): its world at any time.

       const world = new EngineWorld(engine, inputs);
       world.goTo(12_340_000_000);
       engine.call("read_all", world.record, world.tick, world.time_ns, proximity, ambient);

   A world remembers its state now and then, so that each time is near one. Several worlds of one run, in one engine, may
   share what they remember. */

import { CHANGING, CHECK, SEGMENT, PATTERNS } from "./engine_inputs.js";

export const TICK_NS = 10_000_000;
const SPACING_TICKS = 500;
/** Most bytes of all states that are remembered; where they would be more, every second one is forgotten. */
const STATES_BYTES = 32 << 20;
/** The first words of a robot's record say where it is: x and y, eight bytes each. */
const PLACE_WORDS = 4;

/** The states of a run at some ticks, after all that came at them. */
export class States {
  constructor() {
    this.spacing_ticks = SPACING_TICKS;
    this._states = new Map();
    this._bytes = 0;
  }

  /** Remember a state, which `save` returns, if none of its tick is there. */
  keep(tick, save) {
    if (this._states.has(tick) || tick % this.spacing_ticks) return;
    const state = save();
    this._states.set(tick, state);
    this._bytes += state.bytes.length;
    if (this._bytes <= STATES_BYTES) return;
    this.spacing_ticks *= 2;
    for (const [other, { bytes }] of this._states)
      if (other % this.spacing_ticks) {
        this._states.delete(other);
        this._bytes -= bytes.length;
      }
  }

  /** The last state at or before a tick, undefined if there is none. */
  before(tick) {
    let last = Math.floor(tick / this.spacing_ticks) * this.spacing_ticks;
    while (last > 0 && !this._states.has(last)) last -= this.spacing_ticks;
    return this._states.get(last);
  }
}

export class EngineWorld {
  constructor(engine, inputs, states = new States()) {
    this.engine = engine;
    this.inputs = inputs;
    this.states = states;
    /** Called at each checkpoint with its number, while the state is that of it. */
    this.onCheck = () => {};
    /** Arrays of the scene by name, and `shown`. */
    this.arrays = {};
    /** The scene's record, the first argument of kernels. */
    this.record = engine.array(engine.about.layouts.SCENE.size, [1]);
    this.segment = -1;
    this._first = engine.array(8, [1]); // world 0
    this._room = new Map();
    this.tick = inputs.ticks[0];
    this.time_ns = inputs.begin_ns;
    this._next = 1;
    this._take(0);
    this._begin = this.save();
  }

  get robotCount() { return this.arrays.robots.shape[1]; }
  get bodyCount() { return this.arrays.bodies.shape[1]; }
  get lampCount() { return this.arrays.lamps.shape[1]; }

  /** Go to a time [ns], back or on; to the begin if it is before that. */
  goTo(time_ns) {
    if (time_ns <= this.inputs.begin_ns) return this.load(this._begin);
    const tick = Math.ceil(time_ns / TICK_NS), before = this.states.before(tick) ?? this._begin;
    if (tick < this.tick || before.tick > this.tick) this.load(before);
    this.advanceTo(tick);
    this.time_ns = time_ns;
  }

  /** Let time pass up to a tick, with all that came to the engine up to then. */
  advanceTo(tick) {
    const { spacing_ticks: spacing } = this.states;
    while (this.tick < tick) {
      const until = Math.min(tick, (Math.floor(this.tick / spacing) + 1) * spacing);
      this._advance(until);
      this.states.keep(until, () => this.save());
    }
    this._advance(tick);
    this.time_ns = this.tick * TICK_NS;
  }

  /** The present state, a copy. */
  save() {
    const views = CHANGING.map((name) => this.view(name)), bytes = new Uint8Array(views.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const view of views) {
      bytes.set(view, at);
      at += view.length;
    }
    return { tick: this.tick, time_ns: this.time_ns, next: this._next, segment: this.segment, bytes };
  }

  /** Go to a state that `save` has returned. */
  load({ tick, time_ns, next, segment, bytes }) {
    if (segment !== this.segment) this._lay(segment);
    Object.assign(this, { tick, time_ns, _next: next });
    let at = 0;
    for (const name of CHANGING) {
      const view = this.view(name);
      view.set(bytes.subarray(at, at + view.length));
      at += view.length;
    }
    this.enter();
  }

  /** Let time pass without what came in the recording: for a world that has become another one. */
  pass(tickCount) {
    this.engine.call("advance", this.record, this.tick, tickCount);
    this.tick += tickCount;
    this.time_ns = this.tick * TICK_NS;
  }

  /** Tell the engine that something was moved. */
  enter() { this.engine.call("enter_worlds", this.record, this._first); }

  /** The bytes of an array, until the engine's memory grows. */
  view(name) {
    const { at, shape, size } = this.arrays[name];
    return this.engine.bytes(at, size * product(shape));
  }

  /** The bytes of which a checkpoint has a hash, as `State.hash` in kiks/engine/state.py takes them. */
  hashedBytes() {
    const robots = this.view("robots"), bodies = this.view("bodies"), { size } = this.arrays.robots;
    const common = this.engine.about.layouts.ROBOT.fields.registers[0], count = robots.length / size, special = size - common;
    const bytes = new Uint8Array(8 + robots.length + bodies.length);
    new DataView(bytes.buffer).setBigUint64(0, BigInt(this.tick), true);
    let at = 8 + count * common + bodies.length, isSpecial = false;
    for (let k = 0; k < count; k++) {
      bytes.set(robots.subarray(k * size, k * size + common), 8 + k * common);
      const part = robots.subarray(k * size + common, (k + 1) * size);
      bytes.set(part, at);
      at += special;
      isSpecial ||= part.some((byte) => byte !== 0);
    }
    bytes.set(bodies, 8 + count * common);
    return isSpecial ? bytes : bytes.subarray(0, bytes.length - count * special);
  }

  _advance(tick) {
    const { ticks } = this.inputs;
    while (this._next < ticks.length && ticks[this._next] <= tick) {
      this._run(ticks[this._next]);
      this._take(this._next++);
    }
    this._run(tick);
  }

  _run(tick) {
    if (tick > this.tick) this.pass(tick - this.tick);
  }

  /** Do what came at a moment. */
  _take(moment) {
    const { whats, firsts, values, patterns } = this.inputs, what = whats[moment];
    if (what === CHECK) this.onCheck(firsts[moment]);
    else if (what === SEGMENT) this._lay(firsts[moment]);
    else {
      const views = CHANGING.map((name) => wordsOf(this.view(name)));
      let at = firsts[moment], hasMoved = false;
      for (const { array, word } of patterns[what - PATTERNS]) {
        views[array][word] = values[at++];
        hasMoved ||= array === 1 || (array === 0 && word % (this.arrays.robots.size / 4) < PLACE_WORDS);
      }
      if (hasMoved) this.enter();
    }
  }

  /** Arrange the arrays of a segment in memory, as they are at its begin. */
  _lay(number) {
    const { arrays, numbers, shown } = this.inputs.segments[number], { contents } = this.inputs;
    const before = this.inputs.segments[this.segment], isBuilt = before !== undefined && ["brightness", "floor"].every((name) =>
      before.arrays[name].content === arrays[name].content) && before.numbers.cell_mm === numbers.cell_mm;
    this.segment = number;
    for (const [name, { shape, size, content, is_table }] of Object.entries(arrays)) {
      this.arrays[name] = this.place(name, size, shape);
      if (is_table && isBuilt) continue;
      const view = this.view(name);
      if (content === undefined) view.fill(0);
      else view.set(contents[content]);
    }
    const count = contents[shown].length / 4;
    this.arrays.shown = this.place("shown", 4, [count]);
    this.view("shown").set(contents[shown]);
    const { fields } = this.engine.about.layouts.SCENE, view = new DataView(this.engine.memory.buffer, this.record.at);
    for (const name of Object.keys(arrays)) {
      const { at, shape } = this.arrays[name];
      [at, ...shape].forEach((number, k) => view.setBigInt64(fields[name][0] + 8 * k, BigInt(number), true));
    }
    for (const [name, number] of Object.entries(numbers)) {
      const [at, element] = fields[name];
      if (element === "f8") view.setFloat64(at, number, true);
      else view.setBigInt64(at, BigInt(number), true);
    }
    if (!isBuilt) this.build();
    this.enter();
  }

  /** Numbers of the scene that do not change within a segment. */
  get numbers() { return this.inputs.segments[this.segment].numbers; }

  /** Compute the tables of walls and floor. */
  build() {
    const { engine, numbers: { cell_mm } } = this, { brightness, clearance, rooms, leaps, faces, floor, plains } = this.arrays;
    engine.call("fill_distances", brightness, cell_mm, clearance, rooms, leaps);
    engine.call("fill_faces", leaps, cell_mm, faces);
    engine.call("fill_plains", floor, cell_mm, plains);
  }

  /** Return memory for an array of a name: what the last one of that name had, if it has room there. */
  place(name, size, shape) {
    const byteCount = size * product(shape), room = this._room.get(name);
    if (room && room.byteCount >= byteCount) return { at: room.at, shape, size };
    const at = this.engine.allocate(byteCount);
    this._room.set(name, { at, byteCount });
    return { at, shape, size };
  }
}

const product = (shape) => shape.reduce((all, count) => all * count, 1);
const wordsOf = ({ buffer, byteOffset, length }) => new Uint32Array(buffer, byteOffset, length / 4);
