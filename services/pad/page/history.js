// The history of a drawing: what undo and redo do. Pure functions on immutable values. Others may change the drawing between two
// steps, so undo takes back the page's own steps only, and leaves alone what others have changed since.

import { replayed } from "./shared.js";

/** Maximum number of undo steps. */
const MAX_UNDO = 500;

/** A history that starts at `now`. Its steps are `{ from, to }`, since others may change the drawing between two steps. */
export const history = (now) => ({ past: [], now, future: [] });

/** A step to the drawing `now`, which discards the redo steps. An unchanged drawing is no step. */
export function changed(history, now) {
  if (now === history.now) return history;
  return { past: [...history.past.slice(-(MAX_UNDO - 1)), { from: history.now, to: now }], now, future: [] };
}

/** The last step, extended to the drawing `now`. */
export const extended = ({ past, now: before }, now) => ({ past: past.with(-1, { from: past.at(-1)?.from ?? before, to: now }), now, future: [] });

/** One step back; at the beginning, the unchanged history. Steps of which others have changed everything since are skipped. */
export function undone(history) {
  const { past, now, future } = history;
  if (past.length === 0) return history;
  const { from, to } = past.at(-1);
  const next = replayed(now, to, from, true);
  const rest = { past: past.slice(0, -1), now: next, future: [{ from: next, to: now }, ...future] };
  return isSame(next, now) ? undone({ ...rest, future }) : rest;
}

/** One step forward; at the end, the unchanged history. */
export function redone(history) {
  const { past, now, future } = history;
  if (future.length === 0) return history;
  const { from, to } = future[0];
  const next = replayed(now, from, to, true);
  const rest = { past: [...past, { from: now, to: next }], now: next, future: future.slice(1) };
  return isSame(next, now) ? redone({ ...rest, past }) : rest;
}

const isSame = (a, b) => Object.keys(a).every((key) => a[key] === b[key]);
