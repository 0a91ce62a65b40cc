/* Kheperas in three dimensions: a base with two wheels, two round boards, eight sensors, lamps, turrets and a gripper.
   All robots of a kind share one geometry, drawn for all of them at once. */

import { THREE } from "nicegui-scene";
import { arc, board, box, column, empty, merge, plate } from "./solid_parts.js";
import { readingBucket, READING_COLOURS, robotColour } from "./colours.js";
import { armAngle, jawsOf, PIVOT_MM } from "./gripper.js";

/** Heights above the floor [mm]. */
const LOWER_BOARD = 15, UPPER_BOARD = 26, TURRET_STEP = 10, PIVOT = 20;
const BOARD = 1.6;
const LED_PLACES = [[-4, 18], [15, 9.5]];
const NAME_MM = 20;
const GREEN = "#1f6b42", GREEN_ABOVE = "#2a7f50";

export class SolidRobots {
  constructor() {
    this.group = new THREE.Group();
    this._material = new THREE.MeshLambertMaterial({ vertexColors: true });
  }

  setScene(scene) {
    empty(this.group);
    this._material = new THREE.MeshLambertMaterial({ vertexColors: true });
    const count = scene.robots.length;
    this._robots = scene.robots;
    this._matrix = new THREE.Matrix4();
    this._part = new THREE.Matrix4();
    this._tint = new THREE.Color();
    if (!count) return;
    this._bodies = this._many(bodyGeometry(scene.robots[0]), this._material, count);
    this._caps = this._many(merge(board(9, 1.2, "#ffffff", 0, 14)), new THREE.MeshLambertMaterial(), count);
    this._sensors = this._many(box(5, 7, 8), new THREE.MeshLambertMaterial(), 8 * count);
    this._leds = this._many(new THREE.OctahedronGeometry(2.4), new THREE.MeshBasicMaterial(), 2 * count);
    scene.robots.forEach(({ colours }, index) => this._caps.setColorAt(index, this._tint.set(colours.light)));
    this._tops = scene.robots.map((robot) => this._top(robot));
    this._grippers = scene.robots.map((robot) => (robot.has_gripper ? this._gripper(robot) : null));
    this.setShapes(scene);
  }

  setShapes(scene) {
    this._tops?.forEach((top, index) => {
      const { turrets } = top.userData;
      turrets.geometry.dispose();
      turrets.geometry = turretGeometry(scene.robots[index]);
    });
  }

  _many(geometry, material, count) {
    const mesh = new THREE.InstancedMesh(geometry, material, count);
    mesh.frustumCulled = false;
    this.group.add(mesh);
    return mesh;
  }

  /** The parts of a single robot: turrets, stripes and a name. */
  _top(robot) {
    const top = new THREE.Group(), turrets = new THREE.Mesh(new THREE.BufferGeometry(), this._material);
    const name = nameSprite(robot);
    name.position.z = topOf(robot) + 30;
    top.add(turrets, name);
    if (robot.white_stripes_rad.length) top.add(new THREE.Mesh(stripesOf(robot), this._material));
    top.userData = { turrets, name };
    this.group.add(top);
    return top;
  }

  _gripper(robot) {
    const arm = new THREE.Group(), { from_mm, to_mm, width_mm } = jawsOf({ jaws: 0 }, robot.radius_mm);
    const bars = [-20, 20].map((y) => [box(from_mm, 3, 4), "#8a929c", [from_mm / 2, y, 0]]);
    arm.add(new THREE.Mesh(merge([...bars, [box(4, 58, 6), "#8a929c", [from_mm, 0, 0]]]), this._material));
    const jaws = [-1, 1].map(() => {
      const block = box(to_mm - from_mm, width_mm, 18), middle = [(from_mm + to_mm) / 2, 0, -5];
      const jaw = new THREE.Mesh(merge([[block, "#2c3138", middle]]), this._material);
      arm.add(jaw);
      return jaw;
    });
    arm.userData = { jaws };
    this.group.add(arm);
    return arm;
  }

