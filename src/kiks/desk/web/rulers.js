/* The rulers of the top view, along the left and the lower edge, in millimetres. */

import { placeOfShown, shownPlace } from "./coordinates.js";

export const RULER_PX = 26;
export const STEPS_MM = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
const LABEL_EVERY_PX = 56;

/** Draw both rulers on top of the picture; `context` takes CSS pixels. */
export function paintRulers(context, viewport, scene, colours) {
  const { width_px, height_px, scale } = viewport, bottom = height_px - RULER_PX;
  const step_mm = STEPS_MM.find((step) => step * scale >= LABEL_EVERY_PX) ?? 10000;
  context.fillStyle = colours.ruler;
  context.fillRect(0, 0, RULER_PX, height_px);
  context.fillRect(RULER_PX, bottom, width_px - RULER_PX, RULER_PX);
  context.fillStyle = colours.rulerInk;
  context.strokeStyle = colours.rulerTick;
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineWidth = 1;
  context.beginPath();
  const tick_mm = step_mm / 5;
  const ends = [[RULER_PX, bottom], [width_px, 0]].map((end) => shownPlace(scene, ...viewport.toArena(...end)));
  const [[first_x, one_y], [last_x, other_y]] = ends;
  const screen = (x, y) => viewport.toScreen(...placeOfShown(scene, x, y));
  for (let k = Math.ceil(first_x / tick_mm); k * tick_mm <= last_x; k++) {
    const x = Math.round(screen(k * tick_mm, 0)[0]) + 0.5;
    context.moveTo(x, bottom);
    context.lineTo(x, bottom + (k % 5 ? 3 : 6));
    if (k % 5 === 0) context.fillText(`${k * tick_mm}`, x, bottom + 16);
  }
  const last_y = Math.max(one_y, other_y);
  for (let k = Math.ceil(Math.min(one_y, other_y) / tick_mm); k * tick_mm <= last_y; k++) {
    const y = Math.round(screen(0, k * tick_mm)[1]) + 0.5;
    context.moveTo(RULER_PX, y);
    context.lineTo(RULER_PX - (k % 5 ? 3 : 6), y);
    if (k % 5) continue;
    context.save();
    context.translate(10, y);
    context.rotate(-Math.PI / 2);
    context.fillText(`${k * tick_mm}`, 0, 0);
    context.restore();
  }
  context.stroke();
  context.fillStyle = colours.ruler;
  context.fillRect(0, bottom, RULER_PX, RULER_PX);
  context.fillStyle = colours.rulerInk;
  context.fillText("mm", RULER_PX / 2, bottom + RULER_PX / 2);
}
