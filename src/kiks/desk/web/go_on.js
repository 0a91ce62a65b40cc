/* A world that goes on with a controller: the loop of a batch, in the browser (kiks/export/browser_controller.py). */

/** Kernels that read the proximity of many robots together have no address. */
const IN_PACKETS = "sense_proximity";
const ELEMENT_BYTES = { i8: 8, f8: 8, b1: 1 };
/** Of halves of loops: more than there are in a call. */
const ALL_HALVES = 1 << 30;

/** Make what drives robots of a scene: `about` is what the page says of the controller. */
export async function makeDriver(engine, about) {
  const added = about.module ? await engine.add(Uint8Array.from(atob(about.module), (letter) => letter.charCodeAt(0))) : null;
  const addressOf = (name) => (name === IN_PACKETS ? 0 : engine.addressOf(name, added?.[name] ? added : undefined));
  const [decide, senses, orders] = [
    engine.addressOf("decide", added ?? undefined), about.senses.map(([name]) => addressOf(name)),
    about.orders.map(([name]) => addressOf(name))];
  return new Driver(engine, about, { decide, senses, orders });
}

export class Driver {
  constructor(engine, about, addresses) {
    Object.assign(this, { engine, about, addresses });
    this.parameters = [...about.parameters];
  }

  /** Begin in a scene at a tick and a time [ns]. `robots` says of each robot whether the controller drives it; the others
      keep `speeds`, [left, right] of each robot in 8 mm/s. `switches` are those of lamps: [tick, twice the index of the
      lamp and 1 more for on]. */
  begin(scene, tick, time_ns, robots, speeds, switches = []) {
    const { engine, about, addresses } = this, count = robots.length, of = (value) => robots.map(() => value);
    const rows = (list, places) => list.map(([, ...rest], k) => [places[k], ...rest]);
    const orderCount = about.orders.length;
    const values = {
      senses: rows(about.senses, addresses.senses), scales: about.scales, sensor_orders: about.sensor_orders,
      sense_counts: of(about.senses.length), has_camera: of(about.senses.some(([name]) => name === "sense_camera")),
      ticks: [tick], begins_ns: [time_ns], watched_ns: [time_ns], sensed_ns: [time_ns], steps: [0],
      sensors: [of(zeros(about.sensor_count))], turns: [of(0)], memory: [of(zeros(about.memory_count))],
      wheels: [speeds.map((pair) => [...pair, ...zeros(orderCount)])], parameters: [of(this.parameters)],
      notes: [of([])], orders: rows(about.orders, addresses.orders), order_counts: of(orderCount),
      sent: [of(Array(orderCount).fill(NaN))], switch_ticks: [switches.map(([at]) => at)], switch_codes: [switches.map(([, code]) => code)],
      switched: [switches.filter(([at]) => at <= tick).length],
    };
    this._arrays = Object.fromEntries(engine.about.loop.map(([name, kind, dimensions]) =>
      [name, arrayOf(engine, kind, dimensions, values[name])]));
    const first = robots.indexOf(true), end = robots.lastIndexOf(true) + 1;
    this._deciders = arrayOf(engine, "i8", 2, first < 0 ? [] : [[addresses.decide, first, end]], 3);
    this._block = arrayOf(engine, "i8", 1, [0]);
    this._watchers = arrayOf(engine, "i8", 2, [], 3);
    this._scene = scene;
  }

  /** Drive no more: its memory may be used for something else. */
  end() { this._arrays = null; }

  /** Set a parameter of all robots. */
  setParameter(index, value) {
    this.parameters[index] = value;
    if (!this._arrays) return;
    const { at, shape: [, robots, count] } = this._arrays.parameters;
    for (let robot = 0; robot < robots; robot++) numbers(this.engine, at, robots * count)[robot * count + index] = value;
  }

  /** Do all loops that begin before a time [ns]; return the tick and the time [ns] of the world then. */
  passTo(until_ns) {
    const { engine, about } = this, arrays = engine.about.loop.map(([name]) => this._arrays[name]);
    engine.call("roll_out", this._scene, [about.line, ...arrays], 1, this._block, [0, ALL_HALVES, until_ns],
      [this._deciders, this._watchers, -1]);
    return [this._number("ticks"), this._number("begins_ns")];
  }

  _number(name) { return Number(new DataView(this.engine.memory.buffer).getBigInt64(this._arrays[name].at, true)); }
}

const zeros = (count) => Array(count).fill(0);

const numbers = (engine, at, count) => new Float64Array(engine.memory.buffer, at, count);

/** Put nested lists into the engine's memory; the last dimension of an empty one may be given. */
function arrayOf(engine, kind, dimensions, list, width = 0) {
  const shape = [];
  for (let k = 0, part = list; k < dimensions; k++, part = part?.[0]) shape.push(part?.length ?? (k === dimensions - 1 ? width : 0));
  const flat = list.flat(dimensions), array = engine.array(ELEMENT_BYTES[kind], shape);
  if (kind === "b1") engine.bytes(array.at, flat.length).set(flat.map(Number));
  else if (kind === "f8") numbers(engine, array.at, flat.length).set(flat);
  else new BigInt64Array(engine.memory.buffer, array.at, flat.length).set(flat.map(BigInt));
  return array;
}
