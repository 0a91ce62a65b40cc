/* The monitor of one robot: its readings around it, curves of the last seconds, its camera and what else is known of it,
   made of plain elements and drawn from the page's feed for each picture of the screen. monitor_view.js is its component
   on the desk; the page of a recorded run has it without Vue. */

import { Answer } from "./answer.js";
import { READING_COLOURS, readingBucket } from "./colours.js";
import { paintCameraStrip } from "./camera_strip.js";
import { shownSensor } from "./coordinates.js";
import { CURVES, isDashed, lineColour, paintCurves } from "./curves.js";
import { make } from "./elements.js";
import { factsOf } from "./facts.js";
import { pageFeed } from "./feed.js";
import { SENSORS } from "./frame.js";
import { History } from "./history.js";
import { paintLargeRobot, placesOfNumbers } from "./robot_drawing.js";
import { RobotLook } from "./top_robots.js";

const FACTS_MS = 100;
/** Full scale of the wheels' bars [8 mm/s]; a faster wheel extends it. */
const SPEED_SCALE = 20;
const DARK_COUNTS = 450;
const IDLE = { light: [226, 230, 235], dark: [58, 66, 76] };

export class Monitor {
  /** `root` is where it is put; `feed` is the address of the page's feed.

      `tell(event, detail)` is called with "explain", {sensor, which} when a person clicks a reading, for which `purpose`
      says what that does, and null when one closes its explanation; with "keep", whether that is to follow the world;
      if `asksToKeep`, and with "seen", whether the monitor is on the screen. `absent` is read while there is no such
      robot. `facts` is where the list of facts stands if it is not part of the monitor, without those that `leftOut`
      names. */
  constructor(root, feed, tell, { purpose, absent, asksToKeep = false, facts = null, leftOut = [] }) {
    this.feed = pageFeed(feed);
    this.index = 0;
    this.chosen = null;
    this.frames_drawn = 0;
    this._tell = tell;
    this._purpose = purpose;
    this._leftOut = leftOut;
    this._history = new History();
    this._look = null;
    this._isWanted = true;
    this._areFactsOld = false;
    this._facts_ms = 0;
    this._isSeen = false;
    this._answer = new Answer(() => tell("explain", null), asksToKeep ? (isKept) => tell("keep", isKept) : null);
    this._build(root, absent, facts);
    this._ends = [
      this.feed.on("scene", () => this._takeScene()),
      this.feed.on("shapes", (scene) => this._look?.setShapes(scene.robots[this.index]?.shapes)),
      this.feed.on("frame", (frame) => this._take(frame)),
    ];
    // Facts that stand elsewhere are in the same part of the page.
    const whole = facts ? root.parentElement : root;
    this._eye = new IntersectionObserver((entries) => this._see(entries.at(-1).isIntersecting));
    this._eye.observe(whole);
    this._sizes = new ResizeObserver(() => (this._isWanted = true));
    this._sizes.observe(whole);
    this._show("proximity");
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

  /** Mark the reading {sensor, which} and the rays of its sensor; null for none. */
  choose(chosen) {
    this.chosen = chosen;
    this._isWanted = true;
    for (const number of [...this._near, ...this._light]) {
      const isChosen = number.sensor === chosen?.sensor && number.which === chosen.which;
      number.classList.toggle("chosen", isChosen);
      number.setAttribute("aria-pressed", isChosen);
    }
  }

  /** Show an explanation (see answer.js) below the readings; null for none. */
  explain(why) {
    this._answer.show(why, this.feed.scene, this.isDark);
  }

  _build(root, absent, facts) {
    const labelled = (role, label, name, ...children) => make("div", { role, class: name, "aria-label": label }, ...children);
    const picture = (name, label) => make("canvas", { class: name, role: "img", "aria-label": label });
    this._robot = make("canvas", { "aria-hidden": true });
    [this._near, this._light] = ["proximity", "ambient"].map((which) =>
      Array.from({ length: SENSORS }, (_, sensor) => this._number(sensor, which)));
    this._names = this._near.map(() => make("span", { class: "kiks-chip-name", "aria-hidden": true }));
    this._chips = this._names.map((name, sensor) =>
      make("div", { class: "kiks-chip" }, name, this._near[sensor], this._light[sensor]));
    this._wheels = ["left", "right"].map((side) => ({
      side, fill: make("i", { class: "kiks-wheel-fill" }), mark: make("i", { class: "kiks-wheel-mark" }),
      text: make("span", { class: "kiks-wheel-text", "data-testid": `speed-${side}` }),
      bar: make("span", { class: "kiks-wheel-bar" }),
    }));
    const bars = this._wheels.flatMap(({ side, fill, mark, text, bar }) => {
      bar.append(fill, make("i", { class: "kiks-wheel-middle" }), mark);
      return [make("span", {}, side), bar, text];
    });
    this._choices = Object.entries(CURVES).map(([kind, { label }]) => {
      const title = `Curves of ${label.toLowerCase()}`;
      const choice = make("button", { role: "radio", title, "data-testid": `curves-${kind}` }, label);
      choice.addEventListener("click", () => this._show(kind));
      return Object.assign(choice, { kind });
    });
    this._note = make("span", { class: "kiks-curve-note" });
    this._curves = picture("kiks-curves", "");
    this._legend = labelled("group", "Lines to show", "kiks-legend");
    this._camera = picture("kiks-camera", "Picture of the camera");
    this._camera.dataset.testid = "camera-strip";
    this._hasCamera = make("div", { hidden: "" },
      make("div", { class: "kiks-monitor-title" }, "Camera: 64 pixels from the left"), this._camera);
    this._facts = facts ?? make("dl", { class: "kiks-facts", "data-testid": "facts" });
    this._absent = make("div", { class: "kiks-monitor-empty", role: "status" }, absent);
    const hint = `Upper number: proximity, more is nearer. Lower one: light, less is brighter. Click one ${this._purpose}.`;
    this._known = make("div", { hidden: "" },
      labelled("group", `Sensors around the robot: click one ${this._purpose}`, "kiks-monitor-robot", this._robot, ...this._chips),
      make("p", { class: "kiks-monitor-hint" }, hint), this._answer.root,
      labelled("group", "Wheels: measured and commanded speed", "kiks-wheels", ...bars),
      labelled("radiogroup", "Curves to show", "kiks-curve-choice", ...this._choices, this._note),
      this._curves, this._legend, this._hasCamera, facts ? "" : this._facts);
    root.append(this._absent, this._known);
  }

  _number(sensor, which) {
    const look = which === "ambient" ? "kiks-chip-light" : "";
    const number = make("button", { class: look, "aria-pressed": false, "data-testid": `${which}-${sensor}` }, "0");
    number.addEventListener("click", () => this._tell("explain", { sensor, which }));
    return Object.assign(number, { sensor, which });
  }

  /** Show the curves of a kind, with all their lines. */
  _show(kind) {
    this._kind = kind;
    this._hidden = new Set();
    this._writeNote();
    this._curves.ariaLabel = `${CURVES[kind].label} over the last seconds`;
    for (const choice of this._choices) {
      choice.classList.toggle("chosen", choice.kind === kind);
      choice.ariaChecked = choice.kind === kind;
    }
    this._writeLegend();
  }

  _writeNote() {
    this._note.textContent = CURVES[this._kind].note ?? this.feed.scene?.robots[this.index]?.speed_unit ?? "";
  }

  _writeLegend() {
    const { names, titles } = CURVES[this._kind];
    this._legend.replaceChildren(...names.map((name, line) => {
      const entry = make("button", {}, make("i"), titles ? name : this._names[line].textContent);
      entry.title = `${titles?.[line] ?? this._near[line].what}: show or hide its line`;
      const mark = () => {
        entry.classList.toggle("off", this._hidden.has(line));
        entry.ariaPressed = !this._hidden.has(line);
        this._isWanted = true;
      };
      mark();
      entry.addEventListener("click", () => {
        if (!this._hidden.delete(line)) this._hidden.add(line);
        mark();
      });
      return entry;
    }));
    this._dress();
  }

  /** Give chips and legend the colours of their curves. */
  _dress() {
    this._chips.forEach((chip, sensor) => (chip.style.borderColor = lineColour("proximity", sensor, this.isDark)));
    [...this._legend.children].forEach(({ firstChild }, line) => {
      firstChild.style.borderTopColor = lineColour(this._kind, line, this.isDark);
      firstChild.style.borderTopStyle = isDashed(this._kind, line) ? "dashed" : "solid";
    });
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
    this._absent.hidden = Boolean(known);
    this._known.hidden = this._facts.hidden = !known;
    if (known) this._nameSensors(known);
    this._facts_ms = 0;
    if (this.feed.frame) this._take(this.feed.frame);
  }

  _nameSensors({ sensors, speed_unit }) {
    for (const { side, bar } of this._wheels)
      bar.title = `Speed of the ${side} wheel in ${speed_unit}: the bar shows the measured speed, the line the commanded one`;
    this._writeNote();
    sensors.forEach(({ name }, sensor) => {
      const number = shownSensor(this.feed.scene, sensor), near = this._near[sensor], light = this._light[sensor];
      near.what = `Sensor ${number}, ${name}`;
      near.title = `${near.what}: proximity. Click ${this._purpose}`;
      light.title = `${near.what}: light, less is brighter. Click ${this._purpose}`;
      this._names[sensor].textContent = number;
    });
    placesOfNumbers(sensors).forEach(([across, down], sensor) =>
      Object.assign(this._chips[sensor].style, { left: `${100 * across}%`, top: `${100 * down}%` }));
    this._writeLegend();
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
    if (isDark !== this._wasDark) this._dress();
    if (this._isWanted) this._draw(scene, frame, isDark);
    if (!this._areFactsOld || now_ms - this._facts_ms < FACTS_MS) return;
    this._areFactsOld = false;
    this._facts_ms = now_ms;
    this._writeFacts(scene, frame);
  }

  _draw(scene, frame, isDark) {
    this._isWanted = false;
    this._areFactsOld = true;
    this._wasDark = isDark;
    this.frames_drawn++;
    const chosen = this.chosen?.sensor ?? -1, known = scene.robots[this.index];
    onCanvas(this._robot, (context, width, height, ratio) =>
      paintLargeRobot(context, width, height, ratio, this._look, scene, frame, this.index, chosen, isDark));
    onCanvas(this._curves, (context, width, height) =>
      paintCurves(context, width, height, this._history, this._kind, this._hidden, known, isDark));
    const camera = frame.camera(this.index);
    if (camera) onCanvas(this._camera, (context, width, height) => paintCameraStrip(context, width, height, camera, isDark));
    const robot = frame.robot(this.index);
    this._writeNumbers(robot, known.scales, isDark);
    this._writeWheels(robot, known);
  }

  _writeFacts(scene, frame) {
    this._hasCamera.hidden = !frame.camera(this.index);
    const rows = factsOf(scene, frame, this.index).filter(([name]) => !this._leftOut.includes(name));
    this._facts.replaceChildren(...rows.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
  }

  _writeNumbers(robot, scales, isDark) {
    for (let sensor = 0; sensor < SENSORS; sensor++) {
      const near = robot.proximity[sensor], light = robot.ambient[sensor], bucket = readingBucket(near, scales);
      write(this._near[sensor], near, bucket ? READING_COLOURS[bucket] : IDLE[isDark ? "dark" : "light"]);
      write(this._light[sensor], light, lightColour(light * scales.ambient));
    }
  }

  _writeWheels(robot, { speed_scale }) {
    const most = Math.max(SPEED_SCALE * speed_scale, ...[...robot.speeds, ...robot.commanded].map((speed) => Math.abs(speed) || 0));
    this._wheels.forEach(({ fill, mark, text }, wheel) => {
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