  /** Move everything to its pose in a frame. */
  update(frame, poses, show) {
    if (!this._robots?.length) return;
    for (const mesh of [this._bodies, this._caps]) mesh.count = poses.length;
    this._sensors.count = 8 * poses.length;
    this._leds.count = 2 * poses.length;
    poses.forEach((pose, index) => this._put(frame.robot(index), pose, index, show));
    for (const mesh of [this._bodies, this._caps, this._sensors, this._leds]) {
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    this._tops.forEach((top, index) => (top.visible = index < poses.length));
  }

  _put(robot, pose, index, show) {
    const spec = this._robots[index];
    const matrix = this._matrix.makeRotationZ(pose.heading_rad).setPosition(pose.x_mm, pose.y_mm, 0);
    this._bodies.setMatrixAt(index, matrix);
    const place = (mesh, k, x, y, z, turn = 0) =>
      mesh.setMatrixAt(k, this._part.makeRotationZ(turn).setPosition(x, y, z).premultiply(matrix));
    place(this._caps, index, 0, 0, topOf(spec) + 0.6);
    const readings = robot.proximity;
    spec.sensors.forEach(({ x_mm, y_mm, angle_rad }, k) => {
      place(this._sensors, 8 * index + k, 1.02 * x_mm, 1.02 * y_mm, LOWER_BOARD - 2, angle_rad);
      const bucket = readingBucket(readings[k]), [red, green, blue] = bucket ? READING_COLOURS[bucket] : [48, 54, 62];
      this._tint.setRGB(red / 255, green / 255, blue / 255);
      this._sensors.setColorAt(8 * index + k, this._tint);
    });
    robot.leds.forEach((isOn, k) => {
      place(this._leds, 2 * index + k, ...LED_PLACES[k], UPPER_BOARD + 2.5);
      this._leds.setColorAt(2 * index + k, this._tint.set(isOn ? "#ff4030" : "#4a1210"));
    });
    const top = this._tops[index], arm = this._grippers[index];
    top.position.set(pose.x_mm, pose.y_mm, 0);
    top.rotation.z = pose.heading_rad;
    top.userData.name.visible = Boolean(show.names);
    if (arm) putArm(arm, robot, spec, pose);
  }

  dispose() { empty(this.group); }
}

function putArm(arm, robot, spec, pose) {
  const { gap_mm, width_mm } = jawsOf(robot, spec.radius_mm);
  const cosine = Math.cos(pose.heading_rad), sine = Math.sin(pose.heading_rad);
  arm.position.set(pose.x_mm + PIVOT_MM * cosine, pose.y_mm + PIVOT_MM * sine, PIVOT);
  arm.rotation.set(0, -Math.max(0, armAngle(robot)), pose.heading_rad, "ZYX");
  arm.userData.jaws.forEach((jaw, k) => (jaw.position.y = (k ? 1 : -1) * (gap_mm + width_mm / 2)));
}

/** The height of a robot's topmost board: each turret but the gripper's arm is one more. */
function topOf(robot) {
  return UPPER_BOARD + BOARD + TURRET_STEP * robot.turrets.length;
}

function bodyGeometry(robot) {
  const radius = robot.radius_mm, wheel_y = robot.wheel_base_mm / 2 - 1.5;
  const parts = [
    [box(40, 36, 11), "#2a2e33", [0, 0, 8.5]],
    ...board(radius, BOARD, GREEN, LOWER_BOARD + BOARD / 2),
    ...board(radius, BOARD, GREEN_ABOVE, UPPER_BOARD + BOARD / 2),
    [box(11, 12, 2.4), "#15191c", [-11.5, 0, UPPER_BOARD + 2.6]],
    [box(14, 5, 2), "#15191c", [1, 15, UPPER_BOARD + 2.4]],
    [box(14, 5, 2), "#15191c", [1, -15, UPPER_BOARD + 2.4]],
    noseOf(robot, UPPER_BOARD + BOARD),
  ];
  for (const side of [-1, 1]) {
    parts.push([box(26, 2.6, UPPER_BOARD - LOWER_BOARD), "#caa64a", [0, side * 20.6, (LOWER_BOARD + UPPER_BOARD) / 2]]);
    parts.push([column(8, 4.8, 12), "#131517", [0, side * wheel_y, 8], [Math.PI / 2, 0, 0]]);
    const hub = new THREE.CircleGeometry(4.5, 10);
    parts.push([hub, "#9aa1aa", [0, side * (wheel_y + 2.5), 8], [(-side * Math.PI) / 2, 0, 0]]);
  }
  return merge(parts);
}

/** The stripes around a body, between its boards and over their rims. */
function stripesOf({ radius_mm, white_stripes_rad }) {
  const low = LOWER_BOARD, high = UPPER_BOARD + BOARD, place = [0, 0, (low + high) / 2];
  const around = (from, to, radius, colour) => [arc(radius, high - low, from, to), colour, place];
  const white = white_stripes_rad.map(([from, to]) => around(from, to, radius_mm + 0.4, "#ffffff"));
  return merge([around(0, 2 * Math.PI, radius_mm + 0.2, "#000000"), ...white]);
}

/** A white arrow on a board, which marks the robot's front. */
function noseOf({ radius_mm }, height) {
  const outline = [[radius_mm - 3, 0], [radius_mm - 11, 6], [radius_mm - 9, 0], [radius_mm - 11, -6]];
  return [plate(outline, 1), "#ffffff", [0, 0, height]];
}

/** Boards of the turrets, with their shapes on the topmost one. */
function turretGeometry(robot) {
  const top = topOf(robot), parts = robot.turrets.length ? [noseOf(robot, top)] : [];
  for (let z = UPPER_BOARD + BOARD + TURRET_STEP; z <= top + 0.1; z += TURRET_STEP) {
    parts.push(...board(robot.radius_mm, BOARD, GREEN_ABOVE, z - BOARD / 2));
    for (const side of [-1, 1])
      parts.push([box(26, 2.6, TURRET_STEP - BOARD), "#caa64a", [0, side * 20.6, z - TURRET_STEP / 2]]);
  }
  (robot.shapes ?? []).forEach(({ points, colour, radius_mm }, k) => {
    const height = 8 + 1.2 * k;
    if (points.length === 1) parts.push([column(radius_mm || 1, height, 16), colour, [...points[0], top + height / 2]]);
    else if (points.length > 2) parts.push([plate(points, height), colour, [0, 0, top]]);
  });
  return parts.length ? merge(parts) : new THREE.BufferGeometry();
}

function nameSprite(robot) {
  const { name } = robot;
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  context.font = "700 44px system-ui, sans-serif";
  canvas.width = Math.ceil(context.measureText(name).width) + 40;
  canvas.height = 60;
  context.fillStyle = robotColour(robot, false, 0.92);
  context.roundRect(2, 2, canvas.width - 4, 56, 26);
  context.fill();
  context.font = "700 44px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = "#ffffff";
  context.fillText(name, canvas.width / 2, 32);
  const map = new THREE.CanvasTexture(canvas);
  map.generateMipmaps = false;
  map.minFilter = THREE.LinearFilter;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
  sprite.scale.set((NAME_MM * canvas.width) / canvas.height, NAME_MM, 1);
  return sprite;
}
