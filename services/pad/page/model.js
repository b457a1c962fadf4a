// The drawing: walls, obstacles, and where to go; its history; its file. Pure functions on values that
// are never changed in place, so that undo is a step back to an older value.
//
// The file is the strokes file of sketchnav: `canvas`, `strokes`, `obstacles`, `labels`, `start`, `goals`, `route`
// in canvas pixels. What this page alone reads stands under `pad`: `pressure`, beside `strokes`; `groups`,
// each with the places of its strokes and obstacles in their lists; pictures as data URLs. A drawing that
// was saved and loaded is saved again as the same bytes.

import { between, boxOf, cut, distance, distanceToLine, erased, inside } from "./geometry.js";

/** The sheets of paper 004: 2540 × 1252, lying or upright. */
export const LANDSCAPE = [2540, 1252];
export const PORTRAIT = [1252, 2540];
/** How many steps can be undone. */
const MAX_UNDO = 500;
/** Farthest coordinate that a file may hold, pixels. */
const FAR_PX = 100000;

/** A blank sheet. */
export const blank = (canvas) => (
  { canvas, strokes: [], obstacles: [], labels: [], start: null, goals: [], route: null, photo: null, underlay: null }
);

/** Hundredths of a pixel: finer than any pen, and short in a file. */
export const rounded = (p) => [Math.round(p[0] * 100) / 100, Math.round(p[1] * 100) / 100];

/** Whether anything is on the sheet that a robot could take for a map. */
export const hasMap = (drawing) => drawing.strokes.length + drawing.obstacles.length > 0 || drawing.photo !== null;

/** Whether the sheet says where to go. */
export const hasPath = (drawing) => drawing.route !== null || drawing.goals.length > 0;

/** Whether the way can be sent: goals need a start, drawn or known (`located`: the robot knows where it is). */
export const canGo = (d, located) => hasPath(d) && Boolean(d.route || d.start || located);

/** Whether nothing at all is on the sheet. */
export const isBlank = (d) => !hasMap(d) && !hasPath(d) && !d.labels.length && !d.start && !d.underlay;

// ---------------------------------------------------------------------------- history

/** A history that begins with `now`. */
export const history = (now) => ({ past: [], now, future: [] });

/** A step: `now` is the drawing, what was undone is gone. A change of nothing is no step. */
export function changed(history, now) {
  if (now === history.now) return history;
  return { past: [...history.past.slice(-(MAX_UNDO - 1)), history.now], now, future: [] };
}

/** One step back; at the beginning, the history as it is. */
export function undone(history) {
  const { past, now, future } = history;
  if (past.length === 0) return history;
  return { past: past.slice(0, -1), now: past.at(-1), future: [now, ...future] };
}

/** One step forth again; at the end, the history as it is. */
export function redone(history) {
  const { past, now, future } = history;
  if (future.length === 0) return history;
  return { past: [...past, now], now: future[0], future: future.slice(1) };
}

// ---------------------------------------------------------------------------- drawing

/** With one stroke more. `pressure`, 0 to 1 beside the points, is `null` for a mouse. */
export function withStroke(drawing, points, width_px, pressure = null) {
  const stroke = { points: points.map(rounded), width_px, pressure: pressure?.map((p) => Math.round(p * 100) / 100) ?? null };
  return { ...drawing, strokes: [...drawing.strokes, stroke] };
}

/** With one obstacle more. */
export const withObstacle = (drawing, polygon, label = "") => (
  { ...drawing, obstacles: [...drawing.obstacles, { polygon: polygon.map(rounded), label }] }
);

/** With another word on an obstacle. */
export const withLabel = (drawing, index, label) => (
  { ...drawing, obstacles: drawing.obstacles.map((o, i) => (i === index ? { ...o, label } : o)) }
);

/** With one text more; `at` is its middle. It names the place where it stands. */
export const withText = (drawing, text, at) => ({ ...drawing, labels: [...drawing.labels, { text, at: rounded(at) }] });

