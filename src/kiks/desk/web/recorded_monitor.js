/* The monitor (see monitor.js) on a page without a desk: its elements, made without Vue. A click on a number shows the
   rays of its sensor. */

import { CURVES, isDashed, lineColour } from "./curves.js";
import { Monitor } from "./monitor.js";
import { placeOfNumber } from "./robot_drawing.js";

/** What a recording does not know of, or what the player shows. */
const LEFT_OUT = new Set(["Clock", "Line"]);

export class RecordedMonitor {
  /** `root` is an empty element of the player, `facts` an empty list in it. */
  constructor(root, facts) {
    const robot = make("canvas"), around = make("div", "kiks-monitor-robot", robot), near = [], light = [];
    this._chips = CURVES.proximity.names.map((name, sensor) => {
      near.push(this._number(sensor, "proximity"));
      light.push(this._number(sensor, "ambient"));
      const chip = make("div", "kiks-chip", make("span", "kiks-chip-name", name), near[sensor], light[sensor]);
      const [across, down] = placeOfNumber(sensor);
      [chip.style.left, chip.style.top] = [`${100 * across}%`, `${100 * down}%`];
      return chip;
    });
    around.append(...this._chips);
    this._numbers = { proximity: near, ambient: light };
    const wheels = ["left", "right"].map((side) => {
      const fill = make("i", "kiks-wheel-fill"), mark = make("i", "kiks-wheel-mark");
      return { side, fill, mark, text: make("span", "kiks-wheel-text") };
    });
    const bars = wheels.flatMap(({ side, fill, mark, text }) =>
      [make("span", "", side), make("span", "kiks-wheel-bar", fill, make("i", "kiks-wheel-middle"), mark), text]);
    this._choices = Object.entries(CURVES).map(([kind, { label }]) => {
      const choice = make("button", "", label);
      choice.addEventListener("click", () => this._show(kind));
      return Object.assign(choice, { kind });
    });
    this._note = make("span", "kiks-curve-note");
    this._legend = make("div", "kiks-legend");
    this._camera = make("div", "", make("div", "kiks-monitor-title", "Camera: 64 pixels from the left"));
    const curves = make("canvas", "kiks-curves"), camera = make("canvas", "kiks-camera");
    this._camera.append(camera);
    this._camera.hidden = true;
    this._facts = facts;
    this._absent = make("p", "kiks-monitor-empty", root.dataset.absent);
    this._known = make("div", "", around,
      make("p", "kiks-monitor-hint", "Upper number: proximity, 0 to 1023. Lower one: light, less is brighter."),
      make("div", "kiks-wheels", ...bars), make("div", "kiks-curve-choice", ...this._choices, this._note), curves,
      this._legend, this._camera);
    root.classList.add("kiks-monitor");
    root.append(this._absent, this._known);
    // It draws while any part of the player is on the screen, for `facts` stand elsewhere in it.
    const parts = {
      root: root.parentElement, robot, curves, camera: () => camera, wheels: () => wheels, numbers: () => this._numbers,
    };
    this.monitor = new Monitor(parts, "", (event, detail) => this._hear(event, detail));
    this._show("proximity");
  }

  setRobot(index) { this.monitor.setRobot(index); }

  /** Take the colours of the page, light or dark. */
  dress() {
    this._chips.forEach((chip, sensor) => (chip.style.borderColor = lineColour("proximity", sensor, this.monitor.isDark)));
    this._write();
  }

  _number(sensor, which) {
    const number = make("button", which === "ambient" ? "kiks-chip-light" : "", "0");
    const what = which === "ambient" ? "light" : "proximity";
    number.title = `Sensor ${sensor}: ${what}. Click to show its rays`;
    number.addEventListener("click", () => {
      const { chosen } = this.monitor, isSame = chosen?.sensor === sensor && chosen.which === which;
      this.monitor.choose(isSame ? null : { sensor, which });
      for (const [kind, numbers] of Object.entries(this._numbers))
        numbers.forEach((each, k) => each.classList.toggle("chosen", !isSame && k === sensor && kind === which));
    });
    return number;
  }

  _show(kind, hidden = new Set()) {
    this._hidden = hidden;
    this.monitor.show(kind, hidden);
    this._note.textContent = CURVES[kind].note;
    for (const choice of this._choices) choice.classList.toggle("chosen", choice.kind === kind);
    this._write();
  }

  /** Write the legend of the curves. */
  _write() {
    const { kind, isDark } = this.monitor;
    this._legend.replaceChildren(...CURVES[kind].names.map((name, line) => {
      const sample = make("i"), entry = make("button", this._hidden.has(line) ? "off" : "", sample, name);
      sample.style.borderTopColor = lineColour(kind, line, isDark);
      sample.style.borderTopStyle = isDashed(kind, line) ? "dashed" : "solid";
      entry.title = "Show or hide this line";
      entry.addEventListener("click", () => this._show(kind, toggled(this._hidden, line)));
      return entry;
    }));
  }

  _hear(event, detail) {
    if (event === "known") {
      this._known.hidden = this._facts.hidden = !detail;
      this._absent.hidden = Boolean(detail);
    } else if (event === "facts") {
      this._camera.hidden = !detail.hasCamera;
      const rows = detail.rows.filter(([name]) => !LEFT_OUT.has(name));
      this._facts.replaceChildren(...rows.map(([name, value]) => make("div", "", make("dt", "", name), make("dd", "", value))));
    }
  }
}

function toggled(lines, line) {
  const others = new Set(lines);
  if (!others.delete(line)) others.add(line);
  return others;
}

function make(tag, name = "", ...children) {
  const element = document.createElement(tag);
  if (tag === "button") element.type = "button";
  if (name) element.className = name;
  element.append(...children);
  return element;
}
