/* Small things that the 3-D view is built of: merged geometry with colours at its corners, and giving memory back. */

import { THREE } from "nicegui-scene";

/** Merge parts [geometry, colour, [x, y, z], [turn about x, y, z]] into one geometry. */
export function merge(parts) {
  const pieces = parts.map(([geometry, colour, place = [0, 0, 0], turn = [0, 0, 0]]) => {
    const matrix = new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(...turn)).setPosition(...place);
    const piece = geometry.index ? geometry.toNonIndexed() : geometry.clone();
    geometry.dispose();
    return { piece: piece.applyMatrix4(matrix), colour: new THREE.Color(colour) };
  });
  const count = pieces.reduce((sum, { piece }) => sum + piece.attributes.position.count, 0);
  const positions = new Float32Array(3 * count);
  const normals = new Float32Array(3 * count);
  const colours = new Float32Array(3 * count);
  let at = 0;
  for (const { piece, colour } of pieces) {
    positions.set(piece.attributes.position.array, at);
    normals.set(piece.attributes.normal.array, at);
    for (let k = 0; k < piece.attributes.position.count; k++) colours.set([colour.r, colour.g, colour.b], at + 3 * k);
    at += piece.attributes.position.array.length;
    piece.dispose();
  }
  const merged = new THREE.BufferGeometry();
  merged.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  merged.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
  merged.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  return merged;
}

export function box(length, width, height) {
  return new THREE.BoxGeometry(length, width, height);
}

/** A cylinder that stands upright. */
export function column(radius, height, sides = 20) {
  return new THREE.CylinderGeometry(radius, radius, height, sides).rotateX(Math.PI / 2);
}

/** A plate of any outline [[x, y], ...] from z = 0 up. */
export function plate(points, height) {
  const outline = new THREE.Shape(points.map(([x, y]) => new THREE.Vector2(x, y)));
  return new THREE.ExtrudeGeometry(outline, { depth: height, bevelEnabled: false });
}

/** Take everything out of a group and give its memory on the graphics card back. */
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