/** With another text; without it if that is empty. */
export const withOtherText = (drawing, index, text) => (
  { ...drawing, labels: drawing.labels.map((l, i) => (i === index ? { ...l, text } : l)).filter((l) => l.text) }
);

/** With this route; it takes the place of goals, since a robot does one or the other, and begins where the robot stands. */
export const withRoute = (drawing, points) => ({ ...drawing, route: points.map(rounded), goals: [], start: null });

/** With one goal more; it takes the place of a route. */
export const withGoal = (drawing, at) => (
  { ...drawing, route: null, goals: [...drawing.goals, { at: rounded(at) }] }
);

/** With the robot's start; degrees counter-clockwise from "to the right". */
export const withStart = (drawing, at, heading_deg) => (
  { ...drawing, start: { at: rounded(at), heading_deg: Math.round(heading_deg * 10) / 10 } }
);

/** The obstacle that holds a point, or -1. The topmost wins. */
export const obstacleAt = (drawing, p) => drawing.obstacles.findLastIndex((o) => inside(p, o.polygon));

/** Whether an eraser there meets the map or the marks on it: `"map"`, `"marks"`, or `null`. */
export function touched(drawing, center, radius) {
  const { route, goals, start } = drawing;
  const marks = (route && distanceToLine(center, route) < radius)
    || goals.some((goal) => distance(goal.at, center) < radius * 1.5)
    || (start && distance(start.at, center) < radius * 1.5);
  if (marks) return "marks";
  const map = drawing.strokes.some((s) => distanceToLine(center, s.points) < radius + s.width_px / 2)
    || drawing.obstacles.some((o) => inside(center, o.polygon) || distanceToLine(center, o.polygon, true) < radius)
    || drawing.labels.some((label) => distance(label.at, center) < radius * 1.5);
  return map ? "map" : null;
}

/** Without what an eraser's disc covers of the map: strokes lose that part, obstacles and texts go whole. */
export function withoutMapAt(drawing, center, radius) {
  let hit = false;
  const strokes = drawing.strokes.flatMap((stroke) => {
    const pieces = erased(stroke.points, stroke.pressure, center, radius + stroke.width_px / 2);
    if (!pieces) return [stroke];
    hit = true;
    return pieces.map((p) => ({ ...stroke, points: p.points.map(rounded), pressure: p.values }));
  });
  const obstacles = drawing.obstacles.filter(
    (o) => !inside(center, o.polygon) && distanceToLine(center, o.polygon, true) >= radius,
  );
  const labels = drawing.labels.filter((label) => distance(label.at, center) >= radius * 1.5);
  hit ||= obstacles.length < drawing.obstacles.length || labels.length < drawing.labels.length;
  return hit ? { ...drawing, strokes, obstacles, labels } : drawing;
}

/** Without the marks that an eraser's disc covers; a route keeps what comes before it. */
export function withoutMarksAt(drawing, center, radius) {
  const goals = drawing.goals.filter((goal) => distance(goal.at, center) >= radius * 1.5);
  const start = drawing.start && distance(drawing.start.at, center) < radius * 1.5 ? null : drawing.start;
  const rest = drawing.route && erased(drawing.route, null, center, radius);
  const kept = rest?.[0]?.points.map(rounded) ?? null;
  const begins = kept && distance(kept[0], drawing.route[0]) < 1e-9;
  const route = rest ? (begins && kept.length > 1 ? kept : null) : drawing.route;
  const same = goals.length === drawing.goals.length && start === drawing.start && route === drawing.route;
  return same ? drawing : { ...drawing, goals, start, route };
}

/** The part of the segment `a`–`b`, as a range of t, in a strip along the first axis: from 0 to `long`, `half` to either side. */
function rangeWithin(a, b, long, half) {
  let [from, to] = [0, 1];
  for (const [p, d, low, high] of [[a[0], b[0] - a[0], 0, long], [a[1], b[1] - a[1], -half, half]]) {
    if (d === 0 && (p < low || p > high)) return null;
    if (d === 0) continue;
    const [t, u] = [(low - p) / d, (high - p) / d];
    [from, to] = [Math.max(from, Math.min(t, u)), Math.min(to, Math.max(t, u))];
  }
  return to > from ? [from, to] : null;
}

