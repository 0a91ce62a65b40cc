/* The world of a recorded run that people change: what if, and go on.

   It begins with the recording's world at the shown time. What the hand and the tools of the stage ask for, which a desk
   sends to its server, is done here; then the world stands still, or goes on with a controller (see go_on.js). */

import { makePicture } from "./elements.js";
import { radiusOf } from "./things.js";

const NS_PER_S = 1e9;
/** Longest time between two pictures that counts [ms]: a hidden page gets none, and the world waits for it. */
const LONGEST_MS = 250;
/** Overlap that counts as none [mm], as in kiks/sim/free_space.py. */
const OVERLAP_MM = 1e-3;
/** Brightness of a wall that is drawn. */
const WALL = 255;

export class FreeWorld {
  /** `feed` is a `RunFeed`. `onChange()` is called when it begins, ends, goes on or stops. */
  constructor(feed, onChange) {
    this.feed = feed;
    this.world = feed.world;
    this.onChange = onChange;
    /** Whether it has left the recording; goes on with a controller; and is used by what no hand may disturb. */
    this.isOn = this.isGoing = this.isBusy = false;
    this.speed = 1;
    this._held = null;
    feed.send = (message) => this._take(message);
    feed.onShow = () => this.end();
  }

  /** Leave the recording at a time. */
  begin(time_s) {
    if (this.isOn) return;
    this.world.goTo(Math.round(time_s * NS_PER_S));
    this._saved = this.world.save();
    this.since_s = time_s;
    this.isOn = true;
    this.feed.showWorld();
    this.onChange();
  }

  /** Go back to the recording: the feed shows it next. */
  end() {
    if (!this.isOn) return;
    this.isOn = this.isGoing = false;
    if (this._areWallsOther) this.world.segment = -1; // its tables are made again
    this._areWallsOther = false;
    this.world.load(this._saved);
    this.feed.forget();
    this.onChange();
  }

  /** Let a controller drive some robots from now on, given whether it does for each; the others go on at their speeds. */
  goOn(driver, robots) {
    this.begin(this.feed.frame.time_s);
    this.letDrive(driver, robots);
    Object.assign(this, { driver, isGoing: true, _now_ns: this.world.time_ns, _before_ms: performance.now() });
    this.onChange();
    cancelAnimationFrame(this._next);
    this._next = requestAnimationFrame((now_ms) => this._go(now_ms));
  }

  /** Let a controller be ready to drive some robots from the present state on. */
  letDrive(driver, robots) {
    const { world, feed: { frame, lampSwitches } } = this, { speed_scale } = driver.about;
    const speeds = robots.map((_, index) => [...frame.robot(index).commanded].map((speed) => (speed || 0) / speed_scale));
    driver.begin(world.record, world.tick, world.time_ns, robots, speeds, lampSwitches);
  }

  /** Let the world stand still. */
  stop() {
    this.isGoing = false;
    this.onChange();
  }

  _go(now_ms) {
    if (!this.isGoing) return;
    const { world } = this;
    this._now_ns += Math.round(Math.min(now_ms - this._before_ms, LONGEST_MS) * 1e6 * this.speed);
    this._before_ms = now_ms;
    try {
      const [tick, time_ns] = this.driver.passTo(this._now_ns);
      if (tick !== world.tick) {
        Object.assign(world, { tick, time_ns });
        this.feed.showWorld();
      }
    } catch (error) {
      this.stop();
      throw error;
    }
    this._next = requestAnimationFrame((later_ms) => this._go(later_ms));
  }

  // ---- the hand ----

  /** Do what a message of the hand asks for; return whether that is possible. */
  _take({ kind, what, index, ...place }) {
    if (kind === "grab") {
      if (this.isBusy) return false;
      this.begin(this.feed.frame.time_s);
      this._held = { what, index };
      return true;
    }
    if (kind === "drop") this._held = null;
    if (["move", "turn"].includes(kind) && this._held) this._move(this._held, place);
    return this.isOn;
  }

  /** Move or turn a thing, if it has room there; it did not drive there, so sensors that look back see it there, too. */
  _move({ what, index }, { x_mm, y_mm, heading_rad }) {
    const there = what === "lamp" ? this.feed.frame.lamp(index) : what === "robot" ? this.feed.frame.robot(index) : this.feed.frame.body(index);
    const place = [x_mm ?? there.x_mm, y_mm ?? there.y_mm];
    if (what === "lamp") this._numbers("lamps", index).set(place);
    else {
      if (this._isTaken(what, index, ...place)) return;
      const record = what === "robot" ? "ROBOT" : "BODY", pose = what === "robot" ? [...place, heading_rad ?? there.heading_rad] : place;
      const words = this._numbers(what === "robot" ? "robots" : "bodies", index), { fields } = this.world.engine.about.layouts[record];
      words.set(pose, fields.x_mm[0] / 8);
      for (let k = 0; k < fields.trail[2][0]; k++) words.set(pose, fields.trail[0] / 8 + k * pose.length);
      words.set(what === "robot" ? place : [0, 0], fields[what === "robot" ? "start_x_mm" : "velocity_x"][0] / 8);
      // Neither does a gripper hold a body any more.
      if (what === "body") new Int32Array(words.buffer, words.byteOffset + fields.holder[0], 2).fill(0);
      this.world.enter();
    }
    this.feed.showWorld();
  }

