/* The arena from above on a canvas. Static parts (floor, walls, grid, trails) are drawn off screen, and
   again only when the view, the scene or the light changes; each picture then draws what moves over it. */

import { fillDisc, strokeRing } from "./circles.js";
import { LAMPLIGHT, palette, rgba, robotColour } from "./colours.js";
import { Floor } from "./floor.js";
import { paintMarks } from "./top_marks.js";
import { paintRays, paintView } from "./top_rays.js";
import { paintCamera, paintName, paintRobot, RobotLook } from "./top_robots.js";
import { paintRulers, RULER_PX } from "./rulers.js";
import { countOf, LAMP_RADIUS_MM, posesOf } from "./things.js";
import { Trails } from "./trails.js";
import { Viewport } from "./viewport.js";

const MARGIN_PX = RULER_PX + 10;

export class TopView {
  constructor(canvas, feed) {
    this.canvas = canvas;
    this.feed = feed;
    this.viewport = new Viewport();
    this.trails = new Trails();
    this.show = {};
    this.follow = -1;
    this._context = canvas.getContext("2d", { alpha: false });
    this._still = document.createElement("canvas");
    this._rulers = document.createElement("canvas");
    this._floor = new Floor();
    this._looks = [];
    this._still_key = this._rulers_key = "";
    this._drawn = [];
    this._isMoved = false;
    this.setDark(false);
  }

  get isDark() { return this._isDark; }

  setDark(isDark) {
    this._isDark = isDark;
    this.colours = palette(isDark);
    this._floor.setRaster(this._floor.raster, this.colours);
    this._still_key = "";
  }

  /** Take a scene; the raster comes later, with setRaster. The view stays where it is when the arena keeps its size. */
  setScene(scene) {
    const size = `${scene.arena.width_mm},${scene.arena.height_mm}`;
    if (size !== this._size) this._isMoved = false;
    this._size = size;
    this._looks = scene.robots.map((robot) => new RobotLook(robot));
    this.trails.clear();
    if (!this._isMoved) this.fit();
  }

  setShapes(scene) {
    scene.robots.forEach((robot, index) => this._looks[index]?.setShapes(robot.shapes));
  }

  setRaster(raster) {
    this._floor.setRaster(raster, this.colours);
    this._still_key = "";
  }

  resize(width_px, height_px, ratio) {
    this._ratio = ratio;
    for (const canvas of [this.canvas, this._still, this._rulers]) {
      canvas.width = Math.max(1, Math.round(width_px * ratio));
      canvas.height = Math.max(1, Math.round(height_px * ratio));
    }
    this.viewport.resize(width_px, height_px);
    if (!this._isMoved) this.fit();
  }

  fit() {
    const arena = this.feed.scene?.arena;
    if (!arena) return;
    this.viewport.fit(arena.width_mm, arena.height_mm, MARGIN_PX);
    this._isMoved = false;
  }

  /** Keep the view that a finger or a key has moved, until the person asks for all of the arena. */
  keepView() { this._isMoved = true; }

