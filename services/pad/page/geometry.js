// Points and lines on the sheet. All coordinates are canvas pixels: column, row, with row 0 at the top. Pure, without access to the
// browser.

/** Distance between two points. */
export const distance = (a, b) => Math.hypot(b[0] - a[0], b[1] - a[1]);

/** The point at fraction `t` from `a` to `b`. */
export const between = (a, b, t) => [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];

/** Distance of `p` from the segment `a`–`b`. */
export const distanceToSegment = (p, a, b) => distance(p, nearestOn(p, a, b));

/** The point on the segment `a`–`b` closest to `p`. */
export function nearestOn(p, a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const square = dx * dx + dy * dy;
  const t = square === 0 ? 0 : ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square;
  return between(a, b, Math.min(1, Math.max(0, t)));
}

/** Distance of `p` from a line through `points`, or from a polygon if `closed`. */
export function distanceToLine(p, points, closed = false) {
  if (points.length === 1) return distance(p, points[0]);
  let least = closed ? distanceToSegment(p, points.at(-1), points[0]) : Infinity;
  for (let i = 1; i < points.length; i += 1) {
    least = Math.min(least, distanceToSegment(p, points[i - 1], points[i]));
  }
  return least;
}

const boxes = new WeakMap();

/** The bounding box of points: left, top, right, bottom; cached. */
export function boxOf(points) {
  let found = boxes.get(points);
  if (!found) {
    found = [Infinity, Infinity, -Infinity, -Infinity];
    for (const [x, y] of points) {
      found = [Math.min(found[0], x), Math.min(found[1], y), Math.max(found[2], x), Math.max(found[3], y)];
    }
    boxes.set(points, found);
  }
  return found;
}

/** Whether `p` is inside the polygon (even-odd). */
export function inside(p, polygon) {
  let odd = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i, i += 1) {
    const [a, b] = [polygon[i], polygon[j]];
    const crosses = a[1] > p[1] !== b[1] > p[1];
    if (crosses && p[0] < ((b[0] - a[0]) * (p[1] - a[1])) / (b[1] - a[1]) + a[0]) odd = !odd;
  }
  return odd;
}

/** Distances from a point inside a polygon to its edges along the row: left, right; 0 if it is outside. */
function reach(p, polygon) {
  const crossings = polygon.map((b, i) => [polygon.at(i - 1), b]).filter(([a, b]) => a[1] > p[1] !== b[1] > p[1])
    .map(([a, b]) => a[0] + ((p[1] - a[1]) / (b[1] - a[1])) * (b[0] - a[0]) - p[0]);
  const left = Math.max(...crossings.filter((x) => x <= 0));
  const right = Math.min(...crossings.filter((x) => x > 0));
  return Number.isFinite(right - left) ? [-left, right] : [0, 0];
}

/** The maximum width of a line of text of height `height` that is centred at a point of a polygon and stays inside. */
export function roomAt([x, y], polygon, height) {
  const rows = [-0.5, 0, 0.5].flatMap((part) => reach([x, y + part * height], polygon));
  return 2 * Math.min(...rows);
}

