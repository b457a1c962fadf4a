// Snapping: ends of lines to ends and walls, directions to horizontal, vertical and the walls where they begin, moved items to
// their neighbours. Pure. A guide is `{ point }` or `{ line: [a, b] }` and shows what something has snapped to.

import { between, boxOf, distance, meeting, nearestOn } from "./geometry.js";
import { allKeys, isClosed, pointsOf, union } from "./items.js";

/** How close to an end something snaps to it, screen pixels. */
export const SNAP_PX = 10;
/** Directions snap within this many degrees; with Shift, to multiples of the step. */
const [MAGNET_DEG, STEP_DEG] = [4, 15];
/** Lines with more points than this are freehand: only their ends are corners. */
const MOST_CORNERS = 12;
/** The reach of walls and edges, as a fraction of that of ends. */
const WEAKER = 0.6;

/** Snapping targets: `{ points, walls, boxes }` of strokes and obstacles: all, or `only` these keys, `except` those. */
export function targets(drawing, options = null) {
  if (options) return found(drawing, options);
  if (!known.has(drawing)) known.set(drawing, found(drawing, {}));
  return known.get(drawing);
}

const known = new WeakMap();

function found(drawing, { except = [], only = allKeys(drawing) }) {
  const out = new Set(except);
  const all = { points: [], walls: [], boxes: [] };
  for (const key of only) {
    if (out.has(key) || !/^(strokes|obstacles)/.test(key)) continue;
    const points = pointsOf(drawing, key);
    const closed = isClosed(key);
    if (points.length <= MOST_CORNERS) all.points.push(...points);
    else if (!closed) all.points.push(points[0], points.at(-1));
    for (let i = closed ? 0 : 1; i < points.length; i += 1) all.walls.push([points.at(i - 1), points[i]]);
    all.boxes.push(boxOf(points));
  }
  return all;
}

function nearest(candidates, p, reach) {
  let [best, least] = [null, reach];
  for (const q of candidates) {
    const off = distance(p, q);
    if (off <= least) [best, least] = [q, off];
  }
  return best;
}

/** The nearest point on a wall within `reach`; `null` if there is none. */
export const onWall = (p, { walls }, reach) => nearest(walls.map(([a, b]) => nearestOn(p, a, b)), p, reach);

/** A point snapped to an end, or else to a wall: `{ at, guides }`. */
export function snappedPoint(p, around, reach) {
  const at = nearest(around.points, p, reach) ?? onWall(p, around, reach * WEAKER);
  return at ? { at, guides: [{ point: at }] } : { at: p, guides: [] };
}

const degreesOf = (a, b) => (Math.atan2(b[1] - a[1], b[0] - a[0]) * 180) / Math.PI;
const apart = (a, b) => Math.abs(((a - b + 540) % 360) - 180);

/**
 * The intended direction of a line: horizontal, vertical, 45°, or along or across a wall at whose end it begins; `null` if none.
 */
function direction(from, p, { walls }, steps) {
  const drawn = degreesOf(from, p);
  if (steps) return STEP_DEG * Math.round(drawn / STEP_DEG);
  const begins = walls.filter(([a, b]) => distance(a, from) < 0.5 || distance(b, from) < 0.5).map(([a, b]) => degreesOf(a, b));
  const wanted = [0, 45, ...begins].flatMap((d) => [d, d + 90, d + 180, d + 270]);
  const best = wanted.reduce((a, b) => (apart(b, drawn) < apart(a, drawn) - 1e-6 ? b : a));
  return apart(best, drawn) <= MAGNET_DEG ? best : null;
}

/** The end of a line from `from`, snapped: `{ at, guides }`. `steps`: to multiples of 15° only. */
export function snappedEnd(from, p, around, reach, steps = false) {
  const end = steps ? null : nearest(around.points.filter((q) => distance(q, from) > reach), p, reach);
  if (end) return { at: end, guides: [{ point: end }] };
  const degrees = distance(from, p) > 0 ? direction(from, p, around, steps) : null;
  if (degrees === null) {
    const at = onWall(p, around, reach * WEAKER);
    return at ? { at, guides: [{ point: at }] } : { at: p, guides: [] };
  }
  const u = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)].map((v) => (Math.abs(v) < 1e-9 ? 0 : v));
  const far = (p[0] - from[0]) * u[0] + (p[1] - from[1]) * u[1];
  const on = (t) => [from[0] + u[0] * t, from[1] + u[1] * t];
  const stop = stopAt(from, u, far, around, reach);
  const ray = { line: [from, on(stop?.far ?? far)] };
  return { at: on(stop?.far ?? far), guides: stop ? [ray, stop.guide] : [ray] };
}

/** Where a line in the direction `u` should end near `far`: at a wall that it meets, or aligned with a corner. */
function stopAt(from, u, far, { points, walls }, reach) {
  const stops = [];
  for (const [a, b] of walls) {
    const v = [b[0] - a[0], b[1] - a[1]];
    const t = meeting(from, u, a, v);
    if (t === null || t < reach || Math.abs(t - far) > reach * WEAKER) continue;
    const at = [from[0] + u[0] * t, from[1] + u[1] * t];
    if (distance(nearestOn(at, a, b), at) < 0.01) stops.push({ far: t, guide: { point: at } });
  }
  const axis = [0, 1].find((i) => u[1 - i] === 0);
  for (const q of axis === undefined || stops.length ? [] : points) {
    const t = (q[axis] - from[axis]) * u[axis];
    if (t < reach || Math.abs(t - far) > reach * WEAKER || distance(q, from) < 0.5) continue;
    stops.push({ far: t, guide: { line: [q, [from[0] + u[0] * t, from[1] + u[1] * t]] } });
  }
  return stops.reduce((a, b) => (a && Math.abs(a.far - far) <= Math.abs(b.far - far) ? a : b), null);
}

