/* The arena's raster: brightness of each cell (0 floor, 1 black wall to 255 white wall), row 0 on top, read from its
   picture; and the brightness of the floor, if it is not white all over. */

/** Read the raster of a scene's arena: {columns, rows, cells: Uint8Array, shades: Uint8Array or null, mm_per_cell,
    width_mm, height_mm}. */
export async function loadRaster(arena) {
  const picture = new Image();
  picture.src = arena.picture;
  await picture.decode();
  const canvas = document.createElement("canvas");
  const columns = (canvas.width = picture.naturalWidth), rows = (canvas.height = picture.naturalHeight);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(picture, 0, 0);
  const pixels = context.getImageData(0, 0, columns, rows).data;
  const cells = new Uint8Array(columns * rows);
  for (let k = 0; k < cells.length; k++) cells[k] = pixels[4 * k];
  const shades = arena.has_floor ? cells.map((_, k) => pixels[4 * k + 1]) : null;
  return {
    columns, rows, cells, shades, mm_per_cell: arena.mm_per_cell,
    width_mm: columns * arena.mm_per_cell, height_mm: rows * arena.mm_per_cell,
  };
}
