// Keeps what is on the sheet without being asked: in the library (shelf.js), and for this page over a reload.
//
// A drawing carries the `id` of its entry in the library. Steps of undo lead back to drawings with their own ids, so each is kept in
// its own place.

import { fromText, isBlank, sketchBody, toText } from "./model.js";
import { newId } from "./shelf.js";

/** A change is kept within this time, milliseconds. */
const KEEP_MS = 400;
/** What this page keeps over a reload: the text of the drawing, and `{ id, stamp, name, saved }` of its entry. */
const OF_PAGE = ["draft", "kept"];
/** What a page that was closed left to the next one: an entry as `Shelf.save` takes it, by its id. */
const LEFT = "left:";
/** The id of the entry that was on a sheet last, of any page. */
const SHEET = "sheet";
/** Of a drawing that is not known. */
const UNKNOWN = { drawing: null, stamp: null, name: null };

/** A drawing as a new one, of which nothing is in the library. */
export const begun = (drawing) => ({ ...drawing, id: newId() });

export class Keeper {
  #shelf;
  #host;
  #timer = 0;
  #last = null;
  #ofPage = null;
  #saving = Promise.resolve();
  #failed = false;
  #resumed = false;
  /** By the id that a drawing carries: `{ drawing, id, stamp, name }`, what was kept last, and as which entry. */
  #kept = new Map();

