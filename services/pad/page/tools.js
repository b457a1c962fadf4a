// What a gesture does to the drawing, by tool. A tool takes places on the sheet and changes the drawing through its host; it is
// independent of browser events.
//
// The host has: `drawing()`, `change(drawing)`, `preview(drawing)` (shown, but not yet a step of the history), `shown()` (the
// drawing that is shown), `sheet`, `draft(shape | null)`, `guides(list)` (what has snapped to what, snap.js), `over()` (the
// selection is redrawn), `selected()` (the selection has changed), `settings()`, `say(words)`, `label(key)` (asks for the text of
// an item), `write(at)` (asks for a new text there), `answer(at, heading_deg)`. A step with a tag, `change(drawing, tag)`, is
// merged with the previous step if that has the same tag.

import { arc, between, box, distance, ellipse, even, meantStraight, squared } from "./geometry.js";
import {
  obstacleAt, rounded, touched, withDoor, withGoal, withObstacle, withRoute, withStart, withStroke, withoutMapAt, withoutMarksAt,
} from "./model.js";
import { itemAt } from "./items.js";
import { Select } from "./select.js";
import { SNAP_PX, onWall, snappedEnd, snappedPoint, targets } from "./snap.js";

/** A pause of this length straightens a line that was meant to be straight. */
const HOLD_MS = 650;
/** How far the pointer may move during a pause, screen pixels. */
const TREMBLE_PX = 4;
/** How close to its first corner a tap closes a shape, and how close to the last one it is a double tap; screen pixels. */
const [CLOSING_PX, TWICE_PX] = [14, 5];
/** The eraser's radius, screen pixels. */
const RUBBER_PX = 14;
/** Maximum distance of a door from its wall, screen pixels. */
const DOOR_PX = 14;
/** Initial bend of an arc, as a fraction of the distance between its ends. */
const BULGE = 0.25;

/** A freehand line: the pen for walls, and the path. `finish(points, pressures)` turns it into an item. */
class Freehand {
  #points = [];
  #pressures = [];
  #straight = false;
  #hold = 0;
  #held = null;

  constructor(host, color, width, finish) {
    Object.assign(this, { host, color, width, finish });
  }

