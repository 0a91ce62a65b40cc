/* The data of a robot as rows of a list: [name, value]. */

import { clockText } from "./clock.js";
import { shownPlace } from "./coordinates.js";

const DEGREES = 180 / Math.PI;
const ARM_DOWN = 215, ARM_UPRIGHT = 127;

/** Return the rows of a robot in a frame. */
export function factsOf(scene, frame, index) {
  const robot = frame.robot(index), known = scene.robots[index];
  const [x, y] = shownPlace(scene, robot.x_mm, robot.y_mm);
  const rows = [
    ["Clock", clockText(frame.time_s)],
    ["Place", `x ${x.toFixed(1)}, y ${y.toFixed(1)} mm`],
    ["Heading", `${turned(robot.heading_rad * DEGREES).toFixed(1)}°`],
    ["Encoders", `left ${robot.encoders[0]}, right ${robot.encoders[1]}`],
    ["Forwards", `${robot.forwards_mm.toFixed(0)} mm`],
    ["Backwards", `${robot.backwards_mm.toFixed(0)} mm`],
    ["Total", `${(robot.forwards_mm + robot.backwards_mm).toFixed(0)} mm`],
    ["From start", `${robot.straight_mm.toFixed(0)} mm straight`],
    ["Contacts", `${robot.contacts}${robot.isTouching ? ", touching now" : ""}`],
    ["LEDs", known.leds.map(({ name }, k) => `${name} ${robot.isLit(k) ? "on" : "off"}`).join(", ") || "none"],
    ["Line", robot.isLineInUse ? "a program is connected" : "no program is connected"],
    ["Kind", known.kind],
    ["Turrets", known.turrets.length ? known.turrets.join(", ") : "none"],
  ];
  if (known.has_gripper) {
    rows.push(["Arm", `${robot.arm.toFixed(0)} of 255, ${armWord(robot.arm)}`]);
    rows.push(["Jaws", `${robot.jaws.toFixed(0)} of 200, ${jawsWord(robot.jaws)}`]);
  }
  return rows;
}

function turned(degrees) {
  return ((degrees % 360) + 360) % 360;
}

function armWord(arm) {
  if (arm >= ARM_DOWN) return "down in front";
  if (Math.abs(arm - ARM_UPRIGHT) < 3) return "upright";
  return arm > ARM_UPRIGHT ? "raised in front" : "folded back";
}

function jawsWord(jaws) {
  return jaws >= 199.5 ? "open" : jaws < 0.5 ? "closed" : "between";
}
