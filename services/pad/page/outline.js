// The outline of an SVG path as lines: path data after SVG 2, chapter 9, with curves approximated by short lines. Pure.

/** Number of lines per curve. */
const STEPS = 16;
const TOKEN = /([MmZzLlHhVvCcSsQqTtAa])|([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|[\s,]+|(.)/g;
/** Number of arguments of each command. */
const TAKES = { M: 2, L: 2, H: 1, V: 1, C: 6, S: 4, Q: 4, T: 2, A: 7, Z: 0 };

const add = (a, b) => [a[0] + b[0], a[1] + b[1]];
const mirrored = (p, about) => [2 * about[0] - p[0], 2 * about[1] - p[1]];

/** The lines of a path: `{ points, closed }`. Anything after an error in the data is ignored, as in a browser. */
export function outlines(data) {
  const pen = { at: [0, 0], begin: [0, 0], lines: [], line: null, cubic: null, quadratic: null };
  for (const [command, numbers] of commands(data)) draw(pen, command, numbers);
  return pen.lines.filter(({ points }) => points.length > 1);
}

/** The commands of path data with their arguments; a command with several sets of arguments is repeated. */
function commands(data) {
  const found = [];
  let [command, numbers] = [null, []];
  for (const [, letter, number, odd] of splitFlags(data).matchAll(TOKEN)) {
    if (odd !== undefined || (command === null && number !== undefined)) break;
    if (letter !== undefined) {
      if (numbers.length || (found.length === 0 && letter.toUpperCase() !== "M")) break;
      command = letter;
      if (letter.toUpperCase() === "Z") found.push(["Z", []]);
    } else if (number !== undefined) {
      numbers.push(Number(number));
      const takes = TAKES[command.toUpperCase()];
      if (takes === 0) break;
      if (numbers.length < takes) continue;
      found.push([command, numbers]);
      numbers = [];
      // Further points after a move are lines.
      if (command === "M") command = "L";
      if (command === "m") command = "l";
    }
  }
  return found;
}

/** The flags of arcs may be written without spaces: `a1 1 0 01.5 2` is `a1 1 0 0 1 .5 2`. */
const splitFlags = (data) => data.replace(/[Aa][^MmZzLlHhVvCcSsQqTtAa]*/g, (arcs) => {
  const number = "[-+]?(?:\\d+\\.?\\d*|\\.\\d+)(?:[eE][-+]?\\d+)?";
  const gap = "[\\s,]*";
  const one = new RegExp(`(${number})${gap}(${number})${gap}(${number})${gap}([01])${gap}([01])${gap}(${number})${gap}(${number})`, "g");
  return arcs[0] + arcs.slice(1).replace(one, "$1 $2 $3 $4 $5 $6 $7 ");
});

function draw(pen, command, n) {
  const kind = command.toUpperCase();
  const base = command === kind ? [0, 0] : pen.at;
  const point = (i) => add(base, [n[i], n[i + 1]]);
  const before = { cubic: pen.cubic, quadratic: pen.quadratic };
  [pen.cubic, pen.quadratic] = [null, null];
  if (kind === "M") move(pen, point(0));
  else if (kind === "Z") close(pen);
  else if (kind === "L") lineTo(pen, point(0));
  else if (kind === "H") lineTo(pen, [base[0] + n[0], pen.at[1]]);
  else if (kind === "V") lineTo(pen, [pen.at[0], base[1] + n[0]]);
  else if (kind === "C") cubic(pen, point(0), point(2), point(4));
  else if (kind === "S") cubic(pen, before.cubic ? mirrored(before.cubic, pen.at) : pen.at, point(0), point(2));
  else if (kind === "Q") quadratic(pen, point(0), point(2));
  else if (kind === "T") quadratic(pen, before.quadratic ? mirrored(before.quadratic, pen.at) : pen.at, point(0));
  else arc(pen, n, point(5));
}

function move(pen, at) {
  [pen.at, pen.begin, pen.line] = [at, at, null];
}

function close(pen) {
  if (pen.line) pen.line.closed = true;
  move(pen, pen.begin);
}

function lineTo(pen, at) {
  if (!pen.line) {
    pen.line = { points: [pen.at], closed: false };
    pen.lines.push(pen.line);
  }
  pen.line.points.push(at);
  pen.at = at;
}

function cubic(pen, c, d, end) {
  const a = pen.at;
  const on = (t, i) => (1 - t) ** 3 * a[i] + 3 * (1 - t) ** 2 * t * c[i] + 3 * (1 - t) * t * t * d[i] + t ** 3 * end[i];
  for (let k = 1; k <= STEPS; k += 1) lineTo(pen, k === STEPS ? end : [on(k / STEPS, 0), on(k / STEPS, 1)]);
  pen.cubic = d;
}

function quadratic(pen, c, end) {
  const a = pen.at;
  const on = (t, i) => (1 - t) ** 2 * a[i] + 2 * (1 - t) * t * c[i] + t * t * end[i];
  for (let k = 1; k <= STEPS; k += 1) lineTo(pen, k === STEPS ? end : [on(k / STEPS, 0), on(k / STEPS, 1)]);
  pen.quadratic = c;
}

/** From the end points of an elliptical arc to its centre: SVG 2, appendix B.2.4. */
function arc(pen, [rx0, ry0, degrees, large, sweep], end) {
  const [from, phi] = [pen.at, (degrees * Math.PI) / 180];
  let [rx, ry] = [Math.abs(rx0), Math.abs(ry0)];
  if (rx === 0 || ry === 0 || (from[0] === end[0] && from[1] === end[1])) {
    lineTo(pen, end);
    return;
  }
  const [cos, sin] = [Math.cos(phi), Math.sin(phi)];
  const [dx, dy] = [(from[0] - end[0]) / 2, (from[1] - end[1]) / 2];
  const [x, y] = [cos * dx + sin * dy, cos * dy - sin * dx];
  const over = Math.sqrt(Math.max(1, (x / rx) ** 2 + (y / ry) ** 2));
  [rx, ry] = [rx * over, ry * over];
  const part = Math.max(0, (rx * ry) ** 2 - (rx * y) ** 2 - (ry * x) ** 2) / ((rx * y) ** 2 + (ry * x) ** 2);
  const root = Math.sqrt(part) * (Boolean(large) === Boolean(sweep) ? -1 : 1);
  const [mx, my] = [(root * rx * y) / ry, (-root * ry * x) / rx];
  const center = [cos * mx - sin * my + (from[0] + end[0]) / 2, sin * mx + cos * my + (from[1] + end[1]) / 2];
  const angle = (sign) => Math.atan2((sign * y - my) / ry, (sign * x - mx) / rx);
  const begin = angle(1);
  let span = angle(-1) - begin;
  if (sweep && span < 0) span += 2 * Math.PI;
  if (!sweep && span > 0) span -= 2 * Math.PI;
  for (let k = 1; k < STEPS; k += 1) {
    const t = begin + (span * k) / STEPS;
    const [u, v] = [rx * Math.cos(t), ry * Math.sin(t)];
    lineTo(pen, [center[0] + cos * u - sin * v, center[1] + sin * u + cos * v]);
  }
  lineTo(pen, end);
}