/**
 * With a door in the walls along the line from `a` to `b`: strokes lose what lies within `half` of it. Those that cross it do not,
 * so that a door beside a corner leaves the other wall whole.
 */
export function withDoor(drawing, a, b, half) {
  const long = distance(a, b);
  if (long === 0) return drawing;
  const [ux, uy] = [(b[0] - a[0]) / long, (b[1] - a[1]) / long];
  const local = ([x, y]) => [(x - a[0]) * ux + (y - a[1]) * uy, (y - a[1]) * ux - (x - a[0]) * uy];
  const [left, top, right, bottom] = boxOf([a, b]);
  const isNear = (box) => box[0] <= right + half && box[2] >= left - half && box[1] <= bottom + half && box[3] >= top - half;
  let hit = false;
  const strokes = drawing.strokes.flatMap((stroke) => {
    if (!isNear(boxOf(stroke.points))) return [stroke];
    const open = stretches(stroke.points.map(local), long, half);
    if (!open.size) return [stroke];
    hit = true;
    const pieces = cut(stroke.points, stroke.pressure, (i) => {
      const [from, to] = open.get(i) ?? [1, 1];
      return [[0, from], [to, 1]].filter(([t, u]) => u > t);
    });
    return pieces.map((p) => ({ ...stroke, points: p.points.map(rounded), pressure: p.values }));
  });
  return hit ? { ...drawing, strokes } : drawing;
}

/** The parts of a line's segments in a strip, by the point that each ends at, without stretches that run across. */
function stretches(points, long, half) {
  const [open, run] = [new Map(), []];
  const finish = () => {
    if (run.length) {
      const at = ([i, range], end) => between(points[i - 1], points[i], range[end]);
      const [first, last] = [at(run[0], 0), at(run.at(-1), 1)];
      if (Math.abs(last[0] - first[0]) >= Math.abs(last[1] - first[1])) run.forEach(([i, range]) => open.set(i, range));
    }
    run.length = 0;
  };
  for (let i = 1; i < points.length; i += 1) {
    const range = rangeWithin(points[i - 1], points[i], long, half);
    if (!range || range[0] > 0) finish();
    if (range) run.push([i, range]);
    if (range && range[1] < 1) finish();
  }
  finish();
  return open;
}

// ---------------------------------------------------------------------------- what is sent

const wire = ({ points, width_px }) => ({ points, width_px });
const wireObstacle = ({ polygon, label }) => ({ polygon, label });

/** What this page alone reads, without pictures. */
function ownPart({ strokes, obstacles }) {
  const pad = {};
  if (strokes.some((s) => s.pressure)) pad.pressure = strokes.map((s) => s.pressure);
  const groups = new Map();
  for (const [kind, items] of Object.entries({ strokes, obstacles })) {
    items.forEach(({ group }, i) => {
      if (!group) return;
      if (!groups.has(group)) groups.set(group, { strokes: [], obstacles: [] });
      groups.get(group)[kind].push(i);
    });
  }
  if (groups.size) pad.groups = [...groups.values()];
  return pad;
}

/** The map as it is sent: no marks, no underlay. */
export function sketchBody(drawing) {
  const { canvas, strokes, obstacles, labels } = drawing;
  const body = { canvas, strokes: strokes.map(wire), obstacles: obstacles.map(wireObstacle) };
  if (labels.length) body.labels = labels;
  const pad = ownPart(drawing);
  return JSON.stringify(Object.keys(pad).length ? { ...body, pad } : body);
}

/**
 * Where to go as it is sent: a route, or goals. The start is sent where it is drawn, but for one that the
 * robot was put at already (`placed`): it has driven on since, and knows better.
 */
