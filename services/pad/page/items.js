// What can be selected on the sheet: strokes, obstacles, texts, route, goals and start, all handled alike. Pure functions on
// drawings.
//
// A key names an item by its kind and its index among items of this kind, as in `strokes:3`. Keys stay valid until an item is added
// before it or removed. Strokes and obstacles with the same `group`, a number from 1, are selected together.

import { boxOf, distance, distanceToLine, inside } from "./geometry.js";
import { rounded } from "./model.js";
import { idOf } from "./shared.js";

/** Kinds from the bottom of the sheet to the top. */
const KINDS = ["strokes", "obstacles", "labels", "route", "goals", "start"];
/** Kinds of which a drawing has a list; of the others it has at most one. */
const LISTS = new Set(["strokes", "obstacles", "labels", "goals"]);
/**
 * Sizes of marks, screen pixels: radius of a goal, radius of a start, length of a start's arrow, width of a route, height of a
 * text.
 */
export const MARK_PX = { goal: 13, start: 9, arrow: 34, route: 6, text: 16 };
/** Width of a character of a text, as a fraction of its height. */
const LETTER = 0.55;
/** Maximum distance between a freehand line and its simplified form, as a fraction of its width. */
const FLAT = 0.5;

const kindOf = (key) => key.split(":")[0];
const place = (key) => {
  const [kind, index] = key.split(":");
  return [kind, Number(index)];
};

/** The item of a key; `undefined` or `null` if there is none. */
export function itemOf(drawing, key) {
  const [kind, index] = place(key);
  return LISTS.has(kind) ? drawing[kind][index] : drawing[kind];
}

/** All keys, from the bottom to the top. */
export function allKeys(drawing) {
  return KINDS.flatMap((kind) => {
    if (LISTS.has(kind)) return drawing[kind].map((_, i) => `${kind}:${i}`);
    return drawing[kind] ? [`${kind}:0`] : [];
  });
}

/** The key in one drawing of the item that a key names in another, or of its later version; `null` if it is gone. */
export function movedKey(key, before, after) {
  const kind = kindOf(key);
  if (!LISTS.has(kind)) return after[kind] ? key : null;
  const item = itemOf(before, key);
  const at = after[kind].findIndex((other) => other === item || (idOf(item) && idOf(item) === idOf(other)));
  return at < 0 ? null : `${kind}:${at}`;
}

/** Whether two drawings have the same number of items of each kind, so that keys mean the same in both. */
export function sameItems(a, b) {
  const count = (drawing, kind) => (LISTS.has(kind) ? drawing[kind].length : Number(Boolean(drawing[kind])));
  return KINDS.every((kind) => count(a, kind) === count(b, kind));
}

function pointsIn(kind, item) {
  if (kind === "strokes") return item.points;
  if (kind === "obstacles") return item.polygon;
  return kind === "route" ? item : [item.at];
}

function withPointsIn(kind, item, points) {
  if (kind === "strokes") return { ...item, points };
  if (kind === "obstacles") return { ...item, polygon: points };
  return kind === "route" ? points : { ...item, at: points[0] };
}

/** The points of an item. */
export const pointsOf = (drawing, key) => pointsIn(kindOf(key), itemOf(drawing, key));

/** Whether an item's last point is joined to its first. */
export const isClosed = (key) => kindOf(key) === "obstacles";

/** Whether an item is a mark, with a place but no extent. */
export const isMark = (key) => /^(labels|goals|start)/.test(key ?? "");

/** Whether an item has an editable text. */
export const hasText = (key) => /^(labels|obstacles)/.test(key ?? "");

/** The name of an item for the user. */
export function nameOf(drawing, key) {
  const [kind, index] = place(key);
  if (kind === "obstacles") return drawing.obstacles[index].label || "Obstacle";
  if (kind === "labels") return `“${drawing.labels[index].text}”`;
  return { strokes: "Wall", route: "Path", goals: `Goal ${index + 1}`, start: "Start" }[kind];
}

/** Whether an item's points can be edited individually. */
export const hasPoints = (key) => ["strokes", "obstacles", "route"].includes(kindOf(key));

