/* Walls for the 3-D view, with few faces. Tops are rectangles of equal brightness, found greedily. Sides are runs along
   the edges between wall and floor. The shade of a side depends on the direction of the wall around its middle. So
   walls that are round in the picture look round, although all sides run along the raster. */

import { THREE } from "nicegui-scene";
import { wallGrey } from "./colours.js";

export const WALL_HEIGHT_MM = 40;
/** Similar brightnesses count as one, because pictures of drawn or photographed walls would need too many faces. */
const LEVELS = 16;
const MOST_FACES = 40000;
/** Minimum light of a side; it grows the more the side faces south and a little east. */
const DIM = 0.56, LIT = 0.2, TOWARDS = [0.35, -0.94];
/** Radius around a side's middle in which its direction is estimated [cells]. */
const AROUND = 3;
/** Overlap of neighbouring tops, without which the sides below would show through [cells]. */
const OVERLAP = 0.04;
const TOP = 0, SIDE = 1;

/** Return a mesh of all walls of a raster. */
export function wallMesh(raster, colours) {
  let grid = levelsOf(raster), faces = facesOf(grid);
  while (faces.length > MOST_FACES && grid.columns > 1) {
    grid = coarser(grid);
    faces = facesOf(grid);
  }
  const geometry = geometryOf(faces, grid, colours);
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide }));
}

function levelsOf({ cells, columns, rows, mm_per_cell }) {
  const levels = new Uint8Array(cells.length);
  for (let k = 0; k < cells.length; k++) levels[k] = cells[k] && 1 + Math.floor((cells[k] * LEVELS) / 256);
  return { levels, columns, rows, cell_mm: mm_per_cell, height_mm: rows * mm_per_cell };
}

/** Return the grid with cells of twice the size: wall where any of the four was. */
function coarser({ levels, columns, rows, cell_mm, height_mm }) {
  const wide = Math.ceil(columns / 2), high = Math.ceil(rows / 2), next = new Uint8Array(wide * high);
  for (let row = 0, k = 0; row < rows; row++)
    for (let column = 0; column < columns; column++, k++) {
      const to = (row >> 1) * wide + (column >> 1);
      if (levels[k] > next[to]) next[to] = levels[k];
    }
  return { levels: next, columns: wide, rows: high, cell_mm: 2 * cell_mm, height_mm };
}

/** Return faces [TOP or SIDE, level, column from, row from, column to, row to]. */
function facesOf({ levels, columns, rows }) {
  const faces = [], isDone = new Uint8Array(levels.length);
  for (let row = 0, k = 0; row < rows; row++)
    for (let column = 0; column < columns; column++, k++) {
      if (!levels[k] || isDone[k]) continue;
      const level = levels[k];
      let right = column + 1, below = row + 1;
      while (right < columns && levels[row * columns + right] === level && !isDone[row * columns + right]) right++;
      while (below < rows && isFree(below * columns + column, right - column, level)) below++;
      for (let y = row; y < below; y++) isDone.fill(1, y * columns + column, y * columns + right);
      faces.push([TOP, level, column, row, right, below]);
    }
  const isInside = (column, row) => column >= 0 && row >= 0 && column < columns && row < rows;
  const levelAt = (column, row) => (isInside(column, row) ? levels[row * columns + column] : 0);
  /** Follow each line of the raster and make a face of each run of wall of one brightness with floor beside it. */
  const runs = (lines, length, cellAt, face) => {
    for (let line = 0; line <= lines; line++)
      for (const [own, other] of [[line, line - 1], [line - 1, line]]) {
        let from = 0, level = 0;
        for (let k = 0; k <= length; k++) {
          const next = k < length && !cellAt(other, k) ? cellAt(own, k) : 0;
          if (next === level) continue;
          if (level) faces.push(face(level, line, from, k));
          [from, level] = [k, next];
        }
      }
  };
  runs(rows, columns, (row, k) => levelAt(k, row), (level, row, from, to) => [SIDE, level, from, row, to, row]);
  runs(columns, rows, levelAt, (level, column, from, to) => [SIDE, level, column, from, column, to]);
  return faces;

  function isFree(from, count, level) {
    for (let k = from; k < from + count; k++) if (levels[k] !== level || isDone[k]) return false;
    return true;
  }
}

/** Return the shade of a side; the wall's cells around its middle give its direction. */
function shadeOf({ levels, columns, rows }, column, row) {
  let east = 0, north = 0;
  for (let y = Math.ceil(row - AROUND - 0.5); y < row + AROUND; y++)
    for (let x = Math.ceil(column - AROUND - 0.5); x < column + AROUND; x++) {
      if (x < 0 || y < 0 || x >= columns || y >= rows || !levels[y * columns + x]) continue;
      east -= x + 0.5 - column;
      north += y + 0.5 - row;
    }
  const length = Math.hypot(east, north) || 1;
  return DIM + LIT * Math.max(-0.5, (east * TOWARDS[0] + north * TOWARDS[1]) / length);
}

function geometryOf(faces, grid, colours) {
  const { cell_mm, height_mm } = grid;
  const positions = new Float32Array(12 * faces.length), tints = new Float32Array(12 * faces.length);
  const indices = new Uint32Array(6 * faces.length), tint = new THREE.Color();
  faces.forEach(([kind, level, left, above, right, below], k) => {
    const more = kind === TOP ? OVERLAP : 0;
    const x0 = (left - more) * cell_mm, x1 = (right + more) * cell_mm;
    const y0 = height_mm - (above - more) * cell_mm, y1 = height_mm - (below + more) * cell_mm;
    const top = WALL_HEIGHT_MM, shade = kind === TOP ? 1 : shadeOf(grid, (left + right) / 2, (above + below) / 2);
    const flat = [x0, y0, top, x1, y0, top, x1, y1, top, x0, y1, top];
    const upright = [x0, y0, 0, x1, y1, 0, x1, y1, top, x0, y0, top];
    positions.set(kind === TOP ? flat : upright, 12 * k);
    const grey = ((12 + 0.92 * wallGrey((level - 0.5) * (256 / LEVELS), colours)) * shade) / 255;
    tint.setRGB(grey, grey, grey * 1.01);
    for (let corner = 0; corner < 4; corner++) tints.set([tint.r, tint.g, tint.b], 12 * k + 3 * corner);
    indices.set([0, 1, 2, 0, 2, 3].map((corner) => 4 * k + corner), 6 * k);
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(tints, 3));
  geometry.setIndex(new THREE.BufferAttribute(indices, 1));
  return geometry;
}
