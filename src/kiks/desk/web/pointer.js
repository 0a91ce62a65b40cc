/* Mouse, pen and fingers: drag things, turn robots by their rim, pan, pinch, draw with a tool, and pick.

   The pointer works on a surface: {element, toArena(clientX, clientY) -> [x_mm, y_mm] or null, scale (pixels/mm),
   viewport or null, claim(isClaimed)}. The top view has a viewport to pan and zoom; the 3-D view moves its camera by
   itself while the pointer is not claimed. */

import { thingAt } from "./things.js";

/** A press that moves less than this is a click [pixels]. */
const CLICK_PX = { mouse: 4, pen: 6, touch: 9 };
const MIDDLE = 1, RIGHT = 2;

export class Pointer {
  /** `tell` is {pick(pick), edit(thing, place), draw(stroke), view(), fit()}: a click, a double click, a stroke, a view
      moved by hand, a request to show the whole arena. */
  constructor(surface, feed, hand, drawing, tell) {
    Object.assign(this, { surface, feed, hand, drawing, tell });
    this._fingers = new Map();
    this._press = null;
    const { element } = surface;
    const listen = (name, act, options) => element.addEventListener(name, act.bind(this), options);
    listen("pointerdown", this._down);
    listen("pointermove", this._move);
    listen("pointerup", this._up);
    listen("pointercancel", this._lose);
    listen("lostpointercapture", this._lose);
    listen("pointerleave", this._leave);
    listen("contextmenu", (event) => event.preventDefault());
    listen("dblclick", this._double);
    if (surface.viewport) listen("wheel", this._wheel, { passive: false });
    if (getComputedStyle(element).touchAction !== "none") listen("touchstart", this._touch, { passive: false });
  }

  _down(event) {
    this.surface.element.focus({ preventScroll: true });
    this._fingers.set(event.pointerId, event);
    if (this._fingers.size > 1) return this._beginPinch();
    const place = this.surface.toArena(event.clientX, event.clientY);
    if (!place) return;
    const isDrawing = this.drawing.isActive && this.surface.viewport && event.button === 0;
    const thing = this.drawing.isActive ? { what: "floor", index: -1, sensor: -1 } : this._at(place);
    const isPan = event.button === MIDDLE || (thing.what === "floor" && !isDrawing);
    this._press = {
      thing, place, event, isMoved: false, isDrawing, isPan,
      isTurning: thing.isRim || event.shiftKey || event.button === RIGHT,
    };
    if (isPan && !this.surface.viewport) return;
    this.surface.claim(true);
    capture(this.surface.element, event.pointerId);
    if (isDrawing) this.drawing.begin(...place);
  }

  /** Where a finger on the floor scrolls the page, one on a thing does not, nor do two: they move the view. */
  _touch(event) {
    if (!this._press?.isPan) event.preventDefault();
  }

  _move(event) {
    const place = this.surface.toArena(event.clientX, event.clientY), press = this._press;
    const before = this._fingers.get(event.pointerId);
    if (before) this._fingers.set(event.pointerId, event);
    if (this._pinch) return this._pinchTo();
    if (!press) {
      if (!place) return;
      if (this.drawing.isActive && this.surface.viewport) this.drawing.moveTo(...place);
      else this._hover(event, place);
      return;
    }
    if (!before) return;
    if (press.isDrawing) {
      if (place) this.drawing.moveTo(...place);
      return;
    }
    const far_px = Math.hypot(event.clientX - press.event.clientX, event.clientY - press.event.clientY);
    if (!press.isMoved && far_px > CLICK_PX[event.pointerType || "mouse"]) this._beginDrag(press);
    if (!press.isMoved) return;
    if (!press.isPan) {
      if (place) this.hand.dragTo(...place);
    } else if (this.surface.viewport) {
      this.surface.viewport.panBy(event.clientX - press.last.clientX, event.clientY - press.last.clientY);
      press.last = event;
      this.tell.view();
    }
  }

  _beginDrag(press) {
    press.isMoved = true;
    press.last = press.event;
    if (press.isPan) return;
    this.hand.select(press.thing);
    this.hand.grab(press.thing, press.isTurning, ...press.place);
  }

  _up(event) {
    const press = this._press;
    this._fingers.delete(event.pointerId);
    if (this._pinch) {
      if (!this._fingers.size) this._pinch = null;
      return;
    }
    this._press = null;
    this.surface.claim(false);
    if (!press) return;
    if (press.isDrawing) {
      const stroke = this.drawing.end();
      if (stroke) this.tell.draw(stroke);
    } else if (press.isMoved) {
      this.hand.drop();
    } else if (event.button !== MIDDLE && !this.drawing.isActive) {
      this._pick(press);
    }
  }

  /** The system has cancelled the pointer; the held thing stays where it is. */
  _lose(event) {
    if (!this._fingers.delete(event.pointerId)) return;
    if (!this._fingers.size) this._pinch = null;
    this._press = null;
    this.surface.claim(false);
    this.drawing.cancel();
    this.hand.drop();
  }

  _leave(event) {
    if (this._press || event.pointerType === "touch") return;
    this.hand.hover(null);
    if (!this.drawing.isDrawing) this.drawing.cancel();
  }

  _pick({ thing, place }) {
    this.hand.select(thing.what === "floor" ? null : thing);
    const what = thing.sensor >= 0 ? "sensor" : thing.what;
    this.tell.pick({ what, index: thing.index, sensor: thing.sensor, x_mm: place[0], y_mm: place[1] });
  }

  _at([x_mm, y_mm]) {
    return thingAt(this.feed, x_mm, y_mm, this.surface.scale, this.hand.selected ?? this.hand.hovered);
  }

  _hover(event, place) {
    if (event.pointerType === "touch") return;
    const thing = this._at(place);
    this.hand.hover(thing);
    const isFloor = thing.what === "floor";
    this.surface.element.style.cursor = isFloor ? "" : thing.isRim || event.shiftKey ? "alias" : "grab";
  }

  _beginPinch() {
    if (!this.surface.viewport) return;
    this.hand.drop();
    this.drawing.cancel();
    this._press = null;
    this._pinch = this._span();
  }

  _pinchTo() {
    if (this._fingers.size < 2) return;
    const { viewport, element } = this.surface, before = this._pinch, now = this._span();
    const { left, top } = element.getBoundingClientRect();
    viewport.panBy(now.x - before.x, now.y - before.y);
    viewport.zoomAbout(now.x - left, now.y - top, now.wide / before.wide);
    this._pinch = now;
    this.tell.view();
  }

  _span() {
    const [one, other] = [...this._fingers.values()];
    return {
      x: (one.clientX + other.clientX) / 2,
      y: (one.clientY + other.clientY) / 2,
      wide: Math.max(10, Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY)),
    };
  }

  _wheel(event) {
    event.preventDefault();
    const { left, top } = this.surface.element.getBoundingClientRect();
    const lines_px = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    const strength = event.ctrlKey ? 0.01 : 0.0016;
    const way = Math.max(-300, Math.min(300, event.deltaY * lines_px));
    this.surface.viewport.zoomAbout(event.clientX - left, event.clientY - top, Math.exp(-strength * way));
    this.tell.view();
  }

  _double(event) {
    const place = this.surface.toArena(event.clientX, event.clientY);
    if (!place || this.drawing.isActive) return;
    this.tell.edit(this._at(place), { x_mm: place[0], y_mm: place[1] });
  }
}

/** Capture a pointer, and ignore the error if it has already gone. */
function capture(element, pointer) {
  try {
    element.setPointerCapture(pointer);
  } catch (error) {
    if (error.name !== "NotFoundError") throw error;
  }
}
