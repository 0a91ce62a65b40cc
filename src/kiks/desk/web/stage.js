/* The stage: both views of the arena in one element, with pointer and keyboard, drawn for each picture of the screen.
   It does not depend on Vue; arena_view.js is its component. */

import { clockText } from "./clock.js";
import { shownPlace } from "./coordinates.js";
import { make } from "./elements.js";
import { pageFeed } from "./feed.js";
import { Hand } from "./hand.js";
import { pressKey } from "./keys.js";
import { Pointer } from "./pointer.js";
import { loadRaster } from "./raster.js";
import { saveSnapshot } from "./snapshot.js";
import { nameOf, placeOf } from "./things.js";
import { Drawing } from "./tools.js";
import { TopView } from "./top_view.js";

const OBJECTION_MS = 5000;
const CONNECTIONS = {
  connecting: "Connecting to KiKS …",
  lost: "No connection to KiKS. Trying again …",
  away: "The room has ended, or cannot be reached. What you type stays in this browser. This page goes on by itself when the room is back.",
  gone: "KiKS has ended, or this page has lost it. Open the address that KiKS prints when you start it.",
};

export class Stage {
  /** `root` is the element that it fills, `keys` says what keys do, and `tell(event, detail)` is called with what a person does. */
  constructor(root, path, keys, tell) {
    this.root = root;
    this._keys = keys;
    this.top = canvasOf(`Arena from above. ${keys}`);
    this.top.dataset.testid = "arena-top";
    this.topPane = make("div", { class: "kiks-pane kiks-top" }, this.top);
    this.solidPane = make("div", { class: "kiks-pane kiks-solid", "data-testid": "arena-solid" });
    this.notice = make("div", { class: "kiks-notice", role: "status", "data-testid": "arena-notice", hidden: "" });
    this.live = make("div", { class: "kiks-live", "aria-live": "polite" });
    root.append(this.topPane, this.solidPane, this.notice, this.live);
    this.feed = pageFeed(path);
    this.hand = new Hand(this.feed);
    this.drawing = new Drawing(this.feed);
    this.topView = new TopView(this.top, this.feed);
    this.solidView = null;
    this._wall = null;
    this._announced = null;
    this.view = "top";
    this.show = {};
    this.follow = -1;
    this.frames_drawn = this.solid_frames = 0;
    this._times_ms = [];
    this._isWanted = true;
    this._beats = 0;
    this._tell = {
      pick: (pick) => tell("pick", pick),
      edit: ({ what, index }, place) => {
        const { x_mm, y_mm } = place ?? placeOf(this.feed.frame, what, index);
        tell("edit", { what, index, x_mm, y_mm });
      },
      draw: (stroke) => tell("draw", stroke),
      remove: ({ what, index }) => {
        const { x_mm, y_mm } = placeOf(this.feed.frame, what, index);
        tell("remove", { x_mm, y_mm });
      },
      view: () => this.topView.keepView(),
      fit: () => this.fit(),
    };
    new Pointer(this._topSurface(), this.feed, this.hand, this.drawing, this._tell);
    this.hand.onSelect = (thing) => this._announce(thing);
    this._listen();
    this._sizes = new ResizeObserver(() => this._resize());
    for (const pane of [this.root, this.topPane, this.solidPane]) this._sizes.observe(pane);
    this._dresses = new MutationObserver(() => this._dress());
    this._dresses.observe(document.body, { attributeFilter: ["class"] });
    this._resize();
    if (this.feed.scene) this._takeScene(this.feed.scene);
    if (this.feed.bar) this._takeBar(this.feed.bar);
    this._showConnection(this.feed.connection);
    this._beat = requestAnimationFrame((now_ms) => this._tick(now_ms));
  }

  setTool(tool) {
    this.drawing.setTool(tool);
    this.top.style.cursor = this.drawing.isActive ? "crosshair" : "";
  }

  /** Mark a wall with a shape, which is {kind, points, brush_mm}; null for none. */
  setWall(wall) {
    this._wall = wall;
    this._isWanted = true;
  }

  setShow(show) {
    this.show = this.topView.show = show;
    if (this.solidView) this.solidView.show = show;
    this._isWanted = true;
  }

  setFollow(follow) {
    this.follow = this.topView.follow = follow;
    if (this.solidView) this.solidView.follow = follow;
    this._isWanted = true;
  }

  /** Draw in dark colours or in light ones; null follows the page, which Quasar marks. */
  setDark(isDark) {
    this._asked = isDark;
    this._dress();
  }

  _dress() {
    const isDark = this._asked ?? document.body.classList.contains("body--dark");
    if (isDark === this.isDark) return;
    this.isDark = isDark;
    this.root.classList.toggle("kiks-dark", isDark);
    this.topView.setDark(isDark);
    this.solidView?.setDark(isDark);
    this._isWanted = true;
  }

