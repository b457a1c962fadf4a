// A drawing that several pages change at once, as a set of items with ids. Pure: it knows no link and no sheet.
//
// A change replaces one item as a whole, or removes it, and carries the time and a random name of its page. Of two versions of an
// item, the later one stays, and if both are equally late, that of the greater name. So pages agree in whichever order they hear of
// changes, and a page that was cut off only needs to send what it has changed. Removed items leave an entry, so that they stay
// removed. The server checks each change by the same rule (together.rs).
//
// The drawing itself (model.js) has no ids: an item is the same value until it is changed, so this module remembers the id of each
// value, and gives a changed item the id of the one that it takes the place of.

import { blank } from "./model.js";
import { newId } from "./shelf.js";

/** Kinds of which a drawing has a list, and those of which it has at most one, which are their own ids. */
const LISTS = ["strokes", "obstacles", "labels", "goals"];
const ONES = ["route", "start", "photo", "underlay"];

/** The ids of items. */
const ids = new WeakMap();

/** The id of an item in a list; `undefined` if it has none. */
export const idOf = (item) => ids.get(item);

/** Whether version `a` stays when both are known. */
const isLater = (a, b) => a.time > b.time || (a.time === b.time && a.by > b.by);

const sameList = (a, b) => a.length === b.length && a.every((item, i) => item === b[i]);

/**
 * Which items of the list `had` those of `has` take the place of: a map from each item that is only in `has`, to the old one or
 * `null`. An item with an id takes the place of the one with the same id, any other that of the next item that is gone from there.
 */
function replacements(had, has) {
  const place = new Map(had.map((item, i) => [item, i]));
  const remain = new Set(has);
  const gone = new Map(had.filter((item) => !remain.has(item) && ids.has(item)).map((item) => [ids.get(item), item]));
  const [taken, found] = [new Set(), new Map()];
  let next = 0;
  for (const item of has) {
    let old = null;
    if (place.has(item)) old = item;
    else if (ids.has(item)) old = gone.get(ids.get(item)) ?? null;
    else if (next < had.length && !remain.has(had[next])) old = had[next];
    if (taken.has(old)) old = null;
    if (old !== null) next = place.get(old) + 1;
    taken.add(old);
    if (old !== item) found.set(item, old);
  }
  return found;
}

/**
 * The drawing `now` after the step from `from` to `to`, where others may have changed `now` since `from`. What they have removed
 * stays removed. What they have changed is replaced, or left alone if the step `yields`, as when it is undone.
 */
export function replayed(now, from, to, yields = false) {
  if (now === from || now.id !== from.id || from.id !== to.id) return to;
  const next = { ...now };
  for (const kind of ONES) {
    if (from[kind] !== to[kind] && (now[kind] === from[kind] || !yields)) next[kind] = to[kind];
  }
  for (const kind of LISTS) {
    if (from[kind] === to[kind]) continue;
    const isSame = (item, old) => item === old || (!yields && ids.has(old) && ids.get(item) === ids.get(old));
    const place = (old) => next[kind].findIndex((item) => isSame(item, old));
    const found = replacements(from[kind], to[kind]);
    const [replaced, remain] = [new Set(found.values()), new Set(to[kind])];
    for (const old of from[kind]) {
      const at = remain.has(old) || replaced.has(old) ? -1 : place(old);
      if (at >= 0) next[kind] = next[kind].toSpliced(at, 1);
    }
    for (const [item, old] of found) {
      if (old === null && !next[kind].some((other) => ids.has(other) && ids.get(other) === ids.get(item))) next[kind] = [...next[kind], item];
      const at = old === null ? -1 : place(old);
      if (at < 0) continue;
      if (ids.has(old)) ids.set(item, ids.get(old));
      next[kind] = next[kind].with(at, item);
    }
  }
  return next;
}

/** Fills in the places of new items: between those of their neighbours. */
function place(entries) {
  for (let i = 0; i < entries.length; i += 1) {
    if (entries[i].order !== undefined) continue;
    let end = i;
    while (end < entries.length && entries[end].order === undefined) end += 1;
    const after = entries[end]?.order;
    const before = entries[i - 1]?.order ?? (after === undefined ? 0 : after - (end - i) - 1);
    const step = after === undefined ? 1 : (after - before) / (end - i + 1);
    for (let n = 0; i < end; i += 1) entries[i].order = before + step * (n += 1);
  }
}

/** The items of a drawing, as one page knows them. */
export class Shared {
  /** By id: `{ id, kind, time, by, order, item }`; the item of a removed one is `null`. */
  #entries = new Map();
  #by;
  #time = 0;

