/* The keys of the arena. What people read of them is in panels/shortcuts.py. */

import { allThings, isSame } from "./things.js";

const STEP_MM = 10;
const SMALL_STEP_MM = 1;
const TURN_RAD = (5 * Math.PI) / 180;
const PAN_PX = 60;
const ZOOM = 1.25;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const TURNS = { q: 1, "<": 1, e: -1, ">": -1 };

/** Handle a key; return whether it was a shortcut. `tell` is that of the pointer. */
export function pressKey(event, feed, hand, drawing, viewport, tell) {
  if (event.ctrlKey || event.altKey || event.metaKey) return false;
  const { key } = event;
  if (key === "Tab" || key === "n" || key === "N") return choose(feed, hand, event.shiftKey ? -1 : 1, key !== "Tab");
  if (key === "Escape") {
    if (drawing.isDrawing) drawing.cancel();
    else if (hand.holding) hand.cancel();
    else hand.select(null);
    return true;
  }
  if (key in ARROWS) {
    const [right, up] = ARROWS[key], step_mm = event.shiftKey ? SMALL_STEP_MM : STEP_MM;
    if (hand.selected) return hand.step(right * step_mm, up * step_mm, 0);
    viewport.panBy(-right * PAN_PX, up * PAN_PX);
    tell.view();
    return true;
  }
  if (key === "Enter") {
    if (hand.selected) tell.edit(hand.selected);
    return Boolean(hand.selected);
  }
  if (key === "Delete") {
    if (hand.selected && !hand.holding) tell.remove(hand.selected);
    return true;
  }
  if (key in TURNS) return hand.step(0, 0, TURNS[key] * TURN_RAD);
  if (key === "+" || key === "=" || key === "-") {
    viewport.zoomAbout(viewport.width_px / 2, viewport.height_px / 2, key === "-" ? 1 / ZOOM : ZOOM);
    tell.view();
    return true;
  }
  if (key === "f" || key === "0") {
    tell.fit();
    return true;
  }
  return false;
}

/** Select the next thing. After the last one, Tab leaves the view, so that it does not trap the focus. */
function choose(feed, hand, way, isRound) {
  const things = allThings(feed), at = things.findIndex((thing) => isSame(thing, hand.selected));
  let next = at < 0 && way < 0 ? things.length - 1 : at + way;
  if (isRound && things.length) next = (next + things.length) % things.length;
  hand.select(things[next] ?? null);
  return next >= 0 && next < things.length;
}