/** Mean of the corners. */
export function middle(points) {
  const sum = points.reduce((s, p) => [s[0] + p[0], s[1] + p[1]], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

/** Whether a stroke that ended with a pause was meant to be straight. */
export function meantStraight(points) {
  const [first, last] = [points[0], points.at(-1)];
  const chord = distance(first, last);
  if (points.length < 2 || chord < 40) return false;
  const allowed = Math.max(12, chord * 0.08);
  return points.every((p) => distanceToSegment(p, first, last) <= allowed);
}

/** `end` moved so that the line from `start` is horizontal or vertical if it nearly is (within 4°). */
export function squared(start, end) {
  const [dx, dy] = [Math.abs(end[0] - start[0]), Math.abs(end[1] - start[1])];
  const slope = Math.tan((4 * Math.PI) / 180);
  if (dy < dx * slope) return [end[0], start[1]];
  if (dx < dy * slope) return [start[0], end[1]];
  return end;
}

/** Corners of the axis-aligned rectangle between two opposite ones. */
export const box = (a, b) => [[a[0], a[1]], [b[0], a[1]], [b[0], b[1]], [a[0], b[1]]];

/** The parts of the segment `a`–`b` outside a disc, as ranges of t. */
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
 * What an eraser's disc leaves of a line: pieces `{ points, values }`, cut exactly at its edge; `null` if it does not touch the
 * line. `values` are per-point numbers (pressure), or `null`.
 */
export function erased(points, values, center, radius) {
  if (points.length === 1) return distance(points[0], center) < radius ? [] : null;
  if (distanceToLine(center, points) >= radius) return null;
  return cut(points, values, (i) => rangesOutside(points[i - 1], points[i], center, radius));
}

/**
 * The remaining pieces of a line if only the parts `ranges(i)` of the segment before each point `i` are kept: each part is `[from,
 * to]`, from 0 at the previous point to 1. `values` are per-point numbers, or `null`.
 */
export function cut(points, values, ranges) {
  const pieces = [];
  let piece = null;
  const value = (i, t) => (values ? values[i - 1] + (values[i] - values[i - 1]) * t : 0);
  for (let i = 1; i < points.length; i += 1) {
    const [a, b] = [points[i - 1], points[i]];
    const kept = ranges(i);
    for (const [from, to] of kept) {
      if (from > 0 || !piece) {
        piece = { points: [between(a, b, from)], values: [value(i, from)] };
        pieces.push(piece);
      }
      piece.points.push(between(a, b, to));
      piece.values.push(value(i, to));
    }
    if (kept.at(-1)?.[1] !== 1) piece = null;
  }
  return pieces.map(({ points: p, values: v }) => ({ points: p, values: values ? v : null }));
}

/**
 * The intersection of the lines through `a` along `u` and through `b` along `v`, as a multiple of `u` from `a`; `null` if parallel.
 */
export function meeting(a, u, b, v) {
  const cross = u[0] * v[1] - u[1] * v[0];
  if (Math.abs(cross) < 1e-9) return null;
  return ((b[0] - a[0]) * v[1] - (b[1] - a[1]) * v[0]) / cross;
}

/** The opposite corner, moved so that the box from `a` is a square. */
export function even(a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const side = Math.max(Math.abs(dx), Math.abs(dy));
  return [a[0] + side * (dx < 0 ? -1 : 1), a[1] + side * (dy < 0 ? -1 : 1)];
}

/** Number of corners for a curve of this length: one every 12 px, within limits. */
const corners = (length, least, most) => Math.round(Math.min(most, Math.max(least, length / 12)));

/** The corners of the ellipse in the box between two points. */
export function ellipse(a, b) {
  const [cx, cy] = between(a, b, 0.5);
  const [rx, ry] = [Math.abs(b[0] - a[0]) / 2, Math.abs(b[1] - a[1]) / 2];
  const count = corners(Math.PI * (rx + ry), 16, 64);
  const angle = (i) => (2 * Math.PI * i) / count;
  return Array.from({ length: count }, (_, i) => [cx + rx * Math.cos(angle(i)), cy + ry * Math.sin(angle(i))]);
}

/** The arc of a circle from `a` over `via` to `b`; a straight line if they lie on one. */
export function arc(a, b, via) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const [ex, ey] = [via[0] - a[0], via[1] - a[1]];
  const cross = 2 * (dx * ey - dy * ex);
  const chord = Math.hypot(dx, dy);
  if (Math.abs(cross) < chord * chord * 0.02) return [a, b];
  const [d2, e2] = [dx * dx + dy * dy, ex * ex + ey * ey];
  const middle = [a[0] + (ey * d2 - dy * e2) / cross, a[1] + (dx * e2 - ex * d2) / cross];
  const radius = distance(middle, a);
  const angle = (p) => Math.atan2(p[1] - middle[1], p[0] - middle[0]);
  const whole = 2 * Math.PI;
  const from = angle(a);
  const turn = (p) => (angle(p) - from + 2 * whole) % whole;
  const span = turn(via) < turn(b) ? turn(b) : turn(b) - whole;
  const count = corners(radius * Math.abs(span), 8, 96);
  const on = (t) => [middle[0] + radius * Math.cos(from + span * t), middle[1] + radius * Math.sin(from + span * t)];
  return [a, ...Array.from({ length: count - 1 }, (_, i) => on((i + 1) / count)), b];
}