  setView(view) {
    this.view = view;
    this._resize();
    if (view !== "top") this._openSolid();
  }

  fit() {
    this.topView.fit();
    this.solidView?.fit();
    this._isWanted = true;
  }

  /** Download a picture of what is shown. */
  async snapshot() {
    await saveSnapshot(this);
    this._isWanted = true;
  }

  clearTrails() {
    this.topView.trails.clear();
    this._isWanted = true;
  }

  stats() {
    return {
      frames_drawn: this.frames_drawn, frames_received: this.feed.frames_received, bytes: this.feed.bytes_received,
      fps: this._fps(), solid_frames: this.solid_frames, solid_parts: this.solidView?.parts ?? 0,
    };
  }

  /** Position on the page of a place in the arena: in the top view, unless only the 3-D view is visible. */
  toClient(x_mm, y_mm) {
    if (this.view === "solid" && this.solidView) return this.solidView.toClient(x_mm, y_mm);
    const { left, top } = this.top.getBoundingClientRect(), [x, y] = this.topView.viewport.toScreen(x_mm, y_mm);
    return [left + x, top + y];
  }

  dispose() {
    cancelAnimationFrame(this._beat);
    this._isOver = true;
    this._sizes.disconnect();
    this._dresses.disconnect();
    for (const stop of this._stops) stop();
    this.hand.drop();
    this.solidView?.dispose();
  }

  _topSurface() {
    const { top, topView } = this;
    return {
      element: top,
      viewport: topView.viewport,
      get scale() { return topView.viewport.scale; },
      toArena(clientX, clientY) {
        const box = top.getBoundingClientRect();
        return topView.viewport.toArena(clientX - box.left, clientY - box.top);
      },
      claim() {},
    };
  }

  _listen() {
    this.root.addEventListener("keydown", (event) => this._press(event));
    this.root.addEventListener("keyup", () => this.root.classList.add("kiks-keys"));
    this.root.addEventListener("pointerdown", () => this.root.classList.remove("kiks-keys"));
    this._stops = [
      this.feed.on("scene", (scene) => this._takeScene(scene)),
      this.feed.on("shapes", (scene) => {
        this.topView.setShapes(scene);
        this.solidView?.setShapes(scene);
        this._isWanted = true;
      }),
      this.feed.on("frame", (frame) => {
        this.topView.trails.add(frame);
        this._announceChange(frame);
      }),
      this.feed.on("engine", () => (this._isWanted = true)), // there may be light now
      this.feed.on("bar", (bar) => this._takeBar(bar)),
      this.feed.on("connection", (connection) => {
        if (connection !== "open") this.hand.forget();
        this._showConnection(connection);
      }),
      this.feed.on("error", (text) => this._showError(text)),
    ];
  }

  _press(event) {
    if (!pressKey(event, this.feed, this.hand, this.drawing, this.topView.viewport, this._tell)) return;
    event.preventDefault();
    event.stopPropagation();
  }

  _takeBar({ is_past }) { this.root.classList.toggle("kiks-past", is_past); }

  async _takeScene(scene) {
    this.hand.forget();
    this.topView.setScene(scene);
    this.solidView?.setScene(scene);
    this._resize();
    const raster = await loadRaster(scene.arena).catch(() => null);
    if (this._isOver || scene !== this.feed.scene) return;
    if (!raster) return this._notice("The arena's picture did not arrive. Reload the page to try again.");
    this._raster = raster;
    this.topView.setRaster(raster);
    this.solidView?.setRaster(raster);
    this._isWanted = true;
  }

  async _openSolid() {
    if (this._isOpening) return;
    this._isOpening = true;
    try {
      const { SolidView } = await import("./solid_view.js");
      if (this._isOver) return;
      const canvas = canvasOf(`Arena in three dimensions. ${this._keys}`);
      const solid = new SolidView(canvas, this.feed, Boolean(this.isDark));
      this.solidPane.replaceChildren(canvas);
      new Pointer(solid, this.feed, this.hand, this.drawing, this._tell);
      solid.control();
      canvas.addEventListener("webglcontextlost", () => this._loseSolid());
      solid.show = this.show;
      solid.follow = this.follow;
      this.solidView = solid;
      this._resize();
      if (this.feed.scene) solid.setScene(this.feed.scene);
      if (this._raster) solid.setRaster(this._raster);
      this._isWanted = true;
    } catch (error) {
      this._replaceSolid(error.message);
    }
  }

  _loseSolid() {
    if (this._isOver) return;
    this.solidView = null;
    this._replaceSolid("The graphics card has lost the 3-D view. Reload the page to restore it.");
  }

