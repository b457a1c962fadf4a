// The select tool: a tap or a marquee selects, a drag moves, handles scale and turn, a double tap edits points. The selection and
// its actions are in selection.js, the drawing of it in overlay.js.
//
// The host is described in tools.js.

import { distance } from "./geometry.js";
import {
  boxAround, duplicated, isClosed, isMark, itemAt, itemOf, keysWithin, placeAt, pointAt, pointsOf, tipOf, transformed, withGroups,
  withPointAt, withPointMore,
} from "./items.js";
import { rounded } from "./model.js";
import { Selection } from "./selection.js";
import { SNAP_PX, snappedEnd, snappedMove, snappedPoint, targets } from "./snap.js";
import { center, frame, handleAt, handles, move, resize, turn, turned, upright } from "./transform.js";

/** How close a mouse or pen, and a finger, must come to an item, and how far each may move during a tap; screen pixels. */
const [REACH_PX, FINGER_PX] = [10, 22];
const [STILL_PX, FINGER_STILL_PX] = [4, 8];
/** A second tap this soon and this close is a double tap. */
const [TWICE_MS, TWICE_PX] = [500, 12];
/**
 * Points closer than this are thinned out, and segments of at least the second length show where a point can be added; screen
 * pixels.
 */
const [DENSE_PX, ROOMY_PX] = [12, 48];

const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];
const holds = ([left, top, right, bottom], [x, y]) => x >= left && x <= right && y >= top && y <= bottom;
const cornersOf = ([left, top, right, bottom]) => [[left, top], [right, top], [right, bottom], [left, bottom]];

export class Select {
  /** The gesture in progress: `{ drag(sample), tap(sample) }`, or `null`. */
  #gesture = null;
  #guides = [];
  #marquee = null;
  /** The corners of the frame while it is being turned. */
  #turning = null;
  #lastTap = null;

  constructor(host) {
    this.host = host;
    this.selection = new Selection(host);
  }

  // ------------------------------------------------------------------ gestures

  begin(sample) {
    const { selection } = this;
    this.before = this.host.drawing();
    this.had = selection.keys;
    this.next = this.before;
    [this.from, this.last, this.dragged] = [sample.at, sample, false];
    this.still = this.#px(sample.touch ? FINGER_STILL_PX : STILL_PX);
    const reach = this.#px(sample.touch ? FINGER_PX : REACH_PX);
    this.#gesture = this.#pointGesture(sample, reach) ?? this.#handleGesture(sample, reach) ?? this.#itemGesture(sample, reach);
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
    this.#drop();
    if (!gesture) return;
    if (!this.dragged) gesture.tap(this.last);
    else if (this.next !== this.before) this.selection.apply(this.next);
    this.selection.changed();
  }