/**
 * A move of `moving` (targets of the moved items) by `by`, snapped: `{ by, guides }`. Ends take precedence over edges and centres.
 */
export function snappedMove(moving, by, around, reach) {
  let [best, least] = [null, reach];
  for (const p of moving.points) {
    const to = [p[0] + by[0], p[1] + by[1]];
    const q = nearest(around.points, to, least);
    if (q) [best, least] = [{ by: [q[0] - p[0], q[1] - p[1]], guides: [{ point: q }] }, distance(q, to)];
  }
  return best ?? besideOthers(moving.boxes, by, around.boxes, reach * WEAKER);
}

const parts = (box, axis) => [box[axis], (box[axis] + box[axis + 2]) / 2, box[axis + 2]];

function besideOthers(moving, by, others, reach) {
  const guides = [];
  if (!moving.length) return { by, guides };
  const own = moving.reduce(union);
  const snapped = [0, 1].map((axis) => {
    let best = null;
    for (const box of others) {
      for (const line of parts(box, axis)) {
        for (const part of parts(own, axis)) {
          const off = line - part;
          if (Math.abs(off - by[axis]) <= (best ? Math.abs(best.off - by[axis]) - 1e-9 : reach)) best = { off, line, box };
        }
      }
    }
    return best;
  });
  const moved = snapped.map((best, axis) => best?.off ?? by[axis]);
  snapped.forEach((best, axis) => {
    if (!best) return;
    const across = 1 - axis;
    const ends = [best.box[across], best.box[across + 2], own[across] + moved[across], own[across + 2] + moved[across]];
    const line = [Math.min(...ends), Math.max(...ends)].map((v) => (axis === 0 ? [best.line, v] : [v, best.line]));
    guides.push({ line });
  });
  return { by: moved, guides };
}

// ---------------------------------------------------------------------------- gaps

/** Maximum width of a gap that is closed, in widths of the stroke. */
const GAP_WIDTHS = 8;
/** Walls that meet at less than this angle are collinear, and their ends meet halfway. */
const IN_LINE = Math.sin((20 * Math.PI) / 180);

/** The ends of the strokes: their position, the previous point, and its index. */
function endsOf(drawing) {
  return drawing.strokes.flatMap(({ points, width_px }, i) => {
    if (points.length < 2) return [];
    return [[0, 1], [points.length - 1, points.length - 2]].map(([index, before]) => (
      { key: `strokes:${i}`, index, at: points[index], before: points[before], most: GAP_WIDTHS * width_px, few: points.length < 3 }
    ));
  });
}

/** Where two ends meet: at the intersection of their walls if that is close to both, or else halfway. */
function joint(a, b, most) {
  const [u, v] = [a, b].map(({ at, before }) => [0, 1].map((i) => (at[i] - before[i]) / distance(at, before)));
  if (Math.abs(u[0] * v[1] - u[1] * v[0]) > IN_LINE) {
    const t = meeting(a.at, u, b.at, v);
    const at = [a.at[0] + u[0] * t, a.at[1] + u[1] * t];
    if (distance(at, a.at) <= most && distance(at, b.at) <= most) return at;
  }
  return between(a.at, b.at, 0.5);
}

/**
 * Where ends of the selected strokes should move to close their gaps: `{ key, index, at }`. Ends close to each other meet; the
 * others move to a wall nearby. Unselected strokes stay unchanged.
 */
export function closings(drawing, keys) {
  const chosen = new Set(keys);
  const ends = endsOf(drawing);
  const pairs = [];
  ends.forEach((a, i) => ends.slice(i + 1).forEach((b) => {
    const off = distance(a.at, b.at);
    const own = a.key === b.key && a.few;
    if (!own && off <= Math.max(a.most, b.most) && (chosen.has(a.key) || chosen.has(b.key))) pairs.push({ a, b, off });
  }));
  const [closed, done] = [[], new Set()];
  for (const { a, b, off } of pairs.sort((p, q) => p.off - q.off)) {
    if (done.has(a) || done.has(b)) continue;
    done.add(a).add(b);
    if (off < 0.01) continue;
    const both = chosen.has(a.key) && chosen.has(b.key);
    const at = both ? joint(a, b, Math.max(a.most, b.most)) : (chosen.has(a.key) ? b : a).at;
    for (const { key, index } of [a, b].filter((end) => chosen.has(end.key))) closed.push({ key, index, at });
  }
  const walls = allKeys(drawing).filter((key) => key.startsWith("strokes"));
  for (const end of ends) {
    if (done.has(end) || !chosen.has(end.key)) continue;
    const at = onWall(end.at, targets(drawing, { except: [end.key], only: walls }), end.most);
    if (at && distance(at, end.at) >= 0.01) closed.push({ key: end.key, index: end.index, at });
  }
  return closed;
}
