/* The picture of a camera: its 64 pixels as a strip, with a curve of their greys above it. */

const STRIP_SHARE = 0.36;
const GAP_PX = 4;

/** Draw the picture of a camera; `context` takes CSS pixels. */
export function paintCameraStrip(context, width, height, camera, isDark) {
  const ink = isDark ? "#e8edf2" : "#1d2329", top = height * (1 - STRIP_SHARE), column = width / camera.pixels.length;
  context.clearRect(0, 0, width, height);
  camera.pixels.forEach((grey, k) => {
    context.fillStyle = `rgb(${grey},${grey},${grey})`;
    // Half a pixel over, so that no seam shows between neighbours.
    context.fillRect(k * column, top, column + 0.5, height - top);
  });
  context.strokeStyle = ink;
  context.lineWidth = 1;
  context.strokeRect(0.5, top + 0.5, width - 1, height - top - 1);
  context.strokeStyle = isDark ? "rgba(230,238,246,.2)" : "rgba(30,40,50,.18)";
  context.beginPath();
  for (const grey of [0, 128, 255]) {
    const y = toY(grey, top);
    context.moveTo(0, y);
    context.lineTo(width, y);
  }
  context.stroke();
  context.strokeStyle = isDark ? "#6db1ff" : "#0b62d6";
  context.lineWidth = 2;
  context.lineJoin = "round";
  context.beginPath();
  camera.pixels.forEach((grey, k) => context.lineTo((k + 0.5) * column, toY(grey, top)));
  context.stroke();
}

function toY(grey, top) {
  return GAP_PX + (1 - grey / 255) * (top - 3 * GAP_PX);
}
