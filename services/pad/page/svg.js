// The drawing as an SVG: for a file, and for the thumbnails of the library. Pure.

import { middle } from "./geometry.js";
import { toText } from "./model.js";

/** The id of the metadata that contains the original drawing. */
export const OWN = "sketchnav-drawing";

/** Colours on white paper. The map has only one, so that walls and obstacles are read as the same ink. */
const [INK, PLACE, ROUTE, GOAL, START] = ["#1d2226", "#4a3aa8", "#0d6ea8", "#0d6ea8", "#1f7a3d"];
/** Sizes of texts and marks, as fractions of the sheet's longer side. */
const [TEXT, MARK, LINE] = [1 / 60, 1 / 90, 1 / 250];

const escaped = (text) => text.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
const listed = (points) => points.map(([x, y]) => `${x},${y}`).join(" ");
/** A tap of the pen: a line of length zero has no caps, so it gets a tiny length. */
const lineOf = (points) => (points.length > 1 ? points : [points[0], [points[0][0] + 0.1, points[0][1]]]);

const stroke = ({ points, width_px }, least) => (
  `<polyline points="${listed(lineOf(points))}" stroke="${INK}" stroke-width="${Math.max(width_px, least)}"/>`
);

const obstacle = ({ polygon, label }) => {
  const title = label ? `<title>${escaped(label)}</title>` : "";
  return `<polygon points="${listed(polygon)}" fill="${INK}" stroke="none">${title}</polygon>`;
};

const words = (text, [x, y], size, color) => (
  `<text x="${x}" y="${y}" font-size="${size}" text-anchor="middle" dominant-baseline="central" fill="${color}" stroke="none">${escaped(text)}</text>`
);

/** Route, goals and start, and labels of obstacles. */
function marks({ obstacles, route, goals, start }, side) {
  const [text, mark, line] = [TEXT, MARK, LINE].map((part) => part * side);
  const disc = ([x, y], color) => `<circle cx="${x}" cy="${y}" r="${mark}" fill="${color}" stroke="none"/>`;
  const out = obstacles.filter(({ label }) => label).map(({ polygon, label }) => words(label, middle(polygon), text * 0.7, "#ffffff"));
  if (route) {
    out.push(`<polyline points="${listed(route)}" stroke="${ROUTE}" stroke-opacity="0.5" stroke-width="${line * 1.5}"/>`, disc(route.at(-1), GOAL));
  }
  goals.forEach(({ at }, i) => out.push(disc(at, GOAL), words(String(i + 1), at, mark * 1.3, "#ffffff")));
  if (start) {
    const [x, y] = start.at;
    const angle = (-start.heading_deg * Math.PI) / 180;
    const tip = [x + 3 * mark * Math.cos(angle), y + 3 * mark * Math.sin(angle)];
    out.push(`<polyline points="${listed([start.at, tip])}" stroke="${START}" stroke-width="${line}"/>`, disc(start.at, START));
  }
  return out;
}

/**
 * The drawing on white paper, in canvas pixels. `shown`: with the marks and the photo to trace. `least`: minimum width of a line.
 * `own`: with the drawing as metadata, so that this page can restore it exactly.
 */
export function toSvg(drawing, { shown = false, least = 0, own = false } = {}) {
  const { canvas: [width, height], strokes, obstacles, labels, photo, underlay } = drawing;
  const side = Math.max(width, height);
  const picture = (url, opacity) => `<image href="${url}" width="${width}" height="${height}" opacity="${opacity}"/>`;
  const rows = [`<rect width="${width}" height="${height}" fill="#ffffff"/>`];
  if (own) rows.unshift(`<metadata id="${OWN}">${escaped(toText(drawing))}</metadata>`);
  if (underlay && shown) rows.push(picture(underlay, 0.45));
  if (photo) rows.push(picture(photo, 1));
  rows.push(...strokes.map((one) => stroke(one, least)), ...obstacles.map(obstacle));
  rows.push(...labels.map(({ text, at }) => words(text, at, TEXT * side, PLACE)));
  if (shown) rows.push(...marks(drawing, side));
  const look = 'fill="none" stroke-linecap="round" stroke-linejoin="round" font-family="system-ui, sans-serif" font-weight="600"';
  const size = `width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"`;
  return `<svg xmlns="http://www.w3.org/2000/svg" ${size} ${look}>\n${rows.join("\n")}\n</svg>\n`;
}
