/* The page of a recorded run (see kiks/export/page.py): the player with the desk's own views, and what belongs to it. */

import { Comparison } from "./comparison.js";
import { download, make } from "./elements.js";
import { loadEngine } from "./engine.js";
import { readInputs } from "./engine_inputs.js";
import { EngineWorld } from "./engine_world.js";
import { explainLight, explainProximity, inWords } from "./explanation.js";
import { setPageFeed } from "./feed.js";
import { makeFreePanel } from "./free_panel.js";
import { Judge } from "./judge.js";
import { Monitor } from "./monitor.js";
import { unpackText } from "./packed_text.js";
import { Player } from "./player.js";
import { fixed } from "./python_numbers.js";
import { RecordedFeed } from "./recorded_feed.js";
import { RunFeed } from "./run_feed.js";
import { Stage } from "./stage.js";

const TOLD_MS = 2000;
/** Facts of the monitor that a recording does not know, or that the player shows. */
const UNRECORDED = ["Clock", "Line"];
const KEYS = "n selects the next thing, arrow keys move the view, plus and minus zoom, 0 shows everything.";
const TOO_OLD = "This browser is too old for the player. Everything else on this page can be read.";
const AGAIN = "Made again on this computer:";
const NOT_COMPARED = `${AGAIN} it was not compared with the recording,`;

const at = (id) => document.getElementById(id);
const all = (selector) => [...document.querySelectorAll(selector)];

async function start() {
  const feed = await makeFeed(at("frames").textContent, at("engine").textContent);
  setPageFeed(feed);
  const stage = new Stage(at("root"), "", KEYS, (event, detail) => {
    if (event === "pick") choose(detail);
    if (event === "draw") panel?.draw(detail);
  });
  const monitor = new Monitor(at("monitor"), "", (event, reading) => event === "explain" && ask(reading ?? monitor.chosen), {
    purpose: feed.world ? "for an explanation" : "to show its rays", absent: at("monitor").dataset.absent,
    facts: at("facts"), leftOut: UNRECORDED,
  });
  function ask(reading) {
    const { sensor, which } = monitor.chosen ?? {};
    monitor.choose(sensor === reading.sensor && which === reading.which ? null : reading);
    answer();
  }
  function answer() {
    if (feed.world) monitor.explain(monitor.chosen && explained(feed, monitor.index, monitor.chosen));
  }
  // Of the frames that are passed at once, the last one is explained.
  let isAsked = false;
  feed.on("frame", () => {
    if (!isAsked && monitor.chosen) requestAnimationFrame(() => { isAsked = false; answer(); });
    isAsked ||= monitor.chosen !== null;
  });
  const player = new Player(
    { play: at("play"), slider: at("slider"), marks: at("marks"), clock: at("clock"), speed: at("speed") },
    feed, JSON.parse(at("moments").textContent));

  feed.onJump = () => stage.clearTrails();
  at("fit").addEventListener("click", () => stage.fit());
  const layers = all("#layers input");
  const show = () => stage.setShow(Object.fromEntries(layers.map(({ name, checked }) => [name, checked])));
  for (const layer of layers) layer.addEventListener("change", show);
  show();

  const robots = at("robot"), follow = at("follow");
  function look() {
    monitor.setRobot(Number(robots.value));
    answer();
    stage.setFollow(follow.checked ? Number(robots.value) : -1);
  }
  function choose({ what, index }) {
    if (what !== "robot" && what !== "sensor") return;
    robots.value = index;
    look();
  }
  for (const control of [robots, follow]) control.addEventListener("change", look);
  look();
  const panel = feed.world ? makeFreePanel(feed, player, stage, JSON.parse(at("controllers").textContent), judged().measures) : null;
  followPage(stage, player);
  listMoments(player);
  window.kiksPage = { free: panel?.free, feed, player, stage, comparison: feed.world && compare(feed) };
}

/** The feed of a run that the engine makes again, or of frames. */
async function makeFeed(packed, packedEngine) {
  const [{ head: run, rest }, module] = await Promise.all([unpackText(packed), unpackText(packedEngine)]);
  const engine = await loadEngine(module.rest);
  for (const { arena } of run.scenes) arena.picture = run.pictures[arena.picture];
  return run.inputs ? new RunFeed(run, new EngineWorld(engine, readInputs(run.inputs, rest))) : new RecordedFeed(run, rest, engine);
}

/** Why a robot reads what it reads at the time of the feed; null if it is not there. */
function explained({ world, scene }, index, { sensor, which }) {
  if (!scene.robots[index]) return null;
  const why = (which === "ambient" ? explainLight : explainProximity)(world, scene, index, sensor);
  return { ...why, text: inWords(why, scene.responses) };
}

