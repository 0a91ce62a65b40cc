/* Balls, cylinders, lamps and rays in three dimensions. */

import { THREE } from "nicegui-scene";
import { LAMPLIGHT, readingBucket, READING_COLOURS } from "./colours.js";
import { NO_HIT, RAY_UNIT_MM, RAYS_PER_ROBOT, RAYS_PER_SENSOR, SENSORS } from "./frame.js";
import { column, empty } from "./solid_parts.js";

const CYLINDER_MM = 34;
const LIFT_MM = 32;
const LAMP_MM = 85;
/** How far below its lower board a robot's rays are drawn [mm]. */
const RAY_BELOW_MM = 3;
/** Maximum number of real lights, which are expensive; the glow of all others is painted. */
const MOST_LIGHTS = 3;

export class SolidThings {
  /** Without a graphics card (`isPlain`) lamps only glow and light the floor. */
  constructor(isPlain) {
    this._light_count = isPlain ? 0 : MOST_LIGHTS;
    this.group = new THREE.Group();
    this._bodies = [];
    this._lamps = [];
    this._matrix = new THREE.Matrix4();
    this._size = new THREE.Vector3();
    this._place = new THREE.Vector3();
    this._upright = new THREE.Quaternion();
  }

  setScene(scene) {
    empty(this.group);
    this._lamps = [];
    this._bodies = scene.bodies;
    const material = () => new THREE.MeshLambertMaterial(), count = Math.max(1, scene.bodies.length);
    this._balls = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 20, 14), material(), count);
    this._cylinders = new THREE.InstancedMesh(column(1, 1, 24), material(), count);
    const tint = new THREE.Color();
    scene.bodies.forEach((body, index) => {
      const [red, green, blue] = body.colour;
      tint.setRGB(red / 255, green / 255, blue / 255);
      for (const mesh of [this._balls, this._cylinders]) mesh.setColorAt(index, tint);
    });
    this._rays = rayLines(scene.robots.length);
    for (const mesh of [this._balls, this._cylinders, this._rays]) {
      mesh.frustumCulled = false;
      this.group.add(mesh);
    }
  }

  update(frame, scene, poses, show) {
    this._putBodies(frame);
    this._putLamps(frame);
    this._rays.visible = Boolean(show.rays);
    if (show.rays) putRays(this._rays.geometry, frame, scene, poses);
  }

  _putBodies(frame) {
    this._balls.count = this._cylinders.count = Math.min(this._bodies.length, frame.body_count);
    for (let index = 0; index < this._balls.count; index++) {
      const { what, radius_mm } = this._bodies[index];
      const { x_mm, y_mm, isLifted } = frame.body(index);
      const lift = isLifted ? LIFT_MM : 0;
      const put = (mesh, isShown, height, middle) => {
        this._size.set(radius_mm, radius_mm, height).multiplyScalar(isShown ? 1 : 0);
        this._matrix.compose(this._place.set(x_mm, y_mm, middle + lift), this._upright, this._size);
        mesh.setMatrixAt(index, this._matrix);
      };
      put(this._balls, what === "ball", radius_mm, radius_mm);
      put(this._cylinders, what !== "ball", CYLINDER_MM, CYLINDER_MM / 2);
    }
    this._balls.instanceMatrix.needsUpdate = this._cylinders.instanceMatrix.needsUpdate = true;
  }

  _putLamps(frame) {
    while (this._lamps.length < frame.lamp_count) {
      const lamp = lampOf(this._lamps.length < this._light_count);
      this._lamps.push(lamp);
      this.group.add(lamp);
    }
    this._lamps.forEach((lamp, index) => {
      lamp.visible = index < frame.lamp_count;
      if (!lamp.visible) return;
      const { x_mm, y_mm, power_w, isOn } = frame.lamp(index), { bulb, glow, light } = lamp.userData;
      lamp.position.set(x_mm, y_mm, 0);
      bulb.material.color.set(isOn ? "#ffe58a" : "#77736a");
      glow.visible = isOn;
      if (light) light.intensity = isOn ? 70 * Math.sqrt(power_w) : 0;
    });
  }

  dispose() { empty(this.group); }
}

