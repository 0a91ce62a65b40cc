/* The modules that the desk's components share. They import it by the name "kiks-desk", so that a page has one feed.
   The 3-D view is not here: it needs three.js, and is loaded when it is first shown ("kiks-desk/solid_view.js"). */

export { Feed, pageFeed } from "./feed.js";
export { Frame, NO_HIT, RAY_UNIT_MM, RAYS_PER_ROBOT, RAYS_PER_SENSOR, Robot, SENSORS } from "./frame.js";
export { palette, READING_COLOURS, readingBucket, rgba, robotColour } from "./colours.js";
export { clockText } from "./clock.js";
export { loadRaster } from "./raster.js";
export { KEYS_HELP } from "./keys.js";
export { Stage } from "./stage.js";
export { nameOf, placeOf } from "./things.js";
export { CURVES, isDashed, lineColour } from "./curves.js";
export { Monitor } from "./monitor.js";
export { placeOfNumber } from "./robot_drawing.js";
