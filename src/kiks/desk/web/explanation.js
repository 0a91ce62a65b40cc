/* Why a sensor reads what it reads: the engine's kernels give the numbers, and the words are those of
   kiks/sim/explanation.py. A world is an EngineWorld, or another {engine, record, tick, time_ns, lampCount}; a scene is
   the message about it (kiks/export/frames.py). The fields of explanations have the names that they have in Python. */

import { fixed, general } from "./python_numbers.js";

const RAY_COUNT = 7;
/** As in kiks/engine/sensing: what a ray met that met no disc, and effects of a lamp. */
const NOTHING = -2;
const FACING = 0, HIDDEN = 3;
const STATES = { [FACING]: "seen", 1: "behind the sensor", 2: "behind the robot itself", 4: "off" };

/** Return why N returns what it returns for a sensor of a robot, both counted from 0. */
export function explainProximity(world, scene, index, sensor) {
  const { response } = scene.robots[index];
  const [given, numbers, met] = ask(world, "explain_proximity", index, sensor, [RAY_COUNT, 5], [RAY_COUNT]);
  const [age_ms, step_counts, maximum_counts, count, reach_mm, gain, baseline_counts, response_counts, ...noise] = given;
  const rays = numbers.map(([angle_deg, length_mm, brightness, incidence_deg, contribution_counts], ray) => (
    { angle_deg, length_mm, met: nameOf(scene, met[ray]), brightness, incidence_deg, contribution_counts }));
  return {
    ...named(scene, index, sensor), age_ms, step_counts, maximum_counts, count, reach_mm, rays, response, gain,
    baseline_counts, response_counts, scatter_counts: noise[0], jitter_counts: noise[1],
  };
}

/** Return why O returns what it returns for a sensor of a robot, both counted from 0. */
export function explainLight(world, scene, index, sensor) {
  const [given, numbers, reasons] = ask(world, "explain_ambient", index, sensor, [world.lampCount, 4], [world.lampCount, 2]);
  const [age_ms, step_counts, maximum_counts, count, unlit_counts, expected_counts, noise_counts] = given;
  const lamps = numbers.map(([distance_mm, angle_deg, power_w, contribution_counts], lamp) => {
    const how = reasons[2 * lamp], hider = reasons[2 * lamp + 1];
    const state = how === HIDDEN ? `hidden by ${nameOf(scene, hider)}` : STATES[how];
    return { lamp: lamp + 1, distance_mm, angle_deg, power_w, state, contribution_counts };
  });
  return {
    ...named(scene, index, sensor), age_ms, step_counts, maximum_counts, count, lamps,
    unlit_counts, expected_counts, noise_counts,
  };
}

/** Call a kernel; return what it returns, the rows of its numbers, and its whole numbers. */
function ask({ engine, record, tick, time_ns }, kernel, index, sensor, rows, wholes) {
  const top = engine.top;
  const out = [engine.array(8, rows), engine.array(8, wholes)];
  const given = engine.call(kernel, record, index, sensor, tick, time_ns, out);
  const [numbers, whole] = out.map(({ at, shape }) => engine.bytes(at, 8 * shape.reduce((a, b) => a * b, 1)).slice().buffer);
  engine.release(top);
  const values = new Float64Array(numbers), width = rows[1];
  const table = Array.from({ length: rows[0] }, (_, row) => [...values.slice(width * row, width * (row + 1))]);
  return [given, table, Array.from(new BigInt64Array(whole), Number)];
}

function named({ robots }, index, sensor) {
  return { robot: index + 1, sensor, name: robots[index].sensors[sensor].name };
}

/** What people call a disc: robots are numbered first, then bodies; a negative number is that of a wall. */
function nameOf({ robots, bodies }, disc) {
  if (disc < 0) return disc === NOTHING ? "nothing" : "wall";
  if (disc < robots.length) return `robot ${disc + 1}`;
  const { what, number } = bodies[disc - robots.length];
  return `${what} ${number}`;
}

