/* Measures of robots, and the judge of a project's goal as in kiks/sim/judge.py, by the engine's kernel `look_at`. World and
   scene are those of explanation.js; `known` is {names, note_count}, the measures that the engine has. */

import { fixed } from "./python_numbers.js";

export const LOOK_S = 0.1;
const SENSORS = 8, NS_PER_S = 1e9;
const READINGS = { proximity: 0, light: SENSORS };

/** Lets all measures look at a robot once in a while. */
export class Looks {
  constructor({ engine }, scene, index, { names, note_count }) {
    const { scales, speed_max, speed_scale, sensor_order } = scene.robots[index];
    this._index = index;
    this._kind = [engine.array(8, [3]), engine.array(8, [SENSORS])];
    this._out = [engine.array(8, [names.length, note_count]), engine.array(8, [names.length + 1]), engine.array(8, [2, SENSORS])];
    new Float64Array(engine.memory.buffer, this._kind[0].at, 3).set([scales.proximity, speed_max, speed_scale]);
    new BigInt64Array(engine.memory.buffer, this._kind[1].at, SENSORS).set(sensor_order.map(BigInt));
    /** The values of the measures by their names; they and what the sensors read are those of the last look. */
    this.values = Object.fromEntries([...names, "wall_mm"].map((name) => [name, 0]));
    this._readings = new Array(2 * SENSORS).fill(0);
  }

  look({ engine, record, tick, time_ns }, passed_ns) {
    engine.call("look_at", record, this._index, tick, time_ns, passed_ns, this._kind, this._out);
    const numbers = ({ at }, count) => [...new Float64Array(engine.memory.buffer, at, count)];
    numbers(this._out[1], this._out[1].shape[0]).forEach((value, k) => (this.values[Object.keys(this.values)[k]] = value));
    this._readings = numbers(this._out[2], 2 * SENSORS);
  }

  /** The value of a term of a formula; undefined if a page does not know it. */
  valueOf(name, given) {
    if (!Object.hasOwn(READINGS, name)) return given.length || !Object.hasOwn(this.values, name) ? undefined : this.values[name];
    return given.length === 1 && given[0] < SENSORS ? this._readings[READINGS[name] + given[0]] : undefined;
  }
}

/** Judges a run by a goal that is as `Goal.as_lists` has it. */
export class Judge {
  constructor(world, scene, goal, known) {
    this._goal = goal;
    const robots = new Set(goal.terms.map(([, , , robot]) => robot).filter((robot) => scene.robots[robot]));
    this._looks = new Map([...robots].map((robot) => [robot, new Looks(world, scene, robot, known)]));
    this._held_ns = goal.terms.map(() => 0);
    this._looked_ns = world.time_ns;
    this._own = { time_s: 0, is_solved: 0, is_over: 0 };
    /** How the run has done, {isSolved, isFailed, points, time_s}; null until it is decided. */
    this.judgement = null;
    /** What the goal names that a page does not know, as it is written: then nothing may look. */
    this.unknown = goal.terms.filter((term) => !TIMERS.includes(term[0]) && this._valueOf(term) === undefined).map(([, , text]) => text);
  }

  /** Look once more, each `LOOK_S`, until it is decided. */
  look(world) {
    const passed_ns = world.time_ns - this._looked_ns;
    this._looked_ns = world.time_ns;
    this._own.time_s = world.time_ns / NS_PER_S;
    for (const looks of this._looks.values()) looks.look(world, passed_ns);
    this._goal.terms.forEach(([name, [condition]], k) => {
      if (!TIMERS.includes(name)) return;
      // What holds now counts as having held since the last look.
      if (this._number(condition)) this._held_ns[k] += passed_ns;
      else if (name === "held_s") this._held_ns[k] = 0;
    });
    this._solve();
    if (this._own.is_solved || this._number(this._goal.failed)) this._decide();
  }

  /** Decide at the end of the run, where that is not done yet. */
  end(world) {
    if (!this.judgement && world.time_ns !== this._looked_ns) this.look(world);
    if (!this.judgement) this._decide();
  }

  get points() { return this._number(this._goal.points); }

  _solve() {
    // What is solved stays so: a robot that has reached its place may leave it.
    if (this._number(this._goal.solved)) this._own.is_solved = 1;
  }

  _decide() {
    const isFailed = !this._own.is_solved && this._number(this._goal.failed) !== 0;
    this._own.is_over = Number(!this._own.is_solved && !isFailed);
    this._solve();
    const isSolved = this._own.is_solved === 1, points = Number(fixed(this.points, 3));
    this.judgement = { isSolved, isFailed, points, time_s: this._own.time_s };
  }

  _valueOf([name, given, , robot]) {
    return Object.hasOwn(this._own, name) ? this._own[name] : this._looks.get(robot)?.valueOf(name, given);
  }

  _number(formula) {
    const { terms } = this._goal;
    const value = Number(valueOf(formula, (k) => (TIMERS.includes(terms[k][0]) ? this._held_ns[k] / NS_PER_S : this._valueOf(terms[k]))));
    if (!Number.isFinite(value)) throw new Error("a formula of the goal is no number");
    return value;
  }
}

const TIMERS = ["held_s", "total_s"];
const isTrue = (value) => Number(value) !== 0;
const COMPUTE = {
  Add: (a, b) => a + b, Sub: (a, b) => a - b, Mult: (a, b) => a * b, Div: (a, b) => (isTrue(b) ? a / b : NaN),
  UAdd: (a) => +a, USub: (a) => -a, Not: (a) => !isTrue(a), abs: (a) => Math.abs(a),
  Lt: (a, b) => a < b, LtE: (a, b) => a <= b, Gt: (a, b) => a > b, GtE: (a, b) => a >= b,
  Eq: (a, b) => Number(a) === Number(b), NotEq: (a, b) => Number(a) !== Number(b),
  round: (a, digits = 0) => Number(fixed(Number(a), digits)),
  min: (...all) => all.reduce((a, b) => (b < a ? b : a)), max: (...all) => all.reduce((a, b) => (b > a ? b : a)),
};

/** The value of a formula as `Formula.as_lists` has it, where `term(k)` is that of a term. */
export function valueOf([node, ...parts], term) {
  const value = (part) => valueOf(part, term), compute = ([name], ...values) => (Object.hasOwn(COMPUTE, name) ? COMPUTE[name](...values) : NaN);
  switch (node) {
    case "Constant": return parts[0];
    case "Term": return term(parts[0]);
    case "IfExp": return value(parts[isTrue(value(parts[0])) ? 1 : 2]);
    case "UnaryOp": return compute(parts[0], value(parts[1]));
    case "BinOp": return compute(parts[1], value(parts[0]), value(parts[2]));
    case "Call": return compute([parts[0][1]], ...parts[1].map(value));
    case "Compare": {
      const values = [parts[0], ...parts[2]].map(value);
      return parts[1].every((compared, k) => compute(compared, values[k], values[k + 1]));
    }
  }
  // BoolOp: the first part that decides, or the last.
  const [[how], tried] = parts, values = tried.map(value);
  return values.find((each) => isTrue(each) === (how === "Or")) ?? values.at(-1);
}