/** Make the run again beside the player, and say whether it is the recorded one. */
function compare({ world: { engine, inputs, states }, scenes, begin_s, end_s }) {
  const line = at("made-again"), in_s = (time_s) => `${Math.round(10 * time_s) / 10}`;
  const world = new EngineWorld(engine, inputs, states);
  let judge = judgeOf(world, scenes[0], begin_s);
  /** A goal whose formulas have no value ends the judgement alone. */
  function judging(act) {
    try {
      if (judge) act();
    } catch (error) {
      judge = null;
      at("judged-again").textContent += `here it cannot be judged again: ${error.message}.`;
    }
  }
  const comparison = new Comparison(world, ({ isPossible, isOver, count, compared_s, firstDifference_s }) => {
    if (count === 0) line.textContent = `${NOT_COMPARED} which has no checkpoint.`;
    else if (!isPossible) line.textContent = `${NOT_COMPARED} as this browser computes no hashes for pages that come over http.`;
    else if (firstDifference_s !== null) line.textContent = `${AGAIN} it differs from the recording from ${in_s(firstDifference_s)} s on.`;
    else line.textContent = `${AGAIN} equal to the recording, ${in_s(Math.min(compared_s, end_s) - begin_s)} of ${in_s(end_s - begin_s)} s.`;
    if (isOver) judging(() => tellJudgement(world, judge, end_s));
  }, () => judging(() => judge.judgement || judge.look(world)));
  comparison.run().catch((error) => (line.textContent = `${AGAIN} it failed: ${error.message}.`));
  return comparison;
}

/** The measures of the engine and the run's goal, where the page knows them. */
const judged = () => JSON.parse(at("judged")?.textContent ?? "{}");

/** The judge of the run's goal, if it has one that a page can judge from its begin on. */
function judgeOf(world, scene, begin_s) {
  const { goal, measures } = judged();
  if (!goal || begin_s > 0) return null;
  const judge = new Judge(world, scene, goal, measures), line = at("judged-again");
  line.textContent = `${goal.text || "The goal"}: `;
  if (!judge.unknown.length) return judge;
  line.textContent += `here it cannot be judged again, as a page does not know ${judge.unknown.join(", ")}.`;
  return null;
}

function tellJudgement(world, judge, end_s) {
  world.goTo(Math.round(1e9 * end_s));
  judge.end(world);
  const { isSolved, isFailed, points, time_s } = judge.judgement, how = isSolved ? "solved" : isFailed ? "failed" : "not solved";
  at("judged-again").textContent += `${how} after ${fixed(time_s, 1)} s, ${points} points, judged again on this computer.`;
}

/** Use dark colours where the system does. */
function followPage(stage, player) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const dress = () => {
    document.body.classList.toggle("body--dark", dark.matches);
    stage.setDark(dark.matches);
    player.paintMarks();
  };
  dark.addEventListener("change", dress);
  dress();
}

/** A click on a line of the list goes to its time; the last line before the shown time is marked. */
function listMoments(player) {
  const list = at("list"), lines = all("#list button"), times = lines.map((line) => Number(line.dataset.time));
  let marked = null;
  lines.forEach((line, k) => line.addEventListener("click", () => player.seek(times[k])));
  for (const box of all("#kinds input"))
    box.addEventListener("change", () => list.classList.toggle(`without-${box.name}`, !box.checked));
  const mark = () => {
    const next = times.findLastIndex((time_s) => time_s <= player.time_s + 1e-6), line = lines[next] ?? null;
    if (line === marked) return;
    marked?.classList.remove("now");
    line?.classList.add("now");
    marked = line;
    if (line && player.isPlaying) list.scrollTop = line.offsetTop - list.offsetTop - list.clientHeight / 2;
  };
  player.feed.on("frame", mark);
}

/** Buttons that copy or save the text of an element. */
function offerTexts() {
  for (const button of all("button[data-copy]"))
    button.addEventListener("click", async () => {
      const hasCopied = await copy(at(button.dataset.copy));
      button.textContent = hasCopied ? "Copied" : "Press Ctrl-C";
      setTimeout(() => (button.textContent = "Copy"), TOLD_MS);
    });
  for (const button of all("button[data-save]"))
    button.addEventListener("click", () =>
      download(new Blob([at(button.dataset.save).textContent], { type: "text/plain" }), button.dataset.name));
}

/** Copy the text of an element, or select it where the browser forbids that. */
async function copy(element) {
  try {
    await navigator.clipboard.writeText(element.textContent);
    return true;
  } catch {
    getSelection().selectAllChildren(element);
    return false;
  }
}

offerTexts();
const notice = (text) => at("root").append(make("div", { class: "kiks-notice", role: "status" }, text));
if (!("DecompressionStream" in window && "WebAssembly" in window)) notice(TOO_OLD);
else start().catch(({ message }) => notice(`The player cannot start in this browser: ${message}. Everything else on this page can be read.`));