  /** The words of eight bytes of a record. */
  _numbers(name, index) {
    const { at, size, shape } = this.world.arrays[name], bytes = name === "lamps" ? size * shape[2] : size;
    return new Float64Array(this.world.engine.memory.buffer, at + index * bytes, bytes / 8);
  }

  /** Whether a wall or another thing is where a thing would be. */
  _isTaken(what, index, x_mm, y_mm) {
    const { feed: { scene, frame }, world } = this, radius_mm = radiusOf(scene, what, index);
    const { pad, cell_mm } = world.numbers;
    const gap_mm = world.engine.call("clearance_of_disc", world.arrays.clearance, cell_mm, pad, x_mm, y_mm, radius_mm);
    const meets = (kind, other, place) => (kind !== what || other !== index) &&
      Math.hypot(place.x_mm - x_mm, place.y_mm - y_mm) < radius_mm + radiusOf(scene, kind, other) - OVERLAP_MM;
    return gap_mm < -OVERLAP_MM
      || scene.robots.some((_, other) => meets("robot", other, frame.robot(other)))
      || scene.bodies.some((_, other) => !frame.body(other).isLifted && meets("body", other, frame.body(other)));
  }

  // ---- walls ----

  /** Draw a wall along a stroke of the stage, remove what is there, or move the wall where it begins to its end. */
  draw({ points }, tool, brush_mm) {
    if (this.isBusy) return;
    this.begin(this.feed.frame.time_s);
    const { cell_mm, pad } = this.world.numbers;
    const cells = points.map(([x_mm, y_mm]) => [Math.floor(x_mm / cell_mm) + pad, Math.floor(y_mm / cell_mm) + pad]);
    if (tool === "move") this._moveWall(cells[0], cells.at(-1), pad);
    else this._paint(cells, Math.max(brush_mm / (2 * cell_mm), 0.5), tool === "draw" ? WALL : 0, pad);
    this._areWallsOther = true;
    this.world.build();
    this.world.enter();
    this._showWalls(pad);
    this.feed.showWorld();
  }

  _paint(cells, radius, brightness, pad) {
    const raster = this._raster(), [rows, columns] = raster.shape;
    cells.slice(1).forEach(([x1, y1], k) => {
      const [x0, y0] = cells[k], steps = Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0), 1);
      for (let step = 0; step <= steps; step++) {
        const x = x0 + ((x1 - x0) * step) / steps, y = y0 + ((y1 - y0) * step) / steps;
        for (let row = Math.max(pad, Math.ceil(y - radius)); row <= Math.min(rows - pad - 1, y + radius); row++)
          for (let column = Math.max(pad, Math.ceil(x - radius)); column <= Math.min(columns - pad - 1, x + radius); column++)
            if ((row - y) ** 2 + (column - x) ** 2 <= radius * radius) raster.bytes[row * columns + column] = brightness;
      }
    });
  }

  /** Move a wall that stands alone: the cells that hang together with one. */
  _moveWall([column, row], [to_column, to_row], pad) {
    const { bytes, shape: [rows, columns] } = this._raster(), found = [], waiting = [row * columns + column];
    const isInside = (cell) => cell % columns >= pad && cell % columns < columns - pad && cell >= pad * columns && cell < (rows - pad) * columns;
    while (waiting.length) {
      const cell = waiting.pop();
      if (!isInside(cell)) {
        // The border of the arena stays, with all that hangs together with it.
        for (const [each, brightness] of found) bytes[each] = brightness;
        return;
      }
      if (!bytes[cell]) continue;
      found.push([cell, bytes[cell]]);
      bytes[cell] = 0;
      waiting.push(cell - 1, cell + 1, cell - columns, cell + columns);
    }
    const shift = (to_row - row) * columns + to_column - column;
    for (const [cell, brightness] of found) if (isInside(cell + shift)) bytes[cell + shift] = brightness;
  }

  _raster() { return { bytes: this.world.view("brightness"), shape: this.world.arrays.brightness.shape }; }

  /** Let the stage draw the walls as they are. */
  _showWalls(pad) {
    const { bytes, shape: [all_rows, all_columns] } = this._raster(), rows = all_rows - 2 * pad, columns = all_columns - 2 * pad;
    const { arena } = this.feed.scene, floor = arena.has_floor ? this.world.view("floor") : null;
    const picture = makePicture(columns, rows, (pixels) => {
      for (let row = rows - 1, k = 0; row >= 0; row--)
        for (let column = 0; column < columns; column++, k += 4) {
          pixels[k] = bytes[(row + pad) * all_columns + column + pad];
          pixels[k + 1] = pixels[k + 2] = floor ? floor[row * columns + column] : pixels[k];
          pixels[k + 3] = 255;
        }
    });
    this.feed.changeScene({ arena: { ...arena, picture: picture.toDataURL() } });
  }
}