  /** The host has `keeps()` (whether what is drawn here belongs in the library), `say(words, bad)`, `named(name)`. */
  constructor(shelf, host) {
    [this.#shelf, this.#host] = [shelf, host];
    // A page that is hidden may never come back.
    document.addEventListener("visibilitychange", () => document.hidden && this.#leave());
    window.addEventListener("pagehide", () => this.#leave());
  }

  #of(drawing) {
    return this.#kept.get(drawing.id) ?? { ...UNKNOWN, id: drawing.id };
  }

  /** The drawing that was on this page before it was loaded again; `null` if there is none. */
  reloaded() {
    try {
      const { id, stamp, name, saved } = JSON.parse(sessionStorage.getItem("kept"));
      const drawing = { ...fromText(sessionStorage.getItem("draft")), id };
      this.#kept.set(id, { drawing: saved ? drawing : null, id, stamp, name });
      return drawing;
    } catch {
      return null;
    }
  }

  /** The drawing that was on a sheet last; `null` if there is none, or something is on this one already. Once. */
  async resumed(drawing) {
    if (this.#resumed) return null;
    this.#resumed = true;
    try {
      await this.#rescue();
      const latest = isBlank(drawing) && await this.#latest();
      return latest ? this.#opened(latest) : null;
    } catch {
      // What is drawn next says why.
      return null;
    }
  }

  /** Takes in what pages left that were closed before it was in the library. */
  async #rescue() {
    for (const key of Object.keys(localStorage).filter((name) => name.startsWith(LEFT))) {
      const left = JSON.parse(localStorage.getItem(key));
      if (left) await this.#shelf.save(left, true);
      localStorage.removeItem(key);
    }
  }

  /** The entry that was on a sheet last, or was changed last. */
  async #latest() {
    const entries = (await this.#shelf.list()).filter(({ gone }) => !gone);
    const latest = entries.find(({ id }) => id === localStorage.getItem(SHEET)) ?? entries[0];
    return latest ? this.#shelf.open(latest.id) : null;
  }

  /** A drawing of the library. Throws an `Error` if it cannot be read. */
  async open(id) {
    return this.#opened(await this.#shelf.open(id));
  }

  #opened(entry) {
    if (!entry || entry.gone) throw new Error("This drawing is not in the library: another page has deleted it.");
    const drawing = { ...fromText(entry.text), id: entry.id };
    this.#kept.set(entry.id, { drawing, id: entry.id, stamp: entry.changed, name: entry.name });
    return drawing;
  }

  /** A drawing that the robot has: kept when it is changed, or as the latest of the library if that is the same map. */
  async taken(drawing) {
    const latest = await this.#latest().catch(() => null);
    if (latest && sketchBody(fromText(latest.text)) === sketchBody(drawing)) return this.#opened(latest);
    const fresh = begun(drawing);
    this.#kept.set(fresh.id, { ...UNKNOWN, drawing: fresh, id: fresh.id });
    return fresh;
  }

  /** A drawing from a file: a new one with the file's name. */
  imported(drawing, name) {
    const fresh = begun(drawing);
    this.#kept.set(fresh.id, { ...UNKNOWN, id: fresh.id, name });
    return fresh;
  }

  /** The id of a drawing's entry in the library. */
  entryOf(drawing) {
    return this.#of(drawing).id;
  }

  /** What a drawing is called; `drawing` before it is kept. */
  nameOf(drawing) {
    return this.#of(drawing).name ?? "drawing";
  }

  /** An entry has another name, or was changed here: the drawings that were kept as it follow. */
  follow({ id, name, changed }) {
    for (const kept of this.#kept.values()) if (kept.id === id) Object.assign(kept, { name, stamp: changed });
    if (this.#last) this.#host.named(this.#of(this.#last).name);
  }

  /** Nothing of the drawing is left to this page when it is loaded again. */
  forget() {
    clearTimeout(this.#timer);
    this.#last = null;
    OF_PAGE.forEach((key) => sessionStorage.removeItem(key));
  }

  /** The sheet shows this now. It is kept soon; another drawing, and the one that it takes the place of, at once. */
  changed(drawing) {
    const isOther = this.#last?.id !== drawing.id;
    if (isOther) this.keep();
    this.#last = drawing;
    if (isOther) this.keep();
    else this.#timer ||= setTimeout(() => this.keep(), KEEP_MS);
    this.#host.named(this.#of(drawing).name);
  }

  /** Keeps what is on the sheet. */
  keep() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    const drawing = this.#last;
    const { drawing: known } = drawing ? this.#of(drawing) : UNKNOWN;
    if (!drawing || (known === drawing && this.#ofPage === drawing)) return this.#saving;
    const text = toText(drawing);
    this.#keepForPage(drawing, text);
    if (known !== drawing) {
      this.#saving = this.#saving.then(() => this.#save(drawing, text)).catch((error) => this.#trouble(error));
    }
    return this.#saving;
  }

  /** Whether a drawing belongs in the library and is not there as it is. */
  #isDue(drawing) {
    const { drawing: known, stamp } = this.#of(drawing);
    return known !== drawing && this.#host.keeps() && !(stamp === null && isBlank(drawing));
  }

  async #save(drawing, text) {
    if (!this.#isDue(drawing)) return;
    const { id, stamp, name } = this.#of(drawing);
    const entry = await this.#shelf.save({ id, stamp, text, name });
    this.#kept.set(drawing.id, { drawing, id: entry.id, stamp: entry.changed, name: entry.name });
    this.follow(entry);
    this.#failed = false;
    localStorage.removeItem(LEFT + id);
    if (this.#ofPage === drawing) this.#keepForPage(drawing, null);
  }

  /** The page may be closed before a transaction ends: what is due is left to the next page, which is done when this returns. */
  #leave() {
    const drawing = this.#last;
    if (drawing && this.#isDue(drawing)) {
      const { id, stamp, name } = this.#of(drawing);
      try {
        localStorage.setItem(LEFT + id, JSON.stringify({ id, stamp, name, text: toText(drawing) }));
      } catch {
        // Photos may be larger than this store.
      }
    }
    this.keep();
  }

  /** For this page alone. `text` is `null` if only the entry has changed. */
  #keepForPage(drawing, text) {
    const { drawing: known, id, stamp, name } = this.#of(drawing);
    this.#ofPage = drawing;
    try {
      if (this.#host.keeps()) localStorage.setItem(SHEET, id);
      sessionStorage.setItem("kept", JSON.stringify({ id, stamp, name, saved: known === drawing }));
      if (text !== null) sessionStorage.setItem("draft", text);
    } catch {
      // Photos may be larger than this store: the page then takes the drawing from the library.
      sessionStorage.removeItem("draft");
    }
  }

  /** Says once that drawings are not kept. */
  #trouble(error) {
    if (this.#failed) return;
    this.#failed = true;
    const isFull = error.name === "QuotaExceededError";
    const why = isFull ? "this browser has no room left" : `this browser refuses (${error.message})`;
    this.#host.say(`The drawing cannot be kept: ${why}. ${isFull ? "Delete drawings, or save" : "Save"} it as a file.`, true);
  }
}
