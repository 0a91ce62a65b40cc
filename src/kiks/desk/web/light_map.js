/* The light of all lamps on the floor, with the shadows of walls: a small picture that is stretched over the arena.
   The engine says how strong it is (kiks/engine/sensing/lamplight.py), here and in pictures (kiks/export/light.py). */

import { makePicture } from "./elements.js";

const LONGEST_SIDE = 240;

/** Return a canvas of the raster's proportions with the light of lamps that are on. Row 0 is on top. */
export function lightMap(engine, raster, lamps, scale, rgb, strongest) {
  const cell_mm = Math.max(raster.width_mm, raster.height_mm) / LONGEST_SIDE;
  const columns = Math.max(1, Math.round(raster.width_mm / cell_mm));
  const rows = Math.max(1, Math.round(raster.height_mm / cell_mm));
  const { top } = engine;
  const put = (values, shape) => {
    const array = engine.array(values.BYTES_PER_ELEMENT, shape);
    engine.bytes(array.at, values.byteLength).set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength));
    return array;
  };
  const cells = put(raster.cells, [raster.rows, raster.columns]);
  // From the raster's row 0, which is on top.
  const places = lamps.flatMap(({ x_mm, y_mm, power_w }) => [x_mm, raster.height_mm - y_mm, power_w, 1]);
  const strengths = put(Float64Array.from(scale.strengths), [scale.strengths.length]);
  const found = engine.array(4, [rows, columns]);
  engine.call(
    "light_floor", cells, raster.mm_per_cell, put(Float64Array.from(places), [lamps.length, 4]),
    strengths, scale.step_mm, scale.background_flux, found);
  const light = new Float32Array(engine.memory.buffer, found.at, rows * columns);
  engine.release(top);
  return makePicture(columns, rows, (pixels) => {
    for (let k = 0; k < light.length; k++) {
      pixels.set(rgb, 4 * k);
      pixels[4 * k + 3] = 255 * strongest * light[k];
    }
  });
}
