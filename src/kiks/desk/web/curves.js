/* Curves over the last seconds, one line for each sensor or wheel, on one canvas. */

const LIGHT = ["#0067a8", "#c75000", "#00825f", "#b0217f", "#6a4bb5", "#8f6a00", "#51606e", "#b3261e"];
const DARK = ["#5db8ef", "#ff9a55", "#38d9a9", "#ff85cb", "#bda6ff", "#f2d454", "#c0cad4", "#ff7b72"];
const LEFT_PX = 40, RIGHT_PX = 20, TOP_PX = 10, BOTTOM_PX = 20;
const DASH_PX = [6, 3];
const SPEED_LEAST = 12;

export const CURVES = {
  proximity: { label: "Proximity", names: ["0", "1", "2", "3", "4", "5", "6", "7"], note: "counts, more is nearer" },
  ambient: { label: "Light", names: ["0", "1", "2", "3", "4", "5", "6", "7"], note: "counts, less is brighter" },
  speeds: {
    label: "Speeds", names: ["left", "right", "left set", "right set"],
    titles: ["Left wheel, measured", "Right wheel, measured", "Left wheel, commanded", "Right wheel, commanded"],
  },
};

/** The colour of a curve; the measured and the commanded speed of a wheel have the same one. */
export function lineColour(kind, line, isDark) {
  return (isDark ? DARK : LIGHT)[kind === "speeds" ? line % 2 : line];
}

/** Whether a curve is dashed, so that people can identify it without colours. */
export function isDashed(kind, line) {
  return kind === "speeds" ? line >= 2 : line >= 4;
}

function rangeOf(kind, history, { counts_max, scales, speed_scale }) {
  if (kind === "proximity") return [0, counts_max, counts_max > 2000 ? 1000 : 250];
  if (kind === "ambient") return [0, 520 / scales.ambient, scales.ambient < 0.5 ? 1000 : 100];
  let most = SPEED_LEAST * speed_scale;
  for (let back = 0; back < history.count; back++)
    for (const value of history.values(back, "speeds")) if (Math.abs(value) > most) most = Math.abs(value);
  most *= 1.08;
  const step = 10 ** Math.floor(Math.log10(most));
  return [-most, most, most > 4 * step ? 2.5 * step : most > 1.6 * step ? step : step / 2];
}

/** Draw the curves of a kind; `context` takes CSS pixels, `hidden` is a set of lines that are left out, `known` the robot. */
export function paintCurves(context, width, height, history, kind, hidden, known, isDark) {
  const ink = isDark ? "#e8edf2" : "#1d2329", faint = isDark ? "rgba(230,238,246,.16)" : "rgba(30,40,50,.14)";
  const [low, high, step] = rangeOf(kind, history, known), span_s = history.span_s;
  const right = width - RIGHT_PX, bottom = height - BOTTOM_PX;
  const toX = (time_s) => right - ((history.time(0) - time_s) / span_s) * (right - LEFT_PX);
  const toY = (value) => bottom - ((Math.min(Math.max(value, low), high) - low) / (high - low)) * (bottom - TOP_PX);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = ink;
  context.strokeStyle = faint;
  context.lineWidth = 1;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.beginPath();
  for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
    context.moveTo(LEFT_PX, toY(value));
    context.lineTo(right, toY(value));
    context.fillText(String(value), LEFT_PX - 6, toY(value));
  }
  context.textAlign = "center";
  for (let part = 0; part <= 4; part++) {
    const x = LEFT_PX + ((right - LEFT_PX) * part) / 4, ago_s = (span_s * (4 - part)) / 4;
    context.moveTo(x, TOP_PX);
    context.lineTo(x, bottom);
    context.fillText(part === 4 ? "now" : `−${ago_s < 100 ? Math.round(ago_s * 10) / 10 : Math.round(ago_s)} s`, x, bottom + 11);
  }
  context.stroke();
  if (!history.count) return;
  context.lineWidth = 2;
  context.lineJoin = "round";
  context.save();
  context.beginPath();
  context.rect(LEFT_PX, 0, width - LEFT_PX, height);
  context.clip();
  for (let line = 0; line < CURVES[kind].names.length; line++) {
    if (hidden.has(line)) continue;
    context.strokeStyle = lineColour(kind, line, isDark);
    context.setLineDash(isDashed(kind, line) ? DASH_PX : []);
    context.beginPath();
    let isDown = false;
    for (let back = 0; back < history.count; back++) {
      const value = history.values(back, kind)[line], x = toX(history.time(back));
      if (Number.isNaN(value)) isDown = false;
      else if (isDown) context.lineTo(x, toY(value));
      else context.moveTo(x, toY(value)), (isDown = true);
      if (x < LEFT_PX) break;
    }
    context.stroke();
  }
  context.setLineDash([]);
  context.restore();
  nameEnds(context, history, kind, hidden, isDark, right, toY);
}

/** Write the names of the lines at their ends; names that would overlap move down. */
function nameEnds(context, history, kind, hidden, isDark, right, toY) {
  const ends = [];
  history.values(0, kind).slice(0, kind === "speeds" ? 2 : undefined).forEach((value, line) => {
    if (!hidden.has(line) && !Number.isNaN(value)) ends.push({ line, y: toY(value) });
  });
  ends.sort((a, b) => b.y - a.y);
  context.textAlign = "left";
  context.font = "700 11px system-ui, sans-serif";
  let above = Infinity, column = 0;
  for (const { line, y } of ends) {
    // All idle sensors lie at the bottom, so their names are only in the legend.
    column = above - y < 10 ? column + 1 : 0;
    if (column === 0) above = y;
    if (column > 1) continue;
    context.fillStyle = lineColour(kind, line, isDark);
    context.fillText(kind === "speeds" ? "LR"[line] : String(line), right + 3 + 8 * column, y);
  }
}
