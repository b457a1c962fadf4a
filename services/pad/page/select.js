// The tool that selects: a tap or a marquee chooses, a drag moves, handles scale and turn, Enter or a double tap edits points. What
// it does to a drawing are the pure functions of items.js, transform.js and snap.js; this knows the hand and what is chosen.
//
// The host is that of tools.js.

import { distance } from "./geometry.js";
import {
  aligned, allKeys, boxAround, copied, distributed, duplicated, grouped, hasPoints, isClosed, itemAt, itemOf, keysWithin, placeAt,
  pointAt, pointsOf, sameItems, simplified, tipOf, transformed, ungrouped, unitCount, withCopies, withGroups, withPointAt, withPointLess,
  withPointMore, without,
} from "./items.js";
import { rounded } from "./model.js";
import { closings, snappedMove, snappedPoint, targets } from "./snap.js";
import { center, frame, handleAt, handles, move, resize, scale, turn, turned, upright } from "./transform.js";

/** How near a mouse or pen, and a finger, must come to something, and how far each trembles in a tap; screen pixels. */
const [REACH_PX, FINGER_PX] = [10, 20];
const [STILL_PX, FINGER_STILL_PX] = [4, 8];
/** A second tap so soon and so near is a double tap. */
const [TWICE_MS, TWICE_PX] = [500, 12];
/** How near something snaps, and how far copies lie from what they are copies of, screen pixels. */
const [SNAP_PX, COPY_PX] = [10, 24];
/** Points nearer to each other than this are not all shown, and segments as long as the second show where a new point would be. */
const [DENSE_PX, ROOMY_PX] = [12, 48];

const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];
const holds = ([left, top, right, bottom], [x, y]) => x >= left && x <= right && y >= top && y <= bottom;

export class Select {
  #keys = [];
  /** The item whose points are edited and the point that is chosen: `{ key, index }`, or `null`. */
  #edit = null;
  #gesture = null;
  #guides = [];
  #marquee = null;
  /** The frame while it is turned: its corners. */
  #turning = null;
  #lastTap = null;
  #clipboard = [];
  /** Whether taps add, for a hand without a Shift key. */
  #adds = false;

  constructor(host) {
    this.host = host;
  }

  /** What can be done with what is chosen: for the buttons. */
  get state() {
    const drawing = this.host.drawing();
    const keys = this.#keys;
    const [only] = keys.length === 1 ? keys : [null];
    return {
      count: keys.length, editing: this.#edit !== null, adds: this.#adds,
      points: only !== null && hasPoints(only), label: only?.startsWith("obstacles") ?? false,
      strokes: keys.some((key) => key.startsWith("strokes")), copies: keys.some((key) => !/^(route|start)/.test(key)),
      grouped: keys.some((key) => itemOf(drawing, key)?.group), units: unitCount(drawing, keys),
    };
  }

  // ------------------------------------------------------------------ the hand

  begin(sample) {
    this.before = this.host.drawing();
    this.from = sample.at;
    this.dragged = false;
    this.next = this.before;
    const reach = this.host.sheet.px(sample.touch ? FINGER_PX : REACH_PX);
    this.#gesture = this.#pointGesture(sample, reach) ?? this.#handleGesture(sample, reach) ?? this.#itemGesture(sample, reach);
    this.still = this.host.sheet.px(sample.touch ? FINGER_STILL_PX : STILL_PX);
    this.last = sample;
    this.host.over();
  }

