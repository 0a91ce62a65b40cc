/* A picture of the arena as it is seen, with a scale bar, as a PNG to download. */

import { clockText } from "./clock.js";
import { download } from "./elements.js";
import { RULER_PX, STEPS_MM } from "./rulers.js";

const BAR_PX = 160;
const GAP_PX = 14;
const NO_MARKS = { selected: null, hovered: null, ghost: null, preview: null, isFocused: false };

/** Draw both views as far as they are shown on one canvas, without the marks of the hand. */
function pictureOf(stage) {
  const { root, top, topPane, solidPane, topView, solidView } = stage, now_ms = performance.now();
  const frame = root.getBoundingClientRect(), ratio = devicePixelRatio || 1;
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  canvas.width = Math.round(frame.width * ratio);
  canvas.height = Math.round(frame.height * ratio);
  context.scale(ratio, ratio);
  context.fillStyle = getComputedStyle(root).backgroundColor;
  context.fillRect(0, 0, frame.width, frame.height);
  const paint = (view, pane, source) => {
    const { left, top, width, height } = pane.getBoundingClientRect();
    if (!width || !height || !source) return;
    view.draw(NO_MARKS, now_ms); // WebGL keeps a picture only until the browser has shown it
    context.drawImage(source, left - frame.left, top - frame.top, width, height);
    if (view === topView) paintScale(context, topView, left - frame.left, top - frame.top + height);
  };
  if (stage.view !== "solid") paint(topView, topPane, top);
  if (stage.view !== "top" && solidView) paint(solidView, solidPane, solidPane.querySelector("canvas"));
  return canvas;
}

/** Draw the longest bar of a round length that is at most `BAR_PX` long, in the lower left corner. */
function paintScale(context, { viewport, show, colours }, left, bottom) {
  const length_mm = STEPS_MM.findLast((step) => step * viewport.scale <= BAR_PX) ?? STEPS_MM[0];
  const length_px = length_mm * viewport.scale, edge_px = (show.ruler ? RULER_PX : 0) + GAP_PX;
  const x = left + edge_px, y = bottom - edge_px, text = `${length_mm} mm`;
  context.font = "600 13px system-ui, sans-serif";
  const width_px = Math.max(length_px, context.measureText(text).width) + 16;
  context.fillStyle = colours.ruler;
  context.fillRect(x, y - 34, width_px, 34);
  context.fillStyle = colours.rulerInk;
  context.fillRect(x + 8, y - 10, length_px, 3);
  context.fillRect(x + 8, y - 13, 2, 9);
  context.fillRect(x + 6 + length_px, y - 13, 2, 9);
  context.textAlign = "left";
  context.textBaseline = "alphabetic";
  context.fillText(text, x + 8, y - 17);
}

/** Download a picture of what the stage shows; its name tells arena and time. */
export async function saveSnapshot(stage) {
  const { scene, frame } = stage.feed;
  if (!scene || !frame) return;
  const blob = await new Promise((done) => pictureOf(stage).toBlob(done, "image/png"));
  download(blob, `${scene.arena.name} ${clockText(frame.time_s).replace(":", "m")}s.png`);
}