  cancel() {
    if (!this.#gesture) return;
    this.#drop();
    this.selection.keys = this.had;
    this.host.preview(this.before);
    this.selection.changed();
  }

  /** Cancels one thing: the gesture, editing points, or the selection. */
  escape() {
    if (this.#gesture) this.cancel();
    else if (this.selection.edit) this.selection.editPoints();
    else this.selection.choose([]);
  }

  /** The Enter key. */
  close() {
    this.selection.editPoints();
  }

  /** Another tool was selected. */
  leave() {
    this.selection.choose([]);
  }

  /** What is under the mouse, for its cursor. */
  over({ at }) {
    const reach = this.#px(REACH_PX);
    const drawing = this.host.drawing();
    const { box } = this.selection;
    const handle = handleAt(this.#handles(drawing), at, reach, box, this.#px(1));
    if (handle) return handle;
    return (box && holds(frame(box, this.#px(1)), at)) || itemAt(drawing, at, reach, this.#px(1)) !== null ? "item" : "";
  }

  #px(n) {
    return this.host.sheet.px(n);
  }

  #drop() {
    this.#gesture = this.#marquee = this.#turning = null;
    this.#guides = [];
  }

  #preview(next) {
    this.next = next;
    this.host.preview(next);
  }

  #snaps({ ctrl }) {
    return this.host.settings().snap && !ctrl;
  }

  /** A wall of two points, if nothing else is selected: its ends can be dragged immediately. */
  #straight(drawing) {
    const { only, edit } = this.selection;
    return !edit && only?.startsWith("strokes") && pointsOf(drawing, only).length === 2 ? only : null;
  }

  /** Drags a point of the item being edited, or adds one on its line; or drags an end of a straight wall. */
  #pointGesture({ at }, reach) {
    const { selection } = this;
    const key = selection.edit?.key ?? this.#straight(this.before);
    if (!key) return null;
    // The middle of a wall stays free, even if the wall is short.
    const [a, b] = pointsOf(this.before, key);
    const near = selection.edit ? reach : Math.min(reach, distance(a, b) / 3);
    let [start, index] = [this.before, pointAt(this.before, key, at, near)];
    if (index < 0) {
      index = selection.edit ? placeAt(this.before, key, at, reach) : -1;
      if (index < 0) {
        selection.edit = null;
        return null;
      }
      start = withPointMore(this.before, key, index, at);
      this.#preview(start);
    }
    if (selection.edit) selection.edit = { key, index };
    const around = targets(this.before, { except: [key] });
    return {
      drag: (sample) => {
        const to = this.#snapped(sample, pointsOf(start, key), index, around);
        this.#preview(withPointAt(start, key, index, to));
      },
      tap: () => start !== this.before && selection.apply(start),
    };
  }

  /** Snaps a point to ends and walls; in a straight wall, and with Shift, also to directions from the previous point. */
  #snapped(sample, points, index, around) {
    this.#guides = [];
    if (!sample.shift && !this.#snaps(sample)) return sample.at;
    const from = points[index === 0 ? 1 : index - 1];
    const directed = from && (sample.shift || points.length === 2);
    const reach = this.#px(SNAP_PX);
    const end = () => snappedEnd(from, sample.at, around, reach, sample.shift);
    const { at, guides } = directed ? end() : snappedPoint(sample.at, around, reach);
    this.#guides = guides;
    return at;
  }

  #handleGesture({ at }, reach) {
    const { box, keys } = this.selection;
    const name = handleAt(this.#handles(this.before), at, reach, box, this.#px(1));
    if (name === null) return null;
    if (name === "turn") return this.#turnGesture(box);
    const drag = (sample) => {
      const how = resize(box, name, minus(sample.at, this.from), { even: sample.shift, middle: sample.alt });
      this.#preview(transformed(this.before, keys, how));
    };
    return { drag, tap: () => {} };
  }

