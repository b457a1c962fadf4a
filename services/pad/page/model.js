// The drawing: walls, obstacles, and where to go; its file. Pure functions on immutable values.
//
// The file is sketchnav's strokes file: `canvas`, `strokes`, `obstacles`, `labels`, `start`, `goals`, `route` in canvas pixels.
// What only this page reads is under `pad`: `pressure`, parallel to `strokes`; `groups`, each with the indices of its strokes and
// obstacles; pictures as data URLs. Saving a loaded drawing again gives the same bytes.

import { between, boxOf, cut, distance, distanceToLine, erased, inside } from "./geometry.js";

/** The sheets of paper 004: 2540 × 1252, landscape or portrait. */
export const LANDSCAPE = [2540, 1252];
export const PORTRAIT = [1252, 2540];
/** Maximum coordinate in a file, pixels. */
const FAR_PX = 100000;
/** Maximum length of a text, a label or a goal's name in a file, characters. */
export const MOST_CHARACTERS = 400;

/** A blank sheet. */
export const blank = (canvas) => (
  { canvas, strokes: [], obstacles: [], labels: [], start: null, goals: [], route: null, photo: null, underlay: null }
);

/** Hundredths of a pixel: finer than any pen, and short in a file. */
export const rounded = (p) => [Math.round(p[0] * 100) / 100, Math.round(p[1] * 100) / 100];

/** Whether the sheet has anything that a robot could take for a map. */
export const hasMap = (drawing) => drawing.strokes.length + drawing.obstacles.length > 0 || drawing.photo !== null;

/** Whether the sheet says where to go. */
export const hasPath = (drawing) => drawing.route !== null || drawing.goals.length > 0;

/** Whether the sheet is empty. */
export const isBlank = (d) => !hasMap(d) && !hasPath(d) && !d.labels.length && !d.start && !d.underlay;

// ---------------------------------------------------------------------------- drawing

/** The drawing with a stroke added. `pressure`, 0 to 1 for each point, is `null` for a mouse. */
export function withStroke(drawing, points, width_px, pressure = null) {
  const stroke = { points: points.map(rounded), width_px, pressure: pressure?.map((p) => Math.round(p * 100) / 100) ?? null };
  return { ...drawing, strokes: [...drawing.strokes, stroke] };
}

/** The drawing with an obstacle added. */
export const withObstacle = (drawing, polygon, label = "") => (
  { ...drawing, obstacles: [...drawing.obstacles, { polygon: polygon.map(rounded), label }] }
);

/** The drawing with another label on an obstacle. */
export const withLabel = (drawing, index, label) => (
  { ...drawing, obstacles: drawing.obstacles.map((o, i) => (i === index ? { ...o, label } : o)) }
);

/** The drawing with a text added, centred at `at`. It names the place where it stands. */
export const withText = (drawing, text, at) => ({ ...drawing, labels: [...drawing.labels, { text, at: rounded(at) }] });

/** The drawing with a text changed; an empty text is removed. */
export const withOtherText = (drawing, index, text) => (
  { ...drawing, labels: drawing.labels.map((l, i) => (i === index ? { ...l, text } : l)).filter((l) => l.text) }
);

/**
 * The drawing with this route, which replaces the goals, since a robot follows one or the other, and begins where the robot stands.
 */
export const withRoute = (drawing, points) => ({ ...drawing, route: points.map(rounded), goals: [], start: null });

/** The drawing with a goal added, which replaces a route. */
export const withGoal = (drawing, at) => (
  { ...drawing, route: null, goals: [...drawing.goals, { at: rounded(at) }] }
);

/** The drawing with the robot's start; degrees counter-clockwise from the x axis, to the right. */
export const withStart = (drawing, at, heading_deg) => (
  { ...drawing, start: { at: rounded(at), heading_deg: Math.round(heading_deg * 10) / 10 } }
);

/** The topmost obstacle at a point, or -1. */
export const obstacleAt = (drawing, p) => drawing.obstacles.findLastIndex((o) => inside(p, o.polygon));

/** What an eraser there would touch: `"map"`, `"marks"`, or `null`. */
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

/**
 * The drawing without the part of the map under an eraser's disc: strokes lose that part, obstacles and texts are removed as a
 * whole.
 */
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

/** The drawing without the marks under an eraser's disc; a route keeps the part before it. */
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

