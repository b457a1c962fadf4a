// What is selected, and what is done with it by buttons, by keys, and by the hand (select.js). The pure functions that do it to
// a drawing are in items.js, snap.js and transform.js.
//
// The host is that of tools.js.

import {
  aligned, allKeys, boxAround, copied, distributed, duplicated, grouped, hasPoints, hasText, isClosed, itemOf, nameOf, pointsOf, sameItems,
  simplified, transformed, ungrouped, unitCount, withCopies, withGroups, withPointAt, withPointLess, withPointMore, without,
} from "./items.js";
import { rounded } from "./model.js";
import { closings } from "./snap.js";
import { center, move, resize, turn } from "./transform.js";

/** How far copies lie from what they are copies of, screen pixels. */
const COPY_PX = 24;

export class Selection {
  #host;
  #clipboard = [];
  /** The keys of what is selected. */
  keys = [];
  /** The item whose points are edited and the point that is chosen: `{ key, index }`, or `null`. */
  edit = null;
  /** Whether taps add, for a hand without a Shift key. */
  adds = false;

  constructor(host) {
    this.#host = host;
  }

  get #drawing() {
    return this.#host.drawing();
  }

  /** The only item that is selected, `null` if there are none or more. */
  get only() {
    return this.keys.length === 1 ? this.keys[0] : null;
  }

  /** The box around the points of what is selected. */
  get box() {
    return boxAround(this.#drawing, this.keys);
  }

  /** What can be done with it, for the buttons, and what it is, in words. */
  get state() {
    const { keys, only } = this;
    const drawing = this.#drawing;
    return {
      count: keys.length, editing: this.edit !== null, adds: this.adds, units: unitCount(drawing, keys),
      points: only !== null && hasPoints(only), label: hasText(only),
      strokes: keys.some((key) => key.startsWith("strokes")), copies: keys.some((key) => !/^(route|start)/.test(key)),
      grouped: keys.some((key) => itemOf(drawing, key)?.group), words: this.#words(drawing),
    };
  }

  #words(drawing) {
    if (this.edit) return `Point ${this.edit.index + 1} of ${pointsOf(drawing, this.edit.key).length}`;
    if (this.only) return `${nameOf(drawing, this.only)} selected`;
    return this.keys.length ? `${this.keys.length} selected` : "";
  }

  // ------------------------------------------------------------------ what is selected

  /** Selects these and nothing else. */
  choose(keys) {
    const next = [...new Set(keys)];
    const same = next.length === this.keys.length && next.every((key, i) => key === this.keys[i]);
    if (same && !this.edit) return;
    this.keys = next;
    this.edit = null;
    if (!next.length) this.adds = false;
    this.changed();
  }

  /** Shows what is selected now. */
  changed() {
    this.#host.over();
    this.#host.selected();
  }

  /** The drawing becomes another: keys that may mean something else in it are forgotten. */
  follow(before, after) {
    if (before.canvas !== after.canvas || !sameItems(before, after)) [this.keys, this.edit] = [[], null];
    if (this.edit && this.edit.index >= pointsOf(after, this.edit.key).length) this.edit = { ...this.edit, index: 0 };
  }

  selectAll() {
    this.choose(allKeys(this.#drawing));
  }

  toggleAdding() {
    this.adds = !this.adds;
    this.changed();
  }

  /** The next item, or the next point of the one whose points are edited; `by` is -1 for the one before. */
  step(by) {
    const drawing = this.#drawing;
    if (this.edit) {
      const count = pointsOf(drawing, this.edit.key).length;
      this.edit = { ...this.edit, index: (this.edit.index + by + count) % count };
      this.changed();
      return;
    }
    const all = allKeys(drawing);
    const last = this.keys.at(by > 0 ? -1 : 0);
    const at = last ? all.indexOf(last) + by : (by > 0 ? 0 : -1);
    if (all.length) this.choose(withGroups(drawing, [all.at(at % all.length)]));
  }

  /** Begins or ends editing the points of the only item; asks for another text if it is one. */
  editPoints() {
    if (this.edit) this.edit = null;
    else if (this.only && hasPoints(this.only)) this.edit = { key: this.only, index: 0 };
    else if (hasText(this.only)) this.label();
    this.changed();
  }

  // ------------------------------------------------------------------ what is done with it

  /**
   * A step of the history, after which `keys` are selected and the points of `edit` edited. Steps in a row by the same keys of the
   * keyboard, `how`, are one.
   */
  apply(next, keys = this.keys, { how = null, edit = this.edit } = {}) {
    this.#host.change(next, how && `${how} ${keys} ${edit?.index}`);
    [this.keys, this.edit] = [keys, edit];
    this.changed();
  }

  /** Deletes the point that is chosen, or else everything that is selected. */
  remove() {
    if (!this.edit) {
      if (this.keys.length) this.apply(without(this.#drawing, this.keys), []);
      return;
    }
    const { key, index } = this.edit;
    const next = withPointLess(this.#drawing, key, index);
    const remains = sameItems(this.#drawing, next);
    this.apply(next, remains ? this.keys : [], { edit: remains ? { key, index: Math.max(0, index - 1) } : null });
  }

  /** Adds a point halfway from the one that is chosen to the next. */
  insert() {
    if (!this.edit) return;
    const { key, index } = this.edit;
    const points = pointsOf(this.#drawing, key);
    const before = index === points.length - 1 && !isClosed(key) ? index : index + 1;
    const at = center([...points.at(before - 1), ...points[before % points.length]]);
    this.apply(withPointMore(this.#drawing, key, before, at), this.keys, { edit: { key, index: before } });
  }

  duplicate() {
    this.#copies(duplicated(this.#drawing, this.keys, this.#aside));
  }

  copy() {
    if (this.keys.length) this.#clipboard = copied(this.#drawing, this.keys);
  }

  cut() {
    this.copy();
    this.edit = null;
    this.remove();
  }

  paste() {
    this.#copies(withCopies(this.#drawing, this.#clipboard, this.#aside));
  }

  /** Puts another drawing on this one, at a scale, with its middle at `at`. */
  takeIn(drawing, at, scale) {
    const keys = allKeys(drawing);
    const scaled = transformed(drawing, keys, { map: (p) => p.map((v) => v * scale), turn_deg: 0 });
    const box = boxAround(scaled, keys);
    this.#copies(withCopies(this.#drawing, copied(scaled, keys), [0, 1].map((i) => at[i] - (box[i] + box[i + 2]) / 2)));
  }

  get #aside() {
    const by = this.#host.sheet.px(COPY_PX);
    return [by, by];
  }

  #copies({ drawing, keys }) {
    if (keys.length) this.apply(drawing, keys, { edit: null });
    else if (this.keys.length) this.#host.say("A drawing has one path and one start.");
  }

  group() {
    if (this.state.units > 1) this.apply(grouped(this.#drawing, this.keys));
  }

  ungroup() {
    if (this.state.grouped) this.apply(ungrouped(this.#drawing, this.keys));
  }

  /** Aligns it at one of `SIDES`. */
  align(side) {
    if (this.state.units > 1) this.apply(aligned(this.#drawing, this.keys, side));
  }

  /** Makes its gaps equal along an axis. */
  distribute(axis) {
    if (this.state.units > 2) this.apply(distributed(this.#drawing, this.keys, axis));
  }

  simplify() {
    this.apply(simplified(this.#drawing, this.keys), this.keys, { edit: this.edit && { ...this.edit, index: 0 } });
  }

  closeGaps() {
    const moved = closings(this.#drawing, this.keys);
    if (!moved.length) {
      this.#host.say("No end of these walls is near another.");
      return;
    }
    this.apply(moved.reduce((next, { key, index, at }) => withPointAt(next, key, index, at), this.#drawing));
    this.#host.say(moved.length === 1 ? "One end was moved." : `${moved.length} ends were moved.`);
  }

  /** Asks for the name of an obstacle, or for another text. */
  label() {
    if (this.state.label) this.#host.label(this.only);
  }

  /** Moves it, or the point that is chosen, by screen pixels; answers whether there was anything to move. */
  nudge(direction, far) {
    if (!this.keys.length) return false;
    const by = direction.map((d) => d * this.#host.sheet.px(far));
    const drawing = this.#drawing;
    if (this.edit) {
      const { key, index } = this.edit;
      const [x, y] = pointsOf(drawing, key)[index];
      this.apply(withPointAt(drawing, key, index, [x + by[0], y + by[1]]), this.keys, { how: "nudge" });
    } else this.apply(transformed(drawing, this.keys, move(rounded(by))), this.keys, { how: "nudge" });
    return true;
  }

  /** Turns it about its middle. */
  turn(degrees) {
    if (this.box) this.apply(transformed(this.#drawing, this.keys, turn(center(this.box), degrees)), this.keys, { how: "turn" });
  }

  /** Makes it wider or higher by screen pixels, while its left and its top stay; answers whether there was anything. */
  stretch(direction, far) {
    if (!this.box) return false;
    const how = resize(this.box, "se", direction.map((d) => d * this.#host.sheet.px(far)));
    this.apply(transformed(this.#drawing, this.keys, how), this.keys, { how: "stretch" });
    return true;
  }
}