  /** Draw a picture. `marks` are those of the pointer: {selected, hovered, ghost, preview}. */
  draw(marks, now_ms) {
    const { frame, scene } = this.feed, context = this._context, { viewport } = this;
    const poses = posesOf(this.feed, now_ms);
    if (poses[this.follow]) viewport.centreOn(poses[this.follow].x_mm, poses[this.follow].y_mm);
    this._drawStill(frame);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._still, 0, 0);
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    if (frame && scene) this._drawMoving(context, frame, scene, poses, marks);
    if (scene) paintMarks(context, viewport, this.feed, marks, this.colours);
    if (scene && this.show.ruler) this._drawRulers(context);
  }

  _drawStill(frame) {
    const { viewport, show } = this;
    if (this._floor.setLamps((show.light && frame?.lamps) || [], this.feed, this._isDark)) this._still_key = "";
    const isFromTop = Boolean(this.feed.scene?.has_old_coordinates), trails = this.trails.changes;
    const key = `${viewport.changes} ${show.grid} ${show.light} ${show.trails} ${trails} ${this._ratio} ${isFromTop}`;
    const context = this._still.getContext("2d", { alpha: false });
    context.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
    if (key !== this._still_key) {
      this._floor.paint(context, viewport, { isGrid: show.grid, isLight: show.light, isFromTop }, this.colours);
      this._drawn = [];
      this._still_key = key;
    }
    const colourOf = (index) => robotColour(this.feed.scene.robots[index], this._isDark, 0.55);
    if (show.trails) this._drawn = this.trails.paint(context, viewport, this._drawn, colourOf);
  }

  _drawRulers(context) {
    const { scene } = this.feed.scene;
    const key = `${this.viewport.changes} ${this._isDark} ${this._ratio} ${scene}`;
    if (key !== this._rulers_key) {
      const rulers = this._rulers.getContext("2d");
      rulers.setTransform(this._ratio, 0, 0, this._ratio, 0, 0);
      rulers.clearRect(0, 0, this.viewport.width_px, this.viewport.height_px);
      paintRulers(rulers, this.viewport, this.feed.scene, this.colours);
      this._rulers_key = key;
    }
    const { width, height } = this.canvas, thick = Math.round(RULER_PX * this._ratio);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._rulers, 0, 0, thick, height, 0, 0, thick, height);
    context.drawImage(this._rulers, 0, height - thick, width, thick, 0, height - thick, width, thick);
  }

  _drawMoving(context, frame, scene, poses, marks) {
    const { viewport, show, colours } = this, { scale } = viewport;
    const cameras = poses.map((_, index) => (show.camera ? frame.camera(index) : null));
    poses.forEach((pose, index) => cameras[index] && paintView(context, viewport, pose, colours));
    if (show.rays) paintRays(context, viewport, scene, frame, poses, colours);
    const bodies = Array.from({ length: countOf(this.feed, "body") }, (_, index) => frame.body(index));
    const paint = (isLifted) =>
      bodies.forEach((place, index) => {
        if (place.isLifted === isLifted) this._drawBody(context, scene.bodies[index], place);
      });
    paint(false);
    poses.forEach((pose, index) => {
      const [x, y] = viewport.toScreen(pose.x_mm, pose.y_mm), reach = 3 * scene.robots[index].radius_mm * scale;
      if (x < -reach || y < -reach || x > viewport.width_px + reach || y > viewport.height_px + reach) return;
      const robot = frame.robot(index), cosine = Math.cos(pose.heading_rad), sine = Math.sin(pose.heading_rad);
      if (show.contacts && robot.isTouching) {
        const radius = scene.robots[index].radius_mm * scale, dash = [0.35 * radius, 0.25 * radius];
        strokeRing(context, x, y, radius * 1.16 + 2, colours.touch, Math.max(2.5, 0.1 * radius), dash);
      }
      context.save();
      context.transform(scale * cosine, -scale * sine, -scale * sine, -scale * cosine, x, y);
      context.globalAlpha = scene.robots[index].opacity ?? 1;
      paintRobot(context, this._looks[index], robot, scale, this._isDark);
      context.restore();
    });
    paint(true);
    poses.forEach((pose, index) => {
      const [x, y] = viewport.toScreen(pose.x_mm, pose.y_mm), radius = scene.robots[index].radius_mm * scale;
      if (cameras[index]) paintCamera(context, cameras[index], x, y, radius, colours);
      if (show.names) paintName(context, scene.robots[index], x, y, radius, colours);
    });
    for (const lamp of frame.lamps) this._drawLamp(context, lamp);
  }

  _drawBody(context, body, place) {
    const [x, y] = this.viewport.toScreen(place.x_mm, place.y_mm);
    const radius = Math.max(2, body.radius_mm * this.viewport.scale);
    const rgb = body.colour, grow = place.isLifted ? 1.12 : 1;
    fillDisc(context, x, y, radius * grow, rgba(rgb));
    strokeRing(context, x, y, radius * grow, rgba(rgb.map((part) => part >> 1)), Math.max(1, 0.09 * radius));
    const bright = rgba(rgb.map((part) => Math.min(255, part + 60)), 0.75);
    if (body.what === "ball") fillDisc(context, x - 0.3 * radius, y - 0.34 * radius, 0.24 * radius, bright);
    else fillDisc(context, x, y, 0.62 * radius, bright);
  }

  _drawLamp(context, lamp) {
    const [x, y] = this.viewport.toScreen(lamp.x_mm, lamp.y_mm);
    const radius = Math.max(5, LAMP_RADIUS_MM * this.viewport.scale * 0.6);
    if (lamp.isOn) {
      const reach = radius * 4.2, glow = context.createRadialGradient(x, y, 0, x, y, reach);
      glow.addColorStop(0, rgba([255, 250, 225], 1));
      glow.addColorStop(0.25, rgba(LAMPLIGHT, 0.75));
      glow.addColorStop(1, rgba(LAMPLIGHT, 0));
      context.fillStyle = glow;
      context.fillRect(x - reach, y - reach, 2 * reach, 2 * reach);
    }
    context.beginPath();
    for (let k = 0; k < 8; k++) {
      const along = [Math.cos((k * Math.PI) / 4), Math.sin((k * Math.PI) / 4)];
      context.moveTo(x + 1.25 * radius * along[0], y + 1.25 * radius * along[1]);
      context.lineTo(x + 1.75 * radius * along[0], y + 1.75 * radius * along[1]);
    }
    const edge = lamp.isOn ? "#c98a00" : this.colours.lampOff;
    context.lineWidth = Math.max(1.5, 0.2 * radius);
    context.strokeStyle = edge;
    context.stroke();
    fillDisc(context, x, y, radius, lamp.isOn ? "#ffd84d" : this.colours.lampOff);
    strokeRing(context, x, y, radius, edge, context.lineWidth);
  }
}
