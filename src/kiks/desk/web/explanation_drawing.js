/* A drawing of a sensor's seven rays: their lengths, what they met, and their contributions to the reading. */

import { rgba, robotColour } from "./colours.js";

const REACH = 150, THIN = 1.5, THICK = 6;
const RANGES_MM = [6, 15, 30, 60];
const WALL = "#8a6d3b";

/** Return an SVG of the rays of an explanation, with the sensor's axis upwards, in the text colour of the page. */
export function drawRays({ sensor, rays, reach_mm }, scene, isDark) {
  const axis_deg = rays[(rays.length - 1) / 2].angle_deg, hits = rays.filter(hasMet);
  const most = Math.max(...rays.map(({ contribution_counts }) => Math.abs(contribution_counts)));
  const longest_mm = Math.max(...hits.map(({ length_mm }) => length_mm));
  // Up to the sensor's reach, or less if all rays end nearer.
  const range_mm = hits.length < rays.length ? reach_mm : RANGES_MM.find((each) => each >= longest_mm) ?? reach_mm;
  const met = rays.map((ray) => (hasMet(ray) ? `${ray.met} at ${ray.length_mm.toFixed(1)} mm` : "nothing"));
  const drawn = rays.map((ray, number) => {
    const share = most >= 0.5 ? Math.abs(ray.contribution_counts) / most : 0;
    return drawRay(number + 1, ray, ((ray.angle_deg - axis_deg + 540) % 360) - 180, range_mm, share, scene, isDark);
  });
  return svg("svg", {
    viewBox: "-180 -206 360 236", role: "img", class: "kiks-ray-drawing", "aria-label": `Rays of sensor ${sensor}: ${met.join("; ")}`,
  }, [
    ...[1 / 3, 2 / 3, 1].flatMap((share) => drawRing(share, range_mm)), ...drawn.flat(),
    svg("rect", { x: -12, width: 24, height: 12, rx: 2, fill: "currentColor" }), words(0, 26, `sensor ${sensor}`, 12),
  ]);
}

const hasMet = ({ length_mm }) => Number.isFinite(length_mm);

/** The place at some distance along a ray; a positive turn is to the left. */
function placeOf(turn_deg, way) {
  const turn = (turn_deg * Math.PI) / 180;
  return [-way * Math.sin(turn), -way * Math.cos(turn)];
}

function drawRing(share, range_mm) {
  const way = share * REACH, [x0, y0] = placeOf(66, way), [x1, y1] = placeOf(-66, way);
  const d = `M${x0} ${y0} A${way} ${way} 0 0 1 ${x1} ${y1}`;
  return [svg("path", { d, fill: "none", stroke: "currentColor", opacity: 0.25 }),
    words(x1 + 4, y1 + 14, `${(share * range_mm).toFixed(0)} mm`, 10, 0.7)];
}

/** A ray with what it met: a bar for a wall, a ring for a robot, a disc for a ball or cylinder. */
function drawRay(number, ray, turn_deg, range_mm, share, scene, isDark) {
  const way = REACH * (hasMet(ray) ? Math.min(ray.length_mm / range_mm, 1) : 1), parts = [];
  if (hasMet(ray)) {
    const colour = colourOf(ray.met, scene, isDark), isWall = ray.met === "wall", grey = ray.brightness;
    const edge = { stroke: colour, "stroke-width": 2 };
    parts.push(svg("line", { y2: -way, stroke: colour, "stroke-width": THIN + share * (THICK - THIN), "stroke-linecap": "round" }));
    parts.push(isWall ? svg("rect", { x: -9, y: -way - 6, width: 18, height: 6, fill: rgba([grey, grey, grey]), ...edge })
      : svg("circle", { cy: -way, r: 6, fill: ray.met.startsWith("robot") ? "none" : colour, ...edge }));
  } else parts.push(svg("line", { y2: -way, stroke: "currentColor", "stroke-dasharray": "3 4", opacity: 0.5 }));
  const [x, y] = placeOf(turn_deg, REACH + 18);
  return [svg("g", { transform: `rotate(${-turn_deg})` }, parts), words(x, y - 6, number, 11, 0.7),
    words(x, y + 8, hasMet(ray) ? ray.length_mm.toFixed(1) : "–", 13)];
}

function colourOf(met, { robots, bodies }, isDark) {
  const [what, number] = met.split(" "), body = bodies.find((each) => each.what === what && each.number === Number(number));
  if (what === "robot") return robotColour(robots[number - 1], isDark);
  return body ? rgba(body.colour) : WALL;
}

function words(x, y, text, size, opacity = 1) {
  const look = { x, y, "text-anchor": "middle", fill: "currentColor", "font-size": size, opacity };
  return svg("text", look, [String(text)]);
}

function svg(tag, attributes, children = []) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
