/* Robots seen from above: a Khepera's board, wheels, sensors, lamps, turrets and gripper. */

import { readingBucket, READING_COLOURS, rgba, robotColour, robotHue } from "./colours.js";
import { aheadOf, jawsOf } from "./gripper.js";

/** Where the two lamps (LED 0, LED 1) are on the board [mm]. */
const LED_PLACES = [[-4, 18], [15, 9.5]];
const LED_RADIUS_MM = 1.9;
/** A robot smaller than this on the screen is drawn without its small parts [pixels]. */
const SMALL_PX = 7;
const STRIP_PX = [64, 9];
/** How wide stripes around the body are drawn [mm]. */
const STRIPES_MM = 3;

/** The parts of a robot that never change, as paths in its own frame. */
export class RobotLook {
  constructor(robot) {
    const radius_mm = robot.radius_mm, base = robot.wheel_base_mm / 2;
    this.radius_mm = radius_mm;
    this.body = disc(0, 0, radius_mm);
    this.rim = disc(0, 0, radius_mm - STRIPES_MM / 2);
    this.stripes = robot.white_stripes_rad.length ? arcs(robot.white_stripes_rad, radius_mm - STRIPES_MM / 2) : null;
    this.wheels = new Path2D();
    this.treads = new Path2D();
    for (const side of [-1, 1]) {
      this.wheels.roundRect(-8, side * (base - 1.5) - 2.4, 16, 4.8, 1.2);
      for (let x = -6; x <= 6; x += 3) {
        this.treads.moveTo(x, side * (base - 1.5) - 2);
        this.treads.lineTo(x, side * (base - 1.5) + 2);
      }
    }
    this.chips = new Path2D();
    this.chips.roundRect(-17, -6, 11, 12, 0.8);
    this.chips.roundRect(-6, 12.5, 14, 5, 0.6);
    this.chips.roundRect(-6, -17.5, 14, 5, 0.6);
    this.pins = new Path2D();
    for (let x = -11; x <= 11; x += 2.75) for (const y of [-20.6, 20.6]) this.pins.rect(x - 0.6, y - 0.6, 1.2, 1.2);
    this.nose = new Path2D();
    this.nose.moveTo(radius_mm - 3.5, 0);
    this.nose.lineTo(radius_mm - 11, 5.5);
    this.nose.lineTo(radius_mm - 9, 0);
    this.nose.lineTo(radius_mm - 11, -5.5);
    this.nose.closePath();
    this.sensors = robot.sensors.map((sensor) => sensorPath(sensor, radius_mm));
    this.setShapes(robot.shapes);
  }

  setShapes(shapes) {
    this.shapes = (shapes ?? []).map((shape) => ({ path: shapePath(shape), colour: shape.colour }));
  }
}

function disc(x, y, radius) {
  const path = new Path2D();
  path.arc(x, y, radius, 0, 2 * Math.PI);
  return path;
}

/** Parts of a circle, [from, to] in radians each. */
function arcs(parts, radius) {
  const path = new Path2D();
  for (const [from, to] of parts) {
    path.moveTo(radius * Math.cos(from), radius * Math.sin(from));
    path.arc(0, 0, radius, from, to);
  }
  return path;
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

/** Draw one robot. `place(context, pose)` makes the context take the robot's own millimetres. */
export function paintRobot(context, look, robot, pose, index, scale, hasGripper, isDark) {
  const isSmall = look.radius_mm * scale < SMALL_PX;
  context.fillStyle = "#22643f";
  context.fill(look.body);
  context.strokeStyle = robotColour(index, isDark);
  context.lineWidth = isSmall ? 4 : 2.2;
  context.stroke(look.body);
  if (look.stripes) {
    context.lineWidth = STRIPES_MM;
    context.strokeStyle = "#000000";
    context.stroke(look.rim);
    context.strokeStyle = "#ffffff";
    context.stroke(look.stripes);
  }
  context.fillStyle = "#17191c";
  context.fill(look.wheels);
  if (!isSmall) {
    context.strokeStyle = "#5a6068";
    context.lineWidth = 0.5;
    context.stroke(look.treads);
    context.fillStyle = "#d7b45a";
    context.fill(look.pins);
    context.fillStyle = "#10231a";
    context.fill(look.chips);
    for (const { path, colour } of look.shapes) {
      context.fillStyle = colour;
      context.fill(path);
    }
    paintSensors(context, look, robot.proximity);
    paintLeds(context, robot.leds);
  }
  if (hasGripper) paintGripper(context, robot, look.radius_mm);
  context.fillStyle = "#ffffff";
  context.fill(look.nose);
}

function paintSensors(context, look, proximity) {
  context.lineWidth = 0.5;
  context.strokeStyle = "#050607";
  look.sensors.forEach((path, k) => {
    const bucket = readingBucket(proximity[k]);
    context.fillStyle = bucket ? rgba(READING_COLOURS[bucket]) : "#3c434c";
    context.fill(path);
    context.stroke(path);
  });
}

function paintLeds(context, leds) {
  LED_PLACES.forEach(([x, y], k) => {
    context.fillStyle = leds[k] ? "rgba(255,70,50,.35)" : "#5b1512";
    if (leds[k]) context.fill(disc(x, y, 2.4 * LED_RADIUS_MM));
    if (leds[k]) context.fillStyle = "#ff3a28";
    context.fill(disc(x, y, LED_RADIUS_MM));
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
export function paintName(context, name, index, x, y, radius_px, colours) {
  const isInside = name.length <= 2 && radius_px >= 11;
  context.textAlign = "center";
  context.textBaseline = "middle";
  if (isInside) {
    const size = Math.max(9, 0.6 * radius_px) / (name.length === 2 ? 1.15 : 1);
    context.beginPath();
    context.arc(x, y, 0.42 * radius_px, 0, 2 * Math.PI);
    context.fillStyle = `hsl(${robotHue(index)},72%,36%)`;
    context.fill();
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
