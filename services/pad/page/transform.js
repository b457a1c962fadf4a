// Moving, turning and scaling the selection, and the handles for it. Pure. A transform is `{ map(point), turn_deg }`; it turns
// clockwise on the screen, since y points down.

/** Step of turns with Shift, degrees: as in Excalidraw. */
const STEP_DEG = 15;
/** Distance of the frame from its contents, and of the turning handle from the frame, screen pixels. */
const [PAD_PX, STEM_PX] = [8, 30];
/**
 * Minimum length of a side with a handle in its middle; frames smaller than the second size have only one corner handle; screen
 * pixels.
 */
const [FEW_PX, ONE_PX] = [72, 28];
/** Handles with the sides that they move: from the left or top, -1, to the right or bottom, 1. */
const HANDLES = { nw: [-1, -1], n: [0, -1], ne: [1, -1], e: [1, 0], se: [1, 1], s: [0, 1], sw: [-1, 1], w: [-1, 0] };

/** A translation. */
export const move = ([dx, dy]) => ({ map: ([x, y]) => [x + dx, y + dy], turn_deg: 0 });

/** A rotation about a point. */
export function turn([cx, cy], degrees) {
  const [cos, sin] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  return { map: ([x, y]) => [cx + cos * (x - cx) - sin * (y - cy), cy + sin * (x - cx) + cos * (y - cy)], turn_deg: degrees };
}

/** A scaling about a point. */
export const scale = ([cx, cy], [sx, sy]) => ({ map: ([x, y]) => [cx + sx * (x - cx), cy + sy * (y - cy)], turn_deg: 0 });

/** The middle of a box. */
export const center = ([left, top, right, bottom]) => [(left + right) / 2, (top + bottom) / 2];

/** The frame around a box; `px` is the size of a screen pixel in sheet pixels. */
export function frame([left, top, right, bottom], px) {
  const pad = PAD_PX * px;
  return [left - pad, top - pad, right + pad, bottom + pad];
}

/** The handles of a box: name → place. A box that cannot be scaled, such as that of a point, has only the turning handle. */
export function handles(box, px, { scales = true, turns = true } = {}) {
  const [left, top, right, bottom] = frame(box, px);
  const [width, height] = [(right - left) / px, (bottom - top) / px];
  const names = Object.entries(HANDLES).filter(([name, [dx, dy]]) => {
    if (Math.max(width, height) < ONE_PX) return name === "se";
    if (dx === 0) return width >= FEW_PX;
    return dy !== 0 || height >= FEW_PX;
  });
  const at = ([dx, dy]) => [(left + right + dx * (right - left)) / 2, (top + bottom + dy * (bottom - top)) / 2];
  const places = scales ? names.map(([name, sides]) => [name, at(sides)]) : [];
  if (turns) places.push(["turn", [(left + right) / 2, top - STEM_PX * px]]);
  return Object.fromEntries(places);
}

/** The closest handle within `reach` of a point; `null` if there is none. The middle of a small `box` stays free. */
export function handleAt(places, [x, y], reach, box, px) {
  if (!box) return null;
  const [[left, top, right, bottom], [cx, cy]] = [frame(box, px), center(box)];
  const within = x > left && x < right && y > top && y < bottom;
  let [best, least] = [null, reach];
  for (const [name, place] of Object.entries(places)) {
    const off = Math.hypot(place[0] - x, place[1] - y);
    const free = within ? Math.hypot(place[0] - cx, place[1] - cy) / 2 : Infinity;
    if (off <= Math.min(least, free)) [best, least] = [name, off];
  }
  return best;
}

/**
 * The transform for dragging a handle of a box by `[dx, dy]`. `even`: both sides by the same factor; `middle`: about the centre
 * instead of the opposite side. A side never becomes shorter than a pixel, and a side of length zero stays so.
 */
export function resize(box, handle, [dx, dy], { even = false, middle = false } = {}) {
  const [hx, hy] = HANDLES[handle];
  const size = [box[2] - box[0], box[3] - box[1]];
  const grown = [hx * dx, hy * dy].map((by, i) => {
    if (size[i] <= 0) return 1;
    return Math.max(1 / size[i], (size[i] + by * (middle ? 2 : 1)) / size[i]);
  });
  const both = even ? larger(grown, [hx, hy], size) : null;
  const [cx, cy] = center(box);
  const anchor = middle ? [cx, cy] : [cx - (hx * size[0]) / 2, cy - (hy * size[1]) / 2];
  return scale(anchor, both === null ? grown : [both, both]);
}

/** The factor for both sides: that of the dragged side, or the one that changes more. */
function larger([x, y], [hx, hy], [width, height]) {
  if (hx === 0 || width <= 0) return y;
  if (hy === 0 || height <= 0) return x;
  return Math.abs(x - 1) > Math.abs(y - 1) ? x : y;
}

/** The angle between two points about a centre, degrees; in steps with `steps`. */
export function turned([cx, cy], from, to, steps = false) {
  const angle = ([x, y]) => (Math.atan2(y - cy, x - cx) * 180) / Math.PI;
  const degrees = angle(to) - angle(from);
  return steps ? STEP_DEG * Math.round(degrees / STEP_DEG) : degrees;
}

/** A move restricted to its longer axis. */
export const upright = ([dx, dy]) => (Math.abs(dx) >= Math.abs(dy) ? [dx, 0] : [0, dy]);
