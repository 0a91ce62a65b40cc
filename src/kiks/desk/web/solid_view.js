/* The arena in three dimensions, with three.js. It orbits, pans, zooms and follows a robot from behind; no shadows,
   few triangles: it must run without a graphics card, too. The constructor throws an Error with the reason if 3-D is not
   possible. */

import { OrbitControls, THREE } from "nicegui-scene";
import { palette } from "./colours.js";
import { Floor } from "./floor.js";
import { SolidRobots } from "./solid_robots.js";
import { SolidThings } from "./solid_things.js";
import { empty } from "./solid_parts.js";
import { WALL_HEIGHT_MM, wallMesh } from "./solid_walls.js";
import { countOf, placeOf, posesOf, radiusOf } from "./things.js";
import { Viewport } from "./viewport.js";

const FIELD_OF_VIEW_DEG = 42;
const FLOOR_PX = 1024;
/** The share of the pane that the whole arena fills. */
const FILLED = 0.95;
/** Height of the plane on which the pointer moves things [mm]. */
const GRIP_MM = 14;
const CHASE_BEHIND_MM = 260, CHASE_ABOVE_MM = 170;
const NO_WEBGL =
  "The 3-D view needs WebGL 2, which this browser does not offer or has switched off. Allow hardware acceleration in " +
  "its settings, or use another browser. The view from above works without it.";