export function pathBody({ route, goals, start }, placed = null) {
  const begin = start && JSON.stringify(start) !== JSON.stringify(placed) ? { start } : {};
  if (route) return JSON.stringify({ ...begin, route });
  return JSON.stringify({ ...begin, goals: goals.map((goal) => (goal.name ? goal : goal.at)) });
}

/** Whether a drawing is an edit of the one before, of which at least half of the walls and obstacles are left as they were. */
export function isEditOf(before, after) {
  const items = ({ strokes, obstacles }) => [...strokes.map(wire), ...obstacles.map(wireObstacle)].map((item) => JSON.stringify(item));
  const [had, has] = [items(before), new Set(items(after))];
  return before.id === after.id && before.canvas.join() === after.canvas.join() && !before.photo && !after.photo
    && 2 * had.filter((item) => has.has(item)).length >= had.length;
}

/** The drawing with a path as it was sent. */
export function withPath(drawing, { start, route, goals }) {
  const named = (goals ?? []).map((goal) => (Array.isArray(goal) ? { at: goal } : goal));
  return { ...drawing, start: start ?? null, route: route ?? null, goals: named };
}

/** How many points the map has. */
export const pointCount = (drawing) => drawing.strokes.reduce((n, s) => n + s.points.length, 0);

// ---------------------------------------------------------------------------- file

/** The drawing as a file: a line for each stroke, obstacle and text. */
export function toText(drawing) {
  const { canvas, strokes, obstacles, labels, start, goals, route, photo, underlay } = drawing;
  const rows = (list) => (list.length ? `[\n    ${list.map((v) => JSON.stringify(v)).join(",\n    ")}\n  ]` : "[]");
  const keys = [`"canvas": ${JSON.stringify(canvas)}`, `"strokes": ${rows(strokes.map(wire))}`];
  keys.push(`"obstacles": ${rows(obstacles.map(wireObstacle))}`);
  if (labels.length) keys.push(`"labels": ${rows(labels)}`);
  if (start) keys.push(`"start": ${JSON.stringify(start)}`);
  if (goals.length) keys.push(`"goals": ${rows(goals)}`);
  if (route) keys.push(`"route": ${JSON.stringify(route)}`);
  const pad = ownPart(drawing);
  if (photo) pad.photo = photo;
  if (underlay) pad.underlay = underlay;
  if (Object.keys(pad).length) keys.push(`"pad": ${JSON.stringify(pad)}`);
  return `{\n  ${keys.join(",\n  ")}\n}\n`;
}

/** Reads a file. Throws an `Error` that says what was expected, what was found, and where. */
export function fromText(text) {
  let file;
  try {
    file = JSON.parse(text.replace(/^\uFEFF/, ""));
  } catch (error) {
    throw new Error(`expected a drawing in JSON: ${error.message}`);
  }
  return fromFile(file);
}

/** Reads a file that is parsed already. */
export function fromFile(file) {
  expect(isObject(file), "the drawing", "an object", file);
  const known = ["canvas", "strokes", "obstacles", "labels", "start", "goals", "route", "pad"];
  const odd = Object.keys(file).find((key) => !known.includes(key));
  expect(odd === undefined, "keys", known.join(", "), odd);
  expect(isPoint(file.canvas) && file.canvas.every((n) => Number.isInteger(n) && n >= 1 && n <= 30000), "canvas", "two sides of 1 to 30000 px", file.canvas);
  const pad = file.pad ?? {};
  expect(isObject(pad), "pad", "an object", pad);
  const strokes = list(file.strokes, "strokes").map((s, i) => readStroke(s, pad.pressure?.[i] ?? null, `strokes[${i}]`));
  const obstacles = list(file.obstacles ?? [], "obstacles").map((o, i) => readObstacle(o, `obstacles[${i}]`));
  readGroups(pad, { strokes, obstacles });
  const labels = list(file.labels ?? [], "labels").map((l, i) => readText(l, `labels[${i}]`));
  const goals = list(file.goals ?? [], "goals").map((g, i) => readGoal(g, `goals[${i}]`));
  const route = file.route == null ? null : readPoints(file.route, "route", 2);
  const start = file.start == null ? null : readStart(file.start);
  const [photo, underlay] = [picture(pad, "photo"), picture(pad, "underlay")];
  return { canvas: file.canvas, strokes, obstacles, labels, start, goals, route, photo, underlay };
}

