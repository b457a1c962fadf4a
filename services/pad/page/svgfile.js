// Reads drawings from SVG: dark lines become walls, dark areas become obstacles, texts name places; an SVG saved by this page is
// restored exactly.
//
// A file is parsed into a separate document that is never displayed, so nothing in it is run or fetched. Only numbers, colours and
// texts are used.

import { fromText } from "./model.js";
import { outlines } from "./outline.js";
import { placed } from "./placing.js";
import { OWN } from "./svg.js";

/** Maximum number of elements, including repeated references: more than any drawing has. */
const MAX_ELEMENTS = 50000;
/** Maximum depth of nested references. */
const MAX_DEPTH = 16;
/** Ink lighter than this counts as paper, from 0 for black to 1. */
const LIGHT = 0.75;
const INHERITED = ["fill", "stroke", "stroke-width", "visibility", "color", "font-size", "text-anchor", "fill-rule"];
const OWN_ONLY = ["display", "opacity", "fill-opacity", "stroke-opacity"];
const INITIAL = {
  fill: "black", stroke: "none", "stroke-width": "1", visibility: "visible", color: "black", "font-size": "16", "text-anchor": "start",
};
const LEFT_OUT = { image: "picture", foreignObject: "HTML", svg: "SVG within the SVG", textPath: "text along a path" };
const GROUPS = ["g", "a", "switch", "symbol"];

const number = (element, name) => parseFloat(element.getAttribute(name) ?? "0") || 0;

/** Path data of the basic shapes. */
const DATA = {
  path: (e) => e.getAttribute("d") ?? "",
  line: (e) => `M${number(e, "x1")} ${number(e, "y1")}L${number(e, "x2")} ${number(e, "y2")}`,
  polyline: (e) => `M${e.getAttribute("points") ?? ""}`,
  polygon: (e) => `M${e.getAttribute("points") ?? ""}Z`,
  rect: (e) => `M${number(e, "x")} ${number(e, "y")}h${number(e, "width")}v${number(e, "height")}h${-number(e, "width")}Z`,
  circle: (e) => round(e, number(e, "r"), number(e, "r")),
  ellipse: (e) => round(e, number(e, "rx"), number(e, "ry")),
};

const round = (e, rx, ry) => `M${number(e, "cx") - rx} ${number(e, "cy")}a${rx} ${ry} 0 1 1 ${2 * rx} 0a${rx} ${ry} 0 1 1 ${-2 * rx} 0Z`;

// ---------------------------------------------------------------------------- transforms: [a, b, c, d, e, f] as in SVG

const UNIT = [1, 0, 0, 1, 0, 0];
const times = ([a, b, c, d, e, f], [p, q, r, s, t, u]) => (
  [a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * t + c * u + e, b * t + d * u + f]
);
const apply = ([a, b, c, d, e, f], [x, y]) => [a * x + c * y + e, b * x + d * y + f];
const size = ([a, b, c, d]) => Math.sqrt(Math.abs(a * d - b * c));
const tan = (degrees) => Math.tan((degrees * Math.PI) / 180);

const TRANSFORMS = {
  matrix: (n) => n,
  translate: ([x, y = 0]) => [1, 0, 0, 1, x, y],
  scale: ([x, y = x]) => [x, 0, 0, y, 0, 0],
  rotate: ([degrees, x = 0, y = 0]) => {
    const [cos, sin] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
    return [cos, sin, -sin, cos, x - cos * x + sin * y, y - sin * x - cos * y];
  },
  skewX: ([degrees]) => [1, 0, tan(degrees), 1, 0, 0],
  skewY: ([degrees]) => [1, tan(degrees), 0, 1, 0, 0],
};

/** The transform of an attribute. */
export function transformOf(text) {
  return [...(text ?? "").matchAll(/(\w+)\s*\(([^)]*)\)/g)].reduce((all, [, name, numbers]) => {
    const n = numbers.split(/[\s,]+/).filter(Boolean).map(Number);
    return TRANSFORMS[name] && n.length && n.every(Number.isFinite) ? times(all, TRANSFORMS[name](n)) : all;
  }, UNIT);
}

// ---------------------------------------------------------------------------- styles

/** The declarations of a style sheet, as `[selector, style]`. Its imports are not loaded, since it belongs to no document. */
function rules(text) {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(text);
  return [...sheet.cssRules].filter((rule) => rule.selectorText).map((rule) => [rule.selectorText, rule.style]);
}

function declared(element, sheets) {
  const found = {};
  const take = (style) => [...INHERITED, ...OWN_ONLY].forEach((name) => {
    const value = style(name)?.trim();
    if (value && value !== "inherit") found[name] = value;
  });
  take((name) => element.getAttribute(name));
  for (const [selector, style] of sheets) if (element.matches(selector)) take((name) => style.getPropertyValue(name));
  if (element.hasAttribute("style")) for (const [, style] of rules(`x{${element.getAttribute("style")}}`)) take((name) => style.getPropertyValue(name));
  return found;
}

const swatch = () => Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });

/** Whether a colour counts as ink on white paper. */
function isInk(value, opacity, { color }, context) {
  if (value === "none" || Number(opacity ?? 1) === 0) return false;
  if (value.startsWith("url(")) return true;
  context.clearRect(0, 0, 1, 1);
  context.fillStyle = "#000";
  context.fillStyle = value === "currentColor" ? color : value;
  context.fillRect(0, 0, 1, 1);
  const [r, g, b, alpha] = context.getImageData(0, 0, 1, 1).data;
  const light = (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255;
  return 1 - (1 - light) * (alpha / 255) < LIGHT;
}

// ---------------------------------------------------------------------------- the file

/** Reads an SVG: `{ drawing, left }`; `left` lists what was left out. Throws an `Error` with what was expected. */
export function fromSvg(text) {
  const parsed = new DOMParser().parseFromString(text, "image/svg+xml");
  const root = parsed.documentElement;
  const wrong = parsed.querySelector("parsererror");
  if (wrong || root.localName !== "svg") throw new Error(`expected an SVG: ${wrong?.textContent.match(/error on line[^\n]*/)?.[0] ?? `found <${root.localName}>`}`);
  const own = [...root.children].find((element) => element.localName === "metadata" && element.id === OWN);
  if (own) return { drawing: fromText(own.textContent), left: [] };
  const sheets = [...root.querySelectorAll("style")].flatMap((style) => rules(style.textContent));
  const read = { strokes: [], obstacles: [], labels: [], route: null, left: [], root, sheets, swatch: swatch(), count: 0, depth: 0 };
  const style = { ...INITIAL, ...declared(root, sheets) };
  for (const child of root.children) walk(child, UNIT, style, read);
  return { drawing: placed(read, pageOf(root)), left: read.left };
}

/** The page: the view box, or else the size; `null` if the file has neither. */
function pageOf(root) {
  const box = (root.getAttribute("viewBox") ?? "").split(/[\s,]+/).filter(Boolean).map(Number);
  if (box.length === 4 && box.every(Number.isFinite) && box[2] > 0 && box[3] > 0) return [box[0], box[1], box[0] + box[2], box[1] + box[3]];
  const side = (name) => (/%\s*$/.test(root.getAttribute(name) ?? "%") ? 0 : number(root, name));
  return side("width") > 0 && side("height") > 0 ? [0, 0, side("width"), side("height")] : null;
}

function walk(element, outer, inherited, read) {
  read.count += 1;
  if (read.count > MAX_ELEMENTS) throw new Error(`expected at most ${MAX_ELEMENTS} elements, found more`);
  const own = declared(element, read.sheets);
  const style = Object.fromEntries(INHERITED.map((name) => [name, own[name] ?? inherited[name]]));
  if (own.display === "none" || Number(own.opacity ?? 1) === 0) return;
  const matrix = times(outer, transformOf(element.getAttribute("transform")));
  const name = element.localName;
  if (GROUPS.includes(name) && name !== "symbol") for (const child of element.children) walk(child, matrix, style, read);
  else if (name === "use") reuse(element, matrix, style, read);
  else if (style.visibility !== "visible") return;
  else if (DATA[name]) shape(element, matrix, { ...own, ...style }, read);
  else if (name === "text") words(element, matrix, style, read);
  else if (LEFT_OUT[name]) read.left.push(LEFT_OUT[name]);
}

/** Repeats an element that is referenced in this file. */
function reuse(element, matrix, style, read) {
  const href = element.getAttribute("href") ?? element.getAttributeNS("http://www.w3.org/1999/xlink", "href") ?? "";
  const target = href.startsWith("#") && read.root.ownerDocument.getElementById(href.slice(1));
  if (!target || read.depth === MAX_DEPTH) {
    read.left.push("reference");
    return;
  }
  read.depth += 1;
  const moved = times(matrix, [1, 0, 0, 1, number(element, "x"), number(element, "y")]);
  if (target.localName === "symbol") for (const child of target.children) walk(child, moved, style, read);
  else walk(target, moved, style, read);
  read.depth -= 1;
}

function shape(element, matrix, style, read) {
  const lines = outlines(DATA[element.localName](element)).map(({ points, closed }) => ({ points: points.map((p) => apply(matrix, p)), closed }));
  if (lines.length === 0) return;
  if (isInk(style.fill, style["fill-opacity"], style, read.swatch) && element.localName !== "line") {
    const rings = lines.map(({ points }) => points).filter((points) => points.length > 2);
    if (rings.length) {
      read.obstacles.push({ polygon: joined(rings), label: titleOf(element) });
      return;
    }
  }
  if (!isInk(style.stroke, style["stroke-opacity"], style, read.swatch)) return;
  const width_px = (parseFloat(style["stroke-width"]) || 0) * size(matrix);
  if (width_px > 0) lines.forEach(({ points, closed }) => read.strokes.push({ points: closed ? [...points, points[0]] : points, width_px }));
}

/** Rings as one polygon with holes (even-odd): each begins and ends at a corner of the first. */
const joined = ([first, ...others]) => others.reduce((all, ring) => [...all, first[0], ...ring, ring[0]], first);

const titleOf = (element) => ([...element.children].find(({ localName }) => localName === "title")?.textContent ?? "").trim().slice(0, 40);

/** A text names the place at its middle, which is approximate, since its font is not available. */
function words(element, matrix, style, read) {
  const text = element.textContent.replace(/\s+/g, " ").trim();
  if (!text) return;
  const from = element.hasAttribute("x") ? element : element.querySelector("[x]") ?? element;
  const high = parseFloat(style["font-size"]) || 16;
  const shift = { start: 0.5, middle: 0, end: -0.5 }[style["text-anchor"]] ?? 0.5;
  const at = [number(from, "x") + shift * 0.55 * high * text.length, number(from, "y") - 0.35 * high];
  read.labels.push({ text, at: apply(matrix, at) });
}