  #turnGesture(box) {
    const middle = center(box);
    const corners = cornersOf(frame(box, this.#px(1)));
    const drag = (sample) => {
      const how = turn(middle, turned(middle, this.from, sample.at, sample.shift));
      this.#turning = corners.map(how.map);
      this.#preview(transformed(this.before, this.selection.keys, how));
    };
    return { drag, tap: () => {} };
  }

  #itemGesture(sample, reach) {
    const { selection, before } = this;
    const hit = itemAt(before, sample.at, reach, this.#px(1));
    const more = sample.shift || selection.adds;
    const within = selection.box && holds(frame(selection.box, this.#px(1)), sample.at);
    if (hit === null && !within) return this.#marqueeGesture(more);
    const had = hit === null || selection.keys.includes(hit);
    if (!had) selection.choose([...more ? selection.keys : [], ...withGroups(before, [hit])]);
    return { drag: this.#moves(), tap: (last) => this.#tapped(last, hit, had, more) };
  }

  #tapped({ at, time }, hit, had, more) {
    const { selection, before } = this;
    const twice = this.#lastTap && time - this.#lastTap.time < TWICE_MS && distance(at, this.#lastTap.at) < this.#px(TWICE_PX);
    this.#lastTap = { at, time };
    if (hit === null) selection.choose([]);
    else if (more && had) selection.choose(selection.keys.filter((key) => !withGroups(before, [hit]).includes(key)));
    else if (more) return;
    else if (!twice) selection.choose(withGroups(before, [hit]));
    else if (selection.only) selection.editPoints();
    else selection.choose([hit]);
  }

  /** Moves the selection, or copies of it with Alt. */
  #moves() {
    let plan = null;
    return (sample) => {
      plan ??= this.#plan(sample.alt);
      let by = rounded(minus(sample.at, this.from));
      this.#guides = [];
      if (sample.shift) by = upright(by);
      else if (this.#snaps(sample)) ({ by, guides: this.#guides } = snappedMove(plan.moving, by, plan.around, this.#px(SNAP_PX)));
      this.#preview(transformed(plan.drawing, plan.keys, move(by)));
    };
  }

  #plan(copies) {
    const { selection, before } = this;
    const { keys } = selection;
    const plan = copies && selection.state.copies ? duplicated(before, keys, [0, 0]) : { drawing: before, keys };
    selection.keys = plan.keys;
    const moving = targets(plan.drawing, { only: plan.keys });
    return { ...plan, moving, around: targets(plan.drawing, { except: plan.keys }) };
  }

  #marqueeGesture(more) {
    const { selection, before } = this;
    const had = more ? selection.keys : [];
    const drag = ({ at }) => {
      const [xs, ys] = [0, 1].map((i) => [this.from[i], at[i]].sort((a, b) => a - b));
      this.#marquee = [xs[0], ys[0], xs[1], ys[1]];
      selection.choose([...had, ...withGroups(before, keysWithin(before, this.#marquee))]);
    };
    return { drag, tap: () => selection.choose(had) };
  }

  // ------------------------------------------------------------------ what is shown

  #handles(drawing) {
    const { keys, only, edit } = this.selection;
    if (!keys.length || edit || this.#straight(drawing)) return {};
    if (isMark(only) && !only.startsWith("start")) return {};
    if (only?.startsWith("start")) return { turn: tipOf(itemOf(drawing, only), this.#px(1)) };
    const box = boxAround(drawing, keys);
    const isWide = box[2] > box[0] || box[3] > box[1];
    return handles(box, this.#px(1), { scales: isWide, turns: isWide });
  }

  /** The overlay for overlay.js. */
  overlay() {
    const drawing = this.host.shown();
    const { keys } = this.selection;
    const lines = keys.filter((key) => !isMark(key)).map((key) => ({ points: pointsOf(drawing, key), closed: isClosed(key) }));
    const marks = keys.filter(isMark).map((key) => itemOf(drawing, key).at);
    return {
      lines, marks, frame: this.#frame(drawing), handles: this.#turning || this.#marquee ? {} : this.#handles(drawing),
      points: this.#points(drawing), marquee: this.#marquee, guides: this.#guides,
    };
  }

  /** The corners of the frame; `null` if rings and points show the selection. */
  #frame(drawing) {
    const { keys, only, edit } = this.selection;
    if (this.#turning) return this.#turning;
    if (!keys.length || edit || isMark(only) || this.#straight(drawing)) return null;
    return cornersOf(frame(boxAround(drawing, keys), this.#px(1)));
  }

  #points(drawing) {
    const { edit } = this.selection;
    const key = edit?.key ?? this.#straight(drawing);
    if (!key || this.#marquee) return null;
    const points = pointsOf(drawing, key);
    let last = null;
    const all = points.filter((p, i) => {
      const shown = i === edit?.index || i === points.length - 1 || last === null || distance(last, p) >= this.#px(DENSE_PX);
      if (shown) last = p;
      return shown;
    });
    const pairs = points.map((p, i) => [points.at(i - 1), p]).slice(isClosed(key) ? 0 : 1);
    const between = edit ? pairs.filter(([a, b]) => distance(a, b) > this.#px(ROOMY_PX)).map(([a, b]) => center([...a, ...b])) : [];
    return { all, chosen: edit && points[edit.index], between };
  }
}
