/* Robots in three dimensions: a body and LEDs, as the scene has them, two wheels, eight sensors, turrets and a gripper.
   All robots with the same look share one geometry, drawn for all of them at once. */

import { THREE } from "nicegui-scene";
import { arc, board, box, column, empty, merge, plate, standing } from "./solid_parts.js";
import { readingBucket, READING_COLOURS, robotColour } from "./colours.js";
import { armAngle, jawsOf, PIVOT_MM } from "./gripper.js";

/** Heights above the floor [mm]. */
const TURRET_STEP = 10, PIVOT = 20;
const BOARD = 1.6;
const NAME_MM = 20;
const GREEN = "#2a7f50";

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
    const leds = scene.robots.flatMap((robot) => robot.leds);
    this._bodies = scene.looks.map((look) => this._many(bodyGeometry(look), this._material, count));
    this._caps = this._many(merge(board(9, 1.2, "#ffffff", 0, 14)), new THREE.MeshLambertMaterial(), count);
    this._sensors = this._many(box(5, 7, 8), new THREE.MeshLambertMaterial(), 8 * count);
    this._leds = this._many(new THREE.OctahedronGeometry(2.4), new THREE.MeshBasicMaterial(), leds.length);
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
    this._caps.count = poses.length;
    this._sensors.count = 8 * poses.length;
    for (const mesh of [...this._bodies, this._leds]) mesh.count = 0;
    poses.forEach((pose, index) => this._put(frame.robot(index), pose, index, show));
    for (const mesh of [...this._bodies, this._caps, this._sensors, this._leds]) {
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    this._tops.forEach((top, index) => (top.visible = index < poses.length));
  }

  _put(robot, pose, index, show) {
    const spec = this._robots[index], body = this._bodies[spec.look];
    const matrix = this._matrix.makeRotationZ(pose.heading_rad).setPosition(pose.x_mm, pose.y_mm, 0);
    body.setMatrixAt(body.count++, matrix);
    const place = (mesh, k, x, y, z, turn = 0) =>
      mesh.setMatrixAt(k, this._part.makeRotationZ(turn).setPosition(x, y, z).premultiply(matrix));
    place(this._caps, index, 0, 0, topOf(spec) + 0.6);
    const readings = robot.proximity;
    spec.sensors.forEach(({ x_mm, y_mm, angle_rad }, k) => {
      place(this._sensors, 8 * index + k, 1.02 * x_mm, 1.02 * y_mm, spec.low_mm - 2, angle_rad);
      const bucket = readingBucket(readings[k], spec.scales), [red, green, blue] = bucket ? READING_COLOURS[bucket] : [48, 54, 62];
      this._tint.setRGB(red / 255, green / 255, blue / 255);
      this._sensors.setColorAt(8 * index + k, this._tint);
    });
    spec.leds.forEach(({ x_mm, y_mm, z_mm, solid_lit, solid_dark }, k) => {
      place(this._leds, this._leds.count, x_mm, y_mm, z_mm);
      this._leds.setColorAt(this._leds.count++, this._tint.set(robot.isLit(k) ? solid_lit : solid_dark));
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
  return robot.high_mm + TURRET_STEP * robot.turrets.length;
}

function bodyGeometry(look) {
  const radius = look.wheel_mm / 2, wheel_y = look.wheel_base_mm / 2 - 1.5;
  const parts = [noseOf(look, look.high_mm), ...look.slabs.flatMap((slab) => standing(slab, slab.low_mm, slab.high_mm))];
  for (const side of [-1, 1]) {
    const wheel = column(radius, 4.8, Math.round(1.5 * radius)), hub = new THREE.CircleGeometry(0.5625 * radius, 10);
    parts.push([wheel, "#131517", [0, side * wheel_y, radius], [Math.PI / 2, 0, 0]]);
    parts.push([hub, "#9aa1aa", [0, side * (wheel_y + 2.5), radius], [(-side * Math.PI) / 2, 0, 0]]);
  }
  return merge(parts);
}

/** The stripes around a body, over the rims of its boards. */
function stripesOf({ radius_mm, white_stripes_rad, low_mm: low, high_mm: high }) {
  const place = [0, 0, (low + high) / 2];
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
  for (let z = robot.high_mm + TURRET_STEP; z <= top + 0.1; z += TURRET_STEP) {
    parts.push(...board(robot.radius_mm, BOARD, GREEN, z - BOARD / 2));
    for (const side of [-1, 1])
      parts.push([box(26, 2.6, TURRET_STEP - BOARD), "#caa64a", [0, side * 20.6, z - TURRET_STEP / 2]]);
  }
  (robot.shapes ?? []).forEach((shape, k) => parts.push(...standing(shape, top, top + 8 + 1.2 * k, 16)));
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