  _replaceSolid(text) {
    this.solidPane.replaceChildren(make("div", { class: "kiks-message", role: "status" }, text));
  }

  _resize() {
    const { width, height } = this.root.getBoundingClientRect();
    this.root.dataset.view = this.view;
    this.root.dataset.split = this._isRoomierBeside(width, height) ? "beside" : "below";
    const fit = (pane, act) => pane.clientWidth && pane.clientHeight && act(pane.clientWidth, pane.clientHeight);
    fit(this.topPane, (wide, high) => this.topView.resize(wide, high, devicePixelRatio || 1));
    if (this.solidView) fit(this.solidPane, (wide, high) => this.solidView.resize(wide, high));
    this._isWanted = true;
  }

  /** Return whether the arena is larger with the views side by side than one above the other. */
  _isRoomierBeside(width, height) {
    const { width_mm, height_mm } = this.feed.scene?.arena ?? { width_mm: 1, height_mm: 1 };
    return Math.min(width / 2 / width_mm, height / height_mm) >= Math.min(width / width_mm, height / 2 / height_mm);
  }

  /** For each picture of the screen: send the hand's messages and draw what has changed. */
  _tick(now_ms) {
    this._beat = requestAnimationFrame((next_ms) => this._tick(next_ms));
    this.hand.flush();
    this._beats++;
    const hasChanged = this._hasChanged(now_ms), isSolidShown = this.view !== "top" && this.solidView;
    this._isSolidDue ||= hasChanged;
    if (hasChanged && this.view !== "solid") this.topView.draw(this._marks(), now_ms);
    if (isSolidShown && this._isSolidDue && this._beats % 2 === 0) {
      this.solidView.draw(this._marks(), now_ms);
      this.solid_frames++;
      this._isSolidDue = false;
    }
    if (!hasChanged) return;
    this.frames_drawn++;
    this._times_ms.push(now_ms);
    if (this._times_ms.length > 60) this._times_ms.shift();
  }

  /** The marks of the hand in both views. */
  _marks() {
    const { selected, hovered, ghost } = this.hand;
    const isFocused = this.root.classList.contains("kiks-keys") && this.root.contains(document.activeElement);
    return { selected, hovered, ghost, preview: this.drawing.preview, wall: this._wall, isFocused };
  }

  /** Return whether anything has changed; a paused world costs nothing. */
  _hasChanged(now_ms) {
    const { frame } = this.feed;
    const counts = [this.hand, this.drawing, this.topView.viewport, this.solidView].map((part) => part?.changes);
    const key = `${frame?.share(now_ms)} ${counts}`;
    const hasChanged = this._isWanted || frame !== this._seen || key !== this._key;
    [this._isWanted, this._seen, this._key] = [false, frame, key];
    return hasChanged;
  }

  _fps() {
    const now_ms = performance.now(), times = this._times_ms.filter((time_ms) => now_ms - time_ms < 2000);
    return times.length < 2 ? 0 : (1000 * (times.length - 1)) / (times.at(-1) - times[0]);
  }

  _showConnection(connection) { this._notice(CONNECTIONS[connection] ?? ""); }

  /** Show an error of the server for a while. */
  _showError(text) {
    this._notice(text);
    setTimeout(() => {
      if (this.notice.textContent === text) this._showConnection(this.feed.connection);
    }, OBJECTION_MS);
  }

  _notice(text) {
    this.notice.textContent = text;
    this.notice.hidden = !text;
  }

  /** Tell readers of screens that time stands or goes on, and which robot has touched something. */
  _announceChange(frame) {
    const { robot_count, isPaused, time_s } = frame, before = this._announced;
    const contacts = Array.from({ length: robot_count }, (_, index) => frame.robot(index).contacts);
    this._announced = { isPaused, contacts };
    if (!before) return;
    const touched = contacts.findIndex((count, index) => count > before.contacts[index]);
    if (isPaused !== before.isPaused) this.live.textContent = isPaused ? `Paused at ${clockText(time_s)}` : "Time goes on";
    else if (touched >= 0) this.live.textContent = `${nameOf(this.feed.scene, { what: "robot", index: touched })} touches something`;
  }

  _announce(thing) {
    if (!thing || !this.feed.frame) {
      this.live.textContent = "Nothing selected";
      return;
    }
    const { x_mm, y_mm } = placeOf(this.feed.frame, thing.what, thing.index);
    const [x, y] = shownPlace(this.feed.scene, x_mm, y_mm).map(Math.round);
    this.live.textContent = `${nameOf(this.feed.scene, thing)} selected, at ${x}, ${y} mm`;
  }
}

function canvasOf(label) {
  return make("canvas", { class: "kiks-canvas", tabindex: 0, role: "application", "aria-label": label });
}