/** Replaces each of these items by `change(item, kind, key)`; an item that becomes `null` is removed. */
export function withItems(drawing, keys, change) {
  const chosen = new Set(keys);
  const next = { ...drawing };
  for (const kind of new Set([...chosen].map(kindOf))) {
    if (LISTS.has(kind)) {
      const changed = (item, i) => (chosen.has(`${kind}:${i}`) ? change(item, kind, `${kind}:${i}`) : item);
      next[kind] = drawing[kind].map(changed).filter((item) => item !== null);
    } else if (drawing[kind]) next[kind] = change(drawing[kind], kind, `${kind}:0`);
  }
  return next;
}

/** The drawing without these items. */
export const without = (drawing, keys) => withItems(drawing, keys, () => null);

const wrapped = (degrees) => Math.round((degrees - 360 * Math.round(degrees / 360)) * 10) / 10;

/** The drawing with these items moved, rotated or scaled by a transform of transform.js. */
export function transformed(drawing, keys, { map, turn_deg }) {
  return withItems(drawing, keys, (item, kind) => {
    const next = withPointsIn(kind, item, pointsIn(kind, item).map((p) => rounded(map(p))));
    // Headings are counter-clockwise; y points down.
    return kind === "start" && turn_deg ? { ...next, heading_deg: wrapped(item.heading_deg - turn_deg) } : next;
  });
}

// ---------------------------------------------------------------------------- geometry of items

/** The union of two boxes. */
export const union = (a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[2], b[2]), Math.max(a[3], b[3])];

/** The bounding box of the points of items; `null` if there are none. */
export const boxAround = (drawing, keys) => (
  [...keys].map((key) => boxOf(pointsOf(drawing, key))).reduce((a, b) => (a ? union(a, b) : b), null)
);

/** The tip of a start's arrow; `px` is the size of a screen pixel in sheet pixels. */
export function tipOf({ at, heading_deg }, px) {
  const angle = (-heading_deg * Math.PI) / 180;
  return [at[0] + MARK_PX.arrow * px * Math.cos(angle), at[1] + MARK_PX.arrow * px * Math.sin(angle)];
}

/** Half the width and half the height of a text. */
const halvesOf = ({ text }, px) => [(MARK_PX.text / 2) * px * Math.max(1, LETTER * text.length), (MARK_PX.text / 2) * px];

/** How far an item may extend beyond the bounding box of its points. */
const extentOf = (kind, item, px) => (kind === "labels" ? halvesOf(item, px)[0] : Math.max(item.width_px ?? 0, MARK_PX.arrow * px));

/** Distance of `p` from an item as drawn; 0 on it. */
function distanceFrom(kind, item, p, px) {
  if (kind === "obstacles") return inside(p, item.polygon) ? 0 : distanceToLine(p, item.polygon, true);
  if (kind === "labels") {
    const [x, y] = halvesOf(item, px).map((half, i) => Math.max(0, Math.abs(p[i] - item.at[i]) - half));
    return Math.hypot(x, y);
  }
  if (kind === "goals") return Math.max(0, distance(item.at, p) - MARK_PX.goal * px);
  if (kind === "start") {
    const arrow = distanceToLine(p, [item.at, tipOf(item, px)]);
    return Math.max(0, Math.min(distance(item.at, p) - MARK_PX.start * px, arrow));
  }
  const half = kind === "strokes" ? item.width_px / 2 : (MARK_PX.route / 2) * px;
  return Math.max(0, distanceToLine(p, pointsIn(kind, item)) - half);
}

/**
 * The key of the item at `p`: the topmost one drawn there, or else the closest within `reach`; `null` if there is none. `px` is the
 * size of a screen pixel in sheet pixels.
 */
export function itemAt(drawing, p, reach, px) {
  let [best, least] = [null, reach];
  for (const key of allKeys(drawing).reverse()) {
    const kind = kindOf(key);
    const item = itemOf(drawing, key);
    const [left, top, right, bottom] = boxOf(pointsIn(kind, item));
    const far = reach + extentOf(kind, item, px);
    if (p[0] < left - far || p[0] > right + far || p[1] < top - far || p[1] > bottom + far) continue;
    const off = distanceFrom(kind, item, p, px);
    if (off === 0) return key;
    if (off <= least && (best === null || off < least)) [best, least] = [key, off];
  }
  return best;
}

