/* The static parts of the top view: floor, light, walls and grid. The 3-D view uses the same picture as its floor. */

import { LAMPLIGHT, rgba, wallGrey } from "./colours.js";
import { makePicture } from "./elements.js";
import { lightMap } from "./light_map.js";

const SHADE_CELLS_MM = 4;
/** How much darker a black floor is drawn than a white one, a share of it. */
const DARKNESS = 0.6;
/** From this scale on, the fine grid is drawn [pixels/mm], and cells of the raster show their edges. */
const FINE_GRID_SCALE = 1.6;

export class Floor {
  constructor() {
    this.raster = null;
    this._walls = null;
    this._zones = null;
    this._light = null;
    this._light_key = "";
  }

  setRaster(raster, colours) {
    this.raster = raster;
    this._walls = raster ? paintWalls(raster, colours) : null;
    this._zones = raster?.shades ? paintZones(raster) : null;
    this._light_key = "";
  }

  /** Take the lamps of a feed's frame; return whether the light has changed. There is none without the engine. */
  setLamps(lamps, feed, isDark) {
    const lit = lamps.filter((lamp) => lamp.isOn && lamp.power_w > 0), scale = feed.scene?.light;
    const key = isDark + lit.map((lamp) => `${lamp.x_mm},${lamp.y_mm},${lamp.power_w}`).join(";");
    if (!this.raster || !scale || key === this._light_key || (lit.length && !feed.engine)) return false;
    this._light_key = key;
    this._light = lit.length ? lightMap(feed.engine, this.raster, lit, scale, LAMPLIGHT, isDark ? 0.5 : 0.6) : null;
    return true;
  }

  /** Draw everything; `context` takes CSS pixels. */
  paint(context, viewport, { isGrid, isLight, isEdged = true, isFromTop = false }, colours) {
    context.fillStyle = colours.outside;
    context.fillRect(0, 0, viewport.width_px, viewport.height_px);
    if (!this.raster) return;
    const { width_mm, height_mm } = this.raster;
    const [left, top] = viewport.toScreen(0, height_mm), [right, bottom] = viewport.toScreen(width_mm, 0);
    const width = right - left, height = bottom - top;
    context.fillStyle = rgba(colours.floor);
    context.fillRect(left, top, width, height);
    if (isLight && this._light) {
      context.imageSmoothingEnabled = true;
      context.drawImage(this._light, left, top, width, height);
    }
    if (this._zones) {
      context.imageSmoothingEnabled = viewport.scale * this.raster.mm_per_cell < 4;
      context.drawImage(this._zones, left, top, width, height);
    }
    if (isGrid) this._grid(context, viewport, { left, top, right, bottom }, isFromTop, colours);
    context.imageSmoothingEnabled = viewport.scale * this.raster.mm_per_cell < 4;
    context.imageSmoothingQuality = "medium";
    context.drawImage(this._walls, left, top, width, height);
    if (!isEdged) return;
    context.strokeStyle = colours.floorEdge;
    context.lineWidth = 2;
    context.strokeRect(left - 1, top - 1, width + 2, height + 2);
  }

  /** Draw lines at multiples of 10 and 100 mm from the left edge, and from the lower or the upper one. */
  _grid(context, viewport, { left, top, right, bottom }, isFromTop, colours) {
    const from = isFromTop ? top : bottom;
    const draw = (step_mm, colour) => {
      const step = step_mm * viewport.scale;
      context.beginPath();
      const first_x = left + step * Math.max(1, Math.ceil(-left / step)), last_x = Math.min(right, viewport.width_px);
      for (let x = first_x; x < last_x; x += step) {
        context.moveTo(Math.round(x) + 0.5, Math.max(top, 0));
        context.lineTo(Math.round(x) + 0.5, Math.min(bottom, viewport.height_px));
      }
      const lowest = Math.min(bottom - 1, viewport.height_px), last_y = Math.max(top, 0);
      for (let y = from + step * Math.floor((lowest - from) / step); y > last_y; y -= step) {
        context.moveTo(Math.max(left, 0), Math.round(y) + 0.5);
        context.lineTo(Math.min(right, viewport.width_px), Math.round(y) + 0.5);
      }
      context.strokeStyle = colour;
      context.lineWidth = 1;
      context.stroke();
    };
    if (viewport.scale >= FINE_GRID_SCALE) draw(10, colours.gridFine);
    if (viewport.scale >= 0.08) draw(100, colours.gridCoarse);
  }
}

/** Return a canvas with a pixel per cell that makes the floor darker where it is not white. */
function paintZones({ shades, columns, rows }) {
  return makePicture(columns, rows, (pixels) => {
    for (let k = 0; k < shades.length; k++) pixels[4 * k + 3] = DARKNESS * (255 - shades[k]);
  });
}

/** Return a canvas with a pixel per cell: walls with their edges, and a shade on the floor below and to the right
    of them. */
function paintWalls({ cells, columns, rows, mm_per_cell }, colours) {
  const shade_cells = Math.max(1, Math.round(SHADE_CELLS_MM / mm_per_cell));
  return makePicture(columns, rows, (pixels) => {
    for (let row = 0, k = 0; row < rows; row++)
      for (let column = 0; column < columns; column++, k++) {
        if (cells[k]) {
          const isEdge =
            (column > 0 && !cells[k - 1]) || (column < columns - 1 && !cells[k + 1]) ||
            (row > 0 && !cells[k - columns]) || (row < rows - 1 && !cells[k + columns]);
          const grey = wallGrey(cells[k], colours);
          for (let part = 0; part < 3; part++) pixels[4 * k + part] = isEdge ? colours.wallEdge[part] : grey;
          pixels[4 * k + 3] = 255;
          continue;
        }
        for (let way = 1; way <= shade_cells; way++)
          if (row >= way && column >= way && cells[k - way * (columns + 1)]) {
            pixels[4 * k + 3] = 255 * colours.shade * (2 - way / shade_cells);
            break;
          }
      }
  });
}
