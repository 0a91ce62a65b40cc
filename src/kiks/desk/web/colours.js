/* All colours of both views, light and dark; those of robots, balls and cylinders come with the scene. */

const LIGHT = {
  outside: "#c9ced6", floor: [226, 222, 211], floorEdge: "#6f6a60", wallEdge: [92, 88, 80], shade: 0.16,
  gridFine: "rgba(70,62,40,.10)", gridCoarse: "rgba(70,62,40,.26)",
  ruler: "rgba(244,245,247,.94)", rulerInk: "#30353d", rulerTick: "#7a818c",
  ink: "#14181d", halo: "rgba(255,255,255,.9)", accent: "#0b62d6", ghost: "rgba(11,98,214,.9)", touch: "#e0261b",
  lampOff: "#8d8a80", tool: "rgba(11,98,214,.35)", rayAlpha: 0.8, fanAlpha: 0.16,
  sky: 0xc9ced6, wallFrom: 22, wallTo: 255,
};

const DARK = {
  outside: "#101317", floor: [49, 55, 64], floorEdge: "#a7b0bd", wallEdge: [20, 23, 27], shade: 0.3,
  gridFine: "rgba(220,230,255,.07)", gridCoarse: "rgba(220,230,255,.18)",
  ruler: "rgba(24,28,33,.94)", rulerInk: "#d5dbe4", rulerTick: "#7d8794",
  ink: "#f2f5f8", halo: "rgba(0,0,0,.8)", accent: "#6db1ff", ghost: "rgba(109,177,255,.95)", touch: "#ff5a4d",
  lampOff: "#77736a", tool: "rgba(109,177,255,.35)", rayAlpha: 0.8, fanAlpha: 0.16,
  sky: 0x14181d, wallFrom: 4, wallTo: 246,
};

export function palette(isDark) {
  return isDark ? DARK : LIGHT;
}

/** The grey on the screen of a wall of a brightness from 1 to 255. All greys differ from the floor by shade or hue. */
export function wallGrey(brightness, colours) {
  return Math.round(colours.wallFrom + (colours.wallTo - colours.wallFrom) * (brightness / 255));
}

/** Colours of rays by their sensor's reading, from nothing near to very near, one per bucket. */
export const READING_COLOURS = [
  [58, 128, 200], [20, 160, 140], [92, 176, 66], [214, 176, 30], [236, 122, 28], [226, 42, 34],
];
const READING_LIMITS = [20, 100, 250, 450, 750];

/** The bucket of a sensor's reading, by the `scales` of its robot: a Khepera's is 1. */
export function readingBucket(reading, { proximity }) {
  const counts = reading * proximity;
  let bucket = 0;
  while (bucket < READING_LIMITS.length && counts >= READING_LIMITS[bucket]) bucket++;
  return bucket;
}

export function rgba([red, green, blue], alpha = 1) {
  return `rgba(${red},${green},${blue},${alpha})`;
}

/** The colour of a robot, of the two that come with the scene: its ring, its trail, its name. */
export function robotColour({ colours }, isDark, alpha = 1) {
  return (isDark ? colours.dark : colours.light) + Math.round(255 * alpha).toString(16).padStart(2, "0");
}

/** A lamp's light [red, green, blue]. */
export const LAMPLIGHT = [255, 214, 96];
