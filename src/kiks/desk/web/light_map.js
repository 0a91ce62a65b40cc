/* The light of all lamps on the floor, with the shadows of walls: a small picture that is stretched over the arena.

   Method: for each lamp, rays in all directions find the range of its light; a cell is lit if it is nearer than that.
   How strong the light is there, the scene says in a table (`export/light.py`, which draws the same for pictures). */

import { makePicture } from "./elements.js";

const LONGEST_SIDE = 240;
const DIRECTIONS = 720;
const NEAREST_MM = 1;

/** Return a canvas of the raster's proportions, or null when no lamp is on. Row 0 is on top. */
export function lightMap(raster, lamps, scale, rgb, strongest) {
  const lit = lamps.filter((lamp) => lamp.isOn && lamp.power_w > 0);
  if (!lit.length) return null;
  const cell_mm = Math.max(raster.width_mm, raster.height_mm) / LONGEST_SIDE;
  const columns = Math.max(1, Math.round(raster.width_mm / cell_mm));
  const rows = Math.max(1, Math.round(raster.height_mm / cell_mm));
  const light = new Float32Array(columns * rows).fill(scale.background_flux);
  for (const lamp of lit) shine(lamp, raster, light, columns, rows, cell_mm);
  const soft = blurred(light.map((flux) => strengthOf(flux, scale)), columns, rows);
  return makePicture(columns, rows, (pixels) => {
    for (let k = 0; k < light.length; k++) {
      pixels.set(rgb, 4 * k);
      pixels[4 * k + 3] = 255 * strongest * soft[k];
    }
  });
}

/** Return how strong the light is where sensors get a flux [W/mm^2], between two entries of the table. */
function strengthOf(flux, { step_mm, strengths }) {
  const place = 1 / Math.sqrt(flux) / step_mm, before = Math.floor(place);
  if (!(before + 1 < strengths.length)) return 0;
  return strengths[before] + (place - before) * (strengths[before + 1] - strengths[before]);
}

/** Return the mean of each cell and its neighbours, for shadows with soft edges. */
function blurred(light, columns, rows) {
  const soft = new Float32Array(light.length);
  for (let row = 0, k = 0; row < rows; row++)
    for (let column = 0; column < columns; column++, k++) {
      let sum = 0;
      for (let y = Math.max(0, row - 1); y <= Math.min(rows - 1, row + 1); y++)
        for (let x = Math.max(0, column - 1); x <= Math.min(columns - 1, column + 1); x++)
          sum += light[y * columns + x];
      soft[k] = sum / ((1 + (row > 0) + (row < rows - 1)) * (1 + (column > 0) + (column < columns - 1)));
    }
  return soft;
}

function shine(lamp, raster, light, columns, rows, cell_mm) {
  const reach = reaches(lamp, raster, cell_mm);
  for (let row = 0; row < rows; row++) {
    const y = raster.height_mm - (row + 0.5) * cell_mm - lamp.y_mm;
    for (let column = 0; column < columns; column++) {
      const x = (column + 0.5) * cell_mm - lamp.x_mm, square = x * x + y * y;
      const turn = (Math.atan2(y, x) / (2 * Math.PI) + 1) * DIRECTIONS;
      const before = Math.floor(turn);
      const share = turn - before;
      const isSeen = (direction) => reach[direction % DIRECTIONS] >= square;
      const seen = (isSeen(before) ? 1 - share : 0) + (isSeen(before + 1) ? share : 0);
      light[row * columns + column] += (seen * lamp.power_w) / Math.max(square, NEAREST_MM * NEAREST_MM);
    }
  }
}

/** Return the squared distance to the first wall in each direction [mm^2], plus a cell, so that the faces of walls
    are lit. */
function reaches(lamp, raster, step_mm) {
  const reach = new Float32Array(DIRECTIONS), { cells, columns, rows, mm_per_cell } = raster;
  for (let k = 0; k < DIRECTIONS; k++) {
    const angle = (2 * Math.PI * k) / DIRECTIONS, x_step = Math.cos(angle), y_step = Math.sin(angle);
    const stride = Math.max(mm_per_cell, step_mm / 2);
    let way_mm = 0;
    for (; ; way_mm += stride) {
      const column = Math.floor((lamp.x_mm + way_mm * x_step) / mm_per_cell);
      const row = rows - 1 - Math.floor((lamp.y_mm + way_mm * y_step) / mm_per_cell);
      if (column < 0 || row < 0 || column >= columns || row >= rows || cells[row * columns + column]) break;
    }
    reach[k] = (way_mm + step_mm) ** 2;
  }
  return reach;
}
