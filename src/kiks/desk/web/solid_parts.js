/* Helpers of the 3-D view: merged geometry with vertex colours, and releasing memory. */

import { THREE } from "nicegui-scene";

// Colours are blended in screen space: converting each pixel to linear light and back is the largest cost without a
// graphics card.
THREE.ColorManagement.enabled = false;

/** Merge parts [geometry, colour, [x, y, z], [turn about x, y, z]] into one geometry. */
export function merge(parts) {
  const positions = [], normals = [], colours = [], indices = [], colour = new THREE.Color();
  for (const [geometry, paint, place = [0, 0, 0], turn = [0, 0, 0]] of parts) {
    geometry.applyMatrix4(new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(...turn)).setPosition(...place));
    const { position, normal } = geometry.attributes, first = positions.length / 3;
    colour.set(paint);
    positions.push(...position.array);
    normals.push(...normal.array);
    for (let k = 0; k < position.count; k++) {
      colours.push(colour.r, colour.g, colour.b);
      if (!geometry.index) indices.push(first + k);
    }
    if (geometry.index) for (const k of geometry.index.array) indices.push(first + k);
    geometry.dispose();
  }
  const merged = new THREE.BufferGeometry();
  merged.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  merged.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  merged.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
  merged.setIndex(indices);
  return merged;
}

export function box(length, width, height) {
  return new THREE.BoxGeometry(length, width, height);
}

/** A cylinder that stands upright. */
export function column(radius, height, sides = 20) {
  return new THREE.CylinderGeometry(radius, radius, height, sides).rotateX(Math.PI / 2);
}

/** A round board as parts for `merge`: a rim and a top, as the bottom is never visible. */
export function board(radius, height, colour, z, sides = 20) {
  const rim = new THREE.CylinderGeometry(radius, radius, height, sides, 1, true).rotateX(Math.PI / 2);
  return [[rim, colour, [0, 0, z]], [new THREE.CircleGeometry(radius, sides), colour, [0, 0, z + height / 2]]];
}

/** The side of an upright column, from one angle to another, at z = 0. */
export function arc(radius, height, from, to) {
  const sides = Math.ceil(8 * (to - from));
  // Its angle 0 is at -y.
  const side = new THREE.CylinderGeometry(radius, radius, height, sides, 1, true, from + Math.PI / 2, to - from);
  return side.rotateX(Math.PI / 2);
}

/** A plate of any outline [[x, y], ...] from z = 0 up. */
export function plate(points, height) {
  const outline = new THREE.Shape(points.map(([x, y]) => new THREE.Vector2(x, y)));
  return new THREE.ExtrudeGeometry(outline, { depth: height, bevelEnabled: false });
}

/** A shape of the scene that stands from a height to another, as parts for `merge`. */
export function standing({ points, colour, radius_mm }, low, high, sides) {
  if (points.length === 1)
    return [[column(radius_mm || 1, high - low, sides), colour, [...points[0], (low + high) / 2]]];
  return points.length > 2 ? [[plate(points, high - low), colour, [0, 0, low]]] : [];
}

/** Empty a group and release its memory on the graphics card. */
export function empty(group) {
  group.traverse((thing) => {
    thing.geometry?.dispose();
    for (const material of [thing.material ?? []].flat()) {
      material.map?.dispose();
      material.dispose();
    }
    if (thing.isInstancedMesh) thing.dispose();
  });
  group.clear();
}
