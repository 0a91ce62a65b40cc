/* A small evolution on the page: from the instant that is shown, candidates drive one after the other, each from the same
   state, and the parameters of the one whose measure is largest become those of the controller. */

import { Looks, LOOK_S } from "./judge.js";

const TRIAL_S = 10;
const CANDIDATES = 10;
const NS_PER_S = 1e9;
/** Standard deviation of the first changes, and by how much it changes after a better candidate, and after none: the rule of
    one fifth (Rechenberg, Evolutionsstrategie, 1973). */
const DEVIATION = 0.3, WIDER = 1.5, NARROWER = 1.5 ** -0.25;

export class Evolution {
  /** `free` is a `FreeWorld` that has begun, `robots` says whether the controller drives each, `known` is that of judge.js. */
  constructor(free, driver, robots, known) {
    Object.assign(this, { free, driver, robots, known });
    this._start = free.world.save();
    this._chance = chances(1);
    this._deviation = DEVIATION;
    this.generation = 0;
    this.isOn = false;
  }

  /** Go on until `stop`; `onNews(value)` is called after each generation with the best candidate's measure. */
  async run(measure, onNews) {
    this.isOn = this.free.isBusy = true;
    this._best = [...this.driver.parameters];
    let most = this.value(this._best, measure);
    for (;;) {
      const parent = this._best, before = most;
      for (let k = 0; k < CANDIDATES; k++) {
        await new Promise((go) => setTimeout(go));
        if (!this.isOn) return;
        const parameters = parent.map((each) => each + this._deviation * this._chance());
        const value = this.value(parameters, measure);
        if (value > most) [this._best, most] = [parameters, value];
      }
      this._deviation *= most > before ? WIDER : NARROWER;
      this.generation++;
      this.driver.parameters = [...this._best];
      onNews(most);
    }
  }

  /** Leave the best parameters to the controller, and the world as it was. */
  stop() {
    this.isOn = this.free.isBusy = false;
    this.driver.parameters = [...this._best];
    if (this.free.isOn) this.free.world.load(this._start);
  }

  /** What a measure says of the robots that are driven with some parameters, the mean. */
  value(parameters, measure) {
    const { free: { world, feed }, driver, robots } = this, { engine } = world, { top } = engine;
    world.load(this._start);
    const driven = robots.flatMap((is, index) => (is ? [new Looks(world, feed.scene, index, this.known)] : []));
    driver.parameters = [...parameters];
    this.free.letDrive(driver, robots);
    for (let look = 1; look <= Math.round(TRIAL_S / LOOK_S); look++) {
      const before_ns = world.time_ns, [tick, time_ns] = driver.passTo(this._start.time_ns + Math.round(look * LOOK_S * NS_PER_S));
      Object.assign(world, { tick, time_ns });
      for (const looks of driven) looks.look(world, time_ns - before_ns);
    }
    driver.end();
    engine.release(top);
    const sum = driven.reduce((total, { values }) => total + values[measure], 0);
    return sum / driven.length;
  }
}

/** Return what draws normal numbers, the same ones for the same seed. */
function chances(seed) {
  let state = seed;
  // A linear congruential generator (Numerical Recipes, 2nd edition, section 7.1).
  const uniform = () => ((state = (Math.imul(state, 1664525) + 1013904223) >>> 0) + 0.5) / 2 ** 32;
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}
