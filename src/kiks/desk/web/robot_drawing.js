/* One robot from above, large, with its front upwards: its rays, and lines from its sensors to their numbers. */

import { fillDisc, strokeRing } from "./circles.js";
import { palette, readingBucket, READING_COLOURS, rgba } from "./colours.js";
import { NO_HIT, RAY_UNIT_MM, RAYS_PER_SENSOR } from "./frame.js";
import { paintRobot } from "./top_robots.js";

/** Directions of the numbers of the eight sensors around a robot, clockwise from behind, independent of its heading [rad]. */
const PLACES_RAD = [153, 83, 49, 17, -17, -49, -83, -153].map((degrees) => (degrees * Math.PI) / 180);
const ASIDE_SHARE = 0.42, ALONG_SHARE = 0.43;
const HIT_PX = 2.6;

/** Places of the numbers of sensors, which stand around the robot in their order, as fractions of the picture's width and height. */
export function placesOfNumbers(sensors) {
  const around = ({ x_mm, y_mm }) => sensors.filter((each) => Math.atan2(each.y_mm, each.x_mm) > Math.atan2(y_mm, x_mm)).length;
  const angles = sensors.map((sensor) => PLACES_RAD[around(sensor)]);
  return angles.map((angle) => [0.5 - ASIDE_SHARE * Math.sin(angle), 0.5 - ALONG_SHARE * Math.cos(angle)]);
}

/** Draw a robot; `context` takes CSS pixels times `ratio`, `look` is a RobotLook. */
export function paintLargeRobot(context, width, height, ratio, look, scene, frame, index, chosen, isDark) {
  const robot = frame.robot(index), known = scene.robots[index];
  const middle = [width / 2, height / 2];
  const scale = Math.min(width, height) / (2 * (known.radius_mm + known.reach_mm));
  const at = (x_mm, y_mm) => [middle[0] - y_mm * scale, middle[1] - x_mm * scale];
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  paintRings(context, middle, known, scale, isDark);
  paintFans(context, at, known, robot, frame.rays(index), chosen, isDark);
  paintLeaders(context, at, width, height, known, isDark);
  context.setTransform(0, -scale * ratio, -scale * ratio, 0, middle[0] * ratio, middle[1] * ratio);
  paintRobot(context, look, robot, scale, isDark);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (robot.isTouching) strokeRing(context, ...middle, known.radius_mm * scale + 4, palette(isDark).touch, 4);
  paintCompass(context, robot.heading_rad, isDark);
}

/** Rings every 20 mm from the robot's rim. */
function paintRings(context, middle, known, scale, isDark) {
  const ink = isDark ? "rgba(230,238,246,.15)" : "rgba(30,40,50,.13)";
  for (let way_mm = 20; way_mm < known.reach_mm; way_mm += 20)
    strokeRing(context, ...middle, (known.radius_mm + way_mm) * scale, ink, 1);
}

function paintFans(context, at, known, robot, lengths, chosen, isDark) {
  known.sensors.forEach(({ x_mm, y_mm, rays_rad }, sensor) => {
    const bucket = readingBucket(robot.proximity[sensor], known.scales), colour = READING_COLOURS[bucket];
    const from = at(x_mm, y_mm), ends = [];
    for (let ray = 0; ray < RAYS_PER_SENSOR; ray++) {
      const length = lengths[sensor * RAYS_PER_SENSOR + ray], isHit = length !== NO_HIT;
      const length_mm = isHit ? length * RAY_UNIT_MM : known.reach_mm;
      ends.push([isHit, at(x_mm + length_mm * Math.cos(rays_rad[ray]), y_mm + length_mm * Math.sin(rays_rad[ray]))]);
    }
    context.fillStyle = rgba(colour, isDark ? 0.16 : 0.13);
    context.beginPath();
    context.moveTo(...from);
    for (const [, end] of ends) context.lineTo(...end);
    context.closePath();
    context.fill();
    context.lineWidth = sensor === chosen ? 2.6 : 1.3;
    for (const [isHit, end] of ends) {
      context.strokeStyle = rgba(colour, sensor === chosen || isHit ? 0.95 : 0.3);
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...end);
      context.stroke();
      if (isHit) fillDisc(context, ...end, HIT_PX, rgba(colour));
    }
  });
}

function paintLeaders(context, at, width, height, known, isDark) {
  context.strokeStyle = isDark ? "rgba(230,238,246,.5)" : "rgba(30,40,50,.4)";
  context.lineWidth = 1;
  context.setLineDash([2, 3]);
  context.beginPath();
  placesOfNumbers(known.sensors).forEach(([across, down], sensor) => {
    context.moveTo(...at(known.sensors[sensor].x_mm, known.sensors[sensor].y_mm));
    context.lineTo(across * width, down * height);
  });
  context.stroke();
  context.setLineDash([]);
}

/** A dial in the corner with the robot's heading in the arena, whose x axis points to the right. */
function paintCompass(context, heading_rad, isDark) {
  const ink = isDark ? "#e8edf2" : "#1d2329", x = 24, y = 24, radius = 17;
  strokeRing(context, x, y, radius, ink, 1.5);
  const tip = (angle, share) => [x + share * radius * Math.cos(angle), y - share * radius * Math.sin(angle)];
  context.fillStyle = isDark ? "#6db1ff" : "#0b62d6";
  context.beginPath();
  context.moveTo(...tip(heading_rad, 0.95));
  context.lineTo(...tip(heading_rad + 2.5, 0.7));
  context.lineTo(...tip(heading_rad, -0.3));
  context.lineTo(...tip(heading_rad - 2.5, 0.7));
  context.closePath();
  context.fill();
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "top";
  context.fillStyle = ink;
  const degrees = Math.round((heading_rad * 180) / Math.PI) % 360;
  context.fillText(`${(degrees + 360) % 360}°`, x + 1, y + radius + 5);
}
