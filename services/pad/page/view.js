// The sheet's position on the screen: `screen = scale · sheet + offset`, in CSS pixels. Pure.

/** Minimum and maximum scale, CSS pixels per canvas pixel. */
const [LEAST, MOST] = [0.05, 8];

/** The whole sheet centred in an area, with a margin, which is smaller on a phone. */
export function fitted(canvas, area) {
  const margin = Math.min(...area) < 420 ? 8 : 16;
  const room = [Math.max(40, area[0] - 2 * margin), Math.max(40, area[1] - 2 * margin)];
  const scale = Math.min(room[0] / canvas[0], room[1] / canvas[1]);
  return { scale, x: (area[0] - canvas[0] * scale) / 2, y: (area[1] - canvas[1] * scale) / 2 };
}

/** From screen to sheet coordinates. */
export const onSheet = (view, [x, y]) => [(x - view.x) / view.scale, (y - view.y) / view.scale];

/** From sheet to screen coordinates. */
export const onScreen = (view, [x, y]) => [x * view.scale + view.x, y * view.scale + view.y];

/** Moved by screen pixels. */
export const panned = (view, dx, dy) => ({ ...view, x: view.x + dx, y: view.y + dy });

/** Zoomed by a factor about the screen position `at`. */
export function zoomed(view, at, factor) {
  const scale = Math.min(MOST, Math.max(LEAST, view.scale * factor));
  const k = scale / view.scale;
  return { scale, x: at[0] - (at[0] - view.x) * k, y: at[1] - (at[1] - view.y) * k };
}

/** Limited so that a part of the sheet stays visible. */
export function held(view, canvas, area) {
  const [w, h] = [canvas[0] * view.scale, canvas[1] * view.scale];
  const within = (v, low, high) => Math.min(high, Math.max(low, v));
  return { ...view, x: within(view.x, 60 - w, area[0] - 60), y: within(view.y, 60 - h, area[1] - 60) };
}
