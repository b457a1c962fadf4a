// What a study measures during drawing: duration, strokes, undo steps, uses of the eraser. Pure functions on immutable values.
// Times are milliseconds that continue across a reload.

/** Before the first stroke. */
export const NOTHING = Object.freeze({ map: null, path: null, strokes: 0, undone: 0, erased: 0, screen: null });

const mapOf = ({ strokes, obstacles, photo }) => [strokes, obstacles, photo];
const pathOf = ({ route, goals, start }) => [route, goals, start];
const differs = (part, before, after) => part(before).some((value, i) => value !== part(after)[i]);
const oneMore = (before, after) => after.length === before.length + 1 && before.every((one, i) => one === after[i]);

const fewer = (before, after) => ["strokes", "obstacles"].some((list) => after[list].length < before[list].length);

/** What a change of the map counts as; `null` if it only changed a text or moved something. */
function kind(before, after, how) {
  if (how === "edit") return fewer(before, after) ? "erased" : null;
  if (how !== "draw") return how === "undo" ? "undone" : null;
  if (oneMore(before.strokes, after.strokes) || oneMore(before.obstacles, after.obstacles)) return "strokes";
  return before.strokes === after.strokes && before.obstacles.length === after.obstacles.length ? null : "erased";
}

/** From the start of the first stroke to the end of the last. */
const longer = (span, began, ended) => [span?.[0] ?? began, ended];

/**
 * The measurements after a step from `before` to `after`. `how`: `draw`, `edit` (with a tool that changes existing items), `undo`
 * or `redo`. `began`: when the hand first touched the sheet for this step; `ended`: now. `screen`: the orientation, `landscape` or
 * `portrait`.
 */
export function measured(sofar, before, after, { how, began, ended, screen }) {
  let next = sofar;
  if (differs(mapOf, before, after)) {
    const counts = kind(before, after, how);
    next = { ...next, map: longer(next.map, began, ended), screen: next.screen ?? screen };
    if (counts) next[counts] += 1;
  }
  if (differs(pathOf, before, after)) next = { ...next, path: longer(next.path, began, ended) };
  return next;
}

const seconds = (span) => (span ? Math.round((span[1] - span[0]) / 10) / 100 : 0);

/** The measurements in the format that is sent; `null` before the first stroke of the map. */
export function report({ map, path, strokes, undone, erased, screen }) {
  return map && { drawing_s: seconds(map), path_s: seconds(path), strokes, undone, erased, screen };
}
