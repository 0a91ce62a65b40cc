/* Drawing on the arena: rectangle, line, disc, freehand and point, snapped to a grid and kept within the arena. What is
   drawn is only shown here, as a preview; the editor does it. */

import { shownPlace } from "./coordinates.js";

const LEAST_STEP_MM = 0.5;
/** What the distance from press to pointer is. */
const SIZES = { line: "length", disc: "radius" };

export class Drawing {
  constructor(feed) {
    this.feed = feed;
    this.tool = { kind: "hand" };
    this.points = [];
    this.isDrawing = false;
    /** Counts changes, so that the stage knows when to draw. */
    this.changes = 0;
  }

  get isActive() { return this.tool.kind !== "hand"; }

  setTool(tool) {
    this.tool = tool ?? { kind: "hand" };
    this.cancel();
  }

  begin(x_mm, y_mm) {
    this.points = [this._snap(x_mm, y_mm)];
    this.isDrawing = true;
    this.changes++;
  }

  moveTo(x_mm, y_mm) {
    const point = this._snap(x_mm, y_mm), [x_last, y_last] = this.points.at(-1) ?? [NaN, NaN];
    this.changes++;
    if (!this.isDrawing || this.tool.kind === "point") this.points = [point];
    else if (this.tool.kind !== "freehand") this.points = [this.points[0], point];
    else if (Math.hypot(point[0] - x_last, point[1] - y_last) >= LEAST_STEP_MM) this.points.push(point);
  }

  /** End the stroke and return it: {kind, points}; null if none was begun. */
  end() {
    if (!this.isDrawing) return null;
    const { kind } = this.tool;
    const points = kind === "freehand" ? this.points : [this.points[0], this.points.at(-1)];
    this.cancel();
    this.points = [points.at(-1)];
    return { kind, points };
  }

  cancel() {
    this.points = [];
    this.isDrawing = false;
    this.changes++;
  }

  /** The preview for top_marks.js; null if the pointer is elsewhere. */
  get preview() {
    if (!this.isActive || !this.points.length) return null;
    const { kind, brush_mm = 1, label } = this.tool, [x, y] = this.points.at(-1), text = label ? [label] : [];
    const [shown_x, shown_y] = this.feed.scene ? shownPlace(this.feed.scene, x, y) : [x, y];
    text.push(`x ${tell(shown_x)}, y ${tell(shown_y)} mm`);
    if (this.isDrawing && kind !== "freehand" && kind !== "point") {
      const wide = Math.abs(x - this.points[0][0]), high = Math.abs(y - this.points[0][1]);
      const way = tell(Math.hypot(wide, high));
      text.push(kind === "rectangle" ? `${tell(wide)} × ${tell(high)} mm` : `${SIZES[kind]} ${way} mm`);
    }
    return { kind, points: this.points, brush_mm, isDrawing: this.isDrawing, text };
  }

  _snap(x_mm, y_mm) {
    const { snap_mm } = this.tool, arena = this.feed.scene?.arena;
    const snap = (value, most) => {
      const near = snap_mm > 0 ? Math.round(value / snap_mm) * snap_mm : value;
      return round(Math.min(most ?? near, Math.max(0, near)));
    };
    return [snap(x_mm, arena?.width_mm), snap(y_mm, arena?.height_mm)];
  }
}

function round(value_mm) {
  return Math.round(100 * value_mm) / 100;
}

function tell(value_mm) {
  return `${Math.round(10 * value_mm) / 10}`;
}
