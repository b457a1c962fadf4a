// Checks a drawing before a robot drives by it: paths through walls, unreachable goals and places, goals that look alike. Each
// finding has a place and a short text. Pure.

import { boxOf, distance, meeting } from "./geometry.js";
import { cellOf, gridOf, reachable, roomsOf, seen, sees } from "./grid.js";

/** Crossings closer to each other than this count as one, as a fraction of the sheet's longer side. */
const ONE = 1 / 60;
/** Number of directions compared, and the mean difference of log distances up to which two places look alike. */
const [DIRECTIONS, ALIKE] = [72, 0.1];

/** The grid of a drawing and its rooms, cached. */
const known = new WeakMap();

function mapOf({ canvas, strokes, obstacles }) {
  const found = known.get(strokes);
  if (found && found.canvas === canvas && found.obstacles === obstacles) return found;
  const grid = gridOf({ canvas, strokes, obstacles });
  const made = { canvas, obstacles, grid, rooms: roomsOf(grid) };
  known.set(strokes, made);
  return made;
}

/** The name of the room that contains a point, if exactly one text is written in it; `null` otherwise. */
export function roomNameAt(drawing, at) {
  const { grid, rooms } = mapOf(drawing);
  const roomAt = (p) => rooms[cellOf(grid, p)] ?? 0;
  const room = roomAt(at);
  const names = room ? drawing.labels.filter((label) => roomAt(label.at) === room) : [];
  return names.length === 1 ? names[0].text : null;
}

/** The drawing with unnamed goals named after their rooms; a room with several goals names none of them. */
export function withRoomNames(drawing) {
  const names = drawing.goals.map(({ name, at }) => name ?? roomNameAt(drawing, at));
  const goals = drawing.goals.map((goal, i) => (goal.name || !names[i] || names.indexOf(names[i]) !== names.lastIndexOf(names[i]) ? goal : { name: names[i], ...goal }));
  return { ...drawing, goals };
}

/**
 * Returns what looks wrong: a list of `{ at, word, why }`, with the text for the drawing and the reason for the list beside it.
 * `from`: the robot's place, if the drawing has no start. A photo is not checked.
 */
export function doubts(drawing, from = null) {
  const { route, goals, labels, start, photo } = drawing;
  if (photo || (!route && goals.length === 0)) return [];
  const { grid, rooms } = mapOf(drawing);
  const begin = start?.at ?? route?.[0] ?? from;
  const crossed = route ? crossings(drawing, route).map((at) => ({ at, word: "through a wall", why: "The path goes through a wall." })) : [];
  if (!begin) return [...crossed, ...alike(grid, goals)];
  const isWall = (at) => grid.walls[cellOf(grid, at)] === 1;
  if (isWall(begin)) return [...crossed, { at: begin, word: "in a wall", why: "The start is in a wall." }];
  const reached = reachable(grid, cellOf(grid, begin));
  const away = goals.flatMap(({ at, name }, i) => {
    if (reached[cellOf(grid, at)]) return [];
    const what = name ? `Goal ${i + 1}, ${name},` : `Goal ${i + 1}`;
    return [isWall(at) ? { at, word: "in a wall", why: `${what} is in a wall.` } : { at, word: "no way", why: `${what} cannot be reached: the walls leave no way.` }];
  });
  const roomAt = ({ at }) => rooms[cellOf(grid, at)] ?? 0;
  const marked = new Set(goals.map(roomAt));
  const shut = labels.filter((label) => roomAt(label) && !marked.has(roomAt(label)) && !reached[cellOf(grid, label.at)])
    .map(({ at, text }) => ({ at, word: "closed", why: `No way leads to “${text}”.` }));
  return [...crossed, ...away, ...shut, ...alike(grid, goals.filter(({ at }) => reached[cellOf(grid, at)]), goals)];
}

/** Where a route crosses walls and edges of obstacles. */
function crossings({ strokes, obstacles, canvas }, route) {
  const lines = [...strokes.map(({ points }) => points), ...obstacles.map(({ polygon }) => [...polygon, polygon[0]])];
  const near = Math.max(...canvas) * ONE;
  const found = [];
  for (const line of lines) {
    if (!touch(boxOf(line), boxOf(route))) continue;
    for (let i = 1; i < route.length; i += 1) {
      const way = boxOf([route[i - 1], route[i]]);
      if (!touch(boxOf(line), way)) continue;
      for (let k = 1; k < line.length; k += 1) {
        const at = crossing(route[i - 1], route[i], line[k - 1], line[k]);
        if (at && found.every((other) => distance(other, at) > near)) found.push(at);
      }
    }
  }
  return found;
}

const touch = (a, b) => a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3];

/** The intersection of two segments; `null` if there is none. */
function crossing(a, b, c, d) {
  const [u, v] = [[b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]]];
  const [t, s] = [meeting(a, u, c, v), meeting(c, v, a, u)];
  if (t === null || t < 0 || t > 1 || s < 0 || s > 1) return null;
  return [a[0] + t * u[0], a[1] + t * u[1]];
}

/** Goals that look, at any heading, like another goal that is out of sight. */
function alike(grid, goals, all = goals) {
  const views = goals.map(({ at }) => seen(grid, at, DIRECTIONS).map(Math.log));
  return goals.flatMap((goal, i) => {
    const other = goals.findIndex(({ at }, k) => k !== i && !sees(grid, goal.at, at) && difference(views[i], views[k]) < ALIKE);
    if (other < 0) return [];
    const [own, its] = [goal, goals[other]].map((one) => all.indexOf(one) + 1);
    return [{ at: goal.at, word: `like ${its}`, why: `Goal ${own} looks like goal ${its}: the robot may take one for the other.` }];
  });
}

/** The mean difference of two views at the rotation that fits best. */
function difference(a, b) {
  let least = Infinity;
  for (let turn = 0; turn < a.length; turn += 1) {
    const sum = a.reduce((total, value, i) => total + Math.abs(value - b[(i + turn) % b.length]), 0);
    least = Math.min(least, sum / a.length);
  }
  return least;
}
