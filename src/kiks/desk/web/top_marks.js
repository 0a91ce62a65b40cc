/* The marks of pointer and keyboard in the top view: selection, handles, ghosts, and previews of the tools. */

import { fillDisc, strokeRing } from "./circles.js";
import { countOf, handleOf, placeOf, radiusOf } from "./things.js";

/** Draw the marks {selected, hovered, ghost, preview, wall}; `context` takes CSS pixels. */
export function paintMarks(context, viewport, feed, { selected, hovered, ghost, preview, wall, isFocused }, colours) {
  const isThere = (thing) => thing && thing.index < countOf(feed, thing.what);
  if (wall) paintShape(context, viewport, wall, colours);
  if (isThere(hovered)) paintRing(context, viewport, feed, hovered, colours, false, false);
  if (isThere(selected)) paintRing(context, viewport, feed, selected, colours, true, isFocused);
  if (ghost) paintGhost(context, viewport, ghost, colours);
  if (preview) paintPreview(context, viewport, preview, colours);
}

function paintRing(context, viewport, feed, thing, colours, isSelected, isFocused) {
  const place = placeOf(feed.frame, thing.what, thing.index), radius_mm = radiusOf(feed.scene, thing.what, thing.index);
  const [x, y] = viewport.toScreen(place.x_mm, place.y_mm), radius = radius_mm * viewport.scale;
  const ring = radius + Math.max(0.12 * radius, 4);
  strokeRing(context, x, y, ring, colours.accent, isSelected ? 3 : 1.5);
  if (isSelected && isFocused) strokeRing(context, x, y, ring + 4, colours.accent, 1.5, [5, 4]);
  if (thing.what !== "robot") return;
  const [hand_x, hand_y] = viewport.toScreen(...handleOf(place, radius_mm, viewport.scale));
  fillDisc(context, hand_x, hand_y, 7, colours.accent);
  strokeRing(context, hand_x, hand_y, 7, colours.halo, 2);
}

/** A thin outline where the pointer holds a thing; the thing itself is drawn at its place in the frame. */
function paintGhost(context, viewport, { x_mm, y_mm, heading_rad, radius_mm }, colours) {
  const [x, y] = viewport.toScreen(x_mm, y_mm), radius = radius_mm * viewport.scale;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  if (heading_rad !== undefined) {
    context.moveTo(x, y);
    context.lineTo(x + 1.35 * radius * Math.cos(heading_rad), y - 1.35 * radius * Math.sin(heading_rad));
  }
  context.lineWidth = 1.5;
  context.strokeStyle = colours.ghost;
  context.setLineDash([6, 4]);
  context.stroke();
  context.setLineDash([]);
}

/** Draw a stroke: a box from corner to corner, a disc from its middle to its rim, or a line as wide as the brush. */
function paintShape(context, viewport, { kind, points, brush_mm }, colours) {
  const places = points.map(([x_mm, y_mm]) => viewport.toScreen(x_mm, y_mm));
  const width = Math.max(1, brush_mm * viewport.scale);
  const [x, y] = places.at(-1);
  context.strokeStyle = context.fillStyle = colours.tool;
  context.lineCap = context.lineJoin = "round";
  context.lineWidth = width;
  context.beginPath();
  if (kind === "rectangle") {
    const [[left, top]] = places, box = [Math.min(left, x), Math.min(top, y), Math.abs(x - left), Math.abs(y - top)];
    context.fillRect(...box);
    context.lineWidth = 1.5;
    context.strokeStyle = colours.accent;
    context.strokeRect(...box);
  } else if (kind === "disc") {
    const [centre_x, centre_y] = places[0];
    context.arc(centre_x, centre_y, Math.hypot(x - centre_x, y - centre_y), 0, 2 * Math.PI);
    context.fill();
    context.lineWidth = 1.5;
    context.strokeStyle = colours.accent;
    context.stroke();
  } else if (places.length > 1) {
    places.forEach(([to_x, to_y], k) => (k ? context.lineTo(to_x, to_y) : context.moveTo(to_x, to_y)));
    context.stroke();
  }
}

function paintPreview(context, viewport, preview, colours) {
  const { kind, points, brush_mm, isDrawing, text } = preview, [x, y] = viewport.toScreen(...points.at(-1));
  if (isDrawing) paintShape(context, viewport, preview, colours);
  strokeRing(context, x, y, Math.max(3, (brush_mm * viewport.scale) / 2), colours.accent, 1.5);
  if (kind === "rectangle" || kind === "line" || kind === "disc") {
    context.beginPath();
    context.moveTo(x - 9, y);
    context.lineTo(x + 9, y);
    context.moveTo(x, y - 9);
    context.lineTo(x, y + 9);
    context.stroke();
  }
  paintText(context, viewport, text, x, y, colours);
}

function paintText(context, viewport, lines, x, y, colours) {
  context.font = "600 13px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "middle";
  const width = Math.max(...lines.map((line) => context.measureText(line).width)) + 14, height = 18 * lines.length + 6;
  const left = Math.max(4, x + 18 + width > viewport.width_px ? x - 18 - width : x + 18);
  const top = Math.max(4, Math.min(y + 14, viewport.height_px - height - 4));
  context.fillStyle = colours.ruler;
  context.beginPath();
  context.roundRect(left, top, width, height, 5);
  context.fill();
  context.fillStyle = colours.ink;
  lines.forEach((line, k) => context.fillText(line, left + 7, top + 12 + 18 * k));
}