/** Return an explanation in plain sentences, one a line. `responses` describes each response by its name. */
export function inWords(why, responses) {
  return (why.rays ? proximityLines(why, responses) : lightLines(why)).join("\n");
}

function proximityLines(why, responses) {
  const { sensor, name, robot, count, rays, response, gain, baseline_counts, response_counts } = why;
  const expected = baseline_counts + response_counts, met = rays.filter(({ brightness }) => brightness > 0);
  const lines = [`Sensor ${sensor} (${name}) of robot ${robot} reads ${count}.`];
  const looked = `It looked ${fixed(why.age_ms, 1)} ms ago`;
  if (met.length) {
    const nearest_mm = fixed(Math.min(...met.map(({ length_mm }) => length_mm)), 1);
    lines.push(`${looked}. ${howMany(met.length)} met ${listed(met)}, ${nearest_mm} mm away where that is nearest.`);
  } else lines.push(`${looked} and saw nothing within ${fixed(why.reach_mm, 0)} mm.`);
  lines.push(`With nothing near it reads ${fixed(baseline_counts, 1)} on average. For its rays the response '${response}' ` +
    `(${responses[response]}) adds ${fixed(response_counts, 1)}: ${fixed(expected, 1)} are expected.`);
  const size = ({ contribution_counts }) => Math.abs(contribution_counts);
  const most = rays.reduce((best, ray) => (size(ray) > size(best) ? ray : best));
  // Less than half a count changes no reading.
  if (size(most) >= 0.5)
    lines.push(`The ray at ${direction(most.angle_deg)} matters most: without it, ` +
      `${fixed(expected - most.contribution_counts, 1)} would be expected.`);
  else if (Math.abs(response_counts) >= 0.5) lines.push("No ray matters by itself: without any one of them, it would be as much.");
  if (gain !== 1) lines.push(`This sensor's own gain, ${general(gain)}, is counted in.`);
  lines.push(noiseLine(why.scatter_counts + why.jitter_counts, expected, count));
  if (count >= why.maximum_counts) lines.push(`That is the most that it can read: ${fixed(why.maximum_counts, 0)}.`);
  return lines;
}

function lightLines({ sensor, name, robot, count, lamps, unlit_counts, expected_counts, noise_counts }) {
  const lines = [`Light sensor ${sensor} (${name}) of robot ${robot} reads ${count}; less is brighter.`];
  lines.push(`Without any lamp it reads ${fixed(unlit_counts, 0)} on average.`);
  if (!lamps.length) lines.push("There is no lamp in the arena.");
  for (const { lamp, power_w, state, distance_mm, angle_deg, contribution_counts } of lamps) {
    const where = `Lamp ${lamp} (${general(power_w)} W)`;
    lines.push(state === "seen"
      ? `${where} shines on it from ${fixed(distance_mm, 0)} mm, ${fixed(angle_deg, 0)} degrees off its axis; ` +
        `without it, ${fixed(expected_counts + contribution_counts, 0)} would be expected.`
      : `${where} does not shine on it: it is ${state}.`);
  }
  return [...lines, noiseLine(noise_counts, expected_counts, count)];
}

function howMany(count) {
  return count === RAY_COUNT ? "All of its seven rays" : `${count === 1 ? "One" : count} of its seven rays`;
}

/** What rays met, nearest things first. */
function listed(rays) {
  const nearestFirst = [...rays].sort((one, other) => one.length_mm - other.length_mm);
  const names = [...new Set(nearestFirst.map(({ met }) => (met === "wall" ? "a wall" : met)))], last = names.pop();
  return names.length ? `${names.join(", ")} and ${last}` : last;
}

function direction(angle_deg) {
  const size = Math.abs(angle_deg);
  return size < 0.5 ? "0 degrees, straight ahead" : `${fixed(size, 0)} degrees to the ${angle_deg > 0 ? "left" : "right"}`;
}

function noiseLine(noise, expected, count) {
  const verb = noise >= 0 ? "added" : "took off";
  return `Chance ${verb} ${fixed(Math.abs(noise), 1)}: that makes ${fixed(expected + noise, 1)}, which the converter gives as ${count}.`;
}
