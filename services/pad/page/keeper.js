// Saves the sheet automatically: to the library (shelf.js), and for this page across a reload.
//
// A drawing has the `id` of its entry in the library. Undo may lead back to drawings with other ids, so each is saved to its own
// entry.

import { fromFile, fromText, isBlank, sketchBody, toText } from "./model.js";
import { newId } from "./shelf.js";

/** Maximum delay before a change is saved, milliseconds. */
const KEEP_MS = 400;
/** What this page keeps across a reload: the text of the drawing, and `{ id, stamp, name, saved }` of its entry. */
const OF_PAGE = ["draft", "kept"];
/** What a closed page leaves to the next one: an entry in the format of `Shelf.save`, by its id. */
const LEFT = "left:";
/** The id of the entry that was on a sheet last, in any page. */
const SHEET = "sheet";
/** For an unknown drawing. */
const UNKNOWN = { drawing: null, stamp: null, name: null };

/** A drawing as a new one, with no entry in the library yet. */
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
  /** By the id of a drawing: `{ drawing, id, stamp, name }`, the last saved version and its entry. */
  #kept = new Map();

  /** By the id of a drawing, what shared.js has kept beside it: `{ drawing, shared }`. */
  #beside = new Map();

  /**
   * The host has `keeps()` (whether the current drawing belongs in the library), `isShared(drawing)` (whether all pages have the same
   * version of it), `beside(drawing)` (what is kept beside it), `reread(id)` (a drawing was
   * read), `say(words, bad)`, `named(name)`.
   */
  constructor(shelf, host) {
    [this.#shelf, this.#host] = [shelf, host];
    // A hidden page may never be shown again.
    document.addEventListener("visibilitychange", () => document.hidden && this.#leave());
    window.addEventListener("pagehide", () => this.#leave());
  }

  #of(drawing) {
    return this.#kept.get(drawing.id) ?? { ...UNKNOWN, id: drawing.id };
  }

  /** The drawing that was on this page before a reload; `null` if there is none. */
  reloaded() {
    try {
      const { id, stamp, name, saved } = JSON.parse(sessionStorage.getItem("kept"));
      const drawing = this.#read(id, sessionStorage.getItem("draft"));
      this.#kept.set(id, { drawing: saved ? drawing : null, id, stamp, name });
      return drawing;
    } catch {
      return null;
    }
  }

  #read(id, text) {
    const file = JSON.parse(text);
    const drawing = { ...fromFile(file), id };
    this.#host.reread(id);
    if (file.pad?.shared) this.#beside.set(id, { drawing, shared: file.pad.shared });
    return drawing;
  }

  /** A drawing that was read, with what was kept beside it; `null` if nothing was. */
  kept(id) {
    return this.#beside.get(id) ?? null;
  }

  /** The drawing that was on a sheet last; `null` if there is none, if this sheet is not blank, or on a second call. */
  async resumed(drawing) {
    if (this.#resumed) return null;
    this.#resumed = true;
    try {
      await this.rescue();
      const latest = isBlank(drawing) && await this.#latest();
      return latest ? this.#opened(latest) : null;
    } catch {
      // The next save reports the cause.
      return null;
    }
  }

  /** Saves what pages left behind that were closed before it reached the library. */
  async rescue() {
    for (const key of Object.keys(localStorage).filter((name) => name.startsWith(LEFT))) {
      const left = JSON.parse(localStorage.getItem(key));
      if (left) await this.#shelf.save(left, true);
      localStorage.removeItem(key);
    }
  }

  /** The entry that was on a sheet last, or else the most recently changed one. */
  async #latest() {
    const entries = (await this.#shelf.list()).filter(({ gone }) => !gone);
    const latest = entries.find(({ id }) => id === localStorage.getItem(SHEET)) ?? entries[0];
    return latest ? this.#shelf.open(latest.id) : null;
  }

  /** Opens a drawing of the library. Throws an `Error` if it cannot be read. */
  async open(id) {
    return this.#opened(await this.#shelf.open(id));
  }

  #opened(entry) {
    if (!entry || entry.gone) throw new Error("This drawing is not in the library: another page has deleted it.");
    const drawing = this.#read(entry.id, entry.text);
    this.#kept.set(entry.id, { drawing, id: entry.id, stamp: entry.changed, name: entry.name });
    return drawing;
  }

  /** A drawing from the robot: saved once it is changed, or opened as the latest of the library if that is the same map. */
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

  /** The name of a drawing; `drawing` before it is saved. */
  nameOf(drawing) {
    return this.#of(drawing).name ?? "drawing";
  }

  /** An entry was renamed, or changed on this page: updates the drawings that were saved to it. */
  follow({ id, name, changed }) {
    for (const kept of this.#kept.values()) if (kept.id === id) Object.assign(kept, { name, stamp: changed });
    if (this.#last) this.#host.named(this.#of(this.#last).name);
  }

  /** Removes the drawing from what this page restores after a reload. */
  forget() {
    clearTimeout(this.#timer);
    this.#last = null;
    OF_PAGE.forEach((key) => sessionStorage.removeItem(key));
  }

  /** The sheet now shows this drawing. It is saved shortly; a different drawing, and the one that it replaces, immediately. */
  changed(drawing) {
    const isOther = this.#last?.id !== drawing.id;
    if (isOther) this.keep();
    this.#last = drawing;
    if (isOther) this.keep();
    else this.#timer ||= setTimeout(() => this.keep(), KEEP_MS);
    this.#host.named(this.#of(drawing).name);
  }

  /** Saves the drawing on the sheet. */
  keep() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    const drawing = this.#last;
    const { drawing: known } = drawing ? this.#of(drawing) : UNKNOWN;
    if (!drawing || (known === drawing && this.#ofPage === drawing)) return this.#saving;
    const text = toText(drawing, this.#host.beside(drawing));
    this.#keepForPage(drawing, text);
    if (known !== drawing) {
      this.#saving = this.#saving.then(() => this.#save(drawing, text)).catch((error) => this.#trouble(error));
    }
    return this.#saving;
  }

  /** Whether a drawing belongs in the library and its current version has not been saved. */
  #isDue(drawing) {
    const { drawing: known, stamp } = this.#of(drawing);
    return known !== drawing && this.#host.keeps() && !(stamp === null && isBlank(drawing));
  }

  async #save(drawing, text) {
    if (!this.#isDue(drawing)) return;
    const { id, stamp, name } = this.#of(drawing);
    const entry = await this.#shelf.save({ id, stamp, text, name, isShared: this.#host.isShared(drawing) });
    this.#kept.set(drawing.id, { drawing, id: entry.id, stamp: entry.changed, name: entry.name });
    this.follow(entry);
    this.#failed = false;
    localStorage.removeItem(LEFT + id);
    if (this.#ofPage === drawing) this.#keepForPage(drawing, null);
  }

  /** The page may be closed before a transaction ends: unsaved changes are left to the next page, synchronously. */
  #leave() {
    const drawing = this.#last;
    if (drawing && this.#isDue(drawing)) {
      const { id, stamp, name } = this.#of(drawing);
      try {
        localStorage.setItem(LEFT + id, JSON.stringify({ id, stamp, name, text: toText(drawing, this.#host.beside(drawing)) }));
      } catch {
        // Photos may exceed this store's quota.
      }
    }
    this.keep();
  }

  /** Saves for this page only. `text` is `null` if only the entry has changed. */
  #keepForPage(drawing, text) {
    const { drawing: known, id, stamp, name } = this.#of(drawing);
    this.#ofPage = drawing;
    try {
      if (this.#host.keeps()) localStorage.setItem(SHEET, id);
      sessionStorage.setItem("kept", JSON.stringify({ id, stamp, name, saved: known === drawing }));
      if (text !== null) sessionStorage.setItem("draft", text);
    } catch {
      // Photos may exceed this store's quota: the page then takes the drawing from the library.
      sessionStorage.removeItem("draft");
    }
  }

  /** Reports once that drawings are not saved. */
  #trouble(error) {
    if (this.#failed) return;
    this.#failed = true;
    const isFull = error.name === "QuotaExceededError";
    const why = isFull ? "this browser has no room left" : `this browser refuses (${error.message})`;
    this.#host.say(`The drawing cannot be kept: ${why}. ${isFull ? "Delete drawings, or save" : "Save"} it as a file.`, true);
  }
}
