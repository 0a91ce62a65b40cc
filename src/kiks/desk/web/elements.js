/* Elements of a page that are made without Vue, as the page of a recorded run has none. */

/** Make an element with attributes and children. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Make a canvas with a pixel for each cell of a raster; `paint` sets the bytes [red, green, blue, alpha] of all. */
export function makePicture(columns, rows, paint) {
  const canvas = document.createElement("canvas");
  canvas.width = columns;
  canvas.height = rows;
  const context = canvas.getContext("2d"), picture = context.createImageData(columns, rows);
  paint(picture.data);
  context.putImageData(picture, 0, 0);
  return canvas;
}

/** Let the browser save a file. */
export function download(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
