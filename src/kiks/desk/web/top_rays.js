/* Rays of the proximity sensors and the cameras' fields of view, from above. One path for each colour holds all
   rays. */

import { NO_HIT, RAY_UNIT_MM, RAYS_PER_SENSOR, SENSORS } from "./frame.js";
import { READING_COLOURS, readingBucket, rgba } from "./colours.js";

/** Half of a camera's field of view, and the range in which it is drawn. */
const HALF_VIEW_RAD = (18 * Math.PI) / 180;
const VIEW_MM = 260;

/** Draw all rays, coloured by their sensor's reading; `context` takes CSS pixels. */
export function paintRays(context, viewport, scene, frame, poses, colours) {
  const lines = READING_COLOURS.map(() => new Path2D()), fans = READING_COLOURS.map(() => new Path2D());
  const { scale, width_px, height_px } = viewport;
  poses.forEach((pose, index) => {
    const robot = scene.robots[index], [x, y] = viewport.toScreen(pose.x_mm, pose.y_mm);
    const margin = (robot.radius_mm + robot.reach_mm) * scale;
    if (x < -margin || y < -margin || x > width_px + margin || y > height_px + margin) return;
    const lengths = frame.rays(index), readings = frame.robot(index).proximity;
    const cosine = Math.cos(pose.heading_rad) * scale, sine = Math.sin(pose.heading_rad) * scale;
    for (let sensor = 0; sensor < SENSORS; sensor++) {
      const { x_mm, y_mm, rays_rad } = robot.sensors[sensor], bucket = readingBucket(readings[sensor], robot.scales);
      const line = lines[bucket], fan = fans[bucket];
      const from_x = x + x_mm * cosine - y_mm * sine, from_y = y - x_mm * sine - y_mm * cosine;
      fan.moveTo(from_x, from_y);
      for (let ray = 0; ray < RAYS_PER_SENSOR; ray++) {
        const length = lengths[sensor * RAYS_PER_SENSOR + ray];
        const length_px = (length === NO_HIT ? robot.reach_mm : length * RAY_UNIT_MM) * scale;
        const angle = pose.heading_rad + rays_rad[ray];
        const to_x = from_x + length_px * Math.cos(angle), to_y = from_y - length_px * Math.sin(angle);
        line.moveTo(from_x, from_y);
        line.lineTo(to_x, to_y);
        fan.lineTo(to_x, to_y);
      }
      fan.closePath();
    }
  });
  context.lineWidth = Math.min(1.6, Math.max(0.8, 0.7 * scale));
  READING_COLOURS.forEach((colour, bucket) => {
    const strength = 0.45 + (0.55 * bucket) / (READING_COLOURS.length - 1);
    context.fillStyle = rgba(colour, colours.fanAlpha * strength);
    context.fill(fans[bucket]);
    context.strokeStyle = rgba(colour, colours.rayAlpha * strength);
    context.stroke(lines[bucket]);
  });
}

/** Draw the field of view of a robot's camera; `context` takes CSS pixels. */
export function paintView(context, viewport, pose, colours) {
  const [x, y] = viewport.toScreen(pose.x_mm, pose.y_mm), reach = VIEW_MM * viewport.scale;
  const fade = context.createRadialGradient(x, y, 0, x, y, reach);
  fade.addColorStop(0, "rgba(80,140,255,.34)");
  fade.addColorStop(1, "rgba(80,140,255,0)");
  context.fillStyle = fade;
  context.beginPath();
  context.moveTo(x, y);
  context.arc(x, y, reach, -pose.heading_rad - HALF_VIEW_RAD, -pose.heading_rad + HALF_VIEW_RAD);
  context.closePath();
  context.fill();
}
