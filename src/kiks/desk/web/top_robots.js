/* Robots seen from above: their parts and LEDs, as the scene has them, sensors, turrets and gripper. */

import { readingBucket, READING_COLOURS, rgba, robotColour } from "./colours.js";
import { fillDisc } from "./circles.js";
import { aheadOf, jawsOf } from "./gripper.js";

/** A robot smaller than this on the screen is drawn without its small parts [pixels]. */
const SMALL_PX = 7;
const STRIP_PX = [64, 9];

/** The parts of a robot that never change, as paths in its own frame; the last one is the nose. */
export class RobotLook {
  constructor({ radius_mm, colours, parts, leds, sensors, scales, shapes, has_gripper }) {
    Object.assign(this, { radius_mm, colours, leds, scales, hasGripper: has_gripper });
    this.body = disc(0, 0, radius_mm);
    this.parts = parts.map(partOf);
    this.nose = this.parts.pop();
    this.sensors = sensors.map((sensor) => sensorPath(sensor, radius_mm));
    this.setShapes(shapes);
  }

  setShapes(shapes) {
    this.shapes = (shapes ?? []).map(partOf);
  }
}

function disc(x, y, radius) {
  const path = new Path2D();
  path.arc(x, y, radius, 0, 2 * Math.PI);
  return path;
}

function partOf(shape) {
  return { path: shapePath(shape), colour: shape.colour };
}

function shapePath({ points, radius_mm }) {
  if (points.length === 1) return disc(points[0][0], points[0][1], radius_mm || 1);
  const path = new Path2D();
  points.forEach(([x, y], k) => (k ? path.lineTo(x, y) : path.moveTo(x, y)));
  path.closePath();
  return path;
}

/** A block of 6 mm by 4 mm that looks along its sensor, just within the rim. */
function sensorPath({ x_mm, y_mm, angle_rad }, radius_mm) {
  const share = Math.min(1, (radius_mm - 3) / Math.hypot(x_mm, y_mm)), x = x_mm * share, y = y_mm * share;
  const ahead = [Math.cos(angle_rad), Math.sin(angle_rad)], path = new Path2D();
  const corner = (along, aside) => [x + along * ahead[0] - aside * ahead[1], y + along * ahead[1] + aside * ahead[0]];
  path.moveTo(...corner(2, 3));
  path.lineTo(...corner(2, -3));
  path.lineTo(...corner(-2, -3));
  path.lineTo(...corner(-2, 3));
  path.closePath();
  return path;
}

/** Draw one robot; the context takes the robot's own millimetres. A part without a colour has the robot's. */
export function paintRobot(context, look, robot, scale, isDark) {
  const isSmall = look.radius_mm * scale < SMALL_PX, own = robotColour(look, isDark);
  const paint = ({ path, colour }) => {
    context.fillStyle = colour || own;
    context.fill(path);
  };
  look.parts.forEach(paint);
  if (isSmall) {
    context.strokeStyle = own;
    context.lineWidth = 4;
    context.stroke(look.body);
  } else {
    look.shapes.forEach(paint);
    paintSensors(context, look, robot.proximity);
    paintLeds(context, look.leds, robot);
  }
  if (look.hasGripper) paintGripper(context, robot, look.radius_mm);
  paint(look.nose);
}

function paintSensors(context, look, proximity) {
  context.lineWidth = 0.5;
  context.strokeStyle = "#050607";
  look.sensors.forEach((path, k) => {
    const bucket = readingBucket(proximity[k], look.scales);
    context.fillStyle = bucket ? rgba(READING_COLOURS[bucket]) : "#3c434c";
    context.fill(path);
    context.stroke(path);
  });
}

function paintLeds(context, leds, robot) {
  leds.forEach(({ x_mm, y_mm, radius_mm, halo_mm, halo, lit, dark }, k) => {
    if (robot.isLit(k)) fillDisc(context, x_mm, y_mm, halo_mm, halo);
    fillDisc(context, x_mm, y_mm, radius_mm, robot.isLit(k) ? lit : dark);
  });
}

function paintGripper(context, robot, radius_mm) {
  const { gap_mm, width_mm, from_mm, to_mm } = jawsOf(robot, radius_mm);
  const near = aheadOf(from_mm, robot), far = aheadOf(to_mm, robot), pivot = aheadOf(0, robot);
  context.fillStyle = "#7d858f";
  for (const side of [-1, 1]) context.fillRect(Math.min(pivot, near), side * 20 - 1.5, Math.abs(near - pivot), 3);
  context.fillRect(near - 1.5, -29, 3, 58);
  context.fillStyle = "#2c3138";
  context.strokeStyle = "#aeb6c0";
  context.lineWidth = 0.6;
  for (const side of [-1, 1]) {
    const y = side * (gap_mm + width_mm / 2) - width_mm / 2;
    context.fillRect(Math.min(near, far), y, Math.abs(far - near), width_mm);
    context.strokeRect(Math.min(near, far), y, Math.abs(far - near), width_mm);
  }
}

/** Write a robot's name on it, or below it when it is long or the robot small; `context` takes CSS pixels. */
export function paintName(context, robot, x, y, radius_px, colours) {
  const { name } = robot;
  const isInside = name.length <= 2 && radius_px >= 11;
  context.textAlign = "center";
  context.textBaseline = "middle";
  if (isInside) {
    const size = Math.max(9, 0.6 * radius_px) / (name.length === 2 ? 1.15 : 1);
    fillDisc(context, x, y, 0.42 * radius_px, robotColour(robot, false));
    context.font = `700 ${size}px system-ui, sans-serif`;
    context.fillStyle = "#ffffff";
    context.fillText(name, x, y + 0.5);
    return;
  }
  context.font = "600 12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = colours.halo;
  context.strokeText(name, x, y + radius_px + 9);
  context.fillStyle = colours.ink;
  context.fillText(name, x, y + radius_px + 9);
}

const strip = document.createElement("canvas");
[strip.width, strip.height] = [STRIP_PX[0], 1];

/** Draw the camera picture of a robot as a strip beside it; `context` takes CSS pixels. */
export function paintCamera(context, camera, x, y, radius_px, colours) {
  const pixels = strip.getContext("2d"), picture = pixels.createImageData(STRIP_PX[0], 1);
  camera.pixels.forEach((grey, k) => picture.data.set([grey, grey, grey, 255], 4 * k));
  pixels.putImageData(picture, 0, 0);
  const width = Math.max(STRIP_PX[0], 2.2 * radius_px), left = x - width / 2, top = y - radius_px - 10 - STRIP_PX[1];
  context.imageSmoothingEnabled = false;
  context.drawImage(strip, left, top, width, STRIP_PX[1]);
  context.strokeStyle = colours.ink;
  context.lineWidth = 1;
  context.strokeRect(left - 0.5, top - 0.5, width + 1, STRIP_PX[1] + 1);
}