  extend(samples) {
    this.last = samples.at(-1);
    this.dragged ||= distance(this.from, this.last.at) > this.still;
    if (!this.dragged || !this.#gesture) return;
    this.#gesture.drag(this.last);
    this.host.over();
  }

  end() {
    const gesture = this.#gesture;
    const { next, dragged } = this;
    this.#drop();
    if (!gesture) return;
    if (!dragged) gesture.tap(this.last);
    else if (next !== this.before) this.#apply(next, this.#keys);
    this.#shown();
  }

  cancel() {
    if (!this.#gesture) return;
    this.#drop();
    this.host.preview(this.before);
    if (!this.#keys.every((key) => itemOf(this.before, key))) this.#keys = [];
    this.#shown();
  }

  #drop() {
    this.#gesture = this.#marquee = this.#turning = null;
    this.#guides = [];
  }

  #preview(next) {
    this.next = next;
    this.host.preview(next);
  }

  /** A point of the item whose points are edited, or its line, where a point is added. */
  #pointGesture({ at }, reach) {
    if (!this.#edit) return null;
    const { key } = this.#edit;
    let [start, index] = [this.before, pointAt(this.before, key, at, reach)];
    if (index < 0) {
      index = placeAt(this.before, key, at, reach);
      if (index < 0) {
        this.#edit = null;
        return null;
      }
      start = withPointMore(this.before, key, index, at);
      this.#preview(start);
    }
    this.#edit = { key, index };
    const around = targets(this.before, { except: [key] });
    return {
      drag: (sample) => {
        const { at: to, guides } = this.#snaps(sample) ? snappedPoint(sample.at, around, this.host.sheet.px(SNAP_PX)) : { at: sample.at, guides: [] };
        this.#guides = guides;
        this.#preview(withPointAt(start, key, index, to));
      },
      tap: () => start !== this.before && this.#apply(start, this.#keys),
    };
  }

  #handleGesture({ at, alt }, reach) {
    const box = this.#box(this.before);
    const name = handleAt(this.#handles(), at, reach, box, this.host.sheet.px(1));
    if (name === null) return null;
    if (name === "turn") return this.#turnGesture(box);
    return {
      drag: (sample) => {
        const how = { even: sample.shift, middle: sample.alt ?? alt };
        this.#preview(transformed(this.before, this.#keys, resize(box, name, minus(sample.at, this.from), how)));
      },
      tap: () => {},
    };
  }

  #turnGesture(box) {
    const middle = center(box);
    const [left, top, right, bottom] = frame(box, this.host.sheet.px(1));
    const corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
    return {
      drag: (sample) => {
        const how = turn(middle, turned(middle, this.from, sample.at, sample.shift));
        this.#turning = corners.map(how.map);
        this.#preview(transformed(this.before, this.#keys, how));
      },
      tap: () => {},
    };
  }

  #itemGesture(sample, reach) {
    const px = this.host.sheet.px(1);
    const hit = itemAt(this.before, sample.at, reach, px);
    const box = this.#box(this.before);
    const more = sample.shift || this.#adds;
    if (hit === null && !(box && holds(frame(box, px), sample.at))) return this.#marqueeGesture(more);
    const had = hit === null || this.#keys.includes(hit);
    if (!had) this.#choose([...more ? this.#keys : [], ...withGroups(this.before, [hit])]);
    return { drag: this.#moves(), tap: (last) => this.#tapped(last, hit, had, more) };
  }

  #tapped({ at, time }, hit, had, more) {
    const twice = this.#lastTap && time - this.#lastTap.time < TWICE_MS && distance(at, this.#lastTap.at) < this.host.sheet.px(TWICE_PX);
    this.#lastTap = { at, time };
    if (hit === null) this.#choose([]);
    else if (more && had) this.#choose(this.#keys.filter((key) => !withGroups(this.before, [hit]).includes(key)));
    else if (more) return;
    else if (!twice) this.#choose(withGroups(this.before, [hit]));
    else if (this.#keys.length > 1) this.#choose([hit]);
    else this.editPoints();
  }

  /** Moves what is chosen; with Alt its copies. */
  #moves() {
    let plan = null;
    return (sample) => {
      plan ??= this.#plan(sample.alt);
      let by = rounded(minus(sample.at, this.from));
      this.#guides = [];
      if (sample.shift) by = upright(by);
      else if (this.#snaps(sample)) ({ by, guides: this.#guides } = snappedMove(plan.moving, by, plan.around, this.host.sheet.px(SNAP_PX)));
      this.#preview(transformed(plan.drawing, plan.keys, move(by)));
    };
  }

  #plan(copies) {
    const plan = copies && this.state.copies ? duplicated(this.before, this.#keys, [0, 0]) : { drawing: this.before, keys: this.#keys };
    this.#keys = plan.keys;
    const moving = targets(plan.drawing, { only: plan.keys });
    return { ...plan, moving, around: targets(plan.drawing, { except: plan.keys }) };
  }

