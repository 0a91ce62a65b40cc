/* The part of a run's page where people change the world and let it go on (see free_world.js). */

import { clockText } from "./clock.js";
import { make } from "./elements.js";
import { Evolution } from "./evolution.js";
import { FreeWorld } from "./free_world.js";
import { makeDriver } from "./go_on.js";

const WALL_MM = 20;
/** Of sliders; one reaches farther if its parameter does. */
const MOST = 2, STEP = 0.01;
/** Most parameters that get sliders. */
const SLIDERS_MAX = 100;
const INVITATION = "What if? Drag a robot, a ball or a lamp, or change walls with a tool: the readings are those of the sensors there.";
const GO_ON = " Or let the world go on from here with a controller.";
const NO_CONTROLLER = " No controller drives robots of several kinds.";
/** Tools of the page, and what the stage draws for them. */
const TOOLS = { move: "line", draw: "freehand", erase: "freehand" };

const at = (id) => document.getElementById(id);

/** Build it for a feed that makes its run; `controllers` are those that the page brings (kiks/export/browser_controller.py),
    `measures` those of judge.js. Returns the free world, and what draws a stroke of the stage in it. */
export function makeFreePanel(feed, player, stage, controllers, measures) {
  const free = new FreeWorld(feed, () => show()), drivers = new Map(), [evolve, measure, news] = ["evolve", "measure", "evolved"].map(at);
  let evolution = null;
  const [state, go, back, chosen, driven, tool] = ["free-state", "go-on", "back", "controller", "driven", "tool"].map(at);
  at("free").hidden = false;
  controllers.forEach(({ title }, k) => chosen.append(make("option", { value: k }, title)));
  for (const control of [go, chosen, driven]) control.disabled = !controllers.length || !feed.scene.robots.length;

  function show() {
    if (free.isOn && player.isPlaying) player.toggle();
    if (!free.isOn) endEvolution();
    go.textContent = free.isGoing ? "Stop" : "Go on from here";
    back.hidden = !free.isOn;
    for (const shown of [stage.root, state]) shown.classList.toggle("free-now", free.isOn);
    tell();
  }

  function tell() {
    state.textContent = free.isOn
      ? `Not the recording any more: this world left it at ${clockText(free.since_s)}. Its clock shows ${clockText(feed.frame.time_s)}.`
      : INVITATION + (controllers.length ? GO_ON : feed.scene.robots.length ? NO_CONTROLLER : "");
  }

  /** The chosen controller, ready to drive; its parameters stay as they were set. */
  function driver() {
    const k = Number(chosen.value);
    if (!drivers.has(k)) drivers.set(k, makeDriver(feed.world.engine, controllers[k]));
    return drivers.get(k);
  }

  async function showSliders() {
    if (!controllers.length) return;
    const made = await driver(), { labels } = made.about;
    at("parameters").replaceChildren(...labels.slice(0, SLIDERS_MAX).map((label, k) => {
      const value = make("output", {}, made.parameters[k].toFixed(2));
      const most = Math.max(MOST, Math.ceil(Math.abs(made.parameters[k])));
      const slider = make("input", { type: "range", min: -most, max: most, step: STEP, value: made.parameters[k] });
      slider.addEventListener("input", () => {
        made.setParameter(k, slider.valueAsNumber);
        value.textContent = slider.valueAsNumber.toFixed(2);
      });
      return make("label", {}, make("span", {}, label), slider, value);
    }));
  }

  const driving = () => feed.scene.robots.map((_, index) => driven.value === "" || Number(driven.value) === index);

  async function goOn() {
    if (free.isGoing) return free.stop();
    endEvolution();
    free.goOn(await driver(), driving());
  }

  /** Evolve the parameters of the chosen controller until a person stops that, or goes elsewhere. */
  async function startEvolution() {
    if (evolution) return endEvolution();
    const made = await driver();
    free.stop();
    free.begin(feed.frame.time_s);
    evolution = new Evolution(free, made, driving(), measures);
    evolve.textContent = "Stop";
    evolution.run(measure.value, (value) => {
      news.textContent = `Generation ${evolution?.generation ?? "the last"}: ${measure.value} ${value.toFixed(3)}.`;
      showSliders();
    });
  }

  function endEvolution() {
    evolution?.stop();
    evolution = null;
    evolve.textContent = "Evolve";
  }

  measure.append(...(measures?.names ?? []).map((name) => make("option", { value: name }, name)));
  measure.value = "roaming";
  evolve.disabled = go.disabled || !measures;
  evolve.addEventListener("click", startEvolution);
  go.addEventListener("click", goOn);
  chosen.addEventListener("change", () => {
    endEvolution();
    free.stop();
    showSliders();
  });
  driven.addEventListener("change", () => free.stop());
  back.addEventListener("click", () => feed.show(player.time_s));
  tool.addEventListener("change", () => stage.setTool(tool.value ? { kind: TOOLS[tool.value], brush_mm: WALL_MM } : null));
  at("speed").addEventListener("change", () => (free.speed = Number(at("speed").value)));
  feed.on("frame", tell);
  show();
  showSliders();
  return { free, draw: (stroke) => tool.value && free.draw(stroke, tool.value, WALL_MM) };
}