/** The keys of the items that lie entirely within a box. */
export function keysWithin(drawing, [left, top, right, bottom]) {
  return allKeys(drawing).filter((key) => {
    const box = boxOf(pointsOf(drawing, key));
    return box[0] >= left && box[1] >= top && box[2] <= right && box[3] <= bottom;
  });
}

// ---------------------------------------------------------------------------- groups

const groupOf = (drawing, key) => itemOf(drawing, key)?.group;
const isGroupable = (key) => ["strokes", "obstacles"].includes(kindOf(key));
/** A number that no other page picks. */
const newGroup = () => 1 + crypto.getRandomValues(new Uint32Array(1))[0] % 2 ** 31;

/** These keys and those of their groups. */
export function withGroups(drawing, keys) {
  const groups = new Set([...keys].map((key) => groupOf(drawing, key)).filter(Boolean));
  return groups.size ? allKeys(drawing).filter((key) => keys.includes(key) || groups.has(groupOf(drawing, key))) : [...keys];
}

/** The drawing with these strokes and obstacles grouped; marks belong to the path and are not grouped. */
export function grouped(drawing, keys) {
  const group = newGroup();
  return withItems(drawing, keys.filter(isGroupable), (item) => ({ ...item, group }));
}

/** The drawing with the groups of these items removed. */
export function ungrouped(drawing, keys) {
  return withItems(drawing, keys.filter((key) => groupOf(drawing, key)), ({ group, ...item }) => item);
}

/** What moves as one when items are aligned: lists of keys, one for each group and one for each ungrouped item. */
function units(drawing, keys) {
  const byGroup = new Map();
  for (const key of keys) {
    const name = groupOf(drawing, key) ?? key;
    byGroup.set(name, [...byGroup.get(name) ?? [], key]);
  }
  return [...byGroup.values()];
}

/** Number of groups and ungrouped items among these. */
export const unitCount = (drawing, keys) => units(drawing, keys).length;

// ---------------------------------------------------------------------------- copies

/**
 * The drawing with copies of items, moved by `[dx, dy]`: `{ drawing, keys }`, with the keys of the copies. A drawing has only one
 * route and one start, so these are not copied. Copies of a group form a new group; the copy of a goal comes last and has no name.
 */
export function duplicated(drawing, keys, by) {
  return withCopies(drawing, copied(drawing, keys), by);
}

/** Like `duplicated`, for items `{ kind, item }` of any drawing. */
export function withCopies(drawing, items, [dx, dy]) {
  const next = { ...drawing };
  const [groups, made] = [new Map(), []];
  for (const { kind, item } of items) {
    if (!LISTS.has(kind)) continue;
    if (kind === "goals") next.route = null;
    const copy = withPointsIn(kind, item, pointsIn(kind, item).map(([x, y]) => rounded([x + dx, y + dy])));
    delete copy.name;
    if (copy.group) {
      if (!groups.has(copy.group)) groups.set(copy.group, newGroup());
      copy.group = groups.get(copy.group);
    }
    made.push(`${kind}:${next[kind].length}`);
    next[kind] = [...next[kind], copy];
  }
  return { drawing: made.length ? next : drawing, keys: made };
}

/** Items in the form in which they are kept for pasting. */
export const copied = (drawing, keys) => [...keys].map((key) => ({ kind: kindOf(key), item: itemOf(drawing, key) }));

// ---------------------------------------------------------------------------- order on the sheet

/** Parameters of `aligned`: the axis, and the position in the box, from 0 for the left or top to 1. */
export const SIDES = { left: [0, 0], center: [0, 0.5], right: [0, 1], top: [1, 0], middle: [1, 0.5], bottom: [1, 1] };

function shifted(drawing, keys, axis, by) {
  const map = (p) => (axis === 0 ? [p[0] + by, p[1]] : [p[0], p[1] + by]);
  return transformed(drawing, keys, { map, turn_deg: 0 });
}

/** The drawing with items aligned at a side of their common bounding box. */
export function aligned(drawing, keys, side) {
  const [axis, part] = SIDES[side];
  const at = (box) => box[axis] + part * (box[axis + 2] - box[axis]);
  const line = at(boxAround(drawing, keys));
  return units(drawing, keys).reduce((next, unit) => shifted(next, unit, axis, line - at(boxAround(drawing, unit))), drawing);
}

