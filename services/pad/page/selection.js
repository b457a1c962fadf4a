// The selection, and what buttons, keys and gestures (select.js) do with it. The pure functions behind it are in items.js, snap.js
// and transform.js.
//
// The host is described in tools.js.

import {
  aligned, allKeys, boxAround, copied, distributed, duplicated, grouped, hasPoints, hasText, isClosed, itemOf, movedKey, nameOf, pointsOf, sameItems,
  simplified, transformed, ungrouped, unitCount, withCopies, withGroups, withPointAt, withPointLess, withPointMore, without,
} from "./items.js";
import { rounded } from "./model.js";
import { closings } from "./snap.js";
import { center, move, resize, turn } from "./transform.js";

/** Offset of copies from their originals, screen pixels. */
const COPY_PX = 24;

export class Selection {
  #host;
  #clipboard = [];
  /** The keys of the selected items. */
  keys = [];
  /** The item being edited and its selected point: `{ key, index }`, or `null`. */
  edit = null;
  /** Whether taps add to the selection, for input without a Shift key. */
  adds = false;

  constructor(host) {
    this.#host = host;
  }

  get #drawing() {
    return this.#host.drawing();
  }

  /** The only selected item; `null` if there are none or several. */
  get only() {
    return this.keys.length === 1 ? this.keys[0] : null;
  }

  /** The bounding box of the points of the selected items. */
  get box() {
    return boxAround(this.#drawing, this.keys);
  }

  /** The state for the buttons, and a description of the selection. */
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

  // ------------------------------------------------------------------ changing the selection

  /** Selects exactly these items. */
  choose(keys) {
    const next = [...new Set(keys)];
    const same = next.length === this.keys.length && next.every((key, i) => key === this.keys[i]);
    if (same && !this.edit) return;
    this.keys = next;
    this.edit = null;
    if (!next.length) this.adds = false;
    this.changed();
  }

  /** Redraws the selection and its bar. */
  changed() {
    this.#host.over();
    this.#host.selected();
  }

  /** Follows a change of the drawing: keys that may refer to other items are dropped. */
  follow(before, after) {
    if (before.canvas !== after.canvas || !sameItems(before, after)) [this.keys, this.edit] = [[], null];
    if (this.edit && this.edit.index >= pointsOf(after, this.edit.key).length) this.edit = { ...this.edit, index: 0 };
  }

  /** Follows a change by others, with the same items selected. */
  keep(before, after) {
    const moved = (key) => movedKey(key, before, after);
    this.keys = this.keys.map(moved).filter((key) => key !== null);
    const key = this.edit && moved(this.edit.key);
    this.edit = key ? { key, index: Math.min(this.edit.index, pointsOf(after, key).length - 1) } : null;
    this.changed();
  }

  selectAll() {
    this.choose(allKeys(this.#drawing));
  }

  toggleAdding() {
    this.adds = !this.adds;
    this.changed();
  }

  /** Selects the next item, or the next point of the item being edited; with `by` -1, the previous one. */
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

  /** Starts or ends editing the points of the only item, or asks for a new text if it is one. */
  editPoints() {
    if (this.edit) this.edit = null;
    else if (this.only && hasPoints(this.only)) this.edit = { key: this.only, index: 0 };
    else if (hasText(this.only)) this.label();
    this.changed();
  }

  // ------------------------------------------------------------------ actions

  /**
   * Applies a step of the history, with `keys` selected and the points of `edit` edited afterwards. Consecutive steps by the same
   * keyboard action `how` are merged.
   */
  apply(next, keys = this.keys, { how = null, edit = this.edit } = {}) {
    this.#host.change(next, how && `${how} ${keys} ${edit?.index}`);
    [this.keys, this.edit] = [keys, edit];
    this.changed();
  }

  /** Deletes the selected point, or else all selected items. */
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

  /** Adds a point halfway between the selected one and the next. */
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

  /** Inserts another drawing at a scale, centred at `at`. */
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

  /** Aligns the items at one of `SIDES`. */
  align(side) {
    if (this.state.units > 1) this.apply(aligned(this.#drawing, this.keys, side));
  }

  /** Equalizes the gaps along an axis. */
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

  /** Asks for an obstacle's label, or for a new text. */
  label() {
    if (this.state.label) this.#host.label(this.only);
  }

  /** Moves the selection, or the selected point, by screen pixels; returns whether there was anything to move. */
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

  /** Turns the selection about its centre. */
  turn(degrees) {
    if (this.box) this.apply(transformed(this.#drawing, this.keys, turn(center(this.box), degrees)), this.keys, { how: "turn" });
  }

  /**
   * Widens or heightens the selection by screen pixels, with its left and top fixed; returns whether there was anything to change.
   */
  stretch(direction, far) {
    if (!this.box) return false;
    const how = resize(this.box, "se", direction.map((d) => d * this.#host.sheet.px(far)));
    this.apply(transformed(this.#drawing, this.keys, how), this.keys, { how: "stretch" });
    return true;
  }
}
