/* Where the arena is on a flat screen: millimetres, y up, to CSS pixels, y down, and back. */

const LEAST_SCALE = 0.02;
const MOST_SCALE = 60;

export class Viewport {
  constructor() {
    this.width_px = 1;
    this.height_px = 1;
    /** The place at the middle of the screen. */
    this.x_mm = 0;
    this.y_mm = 0;
    /** Pixels per millimetre. */
    this.scale = 1;
    /** Counts changes, so that static parts are drawn again. */
    this.changes = 0;
  }

  resize(width_px, height_px) {
    this.width_px = Math.max(width_px, 1);
    this.height_px = Math.max(height_px, 1);
    this.changes++;
  }

  toScreen(x_mm, y_mm) {
    return [
      this.width_px / 2 + (x_mm - this.x_mm) * this.scale,
      this.height_px / 2 - (y_mm - this.y_mm) * this.scale,
    ];
  }

  toArena(x_px, y_px) {
    return [
      this.x_mm + (x_px - this.width_px / 2) / this.scale,
      this.y_mm - (y_px - this.height_px / 2) / this.scale,
    ];
  }

  centreOn(x_mm, y_mm) {
    if (x_mm === this.x_mm && y_mm === this.y_mm) return;
    this.x_mm = x_mm;
    this.y_mm = y_mm;
    this.changes++;
  }

  panBy(x_px, y_px) {
    this.centreOn(this.x_mm - x_px / this.scale, this.y_mm + y_px / this.scale);
  }

  /** Zoom and keep the place under a point of the screen. */
  zoomAbout(x_px, y_px, factor) {
    const [x_mm, y_mm] = this.toArena(x_px, y_px);
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    const [x_now, y_now] = this.toScreen(x_mm, y_mm);
    this.changes++;
    this.panBy(x_px - x_now, y_px - y_now);
  }

  /** Show all of an arena, with a margin for the rulers. */
  fit(width_mm, height_mm, margin_px) {
    const width_px = Math.max(this.width_px - 2 * margin_px, 20);
    const height_px = Math.max(this.height_px - 2 * margin_px, 20);
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, Math.min(width_px / width_mm, height_px / height_mm)));
    this.x_mm = width_mm / 2;
    this.y_mm = height_mm / 2;
    this.changes++;
  }
}
