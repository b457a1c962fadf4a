// Places the contents of another program's file on a sheet. Pure.

import { MOST_CHARACTERS, blank, rounded } from "./model.js";

/** Longest side of the sheet, and its margin for contents without a page, pixels. */
const [LONGEST_PX, MARGIN_PX] = [2540, 100];
/** Minimum and maximum width of a stroke, pixels. */
const [LEAST_PX, MOST_PX] = [1, 1000];

/** The bounding box of all points: left, top, right, bottom; `null` if there are none. */
function around({ strokes, obstacles, labels, route }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = ([x, y]) => [x, y, -x, -y].forEach((v, i) => { box[i] = i < 2 ? Math.min(box[i], v) : Math.max(box[i], -v); });
  strokes.forEach(({ points }) => points.forEach(add));
  obstacles.forEach(({ polygon }) => polygon.forEach(add));
  labels.forEach(({ at }) => add(at));
  route?.forEach(add);
  return Number.isFinite(box[0]) ? box : null;
}

/**
 * A drawing of `read`: `strokes`, `obstacles`, `labels` and `route` in any unit, y down, with widths in the same unit. `page`: the
 * file's page (left, top, right, bottom); without one, the sheet is fitted to the contents. Texts that are too long are cut, which
 * `read.left` lists. Throws an `Error` if there are no contents.
 */
export function placed(read, page = null) {
  const box = page ?? around(read);
  if (!around(read)) throw new Error("expected walls, found no line and no shape");
  const size = [box[2] - box[0], box[3] - box[1]];
  const margin = page ? 0 : MARGIN_PX;
  const scale = (LONGEST_PX - 2 * margin) / Math.max(...size, 1e-6);
  const at = ([x, y]) => rounded([(x - box[0]) * scale + margin, (y - box[1]) * scale + margin]);
  const width = (w) => Math.round(Math.min(MOST_PX, Math.max(LEAST_PX, w * scale)) * 100) / 100;
  const short = (text) => {
    const characters = [...text];
    if (characters.length <= MOST_CHARACTERS) return text;
    read.left.push("end of a long text");
    return characters.slice(0, MOST_CHARACTERS).join("").trim();
  };
  return {
    ...blank(size.map((side) => Math.max(1, Math.round(side * scale + 2 * margin)))),
    strokes: read.strokes.map(({ points, width_px, ...more }) => ({ pressure: null, ...more, points: points.map(at), width_px: width(width_px) })),
    obstacles: read.obstacles.map(({ polygon, ...more }) => ({ label: "", ...more, polygon: polygon.map(at) })),
    labels: read.labels.map(({ text, at: place }) => ({ text: short(text), at: at(place) })),
    route: read.route ? read.route.map(at) : null,
  };
}

/** What was left out, with counts: `["picture", "picture"]` is `2 × picture`. */
export function counted(left) {
  const counts = new Map();
  left.forEach((what) => counts.set(what, (counts.get(what) ?? 0) + 1));
  return [...counts].map(([what, count]) => (count > 1 ? `${count} × ${what}` : what)).join(", ");
}
