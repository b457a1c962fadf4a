// Points and lines on the sheet. All coordinates are canvas pixels: column, row, row 0 at the top.
// Pure: nothing here knows the browser.

/** Distance of two points. */
export const distance = (a, b) => Math.hypot(b[0] - a[0], b[1] - a[1]);

/** The point at `t` of the way from `a` to `b`. */
export const between = (a, b, t) => [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];

/** Distance of `p` from the segment `a`–`b`. */
export function distanceToSegment(p, a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const square = dx * dx + dy * dy;
  if (square === 0) return distance(p, a);
  const t = ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square;
  return distance(p, between(a, b, Math.min(1, Math.max(0, t))));
}

/** Distance of `p` from a line through `points`, closed where it is a polygon's. */
export function distanceToLine(p, points, closed = false) {
  if (points.length === 1) return distance(p, points[0]);
  let least = closed ? distanceToSegment(p, points.at(-1), points[0]) : Infinity;
  for (let i = 1; i < points.length; i += 1) {
    least = Math.min(least, distanceToSegment(p, points[i - 1], points[i]));
  }
  return least;
}

/** Whether `p` lies within the polygon (even-odd). */
export function inside(p, polygon) {
  let odd = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i, i += 1) {
    const [a, b] = [polygon[i], polygon[j]];
    const crosses = a[1] > p[1] !== b[1] > p[1];
    if (crosses && p[0] < ((b[0] - a[0]) * (p[1] - a[1])) / (b[1] - a[1]) + a[0]) odd = !odd;
  }
  return odd;
}

/** How far it is from a point within a polygon to its edges, along its row: left, right; 0 where it is outside. */
function reach(p, polygon) {
  const crossings = polygon.map((b, i) => [polygon.at(i - 1), b]).filter(([a, b]) => a[1] > p[1] !== b[1] > p[1])
    .map(([a, b]) => a[0] + ((p[1] - a[1]) / (b[1] - a[1])) * (b[0] - a[0]) - p[0]);
  const left = Math.max(...crossings.filter((x) => x <= 0));
  const right = Math.min(...crossings.filter((x) => x > 0));
  return Number.isFinite(right - left) ? [-left, right] : [0, 0];
}

/** How wide a line of text may be that is centred at a point of a polygon, `height` high, and stays within. */
export function roomAt([x, y], polygon, height) {
  const rows = [-0.5, 0, 0.5].flatMap((part) => reach([x, y + part * height], polygon));
  return 2 * Math.min(...rows);
}

/** Middle of the corners. */
export function middle(points) {
  const sum = points.reduce((s, p) => [s[0] + p[0], s[1] + p[1]], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

/** Whether a person who drew this, and then held still, meant a straight line. */
export function meantStraight(points) {
  const [first, last] = [points[0], points.at(-1)];
  const chord = distance(first, last);
  if (points.length < 2 || chord < 40) return false;
  const allowed = Math.max(12, chord * 0.08);
  return points.every((p) => distanceToSegment(p, first, last) <= allowed);
}

/** `end` moved so that the line from `start` is level or upright where it nearly is (within 4°). */
export function squared(start, end) {
  const [dx, dy] = [Math.abs(end[0] - start[0]), Math.abs(end[1] - start[1])];
  const slope = Math.tan((4 * Math.PI) / 180);
  if (dy < dx * slope) return [end[0], start[1]];
  if (dx < dy * slope) return [start[0], end[1]];
  return end;
}

/** Corners of the upright rectangle between two opposite ones. */
export const box = (a, b) => [[a[0], a[1]], [b[0], a[1]], [b[0], b[1]], [a[0], b[1]]];

/** Which parts of the segment `a`–`b`, as ranges of t, lie outside a disc. */
function rangesOutside(a, b, center, radius) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const [fx, fy] = [a[0] - center[0], a[1] - center[1]];
  const [qa, qb, qc] = [dx * dx + dy * dy, 2 * (fx * dx + fy * dy), fx * fx + fy * fy - radius * radius];
  if (qa === 0) return qc < 0 ? [] : [[0, 1]];
  const root = qb * qb - 4 * qa * qc;
  if (root <= 0) return [[0, 1]];
  const enter = (-qb - Math.sqrt(root)) / (2 * qa);
  const leave = (-qb + Math.sqrt(root)) / (2 * qa);
  if (leave <= 0 || enter >= 1) return [[0, 1]];
  return [[0, enter], [leave, 1]].filter(([from, to]) => to > from);
}

/**
 * What an eraser's disc leaves of a line: pieces, each `{ points, values }`, cut exactly at its edge;
 * `null` where it does not touch it. `values` are numbers beside the points (pressure), or `null`.
 */
export function erased(points, values, center, radius) {
  if (points.length === 1) return distance(points[0], center) < radius ? [] : null;
  if (distanceToLine(center, points) >= radius) return null;
  const pieces = [];
  let piece = null;
  const value = (i, t) => (values ? values[i - 1] + (values[i] - values[i - 1]) * t : 0);
  for (let i = 1; i < points.length; i += 1) {
    const [a, b] = [points[i - 1], points[i]];
    for (const [from, to] of rangesOutside(a, b, center, radius)) {
      if (from > 0 || !piece) {
        piece = { points: [between(a, b, from)], values: [value(i, from)] };
        pieces.push(piece);
      }
      piece.points.push(between(a, b, to));
      piece.values.push(value(i, to));
      if (to < 1) piece = null;
    }
    if (distance(b, center) < radius) piece = null;
  }
  return pieces.map(({ points: p, values: v }) => ({ points: p, values: values ? v : null }));
}
