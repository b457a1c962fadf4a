// Reads drawings of Excalidraw: lines and outlines become walls, filled shapes become obstacles, the first arrow becomes the path,
// and texts name places. Pure. The format: https://docs.excalidraw.com/docs/codebase/json-schema

import { ellipse } from "./geometry.js";
import { expect, isObject, isPoint, list } from "./model.js";
import { placed } from "./placing.js";

/** Corners of each shape in the box from the origin to (w, h). */
const CORNERS = {
  rectangle: (w, h) => [[0, 0], [w, 0], [w, h], [0, h]],
  diamond: (w, h) => [[w / 2, 0], [w, h / 2], [w / 2, h], [0, h / 2]],
  ellipse: (w, h) => ellipse([0, 0], [w, h]),
};
const LINES = ["line", "freedraw", "arrow"];
/** Elements without a counterpart on a map, with their names. */
const NAMES = { image: "picture", embeddable: "web page", iframe: "web page" };

/** Whether a parsed file is a drawing or clipboard of Excalidraw. */
export const isExcalidraw = (file) => isObject(file) && /^excalidraw(\/clipboard)?$/.test(file.type);

/** Reads a drawing: `{ drawing, left }`; `left` lists what was left out. Throws an `Error` with the place and what was expected. */
export function fromExcalidraw(file) {
  const read = { strokes: [], obstacles: [], labels: [], route: null, left: [], groups: new Map() };
  const elements = list(file.elements, "elements").map((element, i) => checked(element, `elements[${i}]`)).filter((e) => !e.isDeleted);
  const words = new Map(elements.filter((e) => e.type === "text" && e.containerId).map((e) => [e.containerId, e.text.trim()]));
  for (const element of elements) take(element, words.get(element.id) ?? "", read);
  return { drawing: placed(read), left: read.left };
}

/** An element whose members have the expected types. */
function checked(element, where) {
  expect(isObject(element) && typeof element.type === "string", where, "an element with a type", element);
  const { type, x, y, width = 0, height = 0, angle = 0, strokeWidth = 2 } = element;
  if (element.isDeleted || !(type in CORNERS || LINES.includes(type) || type === "text")) return element;
  const numbers = { x, y, width, height, angle, strokeWidth };
  for (const [key, value] of Object.entries(numbers)) expect(Number.isFinite(value) && Math.abs(value) <= 1e6, `${where}.${key}`, "a number within a million", value);
  if (LINES.includes(type)) {
    const points = list(element.points, `${where}.points`);
    const wrong = points.findIndex((p) => !isPoint(p));
    expect(points.length > 0 && wrong < 0, `${where}.points`, "points", points[wrong] ?? points);
  }
  if (type === "text") expect(typeof element.text === "string", `${where}.text`, "a text", element.text);
  return { ...element, ...numbers };
}

function take(element, word, read) {
  const { type, strokeWidth: width_px } = element;
  if (type in CORNERS) takeShape(element, word, read);
  else if (type === "arrow" && !read.route && element.points.length > 1) read.route = onPage(element, element.points);
  else if (type === "arrow") read.left.push("arrow");
  else if (LINES.includes(type)) {
    const points = onPage(element, element.points);
    const fits = element.pressures?.length === points.length && element.pressures.every((p) => p >= 0 && p <= 1);
    read.strokes.push({ points, width_px, pressure: fits && !element.simulatePressure ? element.pressures : null, ...groupOf(element, read) });
  } else if (type === "text") takeText(element, read);
  else if (type !== "selection" && type !== "frame") read.left.push(NAMES[type] ?? type);
}

/** A filled shape is an obstacle; an outline is a wall, and its text names the place inside. */
function takeShape(element, word, read) {
  const { type, width, height, strokeWidth: width_px, backgroundColor = "transparent" } = element;
  const corners = onPage(element, CORNERS[type](width, height));
  if (backgroundColor !== "transparent") {
    read.obstacles.push({ polygon: corners, label: word.slice(0, 40), ...groupOf(element, read) });
    return;
  }
  read.strokes.push({ points: [...corners, corners[0]], width_px, ...groupOf(element, read) });
  if (word) read.labels.push({ text: word, at: middleOf(element) });
}

/** A free text names the place at its middle. A text within a shape was read with the shape. */
function takeText(element, read) {
  const text = element.text.replace(/\s+/g, " ").trim();
  if (text && !element.containerId) read.labels.push({ text, at: middleOf(element) });
}

const middleOf = ({ x, y, width, height }) => [x + width / 2, y + height / 2];

/** Points relative to an element, on the page: rotated about the middle of their box. */
function onPage({ x, y, angle }, points) {
  const [xs, ys] = [0, 1].map((axis) => points.map((p) => p[axis]));
  const [cx, cy] = [xs, ys].map((all) => (all.reduce((a, b) => Math.min(a, b)) + all.reduce((a, b) => Math.max(a, b))) / 2);
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return points.map(([px, py]) => [x + cx + (px - cx) * cos - (py - cy) * sin, y + cy + (px - cx) * sin + (py - cy) * cos]);
}

/** The outermost group, which moves as one. */
function groupOf({ groupIds }, { groups }) {
  const id = Array.isArray(groupIds) ? groupIds.at(-1) : undefined;
  if (id === undefined) return {};
  if (!groups.has(id)) groups.set(id, groups.size + 1);
  return { group: groups.get(id) };
}
