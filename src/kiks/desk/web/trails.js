/* The trails of robots: kept in the browser from the received frames, thinned and bounded. */

const THIN_MM = 4;
const MOST_POINTS = 1500;
/** A jump between two frames beyond this is that of a hand or a reset, and cuts the trail. */
const LEAP_MM = 250;

export class Trails {
  constructor() {
    this.clear();
  }

  clear() {
    /** For each robot [x_mm, y_mm, x_mm, ...]; NaN, NaN cuts a trail. */
    this.ways = [];
    /** Counts changes after which all trails must be drawn again. */
    this.changes = (this.changes ?? 0) + 1;
  }

  /** Add the places of a frame. */
  add(frame) {
    if (frame.time_s < this._time_s) this.clear(); // the world has gone back
    this._time_s = frame.time_s;
    for (let index = 0; index < frame.robot_count; index++) {
      const way = (this.ways[index] ??= []), { x_mm, y_mm } = frame.robot(index), end = way.length;
      if (end) {
        const step_mm = Math.hypot(x_mm - way[end - 2], y_mm - way[end - 1]);
        if (step_mm < THIN_MM) continue;
        if (step_mm > LEAP_MM) way.push(NaN, NaN);
      }
      way.push(x_mm, y_mm);
      if (way.length <= 2 * MOST_POINTS) continue;
      way.splice(0, MOST_POINTS / 2);
      this.changes++;
    }
  }

  /** Draw the trails from the given points on, and return the new end points. */
  paint(context, viewport, drawn, colourOf) {
    context.lineWidth = Math.min(4, Math.max(1.5, 3 * viewport.scale));
    context.lineJoin = "round";
    context.lineCap = "butt"; // consecutive strokes must not overlap
    return this.ways.map((way, index) => {
      const from = Math.max(0, (drawn[index] ?? 0) - 2);
      if (way.length - from < 4) return drawn[index] ?? 0;
      context.strokeStyle = colourOf(index);
      context.beginPath();
      let isPenUp = true;
      for (let k = from; k < way.length; k += 2) {
        if (Number.isNaN(way[k])) {
          isPenUp = true;
          continue;
        }
        const [x, y] = viewport.toScreen(way[k], way[k + 1]);
        if (isPenUp) context.moveTo(x, y);
        else context.lineTo(x, y);
        isPenUp = false;
      }
      context.stroke();
      return way.length;
    });
  }
}
