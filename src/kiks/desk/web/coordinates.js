/* The places and the numbers of sensors that people see. Everywhere else, x points to the right and y up from the lower
   left corner, and sensors are 0 to 7. In the coordinates of KiKS 2.2.0, x is a column and y a row of the arena's matrix,
   both from 1 and y down, and sensors are 1 to 8. Angles are the same. */

/** Return a place as people see it, [x, y]. */
export function shownPlace({ arena, has_old_coordinates }, x_mm, y_mm) {
  return has_old_coordinates ? [x_mm + 0.5, arena.height_mm + 0.5 - y_mm] : [x_mm, y_mm];
}

/** Return the place in the arena that people see as x, y. */
export function placeOfShown({ arena, has_old_coordinates }, x, y) {
  return has_old_coordinates ? [x - 0.5, arena.height_mm + 0.5 - y] : [x, y];
}

/** Return the number of a sensor as people see it. */
export function shownSensor(scene, sensor) {
  return scene?.has_old_coordinates ? sensor + 1 : sensor;
}