/** Throws an `Error` unless it holds. */
export function expect(holds, where, expected, found) {
  if (holds) return;
  const shown = JSON.stringify(found) ?? "nothing";
  throw new Error(`${where}: expected ${expected}, found ${shown.length > 60 ? `${shown.slice(0, 60)}…` : shown}`);
}

export const isObject = (v) => typeof v === "object" && v !== null && !Array.isArray(v);
export const isPoint = (p) => Array.isArray(p) && p.length === 2 && p.every((n) => Number.isFinite(n) && Math.abs(n) <= FAR_PX);

export function list(value, where) {
  expect(Array.isArray(value), where, "a list", value);
  return value;
}

function readPoints(points, where, least) {
  expect(list(points, where).length >= least, where, `${least} points or more`, points.length);
  const wrong = points.findIndex((p) => !isPoint(p));
  expect(wrong < 0, `${where}[${wrong}]`, "a point within 100000 px", points[wrong]);
  return points;
}

function readStroke(stroke, pressure, where) {
  expect(isObject(stroke), where, "an object", stroke);
  const { points, width_px = 5 } = stroke;
  readPoints(points, `${where}.points`, 1);
  expect(Number.isFinite(width_px) && width_px > 0 && width_px <= 1000, `${where}.width_px`, "above 0, at most 1000", width_px);
  const fits = pressure === null || (Array.isArray(pressure) && pressure.length === points.length
    && pressure.every((p) => Number.isFinite(p) && p >= 0 && p <= 1));
  expect(fits, `${where}: pad.pressure`, "a number from 0 to 1 for each point, or null", pressure);
  return { points, width_px, pressure };
}

function readObstacle(obstacle, where) {
  expect(isObject(obstacle), where, "an object", obstacle);
  const { polygon, label = "" } = obstacle;
  readPoints(polygon, `${where}.polygon`, 3);
  expect(typeof label === "string", `${where}.label`, "a text", label);
  return { polygon, label };
}

function readText(label, where) {
  expect(isObject(label) && isPoint(label.at), `${where}.at`, "a point", label?.at);
  expect(typeof label.text === "string" && label.text.trim(), `${where}.text`, "a text", label.text);
  return { text: label.text, at: label.at };
}

/** Groups as numbers on their members, from 1. */
function readGroups({ groups = [] }, items) {
  list(groups, "pad.groups").forEach((group, number) => {
    for (const kind of ["strokes", "obstacles"]) {
      const where = `pad.groups[${number}].${kind}`;
      list(group?.[kind] ?? [], where).forEach((i) => {
        expect(Number.isInteger(i) && items[kind][i] !== undefined, where, `numbers below ${items[kind].length}`, i);
        items[kind][i].group = number + 1;
      });
    }
  });
}

function readGoal(goal, where) {
  expect(isObject(goal) && isPoint(goal.at), `${where}.at`, "a point", goal?.at);
  return goal.name ? { name: String(goal.name), at: goal.at } : { at: goal.at };
}

function readStart({ at, heading_deg = 0 }) {
  expect(isPoint(at), "start.at", "a point", at);
  expect(Number.isFinite(heading_deg), "start.heading_deg", "degrees", heading_deg);
  return { at, heading_deg };
}

function picture(pad, key) {
  const value = pad[key] ?? null;
  const fits = value === null || (typeof value === "string" && /^data:image\/(png|jpeg);base64,/.test(value));
  expect(fits, `pad.${key}`, "a PNG or JPEG as a data URL", value);
  return value;
}
