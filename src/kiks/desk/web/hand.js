/* The hand: the selected thing, the held thing, and the messages for dragging. Pointer and keyboard both use it.

   The engine decides where a held thing is; the hand only sends where it should go, at most once per picture. */

import { countOf, placeOf, radiusOf, isSame } from "./things.js";

/** Key presses within this time add up, even if no frame shows the last one yet. */
const KEY_MEMORY_MS = 400;
/** Largest distance of the keyboard's target from the place in frames. */
const KEY_LEAD_MM = 60;

export class Hand {
  constructor(feed) {
    this.feed = feed;
    this.selected = null;
    this.hovered = null;
    this.holding = null;
    this.ghost = null;
    /** Counts changes, so that the views know when to draw. */
    this.changes = 0;
    this.onSelect = () => {};
    this._pending = null;
    this._key = null;
  }

  select(thing) {
    const isNone = !thing || thing.index < 0 || thing.index >= countOf(this.feed, thing.what);
    const next = isNone ? null : { what: thing.what, index: thing.index, isSelected: true };
    this.changes++;
    if (isSame(next, this.selected) || (!next && !this.selected)) return;
    this.selected = next;
    this.onSelect(next);
  }

  hover(thing) {
    const next = thing && thing.what !== "floor" ? { what: thing.what, index: thing.index } : null;
    if (isSame(next, this.hovered) || (!next && !this.hovered)) return;
    this.hovered = next;
    this.changes++;
  }

  /** Grab a thing at a place, to move or turn it. */
  grab({ what, index }, isTurning, x_mm, y_mm) {
    const start = { ...placeOf(this.feed.frame, what, index) }, radius_mm = radiusOf(this.feed.scene, what, index);
    if (!this.feed.send({ kind: "grab", what, index })) return;
    this.holding = { what, index, isTurning: isTurning && what === "robot", start, x_mm, y_mm };
    this.ghost = { x_mm: start.x_mm, y_mm: start.y_mm, heading_rad: start.heading_rad, radius_mm };
    this.changes++;
  }

  /** Follow the pointer to a place. */
  dragTo(x_mm, y_mm) {
    const held = this.holding;
    if (!held) return;
    const { start } = held, { ghost } = this;
    if (held.isTurning) {
      const angle = (x, y) => Math.atan2(y - start.y_mm, x - start.x_mm);
      ghost.heading_rad = wrap(start.heading_rad + angle(x_mm, y_mm) - angle(held.x_mm, held.y_mm));
      this._pending = { kind: "turn", heading_rad: ghost.heading_rad };
    } else {
      ghost.x_mm = start.x_mm + x_mm - held.x_mm;
      ghost.y_mm = start.y_mm + y_mm - held.y_mm;
      this._pending = { kind: "move", x_mm: ghost.x_mm, y_mm: ghost.y_mm };
    }
    this.changes++;
  }

  /** Send the last position of the pointer; called once per picture. */
  flush() {
    if (this._pending) this.feed.send(this._pending);
    this._pending = null;
  }

  drop() {
    if (!this.holding) return;
    this.flush();
    this.feed.send({ kind: "drop" });
    this._release();
  }

  /** Move the held thing back to where it was grabbed. */
  cancel() {
    if (!this.holding) return;
    const { start, isTurning } = this.holding;
    this._pending = isTurning
      ? { kind: "turn", heading_rad: start.heading_rad } : { kind: "move", x_mm: start.x_mm, y_mm: start.y_mm };
    this.drop();
  }

  /** Forget the held thing, after the connection or the scene has changed. */
  forget() {
    this._release();
    this._key = null;
    this.hover(null);
    if (this.selected && this.selected.index >= countOf(this.feed, this.selected.what)) this.select(null);
  }

  _release() {
    this._pending = this.holding = this.ghost = null;
    this.changes++;
  }

  /** Move and turn the selected thing by a step of the keyboard. */
  step(x_mm, y_mm, turn_rad) {
    if (!this.selected || this.holding) return false;
    const { what, index } = this.selected, now_ms = performance.now();
    if (turn_rad && what !== "robot") return false;
    const there = what === "robot" ? this.feed.frame.robot(index) : placeOf(this.feed.frame, what, index);
    const isFresh = this._key && isSame(this._key, this.selected) && now_ms - this._key.at_ms < KEY_MEMORY_MS;
    const isNear = isFresh && Math.hypot(this._key.x_mm - there.x_mm, this._key.y_mm - there.y_mm) < KEY_LEAD_MM;
    const from = isNear ? this._key : there;
    const heading_rad = wrap((from.heading_rad ?? 0) + turn_rad);
    const next = { x_mm: from.x_mm + x_mm, y_mm: from.y_mm + y_mm, heading_rad };
    this._key = { what, index, ...next, at_ms: now_ms };
    if (!this.feed.send({ kind: "grab", what, index })) return false;
    if (turn_rad) this.feed.send({ kind: "turn", heading_rad: next.heading_rad });
    else this.feed.send({ kind: "move", x_mm: next.x_mm, y_mm: next.y_mm });
    this.feed.send({ kind: "drop" });
    return true;
  }
}

function wrap(angle_rad) {
  return Math.atan2(Math.sin(angle_rad), Math.cos(angle_rad));
}