  #marqueeGesture(more) {
    const had = more ? this.#keys : [];
    return {
      drag: ({ at }) => {
        const [xs, ys] = [0, 1].map((i) => [this.from[i], at[i]].sort((a, b) => a - b));
        this.#marquee = [xs[0], ys[0], xs[1], ys[1]];
        this.#choose([...had, ...withGroups(this.before, keysWithin(this.before, this.#marquee))]);
      },
      tap: () => this.#choose(had),
    };
  }

  #snaps({ ctrl }) {
    return this.host.settings().snap && !ctrl;
  }

  /** What the mouse is over, for its cursor. */
  over({ at }) {
    const [px, reach] = [this.host.sheet.px(1), this.host.sheet.px(REACH_PX)];
    const drawing = this.host.drawing();
    const box = this.#box(drawing);
    const handle = handleAt(this.#handles(), at, reach, box, px);
    if (handle) return handle;
    return (box && holds(frame(box, px), at)) || itemAt(drawing, at, reach, px) !== null ? "item" : "";
  }

  // ------------------------------------------------------------------ what is chosen

  #choose(keys) {
    const next = [...new Set(keys)];
    const same = next.length === this.#keys.length && next.every((key, i) => key === this.#keys[i]);
    if (same && !this.#edit) return;
    this.#keys = next;
    this.#edit = null;
    if (!next.length) this.#adds = false;
    this.#shown();
  }

  #shown() {
    this.host.over();
    this.host.selected();
  }

  /** A step of the history, after which `keys` are chosen. Steps that follow each other by the same keys of the keyboard, `how`, are one. */
  #apply(next, keys, how) {
    const edit = this.#edit;
    this.host.change(next, how && `${how} ${keys} ${edit?.index}`);
    this.#keys = keys;
    this.#edit = edit;
    this.#shown();
  }

  /** The drawing has changed by a step that is not this tool's: keys that may mean something else now are forgotten. */
  follow(before, after) {
    if (before.canvas !== after.canvas || !sameItems(before, after)) [this.#keys, this.#edit] = [[], null];
    if (this.#edit && this.#edit.index >= pointsOf(after, this.#edit.key).length) this.#edit.index = 0;
  }

  /** Another tool is taken. */
  leave() {
    this.#adds = false;
    this.#choose([]);
  }

  /** Lets go of one thing: the gesture, the points, or what is chosen. */
  escape() {
    if (this.#gesture) this.cancel();
    else if (this.#edit) this.editPoints();
    else this.#choose([]);
  }

  /** Enter. */
  close() {
    this.editPoints();
  }

  /** Begins or ends editing the points of the one item that is chosen. */
  editPoints() {
    const [key] = this.#keys;
    if (this.#edit) this.#edit = null;
    else if (this.#keys.length === 1 && hasPoints(key)) this.#edit = { key, index: 0 };
    this.#shown();
  }

  selectAll() {
    this.#choose(allKeys(this.host.drawing()));
  }

  toggleAdding() {
    this.#adds = !this.#adds;
    this.#shown();
  }

  /** The next item, or the next point of the one whose points are edited; `by` is -1 for the one before. */
  step(by) {
    const drawing = this.host.drawing();
    if (this.#edit) {
      const count = pointsOf(drawing, this.#edit.key).length;
      this.#edit = { ...this.#edit, index: (this.#edit.index + by + count) % count };
      this.#shown();
      return;
    }
    const all = allKeys(drawing);
    const at = this.#keys.length ? all.indexOf(this.#keys.at(by > 0 ? -1 : 0)) : (by > 0 ? -1 : 0);
    if (all.length) this.#choose(withGroups(drawing, [all[(at + by + all.length) % all.length]]));
  }

  // ------------------------------------------------------------------ what is done with it

  remove() {
    const { key, index } = this.#edit ?? {};
    const drawing = this.host.drawing();
    if (!this.#keys.length) return;
    if (!key) {
      this.#apply(without(drawing, this.#keys), []);
      return;
    }
    const next = withPointLess(drawing, key, index);
    this.#edit = sameItems(drawing, next) ? { key, index: Math.max(0, index - 1) } : null;
    this.#apply(next, this.#edit ? this.#keys : []);
  }

  /** Adds a point halfway to the next one. */
  insert() {
    if (!this.#edit) return;
    const { key, index } = this.#edit;
    const points = pointsOf(this.host.drawing(), key);
    const before = index === points.length - 1 && !isClosed(key) ? index : index + 1;
    const at = center([...points.at(before - 1), ...points[before % points.length]]);
    const next = withPointMore(this.host.drawing(), key, before, at);
    this.#edit = { key, index: before };
    this.#apply(next, this.#keys);
  }

  duplicate() {
    this.#copies(duplicated(this.host.drawing(), this.#keys, this.#aside()));
  }

  copy() {
    this.#clipboard = copied(this.host.drawing(), this.#keys);
  }

  cut() {
    this.copy();
    this.remove();
  }

  paste() {
    this.#copies(withCopies(this.host.drawing(), this.#clipboard, this.#aside()));
  }

  #aside() {
    const by = this.host.sheet.px(COPY_PX);
    return [by, by];
  }

  #copies({ drawing, keys }) {
    if (keys.length) this.#apply(drawing, keys);
    else if (this.#keys.length) this.host.say("A drawing has one path and one start.");
  }

  group() {
    if (unitCount(this.host.drawing(), this.#keys) > 1) this.#apply(grouped(this.host.drawing(), this.#keys), this.#keys);
  }

  ungroup() {
    if (this.state.grouped) this.#apply(ungrouped(this.host.drawing(), this.#keys), this.#keys);
  }

  align(side) {
    if (this.state.units > 1) this.#apply(aligned(this.host.drawing(), this.#keys, side), this.#keys);
  }

  distribute(axis) {
    if (this.state.units > 2) this.#apply(distributed(this.host.drawing(), this.#keys, axis), this.#keys);
  }

  simplify() {
    const next = simplified(this.host.drawing(), this.#keys);
    if (this.#edit) this.#edit = { ...this.#edit, index: 0 };
    this.#apply(next, this.#keys);
  }

  closeGaps() {
    const drawing = this.host.drawing();
    const moved = closings(drawing, this.#keys);
    if (!moved.length) {
      this.host.say("No end of these walls is near another.");
      return;
    }
    this.#apply(moved.reduce((next, { key, index, at }) => withPointAt(next, key, index, at), drawing), this.#keys);
    this.host.say(moved.length === 1 ? "One end was moved." : `${moved.length} ends were moved.`);
  }

  label() {
    if (this.state.label) this.host.label(Number(this.#keys[0].split(":")[1]));
  }

  /** Moves what is chosen, or the point that is, by screen pixels; those that follow each other are one step. Answers whether there was any. */
  nudge(direction, far) {
    if (!this.#keys.length || this.#gesture) return false;
    const by = direction.map((d) => d * this.host.sheet.px(far));
    const { key, index } = this.#edit ?? {};
    const drawing = this.host.drawing();
    const at = key && pointsOf(drawing, key)[index];
    const next = key ? withPointAt(drawing, key, index, [at[0] + by[0], at[1] + by[1]]) : transformed(drawing, this.#keys, move(rounded(by)));
    this.#apply(next, this.#keys, "nudge");
    return true;
  }

  /** Turns what is chosen about its middle, as `nudge`. */
  turn(degrees) {
    const box = this.#box(this.host.drawing());
    if (box) this.#apply(transformed(this.host.drawing(), this.#keys, turn(center(box), degrees)), this.#keys, "turn");
  }

  /** Makes what is chosen wider or higher by screen pixels, as `nudge`; the left and the top stay. */
  stretch(direction, far) {
    const box = this.#box(this.host.drawing());
    if (!box || this.#gesture) return false;
    const by = this.host.sheet.px(far);
    const how = resize(box, "se", direction.map((d) => d * by));
    this.#apply(transformed(this.host.drawing(), this.#keys, how), this.#keys, "stretch");
    return true;
  }

  // ------------------------------------------------------------------ what is shown

  #box(drawing) {
    return boxAround(drawing, this.#keys);
  }

  #handles() {
    const drawing = this.host.shown();
    const px = this.host.sheet.px(1);
    const [only] = this.#keys.length === 1 ? this.#keys : [null];
    if (!this.#keys.length || this.#edit || only?.startsWith("goals")) return {};
    if (only?.startsWith("start")) return { turn: tipOf(itemOf(drawing, only), px) };
    const box = this.#box(drawing);
    const scales = box[2] > box[0] || box[3] > box[1];
    return handles(box, px, { scales, turns: scales });
  }

  /** What is drawn over the sheet (overlay.js). */
  overlay() {
    const drawing = this.host.shown();
    const px = this.host.sheet.px(1);
    const box = this.#box(drawing);
    const isMark = (key) => /^(goals|start)/.test(key);
    const lines = this.#keys.filter((key) => !isMark(key)).map((key) => ({ points: pointsOf(drawing, key), closed: isClosed(key) }));
    const marks = this.#keys.filter(isMark).map((key) => itemOf(drawing, key).at);
    const [left, top, right, bottom] = box ? frame(box, px) : [];
    const corners = box && lines.length + marks.length > (lines.length ? 0 : 1) ? [[left, top], [right, top], [right, bottom], [left, bottom]] : null;
    return {
      lines, marks, frame: this.#edit ? null : this.#turning ?? corners, handles: this.#turning || this.#marquee ? {} : this.#handles(),
      points: this.#edit && this.#points(drawing), marquee: this.#marquee, guides: this.#guides,
    };
  }

  #points(drawing) {
    const { key, index } = this.#edit;
    const points = pointsOf(drawing, key);
    const between = points.map((p, i) => [points.at(i - 1), p]).slice(isClosed(key) ? 0 : 1)
      .filter(([a, b]) => distance(a, b) > this.host.sheet.px(ROOMY_PX)).map(([a, b]) => center([...a, ...b]));
    let last = null;
    const all = points.filter((p, i) => {
      const shown = i === index || i === points.length - 1 || last === null || distance(last, p) >= this.host.sheet.px(DENSE_PX);
      if (shown) last = p;
      return shown;
    });
    return { all, chosen: points[index], between };
  }
}