/** The drawing with equal gaps between items along an axis, 0 or 1; the first and the last stay in place. */
export function distributed(drawing, keys, axis) {
  const list = units(drawing, keys).map((unit) => ({ unit, box: boxAround(drawing, unit) }));
  list.sort((a, b) => a.box[axis] - b.box[axis]);
  if (list.length < 3) return drawing;
  const total = boxAround(drawing, keys);
  const filled = list.reduce((sum, { box }) => sum + box[axis + 2] - box[axis], 0);
  const gap = (total[axis + 2] - total[axis] - filled) / (list.length - 1);
  let [next, at] = [drawing, total[axis]];
  for (const { unit, box } of list) {
    next = shifted(next, unit, axis, at - box[axis]);
    at += box[axis + 2] - box[axis] + gap;
  }
  return next;
}

// ---------------------------------------------------------------------------- points

/** Minimum number of points of an item. */
const least = (key) => ({ obstacles: 3, route: 2 }[kindOf(key)] ?? 1);

/** The drawing with one point of an item moved. */
export const withPointAt = (drawing, key, index, at) => (
  withItems(drawing, [key], (item, kind) => withPointsIn(kind, item, pointsIn(kind, item).with(index, rounded(at))))
);

/** The drawing with a point added to an item, before the point `index`. */
export function withPointMore(drawing, key, index, at) {
  return withItems(drawing, [key], (item, kind) => {
    const next = withPointsIn(kind, item, pointsIn(kind, item).toSpliced(index, 0, rounded(at)));
    if (!item.pressure) return next;
    const [before, after] = [item.pressure[index - 1] ?? item.pressure[index], item.pressure[index] ?? item.pressure[index - 1]];
    return { ...next, pressure: item.pressure.toSpliced(index, 0, Math.round((before + after) * 50) / 100) };
  });
}

/** The drawing with a point of an item removed; the item is removed if too few would be left. */
export function withPointLess(drawing, key, index) {
  if (pointsOf(drawing, key).length <= least(key)) return without(drawing, [key]);
  return withItems(drawing, [key], (item, kind) => keepPoints(item, kind, pointsIn(kind, item).map((_, i) => i !== index)));
}

function keepPoints(item, kind, keeps) {
  const next = withPointsIn(kind, item, pointsIn(kind, item).filter((_, i) => keeps[i]));
  return item.pressure ? { ...next, pressure: item.pressure.filter((_, i) => keeps[i]) } : next;
}

/** The drawing with unnecessary points of items removed: a freehand line is reduced to a few points (Douglas and Peucker 1973). */
export function simplified(drawing, keys) {
  return withItems(drawing, keys.filter(hasPoints), (item, kind, key) => {
    const points = pointsIn(kind, item);
    const keeps = needed(points, FLAT * (item.width_px ?? 5));
    return keeps.filter(Boolean).length < least(key) ? item : keepPoints(item, kind, keeps);
  });
}

/** The points that a line needs to stay within `off` of all others. */
function needed(points, off) {
  const keeps = points.map((_, i) => i === 0 || i === points.length - 1);
  const spans = [[0, points.length - 1]];
  while (spans.length) {
    const [from, to] = spans.pop();
    let [worst, far] = [-1, off];
    for (let i = from + 1; i < to; i += 1) {
      const away = distanceToLine(points[i], [points[from], points[to]]);
      if (away > far) [worst, far] = [i, away];
    }
    if (worst < 0) continue;
    keeps[worst] = true;
    spans.push([from, worst], [worst, to]);
  }
  return keeps;
}

/** The point of an item closest to `p` within `reach`; -1 if there is none. */
export function pointAt(drawing, key, p, reach) {
  let [best, least_] = [-1, reach];
  pointsOf(drawing, key).forEach((q, i) => {
    const off = distance(p, q);
    if (off <= least_) [best, least_] = [i, off];
  });
  return best;
}

/** The index at which a new point at `p` is inserted into an item; -1 if its line is farther than `reach`. */
export function placeAt(drawing, key, p, reach) {
  const points = pointsOf(drawing, key);
  let [best, least_] = [-1, reach];
  for (let i = isClosed(key) ? 0 : 1; i < points.length; i += 1) {
    const off = distanceToLine(p, [points.at(i - 1), points[i]]);
    if (off <= least_) [best, least_] = [i === 0 ? points.length : i, off];
  }
  return best;
}