  /** `by`: a random name of this page. */
  constructor({ id, canvas }, by) {
    [this.sheet, this.#by] = [{ id, canvas }, by];
  }

  /** The drawing of a file, with what `kept` returned for it. */
  static restored(drawing, kept, by) {
    const shared = new Shared(drawing, by);
    for (const kind of LISTS) {
      kept[kind]?.forEach((known, i) => {
        const item = drawing[kind][i];
        if (!known || !item) return;
        const [id, time, of, order, group] = known;
        // A file numbers its groups anew, but the version with this time has this one.
        if (group) item.group = group;
        ids.set(item, id);
        shared.take({ id, kind, time, by: of, order, item });
      });
    }
    for (const [id, time, of] of kept.ones ?? []) shared.take({ id, kind: id, time, by: of, order: 0, item: drawing[id] ?? null });
    for (const [id, time, of] of kept.removed ?? []) shared.take({ id, kind: null, time, by: of, order: 0, item: null });
    // What the file has beside that is new.
    shared.follow(drawing);
    return shared;
  }

  /** The versions of a drawing's items, to be kept beside it in a file. */
  kept(drawing) {
    const lists = LISTS.map((kind) => [kind, drawing[kind].map((item) => {
      const entry = this.#entries.get(ids.get(item));
      return entry?.item === item ? [entry.id, entry.time, entry.by, entry.order, item.group] : null;
    })]);
    const short = ({ id, time, by }) => [id, time, by];
    const all = this.all();
    const ones = all.filter(({ id, item }) => ONES.includes(id) && item === drawing[id]).map(short);
    return { ...Object.fromEntries(lists), ones, removed: all.filter(({ id, item }) => !ONES.includes(id) && item === null).map(short) };
  }

  all() {
    return [...this.#entries.values()];
  }

  get(id) {
    return this.#entries.get(id);
  }

  /** Takes over a version unless a later one is known; returns whether it did. */
  take(entry) {
    const known = this.#entries.get(entry.id);
    if (known && !isLater(entry, known)) return false;
    this.#time = Math.max(this.#time, entry.time);
    if (entry.item && LISTS.includes(entry.kind)) ids.set(entry.item, entry.id);
    this.#entries.set(entry.id, { ...entry, kind: entry.kind ?? known?.kind ?? null });
    return true;
  }

  /** The entries of a list, in order. */
  #list(kind) {
    const list = this.all().filter((entry) => entry.kind === kind && entry.item !== null);
    return list.sort((a, b) => a.order - b.order || (a.id < b.id ? -1 : 1));
  }

  /** Takes over this page's changes: `drawing` is what `drawing()` returned, changed. Returns the ids of what has changed. */
  follow(drawing, now = Date.now()) {
    const time = Math.max(now, this.#time + 1);
    const changes = [];
    const change = (entry, item) => changes.push({ ...entry, time, by: this.#by, item });
    for (const kind of ONES) {
      const known = this.#entries.get(kind) ?? { id: kind, kind, order: 0, item: null };
      // An entry that came as removed does not say what it was.
      if (known.item !== drawing[kind]) change({ ...known, kind }, drawing[kind]);
    }
    for (const kind of LISTS) this.#followList(kind, drawing[kind], change);
    changes.forEach((entry) => this.take(entry));
    return changes.map(({ id }) => id);
  }

  #followList(kind, items, change) {
    const had = this.#list(kind);
    if (sameList(had.map(({ item }) => item), items)) return;
    const found = replacements(had.map(({ item }) => item), items);
    const byItem = new Map(had.map((entry) => [entry.item, entry]));
    const used = new Set();
    const entries = items.map((item) => {
      const old = found.has(item) ? found.get(item) : item;
      const known = byItem.get(old) ?? this.#entries.get(ids.get(item));
      const entry = known && !used.has(known.id) ? { ...known, kind } : { id: newId().slice(0, 12), kind, order: undefined };
      used.add(entry.id);
      return { ...entry, fresh: item };
    });
    place(entries);
    for (const { fresh, ...entry } of entries) if (entry.item !== fresh) change(entry, fresh);
    for (const entry of had) if (!used.has(entry.id)) change(entry, null);
  }

  /** The drawing. Parts that are the same in `before` are the same values. Of a route and goals, the later stay. */
  drawing(before = null) {
    const { id, canvas } = this.sheet;
    const next = { ...blank(before && before.canvas.join() === canvas.join() ? before.canvas : canvas), id };
    for (const kind of ONES) next[kind] = this.#entries.get(kind)?.item ?? null;
    for (const kind of LISTS) {
      const entries = this.#list(kind);
      const items = entries.map(({ item }) => item);
      next[kind] = before && sameList(before[kind], items) ? before[kind] : items;
      if (kind !== "goals" || !next.route || !entries.length) continue;
      const isRoute = entries.every((goal) => isLater(this.#entries.get("route"), goal));
      if (isRoute) next.goals = before && !before.goals.length ? before.goals : [];
      else next.route = null;
    }
    return next;
  }
}

/** An entry in the format of the server, and back. */
export const wired = ({ id, kind, time, by, order, item }) => ({ id, time, by, order, shape: item === null ? null : { [kind]: item } });
export function unwired({ id, time, by, order, shape }) {
  const [kind, item] = shape ? Object.entries(shape)[0] : [null, null];
  return { id, kind, time, by, order, item };
}