  begin({ at, pressure, shift }) {
    this.#points = [rounded(at)];
    this.#pressures = [pressure];
    this.#straight = shift;
    this.host.sheet.liveBegin(this.#points[0], pressure, this.width(), this.color());
    this.#wait(at);
  }

  extend(samples) {
    const last = samples.at(-1);
    if (last.shift && !this.#straight) this.#straighten();
    if (this.#straight) {
      this.#stretch(last);
      return;
    }
    const fresh = samples.map((s) => ({ at: rounded(s.at), pressure: s.pressure })).filter((s, i, all) => {
      const before = i ? all[i - 1].at : this.#points.at(-1);
      return s.at[0] !== before[0] || s.at[1] !== before[1];
    });
    if (!fresh.length) return;
    this.host.sheet.liveExtend(fresh.map((s) => s.at), fresh.map((s) => s.pressure ?? this.#pressures.at(-1)));
    for (const { at, pressure } of fresh) {
      this.#points.push(at);
      this.#pressures.push(pressure ?? this.#pressures.at(-1));
    }
    if (distance(last.at, this.#held) > this.host.sheet.px(TREMBLE_PX)) this.#wait(last.at);
  }

  end() {
    const pressed = this.#pressures.every((p) => p !== null) ? this.#pressures : null;
    const points = this.#points;
    this.cancel();
    this.finish(points, pressed);
  }

  cancel() {
    clearTimeout(this.#hold);
    this.#points = [];
    this.host.sheet.liveEnd();
  }

  /** Starts waiting for a pause at `at`. */
  #wait(at) {
    this.#held = at;
    clearTimeout(this.#hold);
    if (!this.host.settings().hold) return;
    this.#hold = setTimeout(() => {
      if (this.#straight || !meantStraight(this.#points)) return;
      this.#straighten();
      this.#stretch({ at: this.#points.at(-1) });
      this.host.say("Straightened.");
    }, HOLD_MS);
  }

  #straighten() {
    this.#straight = true;
    clearTimeout(this.#hold);
  }

  /** Draws the line from the first point to this one. */
  #stretch({ at }) {
    const pressure = this.#pressures[0] === null ? null : 0.5;
    this.#points = [this.#points[0], rounded(squared(this.#points[0], at))];
    this.#pressures = [pressure, pressure];
    this.host.sheet.liveBegin(this.#points[0], pressure, this.width(), this.color());
    this.host.sheet.liveExtend([this.#points[1]], [pressure]);
  }
}

/** Two corners: a straight wall, a box. The shape may adjust its begin and end from the samples. */
class TwoCorners {
  #from = null;
  #to = null;

  constructor(host, shape, finish) {
    Object.assign(this, { host, shape, finish });
  }

  begin(sample) {
    this.#from = this.shape.begin?.(sample) ?? sample.at;
    this.#to = this.#from;
  }

  extend(samples) {
    this.#to = this.shape.end?.(this.#from, samples.at(-1)) ?? samples.at(-1).at;
    this.host.draft(this.shape.draft(this.#from, this.#to));
  }

  end() {
    const [from, to] = [this.#from, this.#to];
    this.cancel();
    this.finish(from, to, distance(from, to) < this.host.sheet.px(8));
  }

  cancel() {
    this.host.draft(null);
    this.host.guides([]);
  }
}

/** An arc: its two ends with one drag, then its bend with another, or with a mouse click. */
class Arc {
  #from = null;
  #to = null;
  #via = null;

  constructor(host, snap, finish) {
    Object.assign(this, { host, snap, finish });
  }

  begin(sample) {
    if (this.#via) this.#bend(sample.at);
    else [this.#from, this.#to] = Array(2).fill(this.snap(sample));
  }

  extend(samples) {
    const sample = samples.at(-1);
    if (this.#via) {
      this.#bend(sample.at);
      return;
    }
    this.#to = this.snap(sample, this.#from);
    this.#show([this.#from, this.#to]);
  }

  hover({ at }) {
    if (this.#via) this.#bend(at);
  }

  end() {
    this.host.guides([]);
    if (this.#via) this.close();
    else if (distance(this.#from, this.#to) < this.host.sheet.px(8)) {
      this.cancel();
      this.host.say("Drag from one end of the arc to the other.");
    } else {
      this.#bulge(BULGE);
      this.host.say("Drag to bend the arc. Enter keeps it as it is.");
    }
  }

  close() {
    if (!this.#via) return;
    const points = this.#points();
    this.cancel();
    this.host.say("");
    this.finish(points);
  }

  cancel() {
    this.#via = null;
    this.host.draft(null);
    this.host.guides([]);
  }

  #points() {
    return arc(this.#from, this.#to, this.#via);
  }

  /** Bends the arc by the distance of a place from the line through its ends. */
  #bend([x, y]) {
    const [[ax, ay], [bx, by]] = [this.#from, this.#to];
    const [dx, dy] = [bx - ax, by - ay];
    this.#bulge(((x - ax) * dy - (y - ay) * dx) / (dx * dx + dy * dy));
  }

  /** Bends the arc by a fraction of the distance between its ends, to the left in its direction, or to the right if negative. */
  #bulge(part) {
    const [[ax, ay], [bx, by]] = [this.#from, this.#to];
    const [x, y] = between(this.#from, this.#to, 0.5);
    this.#via = [x + (by - ay) * part, y - (bx - ax) * part];
    this.#show(this.#points());
  }

  #show(points) {
    this.host.draft({ kind: "line", points, width_px: this.host.settings().width_px });
  }
}

/** A door: opens walls along a drag. */
class Door {
  #from = null;
  #walls = null;

  constructor(host) {
    this.host = host;
  }

  begin({ at }) {
    this.before = this.host.drawing();
    this.drawing = this.before;
    const strokes = this.before.strokes.map((_, i) => `strokes:${i}`);
    this.#walls = targets(this.before, { only: strokes });
    this.#from = this.#jamb(at);
  }

  extend(samples) {
    const to = this.#jamb(samples.at(-1).at);
    this.drawing = withDoor(this.before, this.#from, to, this.host.sheet.px(DOOR_PX));
    this.host.preview(this.drawing);
    this.host.guides([{ point: this.#from }, { point: to }]);
  }

  end() {
    this.host.guides([]);
    if (this.drawing === this.before) this.host.say("Drag along a wall to open a door in it.");
    this.before = null;
    this.host.change(this.drawing);
  }

  cancel() {
    this.host.guides([]);
    if (this.before) this.host.preview(this.before);
    this.before = null;
  }

  #jamb(at) {
    return onWall(at, this.#walls, this.host.sheet.px(DOOR_PX)) ?? at;
  }
}

/** Corners one by one; the first one again, Enter or a double tap closes the shape. With Shift, its sides snap to directions. */
class Polygon {
  #corners = [];

  constructor(host, snap) {
    Object.assign(this, { host, snap });
  }

  begin(sample) {
    this.extend([sample]);
  }

  extend(samples) {
    const sample = samples.at(-1);
    const directed = sample.shift && this.#corners.length > 0;
    this.#show(directed ? this.snap(sample, this.#corners.at(-1)) : sample.at);
  }

  hover(sample) {
    if (this.#corners.length) this.extend([sample]);
  }

  end() {
    const at = this.candidate;
    const near = (p, px) => distance(p, at) < this.host.sheet.px(px);
    if (this.#corners.length === 0 && editLabel(this.host, at)) {
      this.cancel();
    } else if (this.#corners.length > 2 && (near(this.#corners[0], CLOSING_PX) || near(this.#corners.at(-1), TWICE_PX))) {
      this.close();
    } else if (this.#corners.length === 0 || !near(this.#corners.at(-1), TWICE_PX)) {
      this.#corners.push(at);
      this.host.guides([]);
      this.#show(null);
      this.host.say(this.#corners.length < 3 ? "Tap the next corner." : "Tap the first corner, or press Enter, to close the shape.");
    }
  }

  close() {
    const corners = this.#corners;
    this.cancel();
    this.host.say("");
    if (corners.length > 2) addObstacle(this.host, corners);
  }

  cancel() {
    this.#corners = [];
    this.host.draft(null);
    this.host.guides([]);
  }

  #show(at) {
    this.candidate = at;
    this.host.draft({ kind: "polygon", points: at ? [...this.#corners, at] : this.#corners, corners: true });
  }
}

/** Erases either the map or the marks, whichever it touches first. */
class Eraser {
  #kind = null;
  #last = null;

  constructor(host) {
    this.host = host;
  }

  begin({ at }) {
    this.before = this.host.drawing();
    this.drawing = this.before;
    this.#kind = null;
    this.#last = at;
    this.#rub(at);
  }

  extend(samples) {
    samples.forEach(({ at }) => {
      // Fast movements leave no gap between two events.
      const steps = Math.max(1, Math.ceil(distance(this.#last, at) / this.#radius()));
      for (let i = 1; i <= steps; i += 1) {
        this.#rub([this.#last[0] + ((at[0] - this.#last[0]) * i) / steps, this.#last[1] + ((at[1] - this.#last[1]) * i) / steps]);
      }
      this.#last = at;
    });
  }

  end() {
    this.host.draft(null);
    this.before = null;
    this.host.change(this.drawing);
  }

  cancel() {
    this.host.draft(null);
    if (this.before) this.host.preview(this.before);
    this.before = null;
  }

  #radius() {
    return this.host.sheet.px(RUBBER_PX);
  }

  #rub(at) {
    const radius = this.#radius();
    this.#kind ??= touched(this.drawing, at, radius);
    const without = this.#kind === "marks" ? withoutMarksAt : withoutMapAt;
    const after = this.#kind ? without(this.drawing, at, radius) : this.drawing;
    if (after !== this.drawing) this.host.preview(after);
    this.drawing = after;
    this.host.draft({ kind: "rubber", at, radius });
  }
}

function addObstacle(host, polygon) {
  host.change(withObstacle(host.drawing(), polygon));
  host.label(`obstacles:${host.drawing().obstacles.length - 1}`);
}

/** A tap on an existing obstacle asks for its label. */
function editLabel(host, at) {
  const index = obstacleAt(host.drawing(), at);
  if (index >= 0) host.label(`obstacles:${index}`);
  return index >= 0;
}

/** A tap on a text changes it; elsewhere it adds a new one. */
function write(host, at) {
  const key = itemAt({ ...host.drawing(), strokes: [], obstacles: [], goals: [], route: null, start: null }, at, 0, host.sheet.px(1));
  if (key) host.label(key);
  else host.write(at);
}

const headingDeg = (from, to) => (Math.atan2(from[1] - to[1], to[0] - from[0]) * 180) / Math.PI;

/** All tools by name. */
export function makeTools(host) {
  const pen = (points, pressures) => host.change(withStroke(host.drawing(), points, host.settings().width_px, pressures));
  const path = (points) => {
    if (points.length < 2) host.say("Draw the path as a line, from where the robot stands.");
    else host.change(withRoute(host.drawing(), points));
  };
  /** A sample's place, snapped to ends and walls, and, if it ends a line, to directions. Ctrl disables snapping. */
  const snap = (sample, from = null) => {
    const free = !host.settings().snap || sample.ctrl;
    const [around, reach] = [targets(host.drawing()), host.sheet.px(SNAP_PX)];
    if (free && !sample.shift) return sample.at;
    const { at, guides } = from ? snappedEnd(from, sample.at, around, reach, sample.shift) : snappedPoint(sample.at, around, reach);
    host.guides(guides);
    return at;
  };
  const wall = {
    begin: (sample) => snap(sample),
    end: (from, sample) => snap(sample, from),
    draft: (a, b) => ({ kind: "line", points: [a, b], width_px: host.settings().width_px }),
  };
  const shape = (outline) => ({
    end: (from, { at, shift }) => (shift ? even(from, at) : at),
    draft: (a, b) => ({ kind: "polygon", points: outline(a, b), closed: true }),
  });
  const obstacle = (outline) => (a, b, tiny) => {
    if (!tiny) addObstacle(host, outline(a, b));
    else if (!editLabel(host, a)) host.say("Drag from one corner of the obstacle to the other.");
  };
  const arrow = {
    draft: (a, b) => ({ kind: "start", start: { at: a, heading_deg: headingDeg(a, b) } }),
  };
  return {
    select: new Select(host),
    pen: new Freehand(host, () => host.sheet.colors.ink, () => host.settings().width_px, pen),
    eraser: new Eraser(host),
    line: new TwoCorners(host, wall, (a, b, tiny) => (tiny ? host.say("Drag from one end of the wall to the other.") : pen([a, b], null))),
    arc: new Arc(host, snap, (points) => pen(points, null)),
    door: new Door(host),
    box: new TwoCorners(host, shape(box), obstacle(box)),
    ellipse: new TwoCorners(host, shape(ellipse), obstacle(ellipse)),
    polygon: new Polygon(host, snap),
    text: new TwoCorners(host, { draft: () => null }, (a) => write(host, a)),
    path: new Freehand(host, () => host.sheet.colors.goal, () => host.sheet.px(4), path),
    goal: new TwoCorners(host, { draft: () => null }, (a) => host.change(withGoal(host.drawing(), a))),
    here: new TwoCorners(host, arrow, (a, b, tiny) => host.answer(a, tiny ? null : headingDeg(a, b))),
    start: new TwoCorners(host, arrow, (a, b, tiny) => host.change(withStart(host.drawing(), a, tiny ? 0 : headingDeg(a, b)))),
  };
}
