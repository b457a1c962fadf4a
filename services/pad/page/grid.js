// The drawing as a grid of cells, wall or free: reachable places, visibility, rooms. Pure.
//
// Cells are large enough to close the small gaps of lines drawn by hand, and small enough to leave doors open.

import { boxOf, distance, inside } from "./geometry.js";

/** Number of cells along the sheet's longer side. */
const CELLS = 256;
/** Maximum width of a door, as a fraction of the drawing's longer side: 1.3 m of 25 m. */
const DOOR = 1.3 / 25;
/** Minimum area of a room, in multiples of the square of a door's width. */
const LEAST_ROOM = 2;

/** The grid of a drawing: `{ width, height, cell, walls }`, where `walls` is 1 for each wall cell, row by row. */
export function gridOf({ canvas, strokes, obstacles }) {
  const cell = Math.max(...canvas) / CELLS;
  const [width, height] = canvas.map((side) => Math.max(1, Math.ceil(side / cell)));
  const grid = { width, height, cell, walls: new Uint8Array(width * height) };
  for (const { points, width_px } of strokes) {
    for (let i = 0; i < points.length; i += 1) draw(grid, points[Math.max(0, i - 1)], points[i], width_px / 2);
  }
  obstacles.forEach(({ polygon }) => fill(grid, polygon));
  return grid;
}

/** The cell of a point; -1 outside the sheet. */
export function cellOf({ width, height, cell }, [x, y]) {
  const [column, row] = [Math.floor(x / cell), Math.floor(y / cell)];
  return column >= 0 && row >= 0 && column < width && row < height ? row * width + column : -1;
}

function draw(grid, a, b, half) {
  const steps = Math.max(1, Math.ceil((2 * distance(a, b)) / grid.cell));
  const far = Math.floor(half / grid.cell);
  for (let k = 0; k <= steps; k += 1) {
    const [x, y] = [a[0] + ((b[0] - a[0]) * k) / steps, a[1] + ((b[1] - a[1]) * k) / steps];
    for (let i = -far; i <= far; i += 1) {
      for (let j = -far; j <= far; j += 1) {
        const at = cellOf(grid, [x + i * grid.cell, y + j * grid.cell]);
        if (at >= 0) grid.walls[at] = 1;
      }
    }
  }
}

function fill(grid, polygon) {
  polygon.forEach((b, i) => draw(grid, polygon.at(i - 1), b, 0));
  const [left, top, right, bottom] = boxOf(polygon).map((v) => v / grid.cell);
  for (let row = Math.max(0, Math.floor(top)); row <= Math.min(grid.height - 1, bottom); row += 1) {
    for (let column = Math.max(0, Math.floor(left)); column <= Math.min(grid.width - 1, right); column += 1) {
      if (inside([(column + 0.5) * grid.cell, (row + 0.5) * grid.cell], polygon)) grid.walls[row * grid.width + column] = 1;
    }
  }
}

/** The neighbours of a cell that share an edge with it. */
function beside({ width, height }, at) {
  const column = at % width;
  const out = [];
  if (column > 0) out.push(at - 1);
  if (column < width - 1) out.push(at + 1);
  if (at >= width) out.push(at - width);
  if (at < width * (height - 1)) out.push(at + width);
  return out;
}

/** Spreads the marks of the cells in `from` to all unmarked cells of `marks` with `opens(cell)`, nearest first. */
function spread(grid, marks, from, opens) {
  for (let i = 0; i < from.length; i += 1) {
    for (const next of beside(grid, from[i])) {
      if (marks[next] || !opens(next)) continue;
      marks[next] = marks[from[i]];
      from.push(next);
    }
  }
}

/** The cells reachable from a cell, as 1. */
export function reachable(grid, from) {
  const marks = new Uint8Array(grid.walls.length);
  if (from < 0) return marks;
  marks[from] = 1;
  spread(grid, marks, [from], (at) => !grid.walls[at]);
  return marks;
}

/** The distance of each cell to the nearest wall, in steps across edges. */
function clearances(grid) {
  const far = new Int32Array(grid.walls.length).fill(-1);
  const queue = [];
  grid.walls.forEach((wall, at) => {
    if (!wall) return;
    far[at] = 0;
    queue.push(at);
  });
  for (let i = 0; i < queue.length; i += 1) {
    for (const next of beside(grid, queue[i])) {
      if (far[next] >= 0) continue;
      far[next] = far[queue[i]] + 1;
      queue.push(next);
    }
  }
  return far;
}

/** The longer side of the bounding box of the walls, in cells. */
function extent({ width, walls }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  walls.forEach((wall, at) => {
    if (!wall) return;
    const [x, y] = [at % width, Math.floor(at / width)];
    box.splice(0, 4, Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y));
  });
  return Math.max(box[2] - box[0], box[3] - box[1], 0);
}

/**
 * The rooms of a grid, each cell with its room's number from 1: free space that is closed except for doors and does not touch the
 * edge of the sheet.
 */
export function roomsOf(grid) {
  const door = Math.max(2, extent(grid) * DOOR);
  const far = clearances(grid);
  const rooms = new Uint16Array(grid.walls.length);
  const seeds = [];
  let count = 0;
  // The middle of rooms: farther from the next wall than half a door is wide.
  far.forEach((steps, at) => {
    if (rooms[at] || steps <= door / 2 + 1) return;
    count += 1;
    rooms[at] = count;
    const own = [at];
    spread(grid, rooms, own, (next) => far[next] > door / 2 + 1);
    seeds.push(...own);
  });
  spread(grid, rooms, seeds, (at) => !grid.walls[at]);
  return withoutOthers(grid, rooms, count, LEAST_ROOM * door * door);
}

/** Removes rooms that touch the edge of the sheet or are too small. */
function withoutOthers(grid, rooms, count, least) {
  const [cells, atEdge] = [new Uint32Array(count + 1), new Uint8Array(count + 1)];
  rooms.forEach((room, at) => {
    cells[room] += 1;
    if (beside(grid, at).length < 4) atEdge[room] = 1;
  });
  return rooms.map((room) => (atEdge[room] || cells[room] < least ? 0 : room));
}

/** The distance to the next wall, or to the edge of the sheet, in equally spaced directions from a point, in cells. */
export function seen(grid, [x, y], directions) {
  return Array.from({ length: directions }, (_, i) => {
    const angle = (2 * Math.PI * i) / directions;
    const step = [Math.cos(angle) / 2, Math.sin(angle) / 2];
    for (let k = 1; ; k += 1) {
      const at = cellOf(grid, [x + k * step[0] * grid.cell, y + k * step[1] * grid.cell]);
      if (at < 0 || grid.walls[at]) return k / 2;
    }
  });
}

/** Whether two points see each other. */
export function sees(grid, a, b) {
  const steps = Math.ceil((2 * distance(a, b)) / grid.cell);
  for (let k = 0; k <= steps; k += 1) {
    const at = cellOf(grid, [a[0] + ((b[0] - a[0]) * k) / steps, a[1] + ((b[1] - a[1]) * k) / steps]);
    if (at < 0 || grid.walls[at]) return false;
  }
  return true;
}
