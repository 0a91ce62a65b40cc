/* The things that can be picked, dragged and turned, and their places: robots, bodies, lamps, and the sensors of the
   selected robot. */

/** Radius of the mark of a lamp [mm]. */
export const LAMP_RADIUS_MM = 11;
const SENSOR_RADIUS_MM = 5;
/** From this share of its radius on, dragging a robot turns it. */
const RIM_FROM = 0.8;
const RIM_BEYOND = 0.4;
const RIM_LEAST_PX = 9;
const FINGER_PX = 8;

export function radiusOf(scene, what, index) {
  if (what === "robot") return scene.robots[index].radius_mm;
  return what === "body" ? scene.bodies[index].radius_mm : LAMP_RADIUS_MM;
}

/** The number of things of a kind that are both in the scene and in the frame. */
export function countOf(feed, what) {
  if (!feed.frame) return 0;
  if (what === "lamp") return feed.frame.lamp_count;
  if (what === "robot") return Math.min(feed.frame.robot_count, feed.scene.robots.length);
  return Math.min(feed.frame.body_count, feed.scene.bodies.length);
}

/** The poses of all robots on the screen. */
export function posesOf(feed, now_ms) {
  return Array.from({ length: countOf(feed, "robot") }, (_, index) => feed.frame.pose(index, now_ms));
}

/** The pose of a thing on the screen: {x_mm, y_mm, heading_rad of a robot}. */
export function placeOf(frame, what, index) {
  if (what === "robot") return frame.pose(index);
  return what === "body" ? frame.body(index) : frame.lamp(index);
}

/** All things, in the order in which the keyboard goes through them. */
export function allThings(feed) {
  return ["robot", "body", "lamp"].flatMap((what) =>
    Array.from({ length: countOf(feed, what) }, (_, index) => ({ what, index })));
}

export function nameOf(scene, { what, index }) {
  if (what === "robot") return `robot ${scene.robots[index]?.name ?? index + 1}`;
  if (what === "body") return `${scene.bodies[index]?.what ?? "body"} ${scene.bodies[index]?.number ?? index + 1}`;
  return `lamp ${index + 1}`;
}

export function isSame(one, other) {
  return Boolean(one && other) && one.what === other.what && one.index === other.index;
}

/** The place of the handle for turning a robot, ahead of it. */
export function handleOf(pose, radius_mm, scale) {
  const way_mm = radius_mm + Math.max(0.25 * radius_mm, 12 / scale);
  return [pose.x_mm + way_mm * Math.cos(pose.heading_rad), pose.y_mm + way_mm * Math.sin(pose.heading_rad)];
}

/** Find the thing at a place: {what, index, sensor, isRim}, or the floor.
    `scale` (pixels/mm) lets small things be hit by a finger; a handle counts on the thing that shows one. */
export function thingAt(feed, x_mm, y_mm, scale, withHandle) {
  const { frame, scene } = feed, floor = { what: "floor", index: -1, sensor: -1, isRim: false };
  if (!frame || !scene) return floor;
  const finger_mm = FINGER_PX / scale;
  const isWithin = (place, reach_mm) => Math.hypot(place.x_mm - x_mm, place.y_mm - y_mm) <= reach_mm;
  const found = (what, index, more) => ({ what, index, sensor: -1, isRim: false, ...more });

  if (withHandle?.what === "robot" && withHandle.index < countOf(feed, "robot")) {
    const { index } = withHandle, robot = scene.robots[index], pose = frame.pose(index);
    const [hand_x, hand_y] = handleOf(pose, robot.radius_mm, scale);
    if (Math.hypot(hand_x - x_mm, hand_y - y_mm) <= finger_mm) return found("robot", index, { isRim: true });
    const sensor = withHandle.isSelected ? sensorAt(robot, pose, x_mm, y_mm) : -1;
    if (sensor >= 0) return found("robot", index, { sensor, isRim: isOnRim(robot, pose, x_mm, y_mm) });
  }
  for (let index = countOf(feed, "lamp") - 1; index >= 0; index--)
    if (isWithin(frame.lamp(index), Math.max(LAMP_RADIUS_MM, finger_mm))) return found("lamp", index);
  for (let index = countOf(feed, "robot") - 1; index >= 0; index--) {
    const robot = scene.robots[index], pose = frame.pose(index);
    if (isWithin(pose, robot.radius_mm)) return found("robot", index, { isRim: isOnRim(robot, pose, x_mm, y_mm) });
  }
  for (let index = countOf(feed, "body") - 1; index >= 0; index--)
    if (isWithin(frame.body(index), Math.max(scene.bodies[index].radius_mm, finger_mm))) return found("body", index);
  for (let index = countOf(feed, "robot") - 1; index >= 0; index--) {
    const { radius_mm } = scene.robots[index];
    const reach_mm = radius_mm + Math.max(RIM_BEYOND * radius_mm, RIM_LEAST_PX / scale);
    if (isWithin(frame.pose(index), reach_mm)) return found("robot", index, { isRim: true });
  }
  return floor;
}

function isOnRim(robot, pose, x_mm, y_mm) {
  return Math.hypot(pose.x_mm - x_mm, pose.y_mm - y_mm) > RIM_FROM * robot.radius_mm;
}

function sensorAt(robot, pose, x_mm, y_mm) {
  const cosine = Math.cos(pose.heading_rad), sine = Math.sin(pose.heading_rad);
  const ahead = (x_mm - pose.x_mm) * cosine + (y_mm - pose.y_mm) * sine;
  const aside = (y_mm - pose.y_mm) * cosine - (x_mm - pose.x_mm) * sine;
  return robot.sensors.findIndex((sensor) => Math.hypot(sensor.x_mm - ahead, sensor.y_mm - aside) <= SENSOR_RADIUS_MM);
}
