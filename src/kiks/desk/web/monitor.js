/* The monitor: one robot's readings, drawn from the page's feed for each picture of the screen.
   It does not depend on Vue; monitor_view.js is its component. */

import { READING_COLOURS, readingBucket } from "./colours.js";
import { paintCameraStrip } from "./camera_strip.js";
import { shownSensor } from "./coordinates.js";
import { paintCurves } from "./curves.js";
import { factsOf } from "./facts.js";
import { pageFeed } from "./feed.js";
import { SENSORS } from "./frame.js";
import { History } from "./history.js";
import { paintLargeRobot } from "./robot_drawing.js";
import { RobotLook } from "./top_robots.js";

const FACTS_MS = 100;
/** Full scale of the wheels' bars [pulses/10 ms]; a faster wheel extends it. */
const SPEED_SCALE = 20;
const DARK_COUNTS = 450;
const IDLE = { light: [226, 230, 235], dark: [58, 66, 76] };

export class Monitor {
  /** `parts` is {root, robot, curves, camera, wheels, numbers}; `tell` is called with (event, detail). */
  constructor(parts, path, tell) {
    Object.assign(this, parts);
    this.feed = pageFeed(path);
    this.index = 0;
    this.kind = "proximity";
    this.hidden = new Set();
    this.chosen = null;
    this.frames_drawn = 0;
    this._tell = tell;
    this._history = new History();
    this._look = null;
    this._isWanted = true;
    this._areFactsOld = false;
    this._facts_ms = 0;
    this._isSeen = false;
    this._ends = [
      this.feed.on("scene", () => this._takeScene()),
      this.feed.on("shapes", (scene) => this._look?.setShapes(scene.robots[this.index]?.shapes)),
      this.feed.on("frame", (frame) => this._take(frame)),
    ];
    this._eye = new IntersectionObserver((entries) => this._see(entries.at(-1).isIntersecting));
    this._eye.observe(this.root);
    this._sizes = new ResizeObserver(() => (this._isWanted = true));
    this._sizes.observe(this.root);
    this._takeScene();
    this._beat = requestAnimationFrame((now_ms) => this._tick(now_ms));
  }

  dispose() {
    cancelAnimationFrame(this._beat);
    this._eye.disconnect();
    this._sizes.disconnect();
    for (const end of this._ends) end();
  }

  setRobot(index) {
    this.index = index;
    this._history.clear();
    this._takeScene();
  }

  show(kind, hidden) {
    this.kind = kind;
    this.hidden = new Set(hidden);
    this._isWanted = true;
  }

  choose(chosen) {
    this.chosen = chosen;
    this._isWanted = true;
  }

  get isDark() {
    return document.body.classList.contains("body--dark");
  }

  _see(isSeen) {
    if (isSeen !== this._isSeen) this._tell("seen", isSeen);
    this._isSeen = isSeen;
    this._isWanted = true;
  }

  _takeScene() {
    const known = this.feed.scene?.robots[this.index];
    this._look = known ? new RobotLook(known) : null;
    this._tell("known", known ?? null);
    this._tell("firstSensor", shownSensor(this.feed.scene, 0));
    this._facts_ms = 0;
    if (this.feed.frame) this._take(this.feed.frame);
  }

  _take(frame) {
    if (!this._look || this.index >= frame.robot_count) return;
    this._history.note(frame.time_s, frame.robot(this.index));
    this._isWanted = true;
  }

  _tick(now_ms) {
    this._beat = requestAnimationFrame((later_ms) => this._tick(later_ms));
    const { scene, frame } = this.feed, isDark = this.isDark;
    if (!this._isSeen || !this._look || !frame || this.index >= frame.robot_count) return;
    if (this._isWanted || isDark !== this._wasDark) this._draw(scene, frame, isDark);
    if (!this._areFactsOld || now_ms - this._facts_ms < FACTS_MS) return;
    this._areFactsOld = false;
    this._facts_ms = now_ms;
    this._tell("facts", { rows: factsOf(scene, frame, this.index), hasCamera: frame.camera(this.index) !== null });
  }

  _draw(scene, frame, isDark) {
    this._isWanted = false;
    this._areFactsOld = true;
    this._wasDark = isDark;
    this.frames_drawn++;
    const chosen = this.chosen?.sensor ?? -1;
    onCanvas(this.robot, (context, width, height, ratio) =>
      paintLargeRobot(context, width, height, ratio, this._look, scene, frame, this.index, chosen, isDark));
    onCanvas(this.curves, (context, width, height) =>
      paintCurves(context, width, height, this._history, this.kind, this.hidden, isDark));
    const camera = frame.camera(this.index);
    if (camera) onCanvas(this.camera(), (context, width, height) => paintCameraStrip(context, width, height, camera, isDark));
    const robot = frame.robot(this.index);
    this._writeNumbers(robot, isDark);
    this._writeWheels(robot);
  }

  _writeNumbers(robot, isDark) {
    const buttons = this.numbers();
    for (let sensor = 0; sensor < SENSORS; sensor++) {
      const near = robot.proximity[sensor], light = robot.ambient[sensor], bucket = readingBucket(near);
      write(buttons.proximity[sensor], near, bucket ? READING_COLOURS[bucket] : IDLE[isDark ? "dark" : "light"]);
      write(buttons.ambient[sensor], light, lightColour(light));
    }
  }

  _writeWheels(robot) {
    const most = Math.max(SPEED_SCALE, ...[...robot.speeds, ...robot.commanded].map((speed) => Math.abs(speed) || 0));
    this.wheels().forEach(({ fill, mark, text }, wheel) => {
      const speed = robot.speeds[wheel], wanted = robot.commanded[wheel], isFree = Number.isNaN(wanted);
      fill.style.left = `${50 + Math.min(0, (50 * speed) / most)}%`;
      fill.style.width = `${Math.abs((50 * speed) / most)}%`;
      mark.style.display = isFree ? "none" : "";
      if (!isFree) mark.style.left = `${50 + (50 * wanted) / most}%`;
      text.textContent = isFree ? `${speed}, by voltage` : `${speed}, set ${Math.round(10 * wanted) / 10}`;
    });
  }
}

/** Return the colour of a light reading: yellow in bright light, blue in the dark. */
function lightColour(counts) {
  const share = 1 - Math.min(Math.max(counts / DARK_COUNTS, 0), 1);
  return [40 + 215 * share, 52 + 162 * share, 78 + 18 * share].map(Math.round);
}

/** Write a number on its button, and set its background: the text is black on bright colours, white on dark ones. */
function write(button, counts, [red, green, blue]) {
  const text = String(Math.round(counts));
  if (button.firstChild.data !== text) button.firstChild.data = text;
  button.style.background = `rgb(${red},${green},${blue})`;
  button.style.color = 0.3 * red + 0.59 * green + 0.11 * blue > 110 ? "#000000" : "#ffffff";
}

/** Draw on a canvas in CSS pixels at the resolution of the screen; skip a canvas without a size. */
function onCanvas(canvas, paint) {
  const width = canvas?.clientWidth ?? 0, height = canvas?.clientHeight ?? 0, ratio = window.devicePixelRatio || 1;
  if (!width || !height) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  paint(context, width, height, ratio);
}