export class SolidView {
  constructor(canvas, feed, isDark) {
    const isPlain = isSoftware(), context = canvas.getContext("webgl2", { antialias: !isPlain, alpha: false });
    if (!context) throw new Error(NO_WEBGL);
    this.canvas = canvas;
    this.feed = feed;
    this.follow = -1;
    this.show = {};
    this.viewport = null;
    /** Counts movements of the camera, so that the stage knows when to draw. */
    this.changes = 0;
    this._renderer = new THREE.WebGLRenderer({ canvas, context });
    this._renderer.setPixelRatio(1);
    this._renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this._scene = new THREE.Scene();
    this._camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 10, 20000);
    this._camera.up.set(0, 0, 1);
    this._ground = new THREE.Group();
    this._robots = new SolidRobots();
    this._things = new SolidThings(isPlain);
    this._ring = ringMesh();
    this._ghost = ringMesh();
    const sun = new THREE.DirectionalLight(0xffffff, 1.2);
    sun.position.set(-0.4, -0.7, 1.4);
    this._scene.add(new THREE.HemisphereLight(0xffffff, 0x7c828a, 2.7), sun);
    this._scene.add(this._ground, this._robots.group, this._things.group, this._ring, this._ghost);
    this._floor = new Floor();
    this._raycaster = new THREE.Raycaster();
    this.setDark(isDark);
  }

  /** Let the pointer move the camera. An earlier listener of the canvas may claim the pointer. */
  control() {
    this._controls = new OrbitControls(this._camera, this.canvas);
    this._controls.maxPolarAngle = 0.49 * Math.PI;
    this._controls.minDistance = 60;
    this._controls.addEventListener("start", () => (this._isMoved = true));
    this._controls.addEventListener("change", () => this.changes++);
    this.fit();
  }

  /** Number of geometries and textures on the graphics card for this view. */
  get parts() {
    const { geometries, textures } = this._renderer.info.memory;
    return geometries + textures;
  }

  // The surface of the pointer (pointer.js).
  get element() { return this.canvas; }

  get scale() {
    const way_mm = this._camera.position.distanceTo(this._controls.target);
    return this.canvas.clientHeight / (2 * way_mm * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360));
  }

  toArena(clientX, clientY) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
    this._raycaster.setFromCamera(at, this._camera);
    const level = new THREE.Plane(new THREE.Vector3(0, 0, 1), -GRIP_MM);
    const hit = this._raycaster.ray.intersectPlane(level, new THREE.Vector3());
    return hit ? [hit.x, hit.y] : null;
  }

  /** Position on the page of a place in the arena, at the height at which the pointer holds things. */
  toClient(x_mm, y_mm) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const { x, y } = new THREE.Vector3(x_mm, y_mm, GRIP_MM).project(this._camera);
    return [left + ((x + 1) / 2) * width, top + ((1 - y) / 2) * height];
  }

  claim(isClaimed) { this._controls.enabled = !isClaimed; }

  setDark(isDark) {
    this._isDark = isDark;
    this._colours = palette(isDark);
    this._scene.background = new THREE.Color(this._colours.sky);
    for (const ring of [this._ring, this._ghost]) ring.material.color.set(this._colours.accent);
    if (this._floor.raster) this.setRaster(this._floor.raster);
  }

  setScene(scene) {
    empty(this._ground);
    this._floor.setRaster(null);
    this._robots.setScene(scene);
    this._things.setScene(scene);
    const size = `${scene.arena.width_mm},${scene.arena.height_mm}`;
    if (size !== this._size) this.fit();
    this._size = size;
  }

  setShapes(scene) { this._robots.setShapes(scene); }

  setRaster(raster) {
    empty(this._ground);
    this._floor.setRaster(raster, this._colours);
    const { width_mm, height_mm } = raster, scale = FLOOR_PX / Math.max(width_mm, height_mm);
    this._flat = new Viewport();
    this._flat.resize(Math.round(width_mm * scale), Math.round(height_mm * scale));
    this._flat.scale = scale;
    this._flat.centreOn(width_mm / 2, height_mm / 2);
    this._paper = document.createElement("canvas");
    this._paper.width = this._flat.width_px;
    this._paper.height = this._flat.height_px;
    const map = new THREE.CanvasTexture(this._paper);
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(width_mm, height_mm), new THREE.MeshBasicMaterial({ map }));
    floor.position.set(width_mm / 2, height_mm / 2, 0);
    this._ground.add(floor, wallMesh(raster, this._colours));
    this._map = map;
    this._floor_key = "";
  }

  resize(width_px, height_px) {
    this._renderer.setSize(Math.max(1, width_px), Math.max(1, height_px), false);
    this._camera.aspect = Math.max(1, width_px) / Math.max(1, height_px);
    this._camera.updateProjectionMatrix();
    if (!this._isMoved) this.fit();
  }

  /** Show all of the arena from the south and above. */
  fit() {
    const arena = this.feed.scene?.arena;
    if (!arena || !this._controls) return;
    const { width_mm, height_mm } = arena;
    const [x, y, up] = [width_mm / 2, 0.48 * height_mm, new THREE.Vector3(0, -0.62, 0.78)];
    this._isMoved = false;
    this._controls.target.set(x, y, 0);
    const look = (way_mm) => {
      this._camera.position.copy(up).multiplyScalar(way_mm).add(this._controls.target);
      this._controls.update();
      this._camera.updateMatrixWorld();
    };
    const isSeen = () => [0, width_mm].every((corner_x) => [0, height_mm].every((corner_y) => {
      const place = new THREE.Vector3(corner_x, corner_y, WALL_HEIGHT_MM).project(this._camera);
      return Math.max(Math.abs(place.x), Math.abs(place.y)) < FILLED;
    }));
    let [near_mm, far_mm] = [0, 20 * Math.max(width_mm, height_mm)];
    for (let step = 0; step < 20; step++) {
      const middle_mm = (near_mm + far_mm) / 2;
      look(middle_mm);
      if (isSeen()) far_mm = middle_mm;
      else near_mm = middle_mm;
    }
    look(far_mm);
  }

  draw({ selected, ghost }, now_ms) {
    const { frame, scene } = this.feed;
    if (frame && scene) {
      const poses = posesOf(this.feed, now_ms);
      this._paintFloor(frame);
      this._robots.update(frame, poses, this.show);
      this._things.update(frame, scene, poses, this.show);
      this._chase(poses[this.follow]);
      this._mark(this._ring, this._markOf(selected));
      this._mark(this._ghost, ghost);
    }
    this._renderer.render(this._scene, this._camera);
  }

  _paintFloor(frame) {
    if (!this._floor.raster) return;
    const isLit = this._floor.setLamps(this.show.light ? frame.lamps : [], this.feed, this._isDark);
    const isFromTop = Boolean(this.feed.scene.has_old_coordinates);
    const key = `${this.show.grid} ${this.show.light} ${this._isDark} ${isFromTop}`;
    if (!isLit && key === this._floor_key) return;
    this._floor_key = key;
    const show = { isGrid: this.show.grid, isLight: this.show.light, isEdged: false, isFromTop };
    this._floor.paint(this._paper.getContext("2d", { alpha: false }), this._flat, show, this._colours);
    this._map.needsUpdate = true;
  }

  _markOf(thing) {
    if (!thing || thing.index >= countOf(this.feed, thing.what)) return null;
    const { frame, scene } = this.feed, { what, index } = thing;
    return { ...placeOf(frame, what, index), radius_mm: radiusOf(scene, what, index) };
  }

  _mark(ring, place) {
    ring.visible = Boolean(place);
    if (!place) return;
    ring.position.set(place.x_mm, place.y_mm, 1.5);
    ring.scale.setScalar(place.radius_mm + 4);
  }

  /** Follow a robot and turn with it slowly. The camera keeps the changes made with the pointer. */
  _chase(pose) {
    const { target } = this._controls, { position } = this._camera;
    if (!pose) {
      if (this._chased) this.fit();
      this._chased = null;
      return;
    }
    if (!this._chased) {
      this._chased = { heading_rad: pose.heading_rad };
      target.set(pose.x_mm, pose.y_mm, 20);
      const cosine = Math.cos(pose.heading_rad), sine = Math.sin(pose.heading_rad);
      position.set(pose.x_mm - CHASE_BEHIND_MM * cosine, pose.y_mm - CHASE_BEHIND_MM * sine, CHASE_ABOVE_MM);
    } else {
      const behind = Math.sin((pose.heading_rad - this._chased.heading_rad) / 2);
      const turn = 0.16 * Math.asin(behind);
      this._chased.heading_rad += turn;
      const offset = position.clone().sub(target).applyAxisAngle(this._camera.up, turn);
      target.set(pose.x_mm, pose.y_mm, 20);
      position.copy(target).add(offset);
    }
    this._controls.update();
  }

  /** Release all memory on the graphics card. */
  dispose() {
    this._controls?.dispose();
    empty(this._scene);
    this._renderer.dispose();
  }
}

function ringMesh() {
  const material = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.9 });
  const ring = new THREE.Mesh(new THREE.RingGeometry(0.92, 1.08, 40), material);
  ring.visible = false;
  return ring;
}

/** Without a graphics card, antialiasing costs more than everything else. */
function isSoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}