/**
 * The part of the segment `a`–`b`, as a range of t, within a strip along the first axis: from 0 to `long`, `half` to either side.
 */
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
 * The drawing with a door in the walls along the line from `a` to `b`: strokes lose the parts within `half` of it. Strokes that
 * cross it are kept, so that a door beside a corner does not cut the other wall.
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

/** The parts of a line's segments within a strip, by the point at the end of each, without stretches that run across. */
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

/** What only this page reads, without pictures. */
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

/** The map in the format that is sent: no marks, no underlay. */
export function sketchBody(drawing) {
  const { canvas, strokes, obstacles, labels } = drawing;
  const body = { canvas, strokes: strokes.map(wire), obstacles: obstacles.map(wireObstacle) };
  if (labels.length) body.labels = labels;
  const pad = ownPart(drawing);
  return JSON.stringify(Object.keys(pad).length ? { ...body, pad } : body);
}

/**
 * The path in the format that is sent: a route, or goals. The start is sent if it is drawn, unless the robot was already placed
 * there (`placed`): it has driven on since, and its own estimate is better.
 */
export function pathBody({ route, goals, start }, placed = null) {
  const begin = start && JSON.stringify(start) !== JSON.stringify(placed) ? { start } : {};
  if (route) return JSON.stringify({ ...begin, route });
  return JSON.stringify({ ...begin, goals: goals.map((goal) => (goal.name ? goal : goal.at)) });
}

/** Whether a drawing is an edit of a previous one with at least half of the walls and obstacles unchanged. */
export function isEditOf(before, after) {
  const items = ({ strokes, obstacles }) => [...strokes.map(wire), ...obstacles.map(wireObstacle)].map((item) => JSON.stringify(item));
  const [had, has] = [items(before), new Set(items(after))];
  return before.id === after.id && before.canvas.join() === after.canvas.join() && !before.photo && !after.photo
    && 2 * had.filter((item) => has.has(item)).length >= had.length;
}

/** The drawing with a path in the format that is sent. */
export function withPath(drawing, { start, route, goals }) {
  const named = (goals ?? []).map((goal) => (Array.isArray(goal) ? { at: goal } : goal));
  return { ...drawing, start: start ?? null, route: route ?? null, goals: named };
}

/** Number of points in the map. */
export const pointCount = (drawing) => drawing.strokes.reduce((n, s) => n + s.points.length, 0);

// ---------------------------------------------------------------------------- file

/** The drawing as a file: a line for each stroke, obstacle and text. `shared`: what shared.js keeps beside it. */
export function toText(drawing, shared = null) {
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
  if (shared) pad.shared = shared;
  if (Object.keys(pad).length) keys.push(`"pad": ${JSON.stringify(pad)}`);
  return `{\n  ${keys.join(",\n  ")}\n}\n`;
}

/** Reads a file. Throws an `Error` with what was expected, what was found, and where. */
export function fromText(text) {
  let file;
  try {
    file = JSON.parse(text.replace(/^\uFEFF/, ""));
  } catch (error) {
    throw new Error(`expected a drawing in JSON: ${error.message}`);
  }
  return fromFile(file);
}

/** Reads a parsed file. */
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

/** Throws an `Error` unless `holds`. */
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

function expectShort(text, where) {
  expect(typeof text === "string", where, "a text", text);
  const { length } = [...text];
  expect(length <= MOST_CHARACTERS, where, `at most ${MOST_CHARACTERS} characters`, length);
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
  expectShort(label, `${where}.label`);
  return { polygon, label };
}

function readText(label, where) {
  expect(isObject(label) && isPoint(label.at), `${where}.at`, "a point", label?.at);
  expectShort(label.text, `${where}.text`);
  expect(label.text.trim(), `${where}.text`, "a text", label.text);
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
  if (!goal.name) return { at: goal.at };
  const name = String(goal.name);
  expectShort(name, `${where}.name`);
  return { name, at: goal.at };
}

function readStart({ at, heading_deg = 0 }) {
  expect(isPoint(at), "start.at", "a point", at);
  expect(Number.isFinite(heading_deg), "start.heading_deg", "degrees", heading_deg);
  return { at, heading_deg: Math.abs(heading_deg) > 360 ? heading_deg % 360 : heading_deg };
}

function picture(pad, key) {
  const value = pad[key] ?? null;
  const fits = value === null || (typeof value === "string" && /^data:image\/(png|jpeg);base64,/.test(value));
  expect(fits, `pad.${key}`, "a PNG or JPEG as a data URL", value);
  return value;
}
