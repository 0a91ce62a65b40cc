/* The answer to a click on a reading: why it is what it is, as a drawing, in words and as a table. */

import { make } from "./elements.js";
import { drawRays } from "./explanation_drawing.js";
import { fixed, general } from "./python_numbers.js";

const RAY_COLUMNS = ["Ray", "Length [mm]", "Met", "Bright", "Angle [°]", "Counts"];
const LAMP_COLUMNS = ["Lamp", "Distance [mm]", "Angle [°]", "Power [W]", "State", "Counts"];
const TEXT_COLUMNS = ["Met", "State"];
const RAY_NOTE = "Ray 1 is the leftmost. Bright: 1 is black, 255 is white. Angle: between the ray and the normal of the " +
  "surface. Counts: by how much the reading would drop without this ray.";
const LAMP_NOTE = "Angle: from the sensor's axis. Counts: the change by this lamp; light makes readings smaller.";

export class Answer {
  /** `close()` is called when a person closes it, `keep(isKept)` when it is to follow the world, or no longer;
      without it, there is no such choice. */
  constructor(close, keep = null) {
    this._title = make("div", { class: "kiks-answer-title", role: "heading", "aria-level": 2, "aria-live": "polite" });
    const end = make("button", { "aria-label": "Close the explanation", title: "Close the explanation", "data-testid": "close-explanation" }, "✕");
    end.addEventListener("click", close);
    const box = make("input", { type: "checkbox", "data-testid": "keep-looking" });
    const ask = make("label", { title: "Update the explanation twice a second" }, box, "Keep looking");
    box.addEventListener("change", () => keep(box.checked));
    this._drawing = make("div", { "data-testid": "explanation-drawing" });
    this._text = make("p", { class: "kiks-answer-text", "data-testid": "explanation-text" });
    this._table = make("table", { "data-testid": "explanation-table" });
    this._note = make("p", { class: "kiks-answer-note" });
    this.root = make("div", { class: "kiks-answer", hidden: "", "data-testid": "explanation" },
      make("div", { class: "kiks-answer-head" }, this._title, end), this._drawing, this._text,
      keep ? ask : "", this._table, this._note);
  }

  /** Show an explanation with its `text`, whose infinite numbers may be null; hide it for null. */
  show(why, scene, isDark) {
    this.root.hidden = !why;
    if (!why) return;
    this._title.textContent = `Why does it read ${why.count}?`;
    this._text.textContent = why.text;
    this._drawing.replaceChildren(...(why.rays ? [drawRays(why, scene, isDark)] : []));
    this._fill(...(why.rays ? [RAY_COLUMNS, why.rays.map(rowOfRay)] : [LAMP_COLUMNS, why.lamps.map(rowOfLamp)]));
    this._note.textContent = why.rays ? RAY_NOTE : LAMP_NOTE;
  }

  _fill(names, rows) {
    const cells = (tag, row) => make("tr", {}, ...row.map((value, k) =>
      make(tag, TEXT_COLUMNS.includes(names[k]) ? { class: "kiks-answer-word" } : {}, String(value))));
    this._table.replaceChildren(make("thead", {}, cells("th", names)), make("tbody", {}, ...rows.map((row) => cells("td", row))));
  }
}

function rowOfRay({ length_mm, met, brightness, incidence_deg, contribution_counts }, ray) {
  return [ray + 1, figure(length_mm, 1), met, brightness || "–", figure(incidence_deg, 0), signed(contribution_counts)];
}

function rowOfLamp({ lamp, distance_mm, angle_deg, power_w, state, contribution_counts }) {
  return [lamp, figure(distance_mm, 0), figure(angle_deg, 0), general(power_w), state, signed(-contribution_counts)];
}

function figure(value, digits) {
  return Number.isFinite(value) ? fixed(value, digits) : "–";
}

function signed(value) {
  return Math.abs(value) >= 0.05 ? `${value > 0 ? "+" : ""}${fixed(value, 1)}` : "0";
}