function lampOf(isReal) {
  const lamp = new THREE.Group();
  const bulb = new THREE.Mesh(new THREE.SphereGeometry(9, 14, 10), new THREE.MeshBasicMaterial());
  const pole = new THREE.Mesh(column(1.2, LAMP_MM, 6), new THREE.MeshBasicMaterial({ color: "#8b8f96" }));
  pole.position.z = LAMP_MM / 2;
  bulb.position.z = LAMP_MM;
  const glow = new THREE.Sprite(new THREE.SpriteMaterial({ map: glowTexture(), depthWrite: false }));
  glow.scale.set(110, 110, 1);
  glow.position.z = LAMP_MM;
  lamp.add(pole, bulb, glow);
  lamp.userData = { bulb, glow };
  if (isReal) {
    const light = new THREE.PointLight(0xffdf9a, 0, 1500, 1);
    light.position.z = LAMP_MM;
    lamp.add(light);
    lamp.userData.light = light;
  }
  return lamp;
}

function glowTexture() {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  canvas.width = canvas.height = 64;
  const fade = context.createRadialGradient(32, 32, 2, 32, 32, 32);
  fade.addColorStop(0, `rgba(${LAMPLIGHT},.9)`);
  fade.addColorStop(1, `rgba(${LAMPLIGHT},0)`);
  context.fillStyle = fade;
  context.fillRect(0, 0, 64, 64);
  return new THREE.CanvasTexture(canvas);
}

function rayLines(robot_count) {
  const geometry = new THREE.BufferGeometry(), corners = 2 * RAYS_PER_ROBOT * robot_count;
  for (const name of ["position", "color"]) {
    const numbers = new THREE.BufferAttribute(new Float32Array(3 * corners), 3);
    geometry.setAttribute(name, numbers.setUsage(THREE.DynamicDrawUsage));
  }
  const material = new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.6 });
  return new THREE.LineSegments(geometry, material);
}

const RAY_TINTS = READING_COLOURS.map((colour) => colour.map((part) => part / 255));

function putRays(geometry, frame, scene, poses) {
  const places = geometry.attributes.position.array, tints = geometry.attributes.color.array;
  let at = 0;
  poses.forEach(({ x_mm, y_mm, heading_rad }, index) => {
    const robot = scene.robots[index], lengths = frame.rays(index), readings = frame.robot(index).proximity;
    const cosine = Math.cos(heading_rad), sine = Math.sin(heading_rad);
    for (let sensor = 0; sensor < SENSORS; sensor++) {
      const spec = robot.sensors[sensor], [red, green, blue] = RAY_TINTS[readingBucket(readings[sensor], robot.scales)];
      const from_x = x_mm + spec.x_mm * cosine - spec.y_mm * sine;
      const from_y = y_mm + spec.x_mm * sine + spec.y_mm * cosine;
      for (let ray = 0; ray < RAYS_PER_SENSOR; ray++, at += 6) {
        const length = lengths[sensor * RAYS_PER_SENSOR + ray];
        const length_mm = length === NO_HIT ? robot.reach_mm : length * RAY_UNIT_MM;
        const angle = heading_rad + spec.rays_rad[ray];
        places[at] = from_x;
        places[at + 1] = from_y;
        places[at + 3] = from_x + length_mm * Math.cos(angle);
        places[at + 4] = from_y + length_mm * Math.sin(angle);
        places[at + 2] = places[at + 5] = robot.low_mm - RAY_BELOW_MM;
        tints[at] = tints[at + 3] = red;
        tints[at + 1] = tints[at + 4] = green;
        tints[at + 2] = tints[at + 5] = blue;
      }
    }
  });
  geometry.setDrawRange(0, at / 3);
  geometry.attributes.position.needsUpdate = geometry.attributes.color.needsUpdate = true;
}
